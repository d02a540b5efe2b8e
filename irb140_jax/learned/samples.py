"""What a network of the kinematics learns from."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from irb140_jax.errors import InputError
from irb140_jax.kinematics import forward_kinematics, jacobian
from irb140_jax.robot import Robot
from irb140_jax.types import Joints


class Samples(NamedTuple):
    """States of an arm and of its tool; N of them.

    Attributes:
        q: Joint positions [rad or m], shape (N, n).
        qd: Joint velocities [rad/s or m/s], shape (N, n).
        position: Where the tool is [m], shape (N, 3).
        velocity: How fast it moves [m/s], shape (N, 3).
    """

    q: Float[Array, "N n"]
    qd: Float[Array, "N n"]
    position: Float[Array, "N 3"]
    velocity: Float[Array, "N 3"]


def joint_samples(
    robot: Robot, lower: Joints, upper: Joints, count: int = 40_000, *, key: Key[Array, ""]
) -> Samples:
    """Joint positions spread evenly over a box, velocities over what the joints allow.

    The study took 40,000 samples off a robot at work; these are made by the kinematics themselves.

    Args:
        robot: Arm with n joints.
        lower: Lower ends of the box [rad or m], shape (n,).
        upper: Upper ends, shape (n,).
        count: Number of samples N.
        key: For the draws.

    Raises:
        InputError: The box is empty or of the wrong shape, or there is no sample.
    """
    low, high = jnp.asarray(lower, float), jnp.asarray(upper, float)
    if low.shape != (robot.n,) or high.shape != (robot.n,) or not bool(jnp.all(low < high)) or count < 1:
        raise InputError(
            f"{count} samples between {low} and {high}: give at least 1 sample, and {robot.n} lower ends below as many "
            "upper ones"
        )
    where, how_fast = jax.random.split(key)
    limit = jnp.where(jnp.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    q = low + (high - low) * jax.random.uniform(where, (count, robot.n))
    qd = limit * jax.random.uniform(how_fast, (count, robot.n), minval=-1.0)
    return Samples(q, qd, *_tool(robot, q, qd))


@jax.jit
def _tool(robot: Robot, q: Float[Array, "N n"], qd: Float[Array, "N n"]):
    position = jax.vmap(lambda q: forward_kinematics(robot, q)[:3, 3])(q)
    return position, jax.vmap(lambda q, qd: jacobian(robot, q)[:3] @ qd)(q, qd)
