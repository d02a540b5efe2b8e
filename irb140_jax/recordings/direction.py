"""Which way a joint moves, as dry friction sees it: the sign of a speed that noise hides near rest.

Over a quick reversal it is the sign, rounded off no further than noise hides it: friction that is rounded further is a
law of its own.  Where a joint rests, a tanh of the speed stands for it.  Where it sticks its torque runs from one level
of friction to the other, while the encoder shows no speed at all.
"""

import numpy as np
from scipy import ndimage

REST = 0.1  # s that a joint must stay where it is to rest: a reversal takes less
STICK = 0.04  # s of a reversal without speed by which it sticks: one that does not is faster through


def direction_of(
    qd: np.ndarray, qdd: np.ndarray, noise: np.ndarray, rest_speed: np.ndarray, rate: float
) -> np.ndarray:
    """sign(qd) along an even grid, and what friction does where a joint is too slow to tell.

    A sample stands for the time half-way to its neighbours, so a reversal counts from when it happens between samples.
    Over a reversal in which the joint sticks it runs evenly from one sign to the other.  A joint that starts has run up
    to its sign for `REST`, for the motor must overcome friction before anything moves; one whose recording ends as it
    comes to rest is held until the end.  After longer rests torque has been seen to fall off, and by how much is not
    known: there a tanh of the speed stands for it.

    Args:
        qd, qdd: Speeds and accelerations, shape (T, n).
        noise: Speed beneath which noise hides the sign, shape (n,).
        rest_speed: Speed beneath which a joint may be at rest, shape (n,).
        rate: Samples per second.

    Returns:
        The direction, from -1 to 1, shape (T, n).
    """
    out, sharp = np.tanh(qd / rest_speed), _mean_tanh(qd / noise, np.abs(qdd) / (2.0 * rate * noise))
    signs = np.where(_slow(qd, qdd, rest_speed, rate), 0.0, np.sign(qd))
    for sign, through, direction in zip(signs.T, sharp.T, out.T, strict=True):
        if sign.any():
            _fill(sign, through, direction, int(REST * rate), int(STICK * rate))
    return out


def _slow(qd: np.ndarray, qdd: np.ndarray, rest_speed: np.ndarray, rate: float) -> np.ndarray:
    """Where a joint may be at rest, shape (T, n).

    Smoothing rings where a joint sticks or breaks free. A joint that goes through at the acceleration found beside it
    is slower than the limit here for half of `STICK` only.

    Args:
        qd, qdd: Speeds and accelerations, shape (T, n).
        rest_speed: Speed beneath which noise hides rest, shape (n,).
        rate: Samples per second.
    """
    around = ndimage.maximum_filter1d(np.abs(qdd), 2 * int(STICK * rate) + 1, axis=0)
    return np.abs(qd) < np.maximum(rest_speed, 0.25 * STICK * around)


def _mean_tanh(x: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Mean of tanh from x - reach to x + reach."""
    log_cosh = lambda y: np.abs(y) + np.log1p(np.exp(-2.0 * np.abs(y)))  # noqa: E731
    wide = np.maximum(reach, 1e-3)  # narrower, it is the tanh itself to seven digits
    return (log_cosh(x + wide) - log_cosh(x - wide)) / (2.0 * wide)


def _fill(sign: np.ndarray, sharp: np.ndarray, direction: np.ndarray, rest: int, stick: int) -> None:
    """Set the direction of one joint, in place, where its sign is known and where what surrounds it is."""
    known = np.flatnonzero(sign)
    direction[known] = sharp[known]
    first, last = known[0], known[-1]
    run_up = min(first, rest)
    direction[first - run_up : first] = sign[first] * np.arange(run_up) / max(run_up, 1)
    if len(sign) - last <= 2 * rest:
        direction[last:] = sign[last]
    for i in np.flatnonzero(np.diff(known) > 1):
        before, after = known[i], known[i + 1]
        # It still takes a quarter of `stick` to come to rest from the speed at which it counts as slow.
        held, free = before + stick // 4, after - stick // 4
        if after - before < stick:
            turns = sign[before] != sign[after]
            direction[before:after] = sharp[before:after] if turns else sign[before]
        elif sign[before] != sign[after] and free - held < rest:
            direction[before:held], direction[free:after] = sign[before], sign[after]
            direction[held:free] = np.linspace(sign[before], sign[after], free - held, endpoint=False)
