"""MuJoCo's C engine forward in time under given torques and controls, many motions side by side: NumPy in and out."""

import copy
import os
from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from jaxtyping import Float
from mujoco import rollout

# From times since the start (B,) [s], positions, speeds, the load of the joints without friction and controls, (B, n)
# each, to what dry friction can hold and to other torque that motors need, (B, n) each [N m or N].
Law = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
HELD = 0.005  # s for which that stays as it is: shorter than arms take to change their load or speed


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
    with _Threads(models[0], len(q)) as threads:
        state = threads.states(models, start, tau, control)
    return np.concatenate([q[:, None], np.where(_ended(start, state), np.inf, state[..., 1 : 1 + n])], axis=1)


def positions_under_law(
    models: Sequence[mujoco.MjModel],
    q: Float[np.ndarray, "B n"],
    qd: Float[np.ndarray, "B n"],
    tau: Float[np.ndarray, "B S n"],
    control: Float[np.ndarray, "B S n"] | None,
    law: Law,
) -> Float[np.ndarray, "B S+1 n"]:
    """The same under a law beside the models' own numbers; what it gives is held for `HELD` each time."""
    n, step = q.shape[1], models[0].opt.timestep
    rubbing, bare = [copy.copy(m) for m in models], [frictionless(m) for m in models]
    own = np.stack([m.dof_frictionloss for m in models])
    asked = np.zeros(tau.shape) if control is None else control
    datas = [mujoco.MjData(m) for m in bare]
    state, went = np.concatenate([np.zeros((len(q), 1)), q, qd], axis=1), [q[:, None]]
    ended, qdd, every = np.zeros((len(q), 1), dtype=bool), np.zeros_like(q), max(round(HELD / step), 1)
    with _Threads(models[0], len(q)) as threads:
        for first in range(0, tau.shape[1], every):
            at = slice(first, first + every)
            load = np.stack([joint_load(m, d, s, a) for m, d, s, a in zip(bare, datas, state, qdd, strict=True)])
            level, torque = law(state[:, 0], state[:, 1 : 1 + n], state[:, 1 + n :], load, asked[:, first])
            for m, loss in zip(rubbing, own + level, strict=True):
                m.dof_frictionloss[:] = loss
            given = tau[:, at] - torque[:, None]
            after = threads.states(rubbing, state, given, None if control is None else asked[:, at])
            gone = _ended(state, after) | ended[:, None]
            went.append(np.where(gone, np.inf, after[..., 1 : 1 + n]))
            ended = gone[:, -1]
            # What flew away stays where it last was, and is infinite all the same.
            last = np.where(ended, state, after[:, -1])
            qdd, state = (last - state)[:, 1 + n :] / (given.shape[1] * step), last
    return np.concatenate(went, axis=1)


def frictionless(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy of a model whose inverse dynamics is the load of its joints."""
    out = copy.copy(model)
    out.dof_frictionloss[:] = out.dof_damping[:] = 0.0
    return out


def joint_load(model: mujoco.MjModel, data: mujoco.MjData, state: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """What the joints of a frictionless model need in a state (1 + 2 n,): time, positions, speeds, (n,) [N m or N]."""
    data.qpos[:], data.qvel[:], data.qacc[:] = state[1 : 1 + model.nq], state[1 + model.nq :], qdd
    mujoco.mj_inverse(model, data)
    return data.qfrc_inverse.copy()


class _Threads:
    """MuJoCo's threads for motions side by side, and what each of them writes to."""

    def __init__(self, model: mujoco.MjModel, motions: int):
        self.datas = [mujoco.MjData(model) for _ in range(min(motions, os.cpu_count() or 1))]
        self.rollout = rollout.Rollout(nthread=len(self.datas))

    def __enter__(self) -> "_Threads":
        mujoco.set_mju_user_warning(lambda _: None)  # or MuJoCo writes a file about motions that fly away
        return self

    def __exit__(self, *_: object) -> None:
        mujoco.set_mju_user_warning(None)
        self.rollout.close()

    def states(
        self, models: Sequence[mujoco.MjModel], start: np.ndarray, tau: np.ndarray, control: np.ndarray | None
    ) -> np.ndarray:
        """States after each step, (B, S, 1 + 2 n): time, positions, speeds."""
        spec, given = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), np.ascontiguousarray(tau)
        if control is not None:  # comes first in MuJoCo's order
            spec, given = spec | int(mujoco.mjtState.mjSTATE_CTRL), np.concatenate([control, tau], axis=-1)
        return self.rollout.rollout(list(models), self.datas, start, given, control_spec=spec)[0]


def _ended(start: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Where MuJoCo gave up, (B, S, 1): time stands still."""
    return np.diff(state[..., :1], axis=1, prepend=start[:, None, :1]) <= 0.0


def tool_positions(model: mujoco.MjModel, q: Float[np.ndarray, "... n"]) -> Float[np.ndarray, "... 3"]:
    """Where the last site is [m], for every position of the joints; NaN where one is not finite."""
    data, out = mujoco.MjData(copy.copy(model)), np.full((*q.shape[:-1], 3), np.nan)
    for index in np.ndindex(*q.shape[:-1]):
        if np.isfinite(q[index]).all():
            data.qpos[:] = q[index]
            mujoco.mj_kinematics(model, data)
            out[index] = data.site_xpos[-1]
    return out
