"""Time and memory of `irb140 diagnose` by the length of a recording: six joints at 1 kHz, with ordinary friction.

    python experiments/long_recordings.py                    # 2, 20 and 60 minutes; some twenty minutes on two cores
    python experiments/long_recordings.py --minutes 2

Written down are how long it takes, the largest memory of the process, and what is named: the friction that is there,
by how many standard deviations it is off, and what is not there.  More data of the same must say no less.
"""

import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version

import jax.numpy as jnp
import numpy as np
import tyro

from irb140_jax import dynamics
from irb140_jax.robot import Robot, irb140

RESULTS = pathlib.Path(__file__).parents[1] / "results" / "long_recordings.json"
RATE, SEED = 1000.0, 0
WAVES = np.array([0.11, 0.23, 0.41, 0.67, 0.97])  # Hz
DRY, VISCOUS = 0.15, 0.1  # of the joint's torque: at any speed, and at a speed of one
PIECE = 60_000  # samples whose torque is evaluated at a time


@dataclasses.dataclass(frozen=True)
class Config:
    """How long."""

    minutes: tuple[float, ...] = (2.0, 20.0, 60.0)


def recording(robot: Robot, minutes: float, path: pathlib.Path) -> dict[tuple[str, str], float]:
    """Write a recording: five waves a joint over most of its range, noise of 2 % of the torque.

    Returns:
        The friction of each joint, by effect and joint.
    """
    rng, t = np.random.default_rng(SEED), np.arange(int(60.0 * minutes * RATE)) / RATE
    lower, upper = np.asarray(robot.lower), np.asarray(robot.upper)
    q, qd, qdd = np.zeros((3, len(t), robot.n))
    for j in range(robot.n):
        size = rng.uniform(0.3, 1.0, len(WAVES))
        size *= 0.8 * min(0.5 * (upper[j] - lower[j]), 1.2) / size.sum()
        for a, w, phase in zip(size, 2.0 * np.pi * WAVES * rng.uniform(0.9, 1.1, len(WAVES)), rng.uniform(0, 6, 5),
                               strict=True):  # fmt: skip
            q[:, j] += a * np.sin(w * t + phase)
            qd[:, j] += a * w * np.cos(w * t + phase)
            qdd[:, j] -= a * w**2 * np.sin(w * t + phase)
    q += 0.5 * (lower + upper)
    tau = np.zeros_like(q)
    for k in range(0, len(t), PIECE):
        moving = (jnp.asarray(x[k : k + PIECE]) for x in (q, qd, qdd))
        tau[k : k + PIECE] = np.asarray(dynamics.inverse_dynamics_batch(robot, *moving))
    size = np.sqrt(np.mean(tau**2, axis=0))
    tau += size * (DRY * np.tanh(qd / 1e-3) + VISCOUS * qd + 0.02 * rng.normal(size=tau.shape))
    q += 1e-6 * rng.normal(size=q.shape)
    columns = {f"{k}.{name}": x[:, j] for k, x in (("q", q), ("tau", tau)) for j, name in enumerate(robot.joint_names)}
    np.savez(path, allow_pickle=False, t=t, **columns)
    laws = (("coulomb_friction", DRY), ("viscous_friction", VISCOUS))
    sizes = dict(zip(robot.joint_names, size, strict=True))
    return {(law, name): float(share * x) for law, share in laws for name, x in sizes.items()}


def measured(path: pathlib.Path, folder: pathlib.Path, truth: dict[tuple[str, str], float]) -> dict[str, float]:
    """Wall time [s], largest resident set [GB] and what a diagnosis names."""
    command = [sys.executable, "-m", "irb140_jax", "diagnose", str(path), "--out", str(folder / path.stem)]
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{' '.join(command)} ended with status {status}")
    seconds = time.perf_counter() - start
    said = json.loads((folder / path.stem / "diagnosis.json").read_text(encoding="utf-8"))["findings"]
    right = {(f["effect"], f["joints"][0]): next(iter(f["parameters"].values())) for f in said
             if len(f["joints"]) == 1 and (f["effect"], f["joints"][0]) in truth}  # fmt: skip
    off = [abs(p["value"] - truth[k]) / p["std"] for k, p in right.items()]
    named = {"frictions": len(truth), "named": len(right), "not_there": len(said) - len(right)}
    worst = {"rms_deviations": float(np.sqrt(np.mean(np.square(off)))), "most_deviations": max(off)} if off else {}
    return {"seconds": seconds, "gb": usage.ru_maxrss / 1e6} | named | worst


def main(config: Config) -> None:
    """Measure each length and keep it."""
    stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for minutes in config.minutes:
            path = pathlib.Path(folder) / f"{minutes:g}_minutes.npz"
            truth = recording(irb140(), minutes, path)
            stored[f"{minutes:g}"] = measured(path, pathlib.Path(folder), truth) | {"cores": os.cpu_count() or 1}
            made = {"rate": RATE, "joints": 6, "version": version("irb140_jax"), "jax": version("jax")}
            RESULTS.write_text(json.dumps(stored | {"made": made}, indent=1) + "\n", encoding="utf-8")
            print(minutes, stored[f"{minutes:g}"], flush=True)


if __name__ == "__main__":
    main(tyro.cli(Config))
