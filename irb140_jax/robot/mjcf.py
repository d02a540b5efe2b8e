"""The only reader of robot models: MuJoCo compiles MJCF or URDF, we take a serial chain out of it."""

import pathlib

import jax.numpy as jnp
import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.robot import Robot


def load_robot(path: str | pathlib.Path) -> Robot:
    """Read an MJCF or URDF file of a serial chain of hinges and slides.

    Args:
        path: The model file.

    Returns:
        The robot, with everything the file says of armature, damping, frictionloss, stiffness and gear.

    Raises:
        RobotError: The file can't be read, or holds what a `Robot` can't represent; the message names it.
    """
    path = pathlib.Path(path)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise RobotError(f"{path}: MuJoCo can't compile this model: {error}") from error
    return robot_from_model(model, source=str(path))


def robot_from_model(model: mujoco.MjModel, source: str = "model") -> Robot:
    """Take the serial chain out of a compiled model; welded bodies are merged into the link that carries them."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, data)
    n = model.njnt
    names = tuple(model.joint(i).name for i in range(n))
    # World pose of every link frame at the reference pose: on the joint anchor, axes of its body.
    body_of = model.jnt_bodyid
    origin = data.xanchor.copy()
    frame = data.xmat[body_of].reshape(n, 3, 3)
    base_body = model.body_parentid[model.body_rootid[body_of[0]]] if n else 0
    base_position, base_rotation = data.xpos[base_body].copy(), data.xmat[base_body].reshape(3, 3).copy()
    parents_R = [base_rotation, *frame[:-1]]
    parents_p = [base_position, *origin[:-1]]
    rotation = np.stack([R.T @ F for R, F in zip(parents_R, frame, strict=True)])
    position = np.stack([R.T @ (o - p) for R, p, o in zip(parents_R, parents_p, origin, strict=True)])

    mass, first, second = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    for body in range(1, model.nbody):
        link = _carrier(model, body)
        if link < 0 or model.body_mass[body] == 0.0 and not model.body_inertia[body].any():
            continue
        R_link = frame[link].T
        c = R_link @ (data.xpos[body] + data.xmat[body].reshape(3, 3) @ model.body_ipos[body] - origin[link])
        quat_R = np.zeros(9)
        mujoco.mju_quat2Mat(quat_R, model.body_iquat[body])
        A = R_link @ data.xmat[body].reshape(3, 3) @ quat_R.reshape(3, 3)
        m = model.body_mass[body]
        mass[link] += m
        first[link] += m * c
        second[link] += A @ np.diag(model.body_inertia[body]) @ A.T + m * (c @ c * np.eye(3) - np.outer(c, c))
    com = first / np.where(mass == 0.0, 1.0, mass)[:, None]
    shift = np.einsum("i,ijk->ijk", mass, (np.einsum("ij,ij->i", com, com)[:, None, None] * np.eye(3)
                                           - com[:, :, None] * com[:, None, :]))
    limited = model.jnt_limited.astype(bool)
    gear = np.ones(n)
    for a in range(model.nu):
        if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT:
            gear[model.actuator_trnid[a, 0]] = model.actuator_gear[a, 0]
    last = body_of[-1]
    tool_p, tool_R = np.zeros(3), np.eye(3)
    sites = [s for s in range(model.nsite) if model.body_weldid[model.site_bodyid[s]] == model.body_weldid[last]]
    if sites:
        mujoco.mj_forward(model, data)
        tool_p = frame[-1].T @ (data.site_xpos[sites[-1]] - origin[-1])
        tool_R = frame[-1].T @ data.site_xmat[sites[-1]].reshape(3, 3)
    as_array = lambda x: jnp.asarray(np.asarray(x, dtype=float))  # noqa: E731
    return Robot(
        rotation=as_array(rotation), position=as_array(position), axis=as_array(model.jnt_axis),
        reference=as_array(model.qpos0), mass=as_array(mass), com=as_array(com), inertia=as_array(second - shift),
        armature=as_array(model.dof_armature), damping=as_array(model.dof_damping.reshape(n)),
        frictionloss=as_array(model.dof_frictionloss), stiffness=as_array(model.jnt_stiffness.reshape(n)),
        springref=as_array(model.qpos_spring), gear=as_array(gear),
        gravity=as_array(base_rotation.T @ model.opt.gravity),
        base_rotation=as_array(base_rotation), base_position=as_array(base_position),
        tool_rotation=as_array(tool_R), tool_position=as_array(tool_p),
        lower=as_array(np.where(limited, model.jnt_range[:, 0], -np.inf)),
        upper=as_array(np.where(limited, model.jnt_range[:, 1], np.inf)),
        velocity_limit=as_array(np.full(n, np.inf)), effort_limit=as_array(np.full(n, np.inf)),
        joint_names=names, is_slide=tuple(bool(t == mujoco.mjtJoint.mjJNT_SLIDE) for t in model.jnt_type),
        name=str(source),
    )


def _carrier(model: mujoco.MjModel, body: int) -> int:
    """Index of the last joint on the way from the base to this body, -1 if it is fixed to the base."""
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    return int(model.body_jntadr[body] + model.body_jntnum[body] - 1) if body else -1
