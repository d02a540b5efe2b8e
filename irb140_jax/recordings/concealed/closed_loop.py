"""The loop that drives the true arm along a motion with a controller that knows the nominal one only."""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np
from scipy import ndimage

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed.hidden import Hidden, Log, Plant
from irb140_jax.recordings.excite import Excitation

SETTLING = 0.4  # [s] of standing still at the start before the log begins, so that it doesn't begin with a jolt
RINGING = 50, 0.3  # steps, and the share of the torque with which it alternates from step to step meanwhile
BANDWIDTH = 60.0  # [rad/s] of the position loop, some 10 Hz: usual for an arm of this size


def closed_loop(
    nominal: mujoco.MjModel, true: mujoco.MjModel, hidden: Sequence[Hidden], motion: Excitation, *, recording: int = 0
) -> Log:
    """Drive the true arm along a motion by computed torque with the nominal model, plus PD.

    tau = ID_nominal(q, qd, qdd_ref + b^2 (q_ref - q) + 2 b (qd_ref - qd)), b the bandwidth

    The torque of step k and the position of step k belong together: the second difference of q around k is the
    acceleration that the torque of k causes, so the log has no hidden delay.

    Args:
        nominal: What the controller believes.
        true: The arm, with native effects already in it; it may have more joints (inside its transmissions).
        hidden: Effects to apply at every step, in this order.
        motion: The reference; its sampling is the engine's step.
        recording: Index of the recording, for effects that act in one recording only.

    Returns:
        The log, T samples.

    Raises:
        InputError: The loop is unstable.
    """
    n, before = nominal.nv, round(SETTLING / true.opt.timestep)
    steps = before + motion.t.size
    true = copy.copy(true)  # effects change friction levels as they go; the next recording starts afresh
    plant = Plant(true, [nominal.joint(i).name for i in range(n)], recording)
    control, data, dofs = mujoco.MjData(nominal), plant.data, plant.dofs
    data.qpos[plant.qpos] = motion.q[0]
    for effect in hidden:
        effect.begin(plant)
    data.qpos[plant.qpos] -= plant.zero
    mujoco.mj_forward(true, data)
    kp, kd = BANDWIDTH**2, 2.0 * BANDWIDTH
    held = lambda x: np.concatenate([np.repeat(x[:1], before, axis=0), x])  # noqa: E731
    wanted, time = held(motion.qdd + kp * motion.q + kd * motion.qd), held(motion.t)
    q, qd, tau = np.empty((steps, n)), np.empty((steps + 1, n)), np.empty((steps, n))
    q_link, inner = np.empty((steps, n)), plant.inside
    acting = [effect for effect in hidden if type(effect).act is not Hidden.act]
    for k in range(steps):
        plant.t = time[k]
        plant.q, plant.qd = data.qpos[plant.qpos], data.qvel[dofs]
        q[k], qd[k] = plant.q + plant.zero, plant.qd
        q_link[k] = plant.q
        q_link[k, list(inner)] += data.qpos[list(inner.values())]
        control.qpos[:], control.qvel[:] = q[k], qd[k]
        control.qacc[:] = wanted[k] - kp * q[k] - kd * qd[k]
        mujoco.mj_inverse(nominal, control)
        tau[k] = control.qfrc_inverse + control.qfrc_constraint
        plant.torque[:], plant.friction[:] = tau[k], plant.own_friction
        plant.inner[:] = 0.0
        for effect in acting:
            effect.act(plant)
        true.dof_frictionloss[dofs] = plant.friction
        data.qfrc_applied[:] = plant.inner
        data.qfrc_applied[dofs] += plant.torque
        mujoco.mj_step(true, data)
        # What accelerates and carries the links is what the gear transmitted: applied torque less friction.
        plant.load = (data.qfrc_applied + data.qfrc_passive + data.qfrc_constraint)[dofs]
    qd[steps] = data.qvel[dofs]
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(tau).all() or _rings(tau):
        raise InputError(
            f"motion {motion.name!r}: the closed loop becomes unstable; hide less, or sample the motion finer"
        )
    qdd = np.diff(qd[before:], axis=0) / plant.dt
    log = Log(motion.t, q[before:], qd[before:-1], qdd, tau[before:], q_link[before:])
    for effect in hidden:
        log = effect.measured(log)
    return log


def _rings(tau: np.ndarray) -> bool:
    """Whether torques (T, n) alternate from step to step: in a log that holds every other one that is a push."""
    steps, share = RINGING
    bend = 0.25 * np.diff(tau, 2, axis=0)
    back = np.where(np.sign(bend[1:]) != np.sign(bend[:-1]), np.abs(bend[1:]), 0.0)
    rms = np.sqrt(np.mean(tau**2, axis=0))
    level = np.maximum(rms, 1e-3 * rms.max() + 1e-9)  # of a joint that hardly does anything, rounding may alternate
    return bool(np.any(ndimage.uniform_filter1d(back, steps, axis=0) > share * level))
