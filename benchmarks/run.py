"""Measure, compare with the goals, and write results.json and the table in README.md.

    python benchmarks/run.py [--slack 0.7] [--out DIR]

Exit code 1 if a metric is missing, not a number, or misses its goal.
"""

import timing  # noqa: F401, I001  first: it sets the number of threads

import argparse
import json
import math
import pathlib
import platform
import sys
from importlib.metadata import version

import cases
import diagnosis_cases
import rollout_cases
import swarm_cases
from goals import GOALS, missed, page, table

from irb140_jax.robot import load_robot

CASES = (
    cases.inverse_dynamics, cases.paper_style, cases.identification, rollout_cases.rollouts, rollout_cases.runge_kutta,
    swarm_cases.swarms, diagnosis_cases.diagnosis,
)  # fmt: skip
HERE = pathlib.Path(__file__).parent


def main() -> int:
    """Run all cases; 0 if every goal is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slack", type=float, default=1.0, help="relax goals by this factor, 0.7 on shared machines")
    parser.add_argument("--out", type=pathlib.Path, default=HERE, help="where results.json and README.md go")
    arguments = parser.parse_args()
    robot = load_robot(HERE.parent / "assets" / "irb140.xml")
    metrics: dict[str, float] = {}
    failures = []
    for case in CASES:
        try:
            metrics |= case(robot)
        except Exception as error:  # a benchmark that fails must fail the run, and not hide the others
            failures.append(f"{case.__name__}: {type(error).__name__}: {error}")
    failures += [text for text in (missed(name, metrics, arguments.slack) for name in GOALS) if text]
    failures += [f"{name} is {value}" for name, value in metrics.items() if not math.isfinite(value)]
    results = {"machine": machine(), "rounds": cases.ROUNDS, "metrics": metrics, "failures": failures}
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "results.json").write_text(json.dumps(results, indent=2) + "\n")
    (arguments.out / "README.md").write_text(page(results))
    print(table(metrics))
    for text in failures:
        print(f"FAILED {text}", file=sys.stderr)
    return 1 if failures else 0


def machine() -> dict[str, str]:
    """What the figures depend on."""
    packages = {name: version(name) for name in ("jax", "jaxlib", "numpy", "pin", "mujoco")}
    return {"processor": _processor(), "python": platform.python_version(), **packages}


def _processor() -> str:
    info = pathlib.Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


if __name__ == "__main__":
    sys.exit(main())
