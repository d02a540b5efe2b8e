"""The regressor: rigid-body torques are linear in the inertial parameters, tau = Y(q, qd, qdd) phi."""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.dynamics.chain import Chain, Structure, chain, packed, structure
from irb140_jax.dynamics.newton_euler import Motion, Placement, outward
from irb140_jax.dynamics.scalars import ZERO, Number, Vector, add, cross, dot, minus, mul, plus
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, JointSamples


def regressor(robot: Robot, q: Joints, qd: Joints, qdd: Joints) -> Float[Array, "n 10*n"]:
    """Matrix Y of the rigid bodies' torques, Y phi + armature qdd + passive = inverse dynamics.

    Args:
        robot: Arm with n joints; its inertial parameters don't matter here.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        qdd: Joint accelerations [rad/s^2 or m/s^2].

    Returns:
        Y, columns as in `robot.phi.ravel()`: torque per kg, per kg m and per kg m^2.  Row j is zero for links before j.

    Source: Atkeson, An, Hollerbach (1986), Estimation of inertial parameters of manipulator loads and links.
    """
    return _regressor(packed(robot), structure(robot), robot.is_slide, q, qd, qdd)


def regressor_batch(
    robot: Robot, q: JointSamples, qd: JointSamples, qdd: JointSamples
) -> Float[Array, "T n 10*n"]:
    """`regressor` of T samples, arrays of shape (T, n) -> (T, n, 10 n)."""
    Y = _regressor(packed(robot), structure(robot), robot.is_slide, q.T, qd.T, qdd.T)
    return jnp.moveaxis(Y, -1, 0)


@partial(jax.jit, static_argnums=(1, 2))
def _regressor(numbers, known: Structure, is_slide: tuple[bool, ...], q, qd, qdd):
    arm = chain(numbers, known, is_slide)
    blocks = regressor_blocks(arm, list(q), list(qd), list(qdd))
    n, zero = len(is_slide), jnp.zeros(q.shape[1:], q.dtype)
    rows = []
    for j in range(n):
        entries = [x for i in range(n) for x in (blocks[j, i] if i >= j else [0.0] * 10)]
        rows.append(jnp.stack([zero if isinstance(x, float) and x == 0.0 else x + zero for x in entries]))
    return jnp.stack(rows)


def regressor_blocks(
    arm: Chain, q: list[Number], qd: list[Number], qdd: list[Number]
) -> dict[tuple[int, int], list[Number]]:
    """Ten scalars Y[j, i] for every joint j and every link i >= j that it carries."""
    places, motions = outward(arm, q, qd, qdd)
    blocks = {}
    screws: list[tuple[Vector, Vector]] = []
    for i, (place, motion) in enumerate(zip(places, motions, strict=True)):
        screws = [_carried(place, screw) for screw in screws]
        screws.append((ZERO, place.link.axis) if place.link.is_slide else (place.link.axis, ZERO))
        for j, screw in enumerate(screws):
            blocks[j, i] = _block(screw, motion)
    return blocks


def _carried(place: Placement, screw: tuple[Vector, Vector]) -> tuple[Vector, Vector]:
    """A joint's unit motion (angular, linear at the origin), from the parent's frame to the link's."""
    angular, linear = screw
    return place.to_link(angular), place.to_link(plus(linear, cross(angular, place.position)))


def _block(screw: tuple[Vector, Vector], motion: Motion) -> list[Number]:
    """Power of a link's wrench (see `link_wrench`) on a joint's unit motion (u, v), per inertial parameter.

    m: v.a;  h: alpha and w terms turned around, v x alpha + (v x w) x w + a x u;
    I: I_kl of u alpha^T + (u x w) w^T, made symmetric.
    """
    u, v = screw
    w, alpha, a = motion
    first = plus(minus(cross(v, alpha), cross(w, cross(v, w))), cross(a, u))
    uw = cross(u, w)
    pair = lambda k, m: add(mul(u[k], alpha[m]), mul(uw[k], w[m]))  # noqa: E731
    mixed = lambda k, m: add(pair(k, m), pair(m, k))  # noqa: E731
    return [dot(v, a), *first, pair(0, 0), mixed(0, 1), mixed(0, 2), pair(1, 1), mixed(1, 2), pair(2, 2)]
