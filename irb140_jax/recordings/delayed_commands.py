"""Commands of position servos as late as their drives take them up."""

from collections.abc import Callable

import numpy as np
from scipy import interpolate

from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.recording import Recording


def delayed_commands(recording: Recording, drive: Drive) -> Callable[[float], np.ndarray]:
    """Commanded positions at the rows, cut to their range, by how much later they are taken up than is stated [s].

    Between rows by a cubic that never overshoots: a straight line between two cuts off what commands accelerate by.

    Returns:
        A function of that delay: positions [rad or m], shape (T, n).
    """
    t, wanted = recording.t, np.clip(np.asarray(recording.qdes), drive.low, drive.high)
    between = [interpolate.PchipInterpolator(t, x) for x in wanted.T]

    def at(delay: float) -> np.ndarray:
        times = (np.clip(t - own - delay, t[0], t[-1]) for own in drive.delay)
        return np.stack([f(x) for f, x in zip(between, times, strict=True)], axis=1)

    return at


def taken_up(recording: Recording, drive: Drive) -> np.ndarray:
    """Commanded positions at the rows, as late as they are stated to be [rad or m], shape (T, n)."""
    if not drive.delay.any():
        return np.clip(np.asarray(recording.qdes), drive.low, drive.high)
    return delayed_commands(recording, drive)(0.0)
