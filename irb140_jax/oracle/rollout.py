"""MuJoCo's C engine forward in time under given torques and controls, many motions side by side: NumPy in and out."""

import copy
import os
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from mujoco import rollout


def simulated_model(text: str, step: float) -> mujoco.MjModel:
    """A compiled model to be simulated: dry friction is in, joint limits and contacts are out.

    Args:
        text: MJCF.
        step: Time step [s].
    """
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = step
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= int(off.mjDSBL_LIMIT | off.mjDSBL_CONTACT | off.mjDSBL_AUTORESET)
    return model


def positions(
    models: Sequence[mujoco.MjModel],
    q: Float[np.ndarray, "B n"],
    qd: Float[np.ndarray, "B n"],
    tau: Float[np.ndarray, "B S n"],
    control: Float[np.ndarray, "B S n"] | None = None,
) -> Float[np.ndarray, "B S+1 n"]:
    """Joint positions of motions under torques, one model each, from start to end [rad or m].

    MuJoCo's steps are semi-implicit.  With speeds half a step before the start they are those of the leapfrog, whose
    error goes with the square of the step; so they are given that way.  What flies away is infinite from then on.

    Args:
        models: From `simulated_model`, all of one robot.
        q: Where each motion starts [rad or m].
        qd: Speeds half a step before that [rad/s or m/s].
        tau: Torque on the joints during each step [N m or N], beside that of the actuators.
        control: Of the actuators during each step; zero where None.
    """
    n = q.shape[1]
    start = np.concatenate([np.zeros((len(q), 1)), q, qd], axis=1)  # of mjSTATE_FULLPHYSICS: time, qpos, qvel
    threads = [mujoco.MjData(models[0]) for _ in range(min(len(q), os.cpu_count() or 1))]
    mujoco.set_mju_user_warning(lambda _: None)  # or MuJoCo writes a file about motions that fly away
    try:
        spec, given = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), np.ascontiguousarray(tau)
        if control is not None:  # comes first in MuJoCo's order
            spec, given = spec | int(mujoco.mjtState.mjSTATE_CTRL), np.concatenate([control, tau], axis=-1)
        state, _ = rollout.rollout(list(models), threads, start, given, control_spec=spec)
    finally:
        mujoco.set_mju_user_warning(None)
    ended = np.diff(state[..., :1], axis=1, prepend=0.0) <= 0.0  # MuJoCo gave up: time stands still
    return np.concatenate([q[:, None], np.where(ended, np.inf, state[..., 1 : 1 + n])], axis=1)


def tool_positions(model: mujoco.MjModel, q: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... 3"]:
    """Where the last site is [m], for every position of the joints; NaN where one is not finite."""
    data, out = mujoco.MjData(copy.copy(model)), np.full((*q.shape[:-1], 3), np.nan)
    for index in np.ndindex(*q.shape[:-1]):
        if np.isfinite(q[index]).all():
            data.qpos[:] = q[index]
            mujoco.mj_kinematics(model, data)
            out[index] = data.site_xpos[-1]
    return out
