"""Gains and delay of a servo by the nominal model: where none are stated, these are all that there is to go by.

    Kp (qdes(t - delay) - q) = m + Fc sign(qd) + (Kd + Fv) qd + J qdd + c

m is the torque of the nominal model; none of Kp, Fc, Kd + Fv and J is negative.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.glance import glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torques import nominal_torques
from irb140_jax.robot import Robot

MOVING = 0.03  # of a joint's top speed: slower rows say nothing of the direction of friction
FAR_FROM_LIMIT = 0.9  # of the torque limit, from which smoothed rows hold some that the limit cut
PIECES = 8  # of all recordings, one of which at a time is left out to know how sure an estimate is
LONGEST, COARSE, FINE = 0.12, 5e-3, 2.5e-4  # s: delays that are tried, first in coarse steps, then in fine ones
CLEAR = 3.0  # standard deviations from which a delay is one, ...
WORTH = 0.05  # ... and share of the error that it takes off


class Estimate(NamedTuple):
    """Gains of one joint: Kp, its relative standard deviation without the inertials', Kd with viscous friction.

    Kp is NaN where it was stated, or where the model's torque does not show.
    """

    kp: float
    spread: float
    kd: float


class Rows(NamedTuple):
    """Rows of one joint over all recordings.

    Attributes:
        model: Torque of the nominal model, shape (R,).
        other: Speed, its sign, acceleration, and a constant of either sign, shape (R, 5).
        error: Position error for each delay that is tried, beyond what is stated, shape (delays, R).
        kp: Stated gain, NaN where none is, shape (R,).
    """

    model: np.ndarray
    other: np.ndarray
    error: np.ndarray
    kp: np.ndarray


def rows_of_joints(
    servos: Sequence[Recording], drives: Sequence[Drive], robot: Robot, delays: Sequence[float] = (0.0,)
) -> list[Rows]:
    """Rows in which each joint moves, smoothed alike, with errors at some delays [s]."""
    parts: list[list[Rows]] = [[] for _ in range(robot.n)]
    for r, d in zip(servos, drives, strict=True):
        seen = glance(r)
        total = nominal_torques(robot, seen.q, seen.qd, seen.qdd).total
        late = [glance(dataclasses.replace(r, tau=_later(r, d, x))).tau - seen.q for x in delays]
        for j in range(robot.n):
            qd = seen.qd[:, j]
            asked = np.nan_to_num(d.kp[j]) * np.abs(late[0][:, j])
            use = (np.abs(qd) > MOVING * np.abs(qd).max()) & (asked < FAR_FROM_LIMIT * d.limit[j])
            slow, one = 0.02 * np.abs(qd).max() + 1e-12, np.ones_like(qd)
            other = np.stack([qd, np.tanh(qd / slow), seen.qdd[:, j], one, -one], axis=1)
            error = np.stack([x[use, j] for x in late])
            parts[j].append(Rows(total[use, j], other[use], error, np.full(int(use.sum()), d.kp[j])))
    return [_joined(joint) for joint in parts]


def _joined(parts: Sequence[Rows]) -> Rows:
    """Rows of one joint, those of each recording behind those of the one before."""
    return Rows(
        model=np.concatenate([part.model for part in parts]),
        other=np.concatenate([part.other for part in parts]),
        error=np.concatenate([part.error for part in parts], axis=1),
        kp=np.concatenate([part.kp for part in parts]),
    )


def _later(r: Recording, d: Drive, delay: float) -> np.ndarray:
    wanted = np.clip(np.asarray(r.qdes), d.low, d.high)
    return np.stack([np.interp(r.t - delay - x, r.t, w) for x, w in zip(d.delay, wanted.T, strict=True)], axis=1)


def estimated_delay(servos: Sequence[Recording], drives: Sequence[Drive], robot: Robot) -> tuple[float, float]:
    """Delay of all commands alike beyond what is stated, and its standard deviation [s]; 0 where there is none.

    What is left of each joint counts by the least that is left of it, so that strong joints don't decide alone.
    """
    coarse = np.arange(0.0, LONGEST, COARSE)
    first, *_ = _best(rows_of_joints(servos, drives, robot, coarse.tolist()), coarse)
    fine = np.concatenate([[0.0], np.arange(max(first[0] - COARSE, FINE), first[0] + COARSE, FINE)])
    best, gain = _best(rows_of_joints(servos, drives, robot, fine.tolist()), fine)
    spread = float(np.hypot(np.sqrt((PIECES - 1) / PIECES * np.sum((best[1:] - best[1:].mean()) ** 2)), FINE))
    clear = best[0] > CLEAR * spread and gain > WORTH
    return (float(best[0]), spread) if clear else (0.0, 0.0)


def _best(rows: Sequence[Rows], delays: np.ndarray) -> tuple[np.ndarray, float]:
    """The best of these delays with all rows and without each piece, and the share of the error that it takes off."""
    left = np.array([[[_left(r, k, piece) for k in range(len(delays))] for r in rows]
                     for piece in (None, *range(PIECES))])  # fmt: skip
    best = np.argmin(np.sum(left / left.min(axis=2, keepdims=True), axis=1), axis=1)
    return delays[best], 1.0 - float(np.exp(0.5 * np.mean(np.log(left[0, :, best[0]] / left[0, :, 0]))))


def _left(rows: Rows, delay: int, piece: int | None) -> float:
    """Share of the power that a fit at one of the delays leaves, without one piece of the rows."""
    keep = _kept(len(rows.model), piece)
    X, y = _system(rows, delay)
    w = _fitted(X[keep], y[keep])
    return float(np.mean((y[keep] - X[keep] @ w) ** 2) / np.mean(y[keep] ** 2)) + 1e-9


def estimated_gains(rows: Rows) -> Estimate:
    """Gains of one joint at the first of the delays."""
    X, y = _system(rows, 0)
    whole, *without = [_fitted(X[keep], y[keep]) for keep in (_kept(len(y), p) for p in (None, *range(PIECES)))]
    if np.isfinite(rows.kp).all():
        return Estimate(np.nan, np.inf, float(whole[0]))
    if np.isfinite(rows.kp).any() or whole[-1] <= 0.0:
        return Estimate(np.nan, np.inf, 0.0)
    share = np.array([w[-1] for w in without]) / whole[-1]
    jackknife = float(np.sqrt((PIECES - 1) / PIECES * np.sum((share - share.mean()) ** 2)))
    return Estimate(float(1.0 / whole[-1]), jackknife, float(whole[0] / whole[-1]))


def _system(rows: Rows, delay: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns and target: Kp e - m where Kp is stated, else e with the model's torque as a further column."""
    if np.isfinite(rows.kp).all():
        return rows.other, rows.kp * rows.error[delay] - rows.model
    return np.column_stack([rows.other, rows.model]), rows.error[delay]


def _kept(count: int, piece: int | None) -> np.ndarray:
    """Rows but one of the pieces, shape (count,)."""
    return np.ones(count, dtype=bool) if piece is None else np.arange(count) * PIECES // max(count, 1) != piece


def _fitted(X: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Least squares without negative coefficients, columns of any size, shape (columns,)."""
    size = np.maximum(np.sqrt(np.mean(X**2, axis=0)), 1e-300)
    Q, R = np.linalg.qr(X / size)
    return nnls(R, Q.T @ y)[0] / size
