"""The same motions as CSV, Parquet, NPZ, ROS bags, MCAP, LeRobot, MAT and controllers' CSV give the same diagnosis.

    python experiments/same_diagnosis.py [--out results]

A three-joint arm whose rigid torque is MuJoCo's, with viscous and dry friction that its model has not.
"""

import dataclasses
import json
import pathlib
import sys
import tempfile
import time

import tyro

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import read_recording

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tests"))

import helpers_recordings as made  # noqa: E402
from test_recordings_formats import WRITERS  # noqa: E402


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write, and how long the recordings are."""

    out: pathlib.Path = pathlib.Path("results")
    duration: float = 10.0
    smoke: bool = False
    """Two formats only."""


def said(diagnosis: dict) -> dict[tuple[str, str, str], float]:
    """Every parameter of every finding, and the figures of the fit, whatever the order."""
    found = {(f["effect"], " ".join(f["joints"]), name): parameter["value"]
             for f in diagnosis["findings"] for name, parameter in f["parameters"].items()}  # fmt: skip
    fit = diagnosis["fit"]
    return found | {("fit", joint, name): value for joint in fit for name, value in fit[joint].items()}


def run(config: Config) -> dict:
    robot, first, rows = made.robot(), None, {}
    motions = [made.recording(seed=seed, duration=config.duration, speeds=False) for seed in (0, 1)]
    for kind in ["csv", "mcap"] if config.smoke else list(WRITERS):
        write, lines = WRITERS[kind]
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            recordings = []
            for i, motion in enumerate(motions):
                place = pathlib.Path(folder) / str(i)
                place.mkdir()
                (place / "map.toml").write_text(lines or "")
                recordings.append(read_recording(write(motion, place), robot, place / "map.toml" if lines else None))
        found = diagnose(robot, recordings).diagnosis.to_json()
        first = found if first is None else first
        rows[kind] = compared(found, first) | {"seconds": round(time.perf_counter() - start, 1)}
        print(kind, rows[kind], flush=True)
    return {"verdict": first["verdict"] if first else "", "formats": rows}


def compared(diagnosis: dict, first: dict) -> dict:
    """How far a diagnosis is from the first one."""
    found, wanted = said(diagnosis), said(first)
    same = found.keys() == wanted.keys() and diagnosis["verdict"] == first["verdict"]
    off = max(abs(found[k] - wanted[k]) / abs(wanted[k]) for k in wanted) if same else float("nan")
    return {"verdict": diagnosis["verdict"], "same": same, "findings": len(diagnosis["findings"]),
            "largest_relative_difference": off}  # fmt: skip


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    result = run(config)
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "same_diagnosis.json"
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(path)


if __name__ == "__main__":
    main()
