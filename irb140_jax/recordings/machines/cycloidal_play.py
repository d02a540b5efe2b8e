"""3D-printed cycloidal gears with their output bolted down: slow torque ramps of +-4 N m against play and springs.

The motor is driven by torque; its position is logged in turns of the output.  Nothing moves but what the gear gives,
so the nominal machine is a spring: one joint, held where it is bolted down, tau = k (q - q0).

Source: github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator (CC BY-SA 4.0); its owner, Anti-Backlash Mechanisms for
Cost-Effective Cycloidal Drive Robotic Actuators, MSc thesis, 2024; see `sources`.
"""

import pathlib

import numpy as np
import pandas as pd

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.machines.sources import SOURCES
from irb140_jax.recordings.recording import Recording, write_recording
from irb140_jax.recordings.repair import with_coarse_times_spread

MACHINE = "cycloidal_play"
JOINT = "output"
STIFFNESS = 275.0  # N m/rad, the middle of the published 200 to 350
INERTIA = 1e-4  # kg m^2, of what the bolted output still turns: nothing beside the spring, but no zero for MuJoCo
AVERAGED = 0.01  # s; a ramp takes 4 s, but the play is crossed in a tenth of one
FIRST_BIG_RAMP = 100  # `test_nr` of the ramps that saturate; below are those of the play test


def cycloidal_runs() -> tuple[str, ...]:
    """Names of the published torque ramps: gear, preload or state, and the number of the repetition."""
    return tuple(sorted(name.split("__")[-1].removesuffix(".csv") for name in SOURCES[MACHINE].files))


def cycloidal_recording(run: str, folder: pathlib.Path | None = None) -> Recording:
    """The play test of one run: five ramps of 4 s, motor position on the output side [rad] and torque [N m].

    The log comes at some 420 rows a second with stamps in ticks of 15.6 ms; rows are spread over the ticks and averaged
    over `AVERAGED`, because the gear creeps most of the time and a step of the encoder is a third of an arc-minute.
    Positions count from the middle of the way between the ends, as the zero of the encoder is arbitrary.

    Args:
        run: One of `cycloidal_runs()`.
        folder: Where the published files are; by default `recordings_folder`.

    Raises:
        RecordingError: There is no such run.
    """
    if run not in cycloidal_runs():
        raise RecordingError(f"no torque ramps called '{run}'; allowed is {', '.join(cycloidal_runs())}")
    name = next(name for name in SOURCES[MACHINE].files if name.endswith(f"__{run}.csv"))
    frame = pd.read_csv(published_file(MACHINE, name, folder))
    frame = frame[frame["test_nr"] < FIRST_BIG_RAMP]
    notes: list[str] = []
    table = {"t": np.asarray(frame["TIME"], float), "q": 2.0 * np.pi * np.asarray(frame["POSITION"], float),
             "tau": np.asarray(frame["TORQUE"], float)}  # fmt: skip
    table = with_coarse_times_spread(table, notes)
    bins = np.floor((table["t"] - table["t"][0]) / AVERAGED).astype(int)
    count = np.bincount(bins)[:-1]  # the last bin is not full
    some = np.flatnonzero(count)  # the operating system was away for longer now and then
    q, tau = (np.bincount(bins, weights=table[name])[some] / count[some] for name in ("q", "tau"))
    t = AVERAGED * (some + 0.5)
    q -= 0.5 * (q.min() + q.max())
    notes.append(f"Rows were averaged over {1000 * AVERAGED:g} ms")
    return Recording(t=t, q=q[:, None], tau=tau[:, None], joint_names=(JOINT,), source=run, notes=tuple(notes))


def cycloidal_model() -> str:
    """MJCF of a bolted output: a hinge with the published stiffness, no play and no friction."""
    return f"""<mujoco model="cycloidal gear, output bolted down">
  <compiler angle="radian"/>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="output">
      <joint name="{JOINT}" axis="0 0 1" stiffness="{STIFFNESS}"/>
      <inertial pos="0 0 0" mass="0.1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
    </body>
  </worldbody>
</mujoco>
"""


def write_cycloidal(
    out: pathlib.Path, run: str, folder: pathlib.Path | None = None, *, suffix: str = ".csv"
) -> tuple[pathlib.Path, pathlib.Path]:
    """Write the model and one run as contract files; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    model = out / "cycloidal.xml"
    model.write_text(cycloidal_model(), encoding="utf-8")
    return model, write_recording(cycloidal_recording(run, folder), out / f"{run.replace(' ', '_')}{suffix}")
