"""Diagnose cycloidal gears with their output bolted down: play without preload, none with it.

    python experiments/real_cycloidal_play.py [--out results]

Published gaps come from a least squares over what moves, with a spring, dry friction and a dead zone; the diagnosis
reads none of them.
"""

import dataclasses
import json
import pathlib
import tempfile

import numpy as np
import tyro

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import read_recording
from irb140_jax.recordings.machines.cycloidal_play import write_cycloidal
from irb140_jax.robot import load_robot

ARC_MINUTE = np.pi / 180.0 / 60.0  # rad
GAPS = {"base_onyx runin1": 88.0, "split_onyx runin1": 67.0}  # arc-min
PRELOADED = ("split_onyx 12pre1", "split_onyx 12pre5")
OTHERS = (
    "base_onyx init1", "base_onyx runin5", "base_onyx runin6", "split_onyx runin5", "split_onyx 3pre1",
    "split_onyx 6pre1",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write, and whether runs without a published gap are diagnosed, too."""

    out: pathlib.Path = pathlib.Path("results")
    others: bool = True


def run(config: Config) -> dict:
    """One diagnosis a run."""
    return {name: diagnosed(name) for name in (*GAPS, *PRELOADED, *(OTHERS if config.others else ()))}


def diagnosed(name: str) -> dict:
    """Verdict, findings, and the gap in arc-minutes where play is named."""
    with tempfile.TemporaryDirectory() as folder:
        model, path = write_cycloidal(pathlib.Path(folder), name)
        robot = load_robot(model)
        diagnosis = diagnose(robot, [read_recording(path, robot)]).diagnosis.to_json()
    play = [f["parameters"]["gap"] for f in diagnosis["findings"] if f["effect"] == "backlash"]
    gap = {key: round(play[0][key] / ARC_MINUTE, 2) for key in ("value", "std")} if play else None
    return {
        "verdict": diagnosis["verdict"], "summary": diagnosis["summary"], "findings": diagnosis["findings"],
        "unexplained": diagnosis["unexplained"], "fit": diagnosis["fit"], "gap_arc_minutes": gap,
        "published_gap_arc_minutes": GAPS.get(name),
    }  # fmt: skip


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    results = run(config)
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "real_cycloidal_play.json"
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    for name, result in results.items():
        print(f"{name}: gap {result['gap_arc_minutes']}, published {result['published_gap_arc_minutes']}")
        print(" ", *(f["effect"] for f in result["findings"]))
    print(path)


if __name__ == "__main__":
    main()
