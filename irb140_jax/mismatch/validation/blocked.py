"""Joints that stand still at an end of their range under far more torque than moves them: against a stop, say.

All else in a diagnosis leaves out rows in which a joint rests, because dry friction is undetermined there.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.glance import SAMPLES
from irb140_jax.recordings.torques import nominal_torques
from irb140_jax.robot import Robot


class Blocked(NamedTuple):
    """A joint that something stops.

    Attributes:
        joint: Index.
        position: Where it stands [rad or m].
        times: When it is there: index of the recording, begin and end in the time of its log [s].
        torque: The most that it takes there beyond what the nominal model needs [N m or N].
        usual: Torque that moves it, root mean square [N m or N].
    """

    joint: int
    position: float
    times: tuple[tuple[int, float, float], ...]
    torque: float
    usual: float


def blocked(robot: Robot, recordings: Sequence[Conditioned]) -> list[Blocked]:
    """Joints that something stops at the lower or upper end of what they travel in the recordings.

    Args:
        robot: The nominal model, n joints.
        recordings: Conditioned, T samples each.
    """
    out = []
    for j in range(robot.n):
        moving = np.concatenate([r.tau[r.usable[:, j], j] for r in recordings])
        if not len(moving):
            continue
        much = settings.ABOVE_NOISE * float(np.sqrt(np.mean(moving**2)))
        travelled = np.concatenate([r.q[r.recorded[:, j], j] for r in recordings])
        low, high = float(travelled.min()), float(travelled.max())
        gives = settings.STOP_GIVES * (high - low)
        for end, way in ((low, -1.0), (high, 1.0)):
            times, held, beside = [], [], []
            for i, r in enumerate(recordings):
                off = np.abs(r.q[:, j] - end)
                there = off < gives
                stands = there & r.recorded[:, j] & ~r.usable[:, j] & (way * r.tau[:, j] > much)
                beside.append(_at(r, np.flatnonzero(~there & (off < 2.0 * gives) & r.recorded[:, j])))
                for first, last in _runs(there):
                    rows = first + np.flatnonzero(stands[first:last])
                    if len(rows) * (r.t[1] - r.t[0]) > settings.EVENT_MARGIN:
                        times.append((i, float(r.t[first]), float(r.t[last - 1])))
                        held.append(_at(r, rows))
            if not times:
                continue
            beyond, before = (way * _beyond(robot, rows, j) for rows in (held, beside))
            # A spring, or a model that is wrong there, pushes back nearly as much just before the end.
            if np.median(beyond) > max(much, 2.0 * np.median(before)):
                out.append(Blocked(j, end, tuple(times), float(beyond.max()), much / settings.ABOVE_NOISE))
    return out


def _at(r: Conditioned, rows: np.ndarray) -> np.ndarray:
    """Motion and torque in some rows, shape (4, rows, n)."""
    return np.stack([x[rows] for x in (r.q, r.qd, r.qdd, r.tau)])


def _beyond(robot: Robot, parts: Sequence[np.ndarray], j: int) -> np.ndarray:
    """Torque of one joint beyond what the nominal model needs, at `SAMPLES` of the rows, 0 without rows [N m or N]."""
    rows = np.concatenate(parts, axis=1)
    if rows.shape[1] == 0:
        return np.zeros(1)
    q, qd, qdd, tau = rows[:, np.linspace(0, rows.shape[1] - 1, SAMPLES).astype(int)]
    return (tau - nominal_torques(robot, q, qd, qdd).total)[:, j]


def _runs(there: np.ndarray) -> np.ndarray:
    """First row and the row after the last of every run of rows, shape (runs, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]))).reshape(-1, 2)
