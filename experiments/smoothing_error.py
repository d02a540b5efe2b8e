"""What smoothing the joints together is worth: error of the model's torque with it, over that one joint at a time.

    python experiments/smoothing_error.py                 # two minutes; writes results/smoothing_error.md

Of arms that `trials.py` makes.  The error is that of the nominal model's torque along smoothed positions, against the
same model along the true motion, in the band of the comparison.
"""

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import tyro
from trials import Kind, case_of

from irb140_jax import dynamics
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.recordings import smooth
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.conceal import ConcealedCase
from irb140_jax.recordings.condition import conditioned
from irb140_jax.recordings.low_pass import filtered, kernels
from irb140_jax.robot import Robot

CASES: dict[Kind, range] = {"single": range(1, 62, 6), "several": range(0, 20, 2), "rough": range(0, 20, 2)}
ENDS = 0.5  # s at either end that do not count: there the derivative is a matter of its own


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """The smoother that sees one joint at a time."""
    together = smooth.signal_weights

    def one_by_one(q: np.ndarray, density: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        parts = [together(q[:, [j]], density[[j]], rate) for j in range(q.shape[1])]
        weights = np.stack([w[:, 0, 0] for w, _, _ in parts], axis=1)
        return weights[:, :, None] * np.eye(q.shape[1]), np.concatenate([f for _, f, _ in parts]), parts[0][2]

    try:
        smooth.signal_weights = one_by_one
        yield
    finally:
        smooth.signal_weights = together


def errors(robot: Robot, case: ConcealedCase) -> np.ndarray:
    """RMS error of each joint's torque within the band, shape (recordings, n)."""
    recordings = [dataclasses.replace(r, qd=None, qdd=None) for r in case.recordings[:-1]]
    band = choose_band(recordings, robot)
    torque = lambda r: np.asarray(dynamics.inverse_dynamics_batch(robot, r.q, r.qd, r.qdd))  # noqa: E731
    out = []
    for log, s in zip(case.secret.logs, conditioned(recordings, band), strict=False):
        true = filtered(torque(log), kernels(band.torque, 1.0 / float(np.median(np.diff(log.t))))[0])
        true = np.stack([np.interp(s.t, log.t, x) for x in true.T], axis=1)
        off = filtered(torque(s), kernels(band.torque, band.rate)[0]) - true
        inside = (s.t > s.t[0] + ENDS) & (s.t < s.t[-1] - ENDS)
        out.append(np.sqrt(np.mean(off[inside] ** 2, axis=0)))
    return np.array(out)


def main(out: Path = Path("results/smoothing_error.md")) -> None:
    """Write the table."""
    set_up_compilation_cache()
    lines = [
        "| arms | joints | error together over error alone, all recordings of a joint: geometric mean | half at most "
        "| more than 5 % worse | recordings one by one: geometric mean | more than 20 % worse | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind, seeds in CASES.items():
        pooled, single = [], []
        for seed in seeds:
            arm, case, _, _ = case_of(kind, seed)
            if arm.robot.n == 1:  # together and alone are the same
                continue
            with alone():
                one = errors(arm.robot, case)
            both = errors(arm.robot, case)
            pooled.append(np.sqrt(np.mean(both**2, axis=0) / np.mean(one**2, axis=0)))
            single.append((both / one).ravel())
        x, y = np.concatenate(pooled), np.concatenate(single)
        mean = lambda r: f"{np.exp(np.mean(np.log(r))):.2f}"  # noqa: E731
        lines.append(
            f"| {kind} | {len(x)} | {mean(x)} | {np.mean(x <= 0.5):.0%} | {np.mean(x > 1.05):.0%} "
            f"| {mean(y)} | {np.mean(y > 1.2):.0%} | {y.max():.1f} |"
        )
        print(lines[-1], flush=True)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    tyro.cli(main)
