"""What lies beyond each joint, told in base axes: the sums over links that equations 10 to 15 share.

With joint screws s_j = [w_j; v_j], where w_j is the axis of a hinge (0 for a slide) and v_j the velocity that joint j
gives to the point of its link passing the base's origin, the Jacobians of link i's centre c_i are

    Jw_ij = w_j,   Jv_ij = v_j + w_j x c_i      (equations 11 and 12: z_j x (c_i - p_j) = z_j x c_i + p_j x z_j).

Nothing but c_i depends on the link, so the sums over links of equation 10 act on masses, first moments and inertias
alone, and each is needed once per joint: for the links that joint j carries, in a chain i >= j.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.kinematics import cross, link_frames
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import Parents, moves
from irb140_jax.types import JointMatrix, Joints


class Links(NamedTuple):
    """Every link and its joint, in base axes about the base's origin.

    Attributes:
        w: Angular parts of the joint screws, shape (n, 3).
        v: Linear parts of the joint screws [m or 1], shape (n, 3).
        centre: Centres of mass [m], shape (n, 3).
        inertia: Inertia tensors about them [kg m^2], shape (n, 3, 3).
    """

    w: Float[Array, "n 3"]
    v: Float[Array, "n 3"]
    centre: Float[Array, "n 3"]
    inertia: Float[Array, "n 3 3"]


class Composite(NamedTuple):
    """Inertial parameters of all links that joint j carries, as one body about the base's origin.

    Attributes:
        mass: Mass [kg], shape (n, 1).
        first: First moment of mass [kg m], shape (n, 3).
        inertia: Inertia tensor about the base's origin [kg m^2], shape (n, 3, 3).
    """

    mass: Float[Array, "n 1"]
    first: Float[Array, "n 3"]
    inertia: Float[Array, "n 3 3"]


def placed_links(robot: Robot, q: Joints) -> Links:
    """The links where the joint positions put them; inertias turned by I_i(base) = R_i I_i R_i^T (equation 8).

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).
    """
    rotation, origin = link_frames(robot, q)
    axis = apply(rotation, robot.axis)
    slide = np.array(robot.is_slide)[:, None]
    turned = multiply(multiply(rotation, robot.inertia), jnp.swapaxes(rotation, 1, 2))
    return Links(
        w=jnp.where(slide, 0.0, axis),
        v=jnp.where(slide, axis, cross(origin, axis)),
        centre=origin + apply(rotation, robot.com),
        inertia=turned,
    )


def composite(robot: Robot, links: Links) -> Composite:
    """Mass, first moment and inertia of what each joint carries (parallel-axis theorem, then sums from the tips).

    Args:
        robot: Arm with n joints.
        links: Its `placed_links`.
    """
    moment = robot.mass[:, None] * links.centre
    spread = jnp.sum(moment * links.centre, axis=-1)[:, None, None] * jnp.eye(3)
    about_base = links.inertia + spread - moment[:, :, None] * links.centre[:, None, :]
    return Composite(*(from_tips(x, robot.parent) for x in (robot.mass[:, None], moment, about_base)))


def momenta(links: Links, beyond: Composite) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    """Momenta of what joint j carries at unit speed of joint j: f_j = m v + w x h, n_j = h x v + I w.

    Args:
        links: The `placed_links`.
        beyond: Their `composite`.

    Returns:
        Linear momenta f [kg m or kg] and angular momenta n about the base's origin [kg m^2 or kg m], shape (n, 3) each.
    """
    linear = beyond.mass * links.v + cross(links.w, beyond.first)
    angular = cross(beyond.first, links.v) + apply(beyond.inertia, links.w)
    return linear, angular


def apply(A: Float[Array, "n 3 3"], x: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """A_i x_i, shape (n, 3); in sums, which XLA's CPU backend fuses over a batch where it would call a matmul."""
    return A[:, :, 0] * x[:, 0, None] + A[:, :, 1] * x[:, 1, None] + A[:, :, 2] * x[:, 2, None]


def multiply(A: Float[Array, "n 3 3"], B: Float[Array, "n 3 3"]) -> Float[Array, "n 3 3"]:
    """A_i B_i, shape (n, 3, 3)."""
    return A[:, :, 0, None] * B[:, None, 0] + A[:, :, 1, None] * B[:, None, 1] + A[:, :, 2, None] * B[:, None, 2]


def pairs(*terms: tuple[Float[Array, "n 3"], Float[Array, "n 3"]]) -> JointMatrix:
    """Sum over terms (a, b) of a_j . b_k for every pair of joints, shape (n, n)."""
    products = (a[:, None, k] * b[None, :, k] for a, b in terms for k in range(3))
    return jnp.asarray(sum(products))


def from_tips(x: Float[Array, "n *k"], parent: Parents) -> Float[Array, "n *k"]:
    """Sums over the links that each joint carries."""
    sums = list(x)
    for i in reversed(range(len(sums))):
        if parent[i] >= 0:
            sums[parent[i]] = sums[parent[i]] + sums[i]
    return jnp.stack(sums)


def from_base(x: Float[Array, "n *k"], parent: Parents) -> Float[Array, "n *k"]:
    """Sums over the joints that move each link.

    Written out: XLA's cumsum is several times slower over a batch of short arms.
    """
    sums: list[Array] = []
    for row, before in zip(x, parent, strict=True):
        sums.append(row if before < 0 else sums[before] + row)
    return jnp.stack(sums)


def by_order(outer: JointMatrix, inner: JointMatrix, parent: Parents) -> JointMatrix:
    """Entries (j, k) of `outer` where joint j carries joint k or is it, of `inner` where k carries j, else 0."""
    carries = moves(parent).T
    rest = inner if np.all(carries | carries.T) else jnp.where(carries.T, inner, 0.0)
    return jnp.where(carries, outer, rest)
