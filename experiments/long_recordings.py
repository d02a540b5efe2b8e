"""Time and memory of `irb140 diagnose` by the length of a recording: six joints at 1 kHz, with ordinary friction.

    python experiments/long_recordings.py                    # 2, 20 and 60 minutes; some twenty minutes on two cores
    python experiments/long_recordings.py --minutes 2

Says nothing of what is found: only how long it takes, and the largest memory of the process.
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
PIECE = 60_000  # samples whose torque is evaluated at a time


@dataclasses.dataclass(frozen=True)
class Config:
    """How long."""

    minutes: tuple[float, ...] = (2.0, 20.0, 60.0)


def recording(robot: Robot, minutes: float, path: pathlib.Path) -> None:
    """Write a recording: five waves a joint over most of its range, noise of 2 % of the torque."""
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
    tau += size * (0.15 * np.tanh(qd / 1e-3) + 0.1 * qd + 0.02 * rng.normal(size=tau.shape))
    q += 1e-6 * rng.normal(size=q.shape)
    columns = {f"{k}.{name}": x[:, j] for k, x in (("q", q), ("tau", tau)) for j, name in enumerate(robot.joint_names)}
    np.savez(path, allow_pickle=False, t=t, **columns)


def measured(path: pathlib.Path, folder: pathlib.Path) -> dict[str, float]:
    """Wall time [s] and largest resident set [GB] of a diagnosis."""
    command = [sys.executable, "-m", "irb140_jax", "diagnose", str(path), "--out", str(folder / path.stem)]
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{' '.join(command)} ended with status {status}")
    return {"seconds": time.perf_counter() - start, "gb": usage.ru_maxrss / 1e6}


def main(config: Config) -> None:
    """Measure each length and keep it."""
    stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for minutes in config.minutes:
            path = pathlib.Path(folder) / f"{minutes:g}_minutes.npz"
            recording(irb140(), minutes, path)
            stored[f"{minutes:g}"] = measured(path, pathlib.Path(folder)) | {"cores": os.cpu_count() or 1}
            made = {"rate": RATE, "joints": 6, "version": version("irb140_jax"), "jax": version("jax")}
            RESULTS.write_text(json.dumps(stored | {"made": made}, indent=1) + "\n", encoding="utf-8")
            print(minutes, stored[f"{minutes:g}"], flush=True)


if __name__ == "__main__":
    main(tyro.cli(Config))
