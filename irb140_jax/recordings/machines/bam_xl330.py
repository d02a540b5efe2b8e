"""A hobby servo (Dynamixel XL330-M288) that swings a pendulum: 16 runs with the position loop of the servo itself.

The servo logs the duty cycle of its bridge, from which the motor's torque follows with the constants of its data sheet:

    V = duty vin,  tau = kt/R V - kt^2/R qd,  and none once torque is switched off

Source: github.com/Rhoban/bam (Apache-2.0); Duclusaud, Passault, Padois, Ly, Extended Friction Models for the Physics
Simulation of Servo Actuators, ICRA 2025, arXiv 2410.08650; data sheet: Robotis e-Manual, XL330-M288-T; see `sources`.
"""

import dataclasses
import json
import pathlib

import numpy as np
from scipy import signal

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.drive import stated_drive
from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.machines.sources import SOURCES
from irb140_jax.recordings.recording import Recording, rows_of, write_recording

MACHINE = "bam_xl330"
JOINT = "servo"
MASS, LENGTH = 0.49, 0.10  # kg at so many m of the shaft, as published; the arm itself is light and not known
STALL_TORQUE, STALL_CURRENT, RATED_VOLTAGE = 0.52, 1.47, 5.0  # N m, A, V of the data sheet
KT, R = STALL_TORQUE / STALL_CURRENT, RATED_VOLTAGE / STALL_CURRENT  # N m/A and ohm
FULL_DUTY = 885.0  # counts of the duty cycle at 100 %
WRAP = 65536  # counts; the duty is logged without its sign, in 16 bits
ERROR_GAIN = 4096.0 / (2.0 * np.pi) / (256.0 * FULL_DUTY)  # duty per rad and unit of gain: counts of encoder and bridge
SPEED_WINDOW = 11  # samples (60 ms) over which positions are differentiated for the back electromotive force


def servo_runs() -> dict[str, tuple[int, str]]:
    """Gain and trajectory of every run, by its name."""
    return {name.removesuffix(".json"): (head["kp"], head["trajectory"])
            for name in SOURCES[MACHINE].files if name.endswith(".json") for head in [_read(name)]}  # fmt: skip


def servo_recording(run: str, folder: pathlib.Path | None = None) -> Recording:
    """One run of 6 s: position [rad], 0 hanging down, and the motor's torque on the output [N m].

    Goals, volts at the motor and whether it was switched on are kept as `goal`, `volts` and `enabled`.

    Args:
        run: One of `servo_runs()`.
        folder: Where the published files are; by default `recordings_folder`.

    Raises:
        RecordingError: There is no such run.
    """
    if f"{run}.json" not in SOURCES[MACHINE].files:
        raise RecordingError(f"{MACHINE} has no run '{run}'; allowed is {', '.join(SOURCES[MACHINE].files)}")
    log = _read(f"{run}.json", folder)
    column = lambda name: np.array([float(entry[name]) for entry in log["entries"]])  # noqa: E731
    t, q, enabled = column("timestamp"), column("position"), column("torque_enable")
    counts = column("load")
    duty = np.where(counts > WRAP / 2, counts - WRAP, counts) / FULL_DUTY
    volts = duty * log["vin"]
    grid = np.linspace(t[0], t[-1], len(t))
    step = float(grid[1] - grid[0])
    even = np.asarray(signal.savgol_filter(np.interp(grid, t, q), SPEED_WINDOW, 2, deriv=1, delta=step))
    tau = enabled * motor_torque(volts, np.interp(t, grid, even))
    return Recording(t=t, q=q[:, None], tau=tau[:, None], joint_names=(JOINT,), source=run,
                     extras={"goal": column("goal_position"), "volts": volts, "enabled": enabled})  # fmt: skip


def servo_commands(run: str, folder: pathlib.Path | None = None) -> Recording:
    """The same run as if no duty had been logged: goals and positions, until the motor is switched off.

    duty = clip(kp error_gain (goal - q), +-1),  error_gain = (4096 / 2 pi) / (256 x 885),  V = duty vin

    Args:
        run, folder: As in `servo_recording`.
    """
    log, whole = _read(f"{run}.json", folder), servo_recording(run, folder)
    off = np.flatnonzero(whole.extras["enabled"] < 0.5)
    part = rows_of(whole, slice(0, int(off[0]) if len(off) else None))
    full = KT / R * float(log["vin"])
    drive = stated_drive(np.array([full * log["kp"] * ERROR_GAIN]), np.array([KT**2 / R]), full)
    return dataclasses.replace(
        part, tau=np.full_like(part.q, np.nan), qdes=part.extras["goal"][:, None], drive=drive, extras={}
    )


def motor_torque(volts: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Torque of a direct-current motor with the constants of the data sheet [N m], from volts and speed [rad/s]."""
    return KT / R * volts - KT**2 / R * speed


def servo_model() -> str:
    """MJCF of a point mass on a weightless arm: no friction, no rotor."""
    return f"""<mujoco model="pendulum on a servo">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="arm">
      <joint name="{JOINT}" axis="0 1 0"/>
      <inertial pos="0 0 {-LENGTH}" mass="{MASS}" diaginertia="1e-6 1e-6 1e-6"/>
    </body>
  </worldbody>
</mujoco>
"""


def write_servo(
    out: pathlib.Path, run: str, folder: pathlib.Path | None = None, *, suffix: str = ".csv"
) -> tuple[pathlib.Path, pathlib.Path]:
    """Write the model and one run as contract files; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    model = out / "servo.xml"
    model.write_text(servo_model(), encoding="utf-8")
    return model, write_recording(servo_recording(run, folder), out / f"{run}{suffix}")


def _read(name: str, folder: pathlib.Path | None = None) -> dict:
    return json.loads(published_file(MACHINE, name, folder).read_text(encoding="utf-8"))
