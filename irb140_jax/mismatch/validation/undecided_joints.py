"""Joints whose motion is too short, or whose remaining error is too large, to tell whether anything is left out."""

from collections.abc import Collection, Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.records import digits
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot


def torque_size(proof: HeldOut, torque: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviation of each joint's low-passed torque over the rows that count, shape (n,)."""
    out = np.zeros(len(proof.carried))
    for j in range(len(out)):
        values = np.concatenate([x[u[:, j], j] for x, u in zip(torque, proof.use, strict=True)])
        out[j] = np.std(values) if len(values) else 0.0
    return out


def made_worse(proof: HeldOut, torque: Sequence[np.ndarray], scatter: np.ndarray, measured: bool) -> np.ndarray:
    """Joints whose error on unseen data an explanation makes larger, shape (n,).

    Larger by more than the sensors leave: what no other recording can tell of is in both errors.  Evidence is then
    between laws that are all wrong.  Torque that is made of commands is itself wrong where the drive is: there the
    error must also be more than half of it.
    """
    left, above = proof.rmse(proof.corrected), settings.ABOVE_NOISE * scatter
    large = left > (above if measured else np.maximum(settings.LARGE_ERROR * torque_size(proof, torque), above))
    return proof.judged & large & (left > np.hypot(without_effects(proof), above))


def without_effects(proof: HeldOut) -> np.ndarray:
    """Error on unseen data of the model as given or refitted, whichever is better at each joint, shape (n,).

    Where columns mean something else, a refit errs more than the model as given.
    """
    return np.minimum(proof.rmse(proof.nominal), proof.rmse(proof.refit))


def undecidable(
    robot: Robot, proof: HeldOut, torque: Sequence[np.ndarray], scatter: np.ndarray, band: Band,
    located: Collection[int] = (),
) -> dict[int, str]:  # fmt: skip
    """Joints of which these recordings can't tell whether anything is left out, each with a sentence why.

    Args:
        robot: The nominal model.
        proof: Errors on unseen data.
        torque: Logged torque, low-passed, one array (R, n) per recording.
        scatter: What the sensors leave, shape (n,).
        band: Of the comparison.
        located: Joints of which it is said what the remaining error depends on.
    """
    size, left = torque_size(proof, torque), proof.rmse(proof.corrected)
    seconds = np.sum([u.sum(axis=0) for u in proof.use], axis=0) * band.step / band.rate
    out = {}
    for j in np.flatnonzero(proof.judged):
        name, unit = robot.joint_names[j], robot.torque_units[j]
        times = f"{digits(left[j] / max(scatter[j], 1e-300))} times the noise of the sensors"
        share = f"{100 * left[j] / max(size[j], 1e-300):.0f} % of its torque"
        error = f"the remaining error of {name}, {left[j]:.3g} {unit}, is"
        depends = "`unexplained` says what it depends on; " if j in located else ""
        if seconds[j] < settings.FEWEST_SECONDS:
            out[int(j)] = (
                f"{name} moves for only {seconds[j]:.2g} s: record at least {settings.FEWEST_SECONDS:g} s in which it "
                "moves, better 20 s with a dozen reversals"
            )
        elif left[j] > settings.LARGE_ERROR * size[j]:
            remedy = "check its columns and units, and record faster or longer motion"
            out[int(j)] = f"{error} {share} and may hide anything: {depends}{remedy}"
        elif left[j] > max(settings.NOT_SMALL * size[j], settings.ABOVE_NOISE * scatter[j]):
            out[int(j)] = f"{error} {times} and {share}: {depends}check its columns, and record longer motion"
    return out
