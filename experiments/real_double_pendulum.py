"""Diagnose a real two-link arm (designs C.1 and A.0), with the correct model and with its published URDF's mistake.

    python experiments/real_double_pendulum.py [--out results]

Test runs are as published; the others are for fitting.  The published parameters are the answer key; the diagnosis
never reads them.
"""

import dataclasses
import json
import pathlib
import tempfile

import numpy as np
import tyro
from scipy import signal

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose, predict
from irb140_jax.recordings import read_recording
from irb140_jax.recordings.machines.dfki_double_pendulum import write_pendulum
from irb140_jax.robot import load_robot

TEST = {"C.1": ("143601", "143747", "144115", "154548"), "A.0": ("02", "05", "11", "13")}
GOAL = {"C.1": (0.190, 0.120), "A.0": (0.233, 0.099)}  # N m, joints 1 and 2: the published corrected figures
TORQUE_FILTER = 10.0  # Hz, zero-phase, as in the published check
TRIM = 0.3  # s off both ends, likewise


@dataclasses.dataclass(frozen=True)
class Config:
    """Which designs with which models, and where to write."""

    sets: tuple[str, ...] = ("C.1 correct", "C.1 mistake", "A.0 correct", "A.0 mistake")
    out: pathlib.Path = pathlib.Path("results")


def run(config: Config) -> dict:
    """Designs with models."""
    results = {}
    for design, test in TEST.items():
        with tempfile.TemporaryDirectory() as folder:
            models, runs = write_pendulum(pathlib.Path(folder), design)
            for kind, model in models.items():
                if f"{design} {kind}" not in config.sets:
                    continue
                robot = load_robot(model)
                recordings = {name: read_recording(path, robot) for name, path in runs.items()}
                unseen = [r for name, r in recordings.items() if name.endswith(test)]
                seen = [r for name, r in recordings.items() if not name.endswith(test)]
                result = diagnose(robot, seen)
                diagnosis = result.diagnosis.to_json()
                results[f"{design} {kind}"] = {
                    "verdict": diagnosis["verdict"], "summary": diagnosis["summary"],
                    "findings": diagnosis["findings"], "inertials": result.views.to_json()["inertials"],
                    "rmse_unseen": rmse(result.model, unseen), "goal": GOAL[design],
                }  # fmt: skip
    return results


def rmse(model, recordings) -> dict[str, list[float]]:
    """Error of the three models over all recordings, both sides through the published filter."""
    squares: dict[str, list[np.ndarray]] = {}
    for r in recordings:
        rate = (len(r.t) - 1) / (r.t[-1] - r.t[0])
        sos = signal.butter(4, TORQUE_FILTER, fs=rate, output="sos")
        inner = (r.t > r.t[0] + TRIM) & (r.t < r.t[-1] - TRIM)
        for name, tau in predict(model, r).items():
            squares.setdefault(name, []).append(signal.sosfiltfilt(sos, r.tau - tau, axis=0)[inner] ** 2)
    return {name: np.sqrt(np.concatenate(s).mean(axis=0)).round(4).tolist() for name, s in squares.items()}


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    results = run(config)
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "real_double_pendulum.json"
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    for name, result in results.items():
        print(f"{name}: {result['summary']}")
        for kind, values in result["rmse_unseen"].items():
            print(f"  RMSE {kind:10s}", values)
        print("  goal           ", list(result["goal"]))
    print(path)


if __name__ == "__main__":
    main()
