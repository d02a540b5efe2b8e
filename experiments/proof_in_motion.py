"""Does the corrected model move as real machines did?  Simulated from recorded torque, on data not seen by the fit.

    python experiments/proof_in_motion.py [--out results/proof_in_motion.json] [--only tx40]

Every set of recordings that holds torque.  The goals: no joint's error over the horizon is more than 2 % above that of
the refitted rigid body, and where physics is named, the error of the joints named is at most half of it.  Times from
which every model is farther off than the joint has moved don't count, and are told.
"""

import argparse
import json
import os
import pathlib
import tempfile
from collections.abc import Callable

import numpy as np

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import read_recording
from irb140_jax.recordings.machines.bam_xl330 import servo_runs, write_servo
from irb140_jax.recordings.machines.cycloidal_play import cycloidal_runs, write_cycloidal
from irb140_jax.recordings.machines.dfki_double_pendulum import write_pendulum
from irb140_jax.recordings.machines.staubli_tx40 import write_tx40
from irb140_jax.robot import load_robot

TIMES = (0.1, 0.5, 2.0)  # [s]
WORSE, HALVED = 1.02, 0.5
Files = tuple[pathlib.Path, list[pathlib.Path]]


def sets() -> dict[str, Callable[[pathlib.Path], Files]]:
    """Model and recordings of each machine, by name, written into a folder when called."""
    out: dict[str, Callable[[pathlib.Path], Files]] = {
        "tx40": lambda folder: write_tx40(folder, split=None),
        "bam_xl330": _servo,
    }
    for design in ("A.0", "C.1"):
        for kind in ("correct", "mistake"):
            out[f"pendulum {design} {kind}"] = lambda folder, d=design, k=kind: _pendulum(folder, d, k)
    for run in cycloidal_runs():
        out[f"gear {run}"] = lambda folder, run=run: _gear(folder, run)
    return out


def _servo(folder: pathlib.Path) -> Files:
    files = [write_servo(folder, run) for run in servo_runs()]
    return files[0][0], [path for _, path in files]


def _pendulum(folder: pathlib.Path, design: str, kind: str) -> Files:
    models, runs = write_pendulum(folder, design)
    return models[kind], list(runs.values())


def _gear(folder: pathlib.Path, run: str) -> Files:
    model, path = write_cycloidal(folder, run)
    return model, [path]


def judged(files: Files) -> dict:
    """The proof of one set, and what it says of the goals."""
    robot = load_robot(files[0])
    result = diagnose(robot, [read_recording(path, robot) for path in files[1]])
    motion, findings = result.views.motion, result.diagnosis.findings
    told = {"verdict": result.diagnosis.verdict,
            "named": [f"{f.effect} on {', '.join(f.joints)}" for f in findings]}  # fmt: skip
    if motion is None:
        return told | {"motion": None}
    named = {joint for f in findings for joint in f.joints}
    rows = []
    for time in TIMES:
        k = motion["horizon"].index(time)
        for joint, row in motion["joints"].items():
            refit, corrected, moved = (row[name]["median"][k] for name in ("refit", "corrected", "moved"))
            if moved is None:
                continue
            rows.append({"time": time, "joint": joint, "named": joint in named, "nominal": row["nominal"]["median"][k],
                         "refit": refit, "corrected": corrected, "moved": moved,
                         "file": row["file"]["median"][k] if "file" in row else corrected})  # fmt: skip
    kept = ("windows", "runs", "as_torque", "as_law", "followed", "tool", "whole_run")
    return told | {key: motion[key] for key in kept} | {"rows": rows}


def scored(told: dict) -> dict:
    """With what it says of the goals; an error that is None is without end."""
    if "rows" not in told:
        return told
    for row in told["rows"]:
        refit, corrected = (np.inf if row[name] is None else row[name] for name in ("refit", "corrected"))
        row["lost"] = bool(min(refit, corrected) > row["moved"])
        row["ratio"] = None if row["lost"] else round(corrected / refit, 4) if np.isfinite(corrected) else None
        row["worse"] = not row["lost"] and bool(corrected > WORSE * refit)
        row["not_halved"] = not row["lost"] and row["named"] and bool(corrected > HALVED * refit)
    counts = {key: sum(row[key] for row in told["rows"]) for key in ("lost", "worse", "not_halved")}
    named = sum(row["named"] and not row["lost"] for row in told["rows"])
    return told | {"counted": len(told["rows"]) - counts["lost"], "counted_named": named} | counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results/proof_in_motion.json"))
    parser.add_argument("--only", default="", help="sets whose names begin so")
    asked = parser.parse_args()
    set_up_compilation_cache()
    results = json.loads(asked.out.read_text()) if asked.only and asked.out.exists() else {}
    for name, write in sets().items():
        if not name.startswith(asked.only):
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                results[name] = judged(write(pathlib.Path(folder)))
            except Exception as error:  # one machine's trouble is not another's
                results[name] = {"error": f"{type(error).__name__}: {error}"}
        _write(results, asked.out)
    _write(results, asked.out)
    for name, told in results.items():
        counts = {key: told.get(key) for key in ("counted", "lost", "worse", "counted_named", "not_halved")}
        print(name, told.get("verdict"), told.get("error", ""), counts)


def _write(results: dict, out: pathlib.Path) -> None:
    results |= {name: scored(told) for name, told in results.items()}
    fresh = out.with_suffix(".new")
    fresh.write_text(json.dumps(results, indent=1) + "\n")
    os.replace(fresh, out)


if __name__ == "__main__":
    main()
