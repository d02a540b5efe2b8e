"""Where a joint turned round: all that hysteresis that doesn't depend on rate can remember of a path."""

import numpy as np

LEAST = 1e-4  # of the joint's range: a smaller swing there and back leaves nothing that is worth remembering


def turning_points(q: np.ndarray) -> np.ndarray:
    """Indices of the samples at which one joint turns round, swings below `LEAST` of its range left out.

    Args:
        q: Positions [rad or m], shape (T,).

    Returns:
        Shape (turning points,), in order.

    Source: A. Visintin, Differential Models of Hysteresis, 1994.
    """
    least, moved = LEAST * float(np.ptp(q)), np.diff(q)
    steps = np.flatnonzero(moved)
    corners = steps[1:][np.diff(np.sign(moved[steps])) != 0]  # the last sample before it moves the other way
    out: list[int] = []
    last, way = 0, 0  # the farthest sample on the way that the joint is on
    for i in (*corners.tolist(), len(q) - 1):
        if way == 0 or (q[i] - q[last]) * way >= 0.0:
            way = way or (int(np.sign(q[i] - q[last])) if abs(q[i] - q[last]) > least else 0)
            last = i if way else last
        elif abs(q[i] - q[last]) > least:
            out.append(last)
            last, way = i, -way
    return np.array(out, dtype=int)


def turned_before(q: np.ndarray, turns: list[np.ndarray], start: int, count: int) -> np.ndarray:
    """Positions at the last turning points of every joint before a sample [rad or m], shape (count, n).

    Where there are fewer, the first sample stands before them.

    Args:
        q: Positions, shape (T, n).
        turns: Turning points of every joint.
        start: The sample.
        count: How many.
    """
    out = np.empty((count, q.shape[1]))
    for j, mine in enumerate(turns):
        past = q[np.concatenate([[0], mine[mine < start]]), j][-count:]
        out[:, j] = np.concatenate([np.full(count - len(past), past[0]), past])
    return out
