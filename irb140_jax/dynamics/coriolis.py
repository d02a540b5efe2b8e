"""Coriolis matrix by Christoffel symbols (equations 14 and 15), in closed form.

Differentiating M and contracting it, as the equations are written, costs n^3 derivatives of which most cancel.  The
contraction can be done by hand.  For mass points x, M_jk = sum m (d_j x . d_k x), the symbols of the first kind are
c_jkl = sum m (d_j x . d_k d_l x), and so

    C_jk = sum m (d_j x . d/dt d_k x),   with d_j x = v_j + w_j x x.

Summed over all that the later of the two joints carries, only three more moments appear than in M: the momentum
sum m xd and the matrix D = sum m ((x . xd) 1 - xd x^T).  For a rigid body with centre c and inertia I about it, turning
at omega, D = m ((c . cd) 1 - cd c^T) - S(omega) (tr(I)/2 1 - I), since tr(I)/2 1 - I = sum m x x^T.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.dynamics.composite import (
    Composite,
    Links,
    apply,
    by_order,
    composite,
    from_base,
    from_tips,
    momenta,
    pairs,
    placed_links,
)
from irb140_jax.kinematics import cross
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import JointMatrix, Joints


class Rates(NamedTuple):
    """What changes while the arm moves, base axes.

    Attributes:
        w: Rates of the angular parts of the screws, shape (n, 3).
        v: Rates of their linear parts, shape (n, 3).
        momentum: sum m xd of all that joint j carries [kg m/s], shape (n, 3).
        moment: D of all that joint j carries [kg m^2/s], shape (n, 3, 3).
    """

    w: Float[Array, "n 3"]
    v: Float[Array, "n 3"]
    momentum: Float[Array, "n 3"]
    moment: Float[Array, "n 3 3"]


@shape_checked
def coriolis_matrix(robot: Robot, q: Joints, qd: Joints) -> JointMatrix:
    """Coriolis matrix by Christoffel symbols, C_ij = sum_k 1/2 (d_k M_ij + d_j M_ik - d_i M_jk) qd_k.

    This choice makes Md - 2 C skew-symmetric.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).

    Returns:
        C, such that C @ qd is the Coriolis and centrifugal torque; C itself in [N m s/rad], shape (n, n).

    Source: equations 14 and 15 of the study; Siciliano et al., Robotics (2009), section 7.2.1; closed form derived in
        this module's docstring (the same matrix as Echeandia and Wensing, J. Mech. Robotics 13 (2021)).
    """
    links = placed_links(robot, q)
    beyond = composite(robot, links)
    rates = _rates(robot, links, qd)
    # Joint k carries the links both joints move (j = k or j before k): project the rates of its momenta on joint j.
    linear = beyond.mass * rates.v + cross(rates.w, beyond.first) + cross(links.w, rates.momentum)
    angular = cross(beyond.first, rates.v) + apply(beyond.inertia, rates.w) + apply(rates.moment, links.w)
    later = pairs((links.v, linear), (links.w, angular))
    # Joint j carries them (k before j): the same sums, with joint j's momenta on the left.
    return by_order(later, _earlier(links, beyond, rates), robot.parent)


def _earlier(links: Links, beyond: Composite, rates: Rates) -> JointMatrix:
    linear, angular = momenta(links, beyond)
    turned = cross(rates.momentum, links.v) + apply(jnp.swapaxes(rates.moment, 1, 2), links.w)
    return pairs((linear, rates.v), (angular, rates.w), (turned, links.w))


def _rates(robot: Robot, links: Links, qd: Joints) -> Rates:
    omega, u = (from_base(x * qd[:, None], robot.parent) for x in (links.w, links.v))
    speed = u + cross(omega, links.centre)
    moment = robot.mass[:, None] * links.centre
    half_trace = 0.5 * jnp.trace(links.inertia, axis1=1, axis2=2)[:, None, None]
    second = half_trace * jnp.eye(3) - links.inertia
    # S(omega) A has the columns omega x A_k, and A is symmetric.
    swing = jnp.swapaxes(cross(omega[:, None, :], second), 1, 2)
    drift = jnp.sum(moment * speed, axis=-1)[:, None, None] * jnp.eye(3) - speed[:, :, None] * moment[:, None, :]
    return Rates(
        w=cross(omega, links.w),
        v=cross(omega, links.v) + cross(u, links.w),
        momentum=from_tips(robot.mass[:, None] * speed, robot.parent),
        moment=from_tips(drift - swing, robot.parent),
    )


@shape_checked
def christoffel_symbols(robot: Robot, q: Joints) -> Float[Array, "n n n"]:
    """Christoffel symbols of the first kind, c_ijk = 1/2 (d_k M_ij + d_j M_ik - d_i M_jk).

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        c, symmetric in its last two indices, shape (n, n, n); C_ij = sum_k c_ijk qd_k.

    Source: equation 14 of the study.  C is linear in qd, so its values at unit speeds are the symbols.
    """
    return jax.vmap(lambda qd: coriolis_matrix(robot, q, qd), out_axes=2)(jnp.eye(robot.n))
