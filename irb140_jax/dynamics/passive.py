"""Joint torques that the model file gives beside the rigid bodies: friction and springs."""

import jax.numpy as jnp

from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints


@shape_checked
def passive_torque(robot: Robot, q: Joints, qd: Joints) -> Joints:
    """Torque a drive spends on the model's own friction and springs, d qd + f sign(qd) + k (q - q0).

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].

    Returns:
        Joint torques [N m or N]; dry friction is 0 at rest, where it could be anything up to `frictionloss`.

    Source: MuJoCo documentation, "Computation", passive forces and friction loss.
    """
    friction = robot.damping * qd + robot.frictionloss * jnp.sign(qd)
    return friction + robot.stiffness * (q - robot.springref)
