"""Where a law of servos is silent: what the servo asks for may be anything there, and so may what is logged.

Elsewhere the torque given follows from the torque asked for, and a law with a motor at rest, or at its limit, in most
rows explains those by their own log.  The density of what is logged, given the motion, is what tells: a row in a dead
band is spread over all of the band, where any other row is within the noise.

    log p(asked | motion) = log p(given | motion) - log(range / (sqrt(2 pi) noise)) in each independent silent row
"""

from collections.abc import Sequence

import numpy as np

from irb140_jax.effects import Asked
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.gram import JointGram
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.recordings.condition import Conditioned


def silent_rows(
    candidates: Sequence[Candidate], recordings: Sequence[Conditioned], joints: Sequence[JointGram], noise: Noise
) -> np.ndarray:
    """Independent rows in which each candidate is silent, and log(range / (sqrt(2 pi) noise)) of them at level 1.

    Args:
        candidates: All of a search.
        recordings: Conditioned.
        joints: Gram matrices of every joint, for their independent rows.
        noise: Of the rows.

    Returns:
        Shape (2, candidates); zero but for laws of servos.
    """
    out, level = np.zeros((2, len(candidates))), np.sqrt(2.0 * np.pi * np.mean(noise.total**2, axis=0))
    for i, c in enumerate(candidates):
        if c.effect.law.silent is None:
            continue
        j, rows, span = c.joints[0], [], 0.0
        for r in recordings:
            assert r.servo is not None, f"{c.slug} in a log of torque"
            column = lambda x: x[r.usable[:, j], j : j + 1]  # noqa: B023, E731
            asked = Asked(column(r.tau), column(r.servo.command - r.q), np.nan_to_num(r.servo.drive.kp)[[j]])  # pyright: ignore[reportArgumentType]: NumPy
            silent, torque = c.effect.law.silent(asked, column(r.qd), c.shape)
            rows.append(silent.ravel())
            span = max(span, torque)
        share = float(np.mean(np.concatenate(rows))) if any(map(len, rows)) else 0.0
        out[:, i] = share * joints[j].rows.sum(), np.log(max(span, 1e-300) / max(level[j], 1e-300))
    return out
