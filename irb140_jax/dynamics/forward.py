"""Forward dynamics: accelerations from torques."""

import jax
import jax.numpy as jnp

from irb140_jax.dynamics.newton_euler import inverse_dynamics
from irb140_jax.robot import Robot
from irb140_jax.types import Joints


def forward_dynamics(robot: Robot, q: Joints, qd: Joints, tau: Joints) -> Joints:
    """Joint accelerations, qdd = M(q)^-1 (tau - C(q, qd) qd - g(q) - passive).

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        tau: Joint torques [N m or N].

    Returns:
        Joint accelerations [rad/s^2 or m/s^2].

    Source: Walker, Orin (1982), method 1: the columns of M are inverse dynamics of unit accelerations.
    """
    torque = lambda qdd: inverse_dynamics(robot, q, qd, qdd)  # noqa: E731
    bias, columns = jax.vmap(torque)(jnp.zeros((1, robot.n)))[0], jax.vmap(torque)(jnp.eye(robot.n))
    M = columns - bias
    return jax.scipy.linalg.solve(M, tau - bias, assume_a="pos")
