"""MuJoCo's C engine under sliding mode control computed in NumPy: the oracle of closed loops."""

from collections.abc import Callable

import mujoco
import numpy as np
from jaxtyping import Float

Vector = Float[np.ndarray, " n"]
Rows = Float[np.ndarray, "S n"]


def sliding_mode_loop(
    true: mujoco.MjModel,
    believed: mujoco.MjModel,
    wanted: tuple[Rows, Rows, Rows],
    law: tuple[Vector, Vector, Vector, str],
    start: tuple[Vector, Vector],
    push: Callable[[float, Vector], Vector],
) -> tuple[Rows, Rows]:
    """Positions and motor torques of `mj_step` at its own time step, torque held over each step.

    tau = mj_inverse(q, qd, qdd_d + L ed) + K f((ed + L e) / layer)

    Args:
        true: The arm, from `mjcf`; its integrator is Euler.
        believed: The controller's model of it.
        wanted: Positions, velocities, accelerations to follow [rad or m, ...], one row a step and one more.
        law: L [1/s], K [N m or N], layer [rad/s or m/s], each (n,), and f: "saturation", "tanh" or "sign".
        start: Positions and velocities at the start, (n,) each.
        push: Joint torques of a disturbance [N m or N] at a time [s] and a motor torque.

    Returns:
        At the start of each step, shape (S - 1, n) each.
    """
    slope, gain, layer, kind = law
    switch = {"tanh": np.tanh, "sign": np.sign, "saturation": lambda x: np.clip(x, -1.0, 1.0)}[kind]
    data, model, dt = mujoco.MjData(true), mujoco.MjData(believed), true.opt.timestep
    data.qpos[:], data.qvel[:] = start
    q, torque = np.empty((2, len(wanted[0]) - 1, true.nv))
    for k in range(len(q)):
        e, ed = wanted[0][k] - data.qpos, wanted[1][k] - data.qvel
        model.qpos[:], model.qvel[:], model.qacc[:] = data.qpos, data.qvel, wanted[2][k] + slope * ed
        mujoco.mj_inverse(believed, model)
        q[k], torque[k] = data.qpos, model.qfrc_inverse + gain * switch((ed + slope * e) / layer)
        data.qfrc_applied[:] = torque[k] + push(k * dt, torque[k])
        mujoco.mj_step(true, data)
    return q, torque
