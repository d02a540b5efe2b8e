"""A quick smooth look at a recording: enough to judge units, signs and names, not to fit anything."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import signal

from irb140_jax.recordings.recording import Recording

SAMPLES = 1024  # always as many, so that the dynamics compile once for recordings of any length
CUTOFF = 10.0  # Hz; arms move below it, and an encoder's steps do not survive it
ENDS = 0.3  # s left out at both ends, where the filter has one side only


class Glance(NamedTuple):
    """Motion and torque, low-passed alike, at `SAMPLES` instants spread evenly over the recording.

    Attributes:
        q, qd, qdd: Smoothed motion, derived from q alone, shape (SAMPLES, n).
        tau: Smoothed torque, shape (SAMPLES, n); NaN where none was logged.
        logged_qd: Smoothed logged velocity, shape (SAMPLES, n), or None.
        logged_qdd: Smoothed logged acceleration, shape (SAMPLES, n), or None.
        travel: What each joint moves between extremes, shape (n,).
        t: The instants [s], shape (SAMPLES,).
    """

    q: Float[np.ndarray, "S n"]
    qd: Float[np.ndarray, "S n"]
    qdd: Float[np.ndarray, "S n"]
    tau: Float[np.ndarray, "S n"]
    logged_qd: Float[np.ndarray, "S n"] | None
    logged_qdd: Float[np.ndarray, "S n"] | None
    travel: Float[np.ndarray, " n"]
    t: Float[np.ndarray, " S"]


def glance(recording: Recording) -> Glance:
    """Resample evenly, low-pass with zero phase, differentiate, thin out."""
    t, logged = recording.t, (recording.qd, recording.qdd)
    grid, picked = _instants(t)
    q, step = _smooth(t, recording.q, grid), grid[1] - grid[0]
    qd = np.gradient(q, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    tau = at_a_glance(t, recording.tau) if recording.has_torque else np.full((SAMPLES, q.shape[1]), np.nan)
    logged_qd, logged_qdd = (None if x is None else at_a_glance(t, x) for x in logged)
    return Glance(q[picked], qd[picked], qdd[picked], tau, logged_qd, logged_qdd, np.ptp(q, axis=0), grid[picked])


def at_a_glance(t: Float[np.ndarray, " T"], x: Float[np.ndarray, "T n"]) -> Float[np.ndarray, "S n"]:
    """Signals as `glance` smooths and thins those of a recording with times t [s]."""
    grid, picked = _instants(t)
    return _smooth(t, x, grid)[picked]


def _instants(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An even grid over a recording, and which of its instants are looked at, (SAMPLES,)."""
    step = float(np.median(np.diff(t)))
    # Evenly by the median step, yet never more than twice the samples there are: gaps may be long.
    grid = np.linspace(t[0], t[-1], min(round((t[-1] - t[0]) / step) + 1, 2 * len(t)))
    ends = min(round(ENDS / (grid[1] - grid[0])), len(grid) // 10)
    return grid, np.linspace(ends, len(grid) - 1 - ends, SAMPLES).round().astype(int)


def _smooth(t: np.ndarray, x: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Columns low-passed on an even grid."""
    step = grid[1] - grid[0]
    sos = signal.butter(2, min(CUTOFF, 0.2 / step) * 2 * step, output="sos")
    even = np.stack([np.interp(grid, t, own) for own in x.T], axis=1)
    return signal.sosfiltfilt(sos, even, axis=0, padlen=min(len(grid) - 1, round(ENDS / step)))
