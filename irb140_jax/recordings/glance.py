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
    t = recording.t
    step = float(np.median(np.diff(t)))
    # Evenly by the median step, yet never more than twice the samples there are: gaps may be long.
    grid = np.linspace(t[0], t[-1], min(round((t[-1] - t[0]) / step) + 1, 2 * len(t)))
    step = grid[1] - grid[0]
    sos = signal.butter(2, min(CUTOFF, 0.2 / step) * 2 * step, output="sos")

    ends = min(round(ENDS / step), len(grid) // 10)
    picked = np.linspace(ends, len(grid) - 1 - ends, SAMPLES).round().astype(int)

    def smooth(x: np.ndarray) -> np.ndarray:
        return signal.sosfiltfilt(sos, np.interp(grid, t, x), padlen=min(len(grid) - 1, round(ENDS / step)))

    def seen(x: np.ndarray | None) -> np.ndarray | None:
        return None if x is None else np.stack([smooth(own)[picked] for own in x.T], axis=1)

    (q, qd, qdd), travel = np.empty((3, SAMPLES, recording.q.shape[1])), np.empty(recording.q.shape[1])
    for j, own in enumerate(recording.q.T):
        position = smooth(own)
        speed = np.gradient(position, step)
        q[:, j], qd[:, j], qdd[:, j] = (x[picked] for x in (position, speed, np.gradient(speed, step)))
        travel[j] = np.ptp(position)
    tau = seen(recording.tau if recording.has_torque else None)
    tau = np.full_like(q, np.nan) if tau is None else tau
    return Glance(q, qd, qdd, tau, seen(recording.qd), seen(recording.qdd), travel, grid[picked])
