"""Inverse dynamics of many samples at once."""

import jax

from irb140_jax.dynamics.chain import packed, structure
from irb140_jax.dynamics.newton_euler import _rigid_torque
from irb140_jax.dynamics.passive import passive_torque
from irb140_jax.robot import Robot
from irb140_jax.types import JointSamples


def inverse_dynamics_batch(robot: Robot, q: JointSamples, qd: JointSamples, qdd: JointSamples) -> JointSamples:
    """`inverse_dynamics` of T samples, arrays of shape (T, n) -> joint torques (T, n)."""
    rigid = _rigid_torque(packed(robot), structure(robot), robot.is_slide, q.T, qd.T, qdd.T).T
    passive = jax.vmap(passive_torque, in_axes=(None, 0, 0))(robot, q, qd)
    return rigid + robot.armature[None] * qdd + passive
