"""The unknowns of the study: centre of mass and inertia of chosen links, masses held; 27 for three links."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.errors import InputError
from irb140_jax.robot import Robot
from irb140_jax.types import Inertials

# Inertia elements of a link, in the order of `Robot.phi`: Ixx, Ixy, Ixz, Iyy, Iyz, Izz.
_ROWS, _COLUMNS = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)
# Place of element (i, j) among the six.
_PLACE = ((0, 1, 2), (1, 3, 4), (2, 4, 5))


def link_parameters(robot: Robot, links: Sequence[int]) -> Float[Array, " d"]:
    """Centres of mass of the links, then their inertias about it: x = (c_1 ... c_k, I_1 ... I_k), d = 9 k.

    Args:
        robot: Arm with n joints.
        links: Which of its links, counted from 0.

    Returns:
        x [m, then kg m^2], inertias as Ixx, Ixy, Ixz, Iyy, Iyz, Izz in link axes.
    """
    chosen = checked_links(robot, links)
    inertia = robot.inertia[chosen][:, _ROWS, _COLUMNS]
    return jnp.concatenate([robot.com[chosen].ravel(), inertia.ravel()])


def with_link_parameters(robot: Robot, links: Sequence[int], x: Float[Array, " d"]) -> Robot:
    """The robot with these centres of mass and inertias of the links, see `link_parameters`."""
    chosen = checked_links(robot, links)
    com, inertia = split(x)
    where = lambda r: (r.com, r.inertia)  # noqa: E731
    tensors = inertia[:, jnp.array(_PLACE)]
    return eqx.tree_at(where, robot, (robot.com.at[chosen].set(com), robot.inertia.at[chosen].set(tensors)))


def split(x: Float[Array, " d"]) -> tuple[Float[Array, "k 3"], Float[Array, "k 6"]]:
    """Centres of mass (k, 3) [m] and inertia elements (k, 6) [kg m^2] of x."""
    k = x.shape[0] // 9
    return x[: 3 * k].reshape(k, 3), x[3 * k :].reshape(k, 6)


def phi_of(x: Float[Array, " d"], mass: Float[Array, " k"]) -> Inertials:
    """Inertial parameters about the link frame, shape (k, 10), as in `Robot.phi`; linear in x but for m c c^T.

    Args:
        x: See `link_parameters`.
        mass: Masses of those links [kg], shape (k,).
    """
    com, inertia = split(x)
    cx, cy, cz = com.T
    moved = [cy**2 + cz**2, -cx * cy, -cx * cz, cx**2 + cz**2, -cy * cz, cx**2 + cy**2]
    about_origin = inertia + mass[:, None] * jnp.stack(moved, axis=1)
    return jnp.concatenate([mass[:, None], mass[:, None] * com, about_origin], axis=1)


def tensors(x: Float[Array, " d"]) -> Float[Array, "k 3 3"]:
    """Inertia tensors about the centres of mass [kg m^2]."""
    return split(x)[1][:, jnp.array(_PLACE)]


def elements(tensor: Float[Array, "k 3 3"]) -> Float[Array, "k 6"]:
    """The six elements of symmetric tensors."""
    return tensor[:, _ROWS, _COLUMNS]


def checked_links(robot: Robot, links: Sequence[int]) -> Array:
    """The links as an index array; `InputError` unless they are links of the robot, none twice."""
    if not len(links) or len(set(links)) != len(links) or not all(0 <= i < robot.n for i in links):
        raise InputError(f"links {tuple(links)}: give some of 0 to {robot.n - 1}, none twice")
    return jnp.array(tuple(links))
