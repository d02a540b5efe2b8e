"""MJX, MuJoCo rewritten in JAX, as an oracle with the signatures of `oracle.mujoco`.

MJX silently ignores some of what a model may hold and would then be confidently wrong; such models are refused.
"""

import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from irb140_jax.errors import RobotError
from irb140_jax.types import JointMatrix, Joints, Pose

# Fields of a compiled model that MJX's JAX backend never reads (3.17), what they are, and what to do about them.
IGNORED = (
    ("actuator_delay", "an actuator delay", "remove it"),
    ("dof_dampingpoly", "polynomial joint damping", "keep the first coefficient"),
    ("jnt_stiffnesspoly", "polynomial joint stiffness", "keep the first coefficient"),
    ("actuator_dampingpoly", "polynomial actuator damping", "keep the first coefficient"),
    ("actuator_armature", "actuator armature", "add gear^2 times it to the joint's armature"),
    ("actuator_damping", "actuator damping", "add gear^2 times it to the joint's damping"),
    ("jnt_springyield", "a spring that yields", "remove it"),
)


def oracle_model(model: mujoco.MjModel) -> mjx.Model:
    """The model for MJX, without constraints, as `oracle.mujoco.oracle_model`.

    Args:
        model: Compiled model; it stays as it is.

    Raises:
        RobotError: MJX would ignore part of the model without saying so.
    """
    for field, what, remedy in IGNORED:
        if np.any(getattr(model, field, 0)):
            raise RobotError(f"the model has {what}, which MJX ignores silently: {remedy}, or use oracle.mujoco")
    loose = mjx.put_model(model, impl="jax")
    flags = int(loose.opt.disableflags) | int(mjx.DisableBit.CONSTRAINT)
    return loose.replace(opt=loose.opt.replace(disableflags=mjx.DisableBit(flags)))


def inverse_dynamics(model: mjx.Model, q: Joints, qd: Joints, qdd: Joints) -> Joints:
    """Joint torques of a motion, `mjx.inverse` [N m or N], shape (n,).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (n,).
    """
    data = mjx.make_data(model).replace(qpos=q, qvel=qd, qacc=qdd)
    return mjx.inverse(model, data).qfrc_inverse


def mass_matrix(model: mjx.Model, q: Joints) -> JointMatrix:
    """Mass matrix with armature, shape (n, n).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
    """
    data = _positions(model, q)
    return mjx.full_m(model, mjx.crb(model, data))


def bias(model: mjx.Model, q: Joints, qd: Joints) -> Joints:
    """Coriolis, centrifugal and gravity torque C qd + g, shape (n,).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
    """
    data = mjx.com_vel(model, _positions(model, q).replace(qvel=qd))
    return mjx.rne(model, data).qfrc_bias


def forward_kinematics(model: mjx.Model, q: Joints) -> Pose:
    """Pose of the tool in the world: the model's last site, or without sites its last body.

    Of a body with a joint, the centre of mass: its own frame lies on the joint.

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
    """
    data = mjx.kinematics(model, mjx.make_data(model).replace(qpos=q))
    rotation = (data.site_xmat if model.nsite else data.xmat)[-1].reshape(3, 3)
    bodies = data.xipos if model.body_jntnum[-1] else data.xpos
    position = (data.site_xpos if model.nsite else bodies)[-1]
    return jnp.eye(4).at[:3, :3].set(rotation).at[:3, 3].set(position)


def _positions(model: mjx.Model, q: Joints) -> mjx.Data:
    return mjx.com_pos(model, mjx.kinematics(model, mjx.make_data(model).replace(qpos=q)))
