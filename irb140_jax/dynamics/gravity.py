"""Torque that holds the arm against gravity (equation 13)."""

import jax.numpy as jnp

from irb140_jax.dynamics.composite import composite, placed_links
from irb140_jax.kinematics import cross
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints


@shape_checked
def gravity_torque(robot: Robot, q: Joints) -> Joints:
    """Gravity torque g(q) = -sum_i Jv_i^T m_i g0, the gradient of the potential energy.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        g [N m or N], shape (n,): what the motors must give to hold the arm still.

    Source: equation 13 of the study, its sum over links done first (see `composite`).
    """
    links = placed_links(robot, q)
    beyond = composite(robot, links)
    force = beyond.mass * robot.gravity
    moment = cross(beyond.first, robot.gravity)
    return -jnp.sum(links.v * force + links.w * moment, axis=-1)
