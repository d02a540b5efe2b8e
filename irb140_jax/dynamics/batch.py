"""Inverse dynamics of many samples at once."""

import jax

from irb140_jax.dynamics.chain import Plan, chain, plan
from irb140_jax.dynamics.chunks import in_chunks
from irb140_jax.dynamics.newton_euler import rigid_torque
from irb140_jax.dynamics.passive import passive_torque
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import JointBatch, JointSamples


@shape_checked
def inverse_dynamics_batch(robot: Robot, q: JointBatch, qd: JointBatch, qdd: JointBatch) -> JointSamples:
    """`inverse_dynamics` of T samples, arrays of shape (T, n) -> joint torques (T, n)."""
    return in_chunks(_torque_of_chunk, (robot, plan(robot)), (q, qd, qdd))


def _torque_of_chunk(given: tuple[Robot, Plan], q: JointSamples, qd: JointSamples, qdd: JointSamples) -> JointSamples:
    robot, ahead = given
    rigid = rigid_torque(chain(robot, ahead), q.T, qd.T, qdd.T).T
    passive = jax.vmap(passive_torque, in_axes=(None, 0, 0))(robot, q, qd)
    return rigid + robot.armature[None] * qdd + passive
