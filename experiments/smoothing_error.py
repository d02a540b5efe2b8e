"""What the smoother's care about chance is worth: error of the acceleration with it and without it.

    python experiments/smoothing_error.py                 # some five minutes; writes results/smoothing_error.md

Of arms that `trials.py` makes.  Without it, whatever stands out of the encoder's noise by half of it counts as motion.
"""

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import tyro
from trials import Kind, case_of

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.recordings import smooth
from irb140_jax.recordings.conceal import ConcealedCase
from irb140_jax.recordings.condition import choose_band, conditioned
from irb140_jax.recordings.low_pass import filtered, kernels
from irb140_jax.robot import Robot

CASES: dict[Kind, range] = {"single": range(1, 62, 6), "several": range(0, 20, 2), "rough": range(0, 20, 2)}
ENDS = 0.5  # s at either end that do not count: there the derivative is a matter of its own
WITHOUT = {"CERTAIN": 1.5, "CHANCE": 1.0}


@contextlib.contextmanager
def careless() -> Iterator[None]:
    """The smoother without its care about chance."""
    kept = {name: getattr(smooth, name) for name in WITHOUT}
    try:
        for name, value in WITHOUT.items():
            setattr(smooth, name, value)
        yield
    finally:
        for name, value in kept.items():
            setattr(smooth, name, value)


def errors(robot: Robot, case: ConcealedCase) -> np.ndarray:
    """RMS error of each joint's acceleration within the band, shape (recordings, n)."""
    recordings = [dataclasses.replace(r, qd=None, qdd=None) for r in case.recordings[:-1]]
    band = choose_band(recordings, robot)
    out = []
    for log, s in zip(case.secret.logs, conditioned(recordings, band), strict=False):
        true = filtered(log.qdd, kernels(band.torque, 1.0 / float(np.median(np.diff(log.t))))[0])
        true = np.stack([np.interp(s.t, log.t, x) for x in true.T], axis=1)
        off = filtered(s.qdd, kernels(band.torque, band.rate)[0]) - true
        inside = (s.t > s.t[0] + ENDS) & (s.t < s.t[-1] - ENDS)
        out.append(np.sqrt(np.mean(off[inside] ** 2, axis=0)))
    return np.array(out)


def counted(robot: Robot, case: ConcealedCase) -> tuple[int, int]:
    """Frequencies at which nothing counts as motion with care, and how many of them count without."""
    nothing = wrong = 0
    recordings = list(case.recordings[:-1])
    band = choose_band(recordings, robot)
    with asked() as spectra:
        conditioned(recordings, band)
    for x, density, rate in spectra:
        kept = smooth.signal_share(x, density, rate)[0]
        with careless():
            loose = smooth.signal_share(x, density, rate)[0]
        nothing += int(np.sum(kept == 0.0))
        wrong += int(np.sum((kept == 0.0) & (loose > 0.0)))
    return nothing, wrong


@contextlib.contextmanager
def asked() -> Iterator[list[tuple[np.ndarray, float, float]]]:
    """The positions that the smoother is asked about, on their grid, with the noise that it is told of."""
    kept, out = smooth.signal_share, []

    def noted(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, float, np.ndarray]:
        out.append((x, density, rate))
        return kept(x, density, rate)

    try:
        smooth.signal_share = noted
        yield out
    finally:
        smooth.signal_share = kept


def main(out: Path = Path("results/smoothing_error.md")) -> None:
    """Write the table."""
    set_up_compilation_cache()
    lines = [
        "| arms | recordings | joints | error of the acceleration with care, over that without: geometric mean "
        "| half at most | more than 2 % worse | frequencies without motion that count without care |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, seeds in CASES.items():
        ratio, recordings, nothing, wrong = [], 0, 0, 0
        for seed in seeds:
            arm, case, _, _ = case_of(kind, seed)
            with careless():
                loose = errors(arm.robot, case)
            ratio.append((errors(arm.robot, case) / loose).ravel())
            recordings += len(loose)
            none, counts = counted(arm.robot, case)
            nothing, wrong = nothing + none, wrong + counts
        x = np.concatenate(ratio)
        lines.append(
            f"| {kind} | {recordings} | {len(x)} | {np.exp(np.mean(np.log(x))):.2f} | {np.mean(x <= 0.5):.0%} "
            f"| {np.mean(x > 1.02):.0%} | {wrong / max(nothing, 1):.1%} |"
        )
        print(lines[-1], flush=True)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    tyro.cli(main)
