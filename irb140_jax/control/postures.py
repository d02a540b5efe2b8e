"""Postures from which a path of the tool can begin: how long an arm is, and where it is not singular."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.control.reference import RANK, task_rows
from irb140_jax.kinematics import jacobian
from irb140_jax.robot import Robot

# Postures that are looked at beside the reference, and how many of them are returned.
DRAWN, TRIED = 64, 8
# Share of the best posture's smallest singular value with which the reference is as good as any.
AS_GOOD = 0.1
# Part of a joint's range, about its middle, from which postures are drawn.
INNER = 0.8


def length(robot: Robot) -> float:
    """How far the arm reaches at most [m]: distances between its joints, to the tool, and the ranges of its slides."""
    apart = np.linalg.norm(np.asarray(robot.position)[1:], axis=1).sum()
    ranges = np.asarray(robot.upper - robot.lower)[np.array(robot.is_slide)]
    return float(apart + np.linalg.norm(np.asarray(robot.tool_position)) + ranges[np.isfinite(ranges)].sum())


def clear_postures(robot: Robot) -> Float[Array, "k n"]:
    """Postures in which the tool can move every way that it can at all, best first; the reference, if it is as good.

    Drawn at random, always the same ones, around the reference and away from the joints' limits.  Judged by the
    smallest singular value of the tool's Jacobian, in lengths of the arm.

    Args:
        robot: Arm with n joints.

    Returns:
        Joint positions [rad or m], shape (k, n).
    """
    size, slides = length(robot) or 1.0, np.array(robot.is_slide)
    span = np.where(slides, 0.5 * size, 0.5 * np.pi)
    lower, upper = (np.asarray(x) for x in (robot.lower, robot.upper))
    middle, half = 0.5 * (lower + upper), 0.5 * INNER * (upper - lower)
    reference = np.asarray(robot.reference)
    limited = np.isfinite(half)
    low = np.maximum(reference - span, np.where(limited, middle - half, -np.inf))
    high = np.minimum(reference + span, np.where(limited, middle + half, np.inf))
    # A reference outside of the inner range, at a limit: whatever is nearest of it.
    low, high = np.minimum(low, high), np.maximum(low, high)
    drawn = np.random.default_rng(0).uniform(low, high, (DRAWN, robot.n))
    tried = np.vstack([reference, drawn])
    J = np.asarray(jax.vmap(jacobian, (None, 0))(robot, jnp.asarray(tried)))[:, : task_rows(robot)]
    rows = np.where(np.arange(J.shape[1]) < 3, 1.0 / size, 1.0)
    values = np.linalg.svd(J * rows[:, None] * np.where(slides, size, 1.0), compute_uv=False)
    rank = max(1, int((values > RANK * values[:, :1]).sum(axis=1).max()))
    least = values[:, rank - 1]
    order = 1 + np.argsort(-least[1:], kind="stable")[:TRIED]
    first = [0] if least[0] >= AS_GOOD * least.max() else []
    return jnp.asarray(tried[[*first, *order]])
