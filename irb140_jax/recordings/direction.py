"""Which way a joint moves, as dry friction sees it: the sign of a speed that noise hides near rest.

A tanh of the speed rounds the sign off where noise hides it.  Where a joint sticks that is not all that is known: its
torque runs from one level of friction to the other, while the encoder shows no speed at all.
"""

import numpy as np

REST = 0.1  # s that a joint must stay where it is to rest: a reversal takes less
STICK = 0.04  # s of a reversal without speed by which it sticks: one that does not is faster through


def direction_of(qd: np.ndarray, rest_speed: np.ndarray, rate: float) -> np.ndarray:
    """sign(qd) along an even grid, and what friction does where a joint is too slow to tell.

    Over a reversal in which the joint sticks it runs evenly from one sign to the other.  A joint that starts has run up
    to its sign for `REST`, for the motor must overcome friction before anything moves; one whose recording ends as it
    comes to rest is held until the end.  After longer rests torque has been seen to fall off, and by how much is not
    known: there a tanh of the speed stands for it.

    Args:
        qd: Speeds, shape (T, n).
        rest_speed: Speed that noise can't tell from rest, shape (n,).
        rate: Samples per second.

    Returns:
        The direction, from -1 to 1, shape (T, n).
    """
    out = np.tanh(qd / rest_speed)
    for sign, direction in zip(np.where(np.abs(qd) >= rest_speed, np.sign(qd), 0.0).T, out.T, strict=True):
        if sign.any():
            _fill_rests(sign, direction, int(REST * rate), int(STICK * rate))
    return out


def _fill_rests(sign: np.ndarray, direction: np.ndarray, rest: int, stick: int) -> None:
    """Set the direction of one joint, in place, where its sign is not known (0) but what surrounds it is."""
    known = np.flatnonzero(sign)
    first, last = known[0], known[-1]
    run_up = min(first, rest)
    direction[first - run_up : first] = sign[first] * np.arange(run_up) / max(run_up, 1)
    if len(sign) - last <= 2 * rest:
        direction[last:] = sign[last]
    for i in np.flatnonzero(np.diff(known) > 1):
        before, after = known[i], known[i + 1]
        if sign[before] != sign[after] and stick <= after - before < rest:
            direction[before:after] = np.linspace(sign[before], sign[after], after - before, endpoint=False)
