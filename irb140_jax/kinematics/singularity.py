"""How close a pose is to a singular one (equation 32)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.kinematics.forward import forward_kinematics
from irb140_jax.kinematics.jacobian import jacobian
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints, Scalar


@shape_checked
def singular_values(robot: Robot, q: Joints) -> Float[Array, " k"]:
    """Singular values of the geometric Jacobian, largest first.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        min(6, n) values; metres and radians stand side by side, so they depend on the unit of length.
    """
    return jnp.linalg.svd(jacobian(robot, q), compute_uv=False)


@shape_checked
def condition_number(robot: Robot, q: Joints) -> Scalar:
    """Condition number of the Jacobian in the 2-norm, kappa = ||J|| ||J^-1|| = s_max / s_min.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        kappa >= 1, shape (); infinite at a singularity.

    Source: equation 32 of the study, which does not say which norm.
    """
    return _ratio(singular_values(robot, q))


class SingularityMap(NamedTuple):
    """Condition number over a grid of two joints, the others held.

    Attributes:
        first, second: The two joints' positions [rad or m], shapes (a,) and (b,).
        tool: Where the tool is [m], shape (a, b, 3).
        condition_number: kappa of the Jacobian (see `condition_number`), shape (a, b); inf at a singularity.
        smallest: Smallest singular value, 0 at a singularity: how far the tool's slowest direction is from being lost.
    """

    first: Float[Array, " a"]
    second: Float[Array, " b"]
    tool: Float[Array, "a b 3"]
    condition_number: Float[Array, "a b"]
    smallest: Float[Array, "a b"]


def singularity_map(
    robot: Robot,
    held: Joints,
    joints: tuple[int, int] = (1, 2),
    *,
    points: tuple[int, int] = (101, 101),
    translation: bool = False,
) -> SingularityMap:
    """How close to singular the arm is over its workspace, as a grid over two joints between their limits.

    Turning joint 1 about the vertical changes nothing, so that of an upright arm joints 2 and 3 (1 and 2 counted from
    0) sweep the whole workspace of the wrist's centre; the wrist's own singularities depend on what is held.

    Args:
        robot: Arm with n joints; a joint without limits goes once around, or 1 m either way.
        held: Positions of the other joints [rad or m], shape (n,).
        joints: The two joints of the grid, counted from 0.
        points: Points along each.
        translation: Whether only the tool's velocity counts, not its angular velocity; with fewer than six joints the
            singular values are as many as joints at most.
    """
    axes = [jnp.linspace(*_range(robot, j), count) for j, count in zip(joints, points, strict=True)]
    rows = 3 if translation else 6

    def point(x, y):
        q = jnp.asarray(held, float).at[joints[0]].set(x).at[joints[1]].set(y)
        s = jnp.linalg.svd(jacobian(robot, q)[:rows], compute_uv=False)
        return forward_kinematics(robot, q)[:3, 3], _ratio(s), s[-1]

    grid = jax.vmap(jax.vmap(point, in_axes=(None, 0)), in_axes=(0, None))
    return SingularityMap(axes[0], axes[1], *jax.jit(grid)(*axes))


def _range(robot: Robot, joint: int) -> tuple[float, float]:
    low, high = float(robot.lower[joint]), float(robot.upper[joint])
    free = 1.0 if robot.is_slide[joint] else float(jnp.pi)
    return (low if low > -jnp.inf else -free), (high if high < jnp.inf else free)


def _ratio(s: Float[Array, " k"]) -> Scalar:
    """Largest over smallest singular value, infinite where the smallest is zero."""
    smallest = jnp.where(s[-1] == 0.0, 1.0, s[-1])
    return jnp.where(s[-1] == 0.0, jnp.inf, s[0] / smallest)
