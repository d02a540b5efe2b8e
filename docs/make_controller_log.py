"""Write logs as a robot's controller might: `python docs/make_controller_log.py FOLDER`.

An IRB 140 in MuJoCo with something hidden in it; positions in degrees, currents in ampere on the motors' side,
semicolons and decimal commas in Latin-1, dates for times, a title above the header.  `docs/first-hour.md` goes on from
here to a report.
"""

import pathlib
import sys

import numpy as np
import pandas as pd

from irb140_jax.recordings import Recording
from irb140_jax.recordings.conceal import ConcealedCase, demo_case

GEAR_RATIO = np.array([100.0, 110.0, 90.0, 60.0, 50.0, 40.0])  # motor turns per turn of the joint
TORQUE_CONSTANT = np.array([0.9, 0.9, 0.8, 0.5, 0.5, 0.4])  # N m/A of each motor
START = pd.Timestamp("2026-11-24 09:30:00")


def write_controller_log(recording: Recording, path: pathlib.Path) -> pathlib.Path:
    """One recording in the controller's own form."""
    stamps = pd.DatetimeIndex(START + pd.to_timedelta(recording.t, unit="s"))
    table: dict[str, object] = {"Zeit": stamps.strftime("%Y-%m-%dT%H:%M:%S.%f")}
    for n in range(recording.q.shape[1]):
        current = recording.tau[:, n] / (TORQUE_CONSTANT[n] * GEAR_RATIO[n])
        table[f"Achse {n + 1} Ist-Position [°]"] = np.degrees(recording.q[:, n])
        table[f"Achse {n + 1} Motorstrom [A]"] = current
    text = pd.DataFrame(table).to_csv(index=False, sep=";", decimal=",", float_format="%.7f")
    path.write_bytes(f"Aufzeichnung der Größen aller Achsen\nTakt: 4 ms\n\n{text}".encode("latin-1"))
    return path


def write_all(folder: pathlib.Path, seed: int = 3) -> ConcealedCase:
    """Every recording of a hidden case."""
    folder.mkdir(parents=True, exist_ok=True)
    case = demo_case(seed)
    for i, recording in enumerate(case.recordings):
        write_controller_log(recording, folder / f"run{i + 1}.csv")
    return case


if __name__ == "__main__":
    write_all(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "controller-logs"))
