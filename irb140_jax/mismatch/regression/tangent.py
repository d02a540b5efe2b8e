"""Where the regression is linearised: what was found of gravity and of the log multiplies all other unknowns.

Two products of unknowns are too large to be left to the next round.  Gravity that leans shows the centres of mass of
links behind a vertical axis, which upright gravity does not: without it, what a wrong centre of mass does there has to
be a spring.  And a lag or a delay of the log is one of every torque in it: a law that changes within milliseconds shows
mostly in its own rate.  Both are as in Gauss and Newton's method: columns are slopes at the last explanation, and what
the products count twice is taken off.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import numpy as np

from irb140_jax import dynamics
from irb140_jax.effects import At
from irb140_jax.mismatch.columns.along import Loads, Prepared, pieces
from irb140_jax.mismatch.columns.torques import Named, as_named
from irb140_jax.robot import Robot

AT_ONCE = 256  # columns whose rates are held at a time


class Point(NamedTuple):
    """What an explanation says of gravity, inertials and the log.

    Attributes:
        leaning: The nominal robot under the gravity found, or None where that is the model's own.
        dphi: Shift of the inertials, shape (10 n,).
        log: Laws of the log, in the order in which they act.
        rests_on: Effects that it is made of, (slug, joints): of an explanation without them its slopes say nothing.
    """

    leaning: Robot | None
    dphi: np.ndarray
    log: tuple[Named, ...]
    rests_on: frozenset[tuple[str, tuple[int, ...]]]

    @property
    def timing(self) -> tuple[Named, ...]:
        """Lags and delays."""
        return tuple(law for law in self.log if law.effect.place.at is At.LOG_TIMING)

    @property
    def plain(self) -> bool:
        """Whether the columns are what they are without it."""
        return self.leaning is None and not self.log


def point(robot: Robot, dphi: np.ndarray, named: Sequence[Named]) -> Point:
    """The point of an explanation.

    Args:
        robot: The nominal model.
        dphi: Shift of the inertials, shape (10 n,).
        named: The effects.
    """
    lean = [n for n in named if not np.array_equal(as_named(robot, [n]).gravity, robot.gravity)]
    leaning = eqx.tree_at(lambda r: r.gravity, robot, as_named(robot, lean).gravity) if lean else None
    scales, times = ([n for n in named if n.effect.place.at is at] for at in (At.LOG_SCALE, At.LOG_TIMING))
    log = (*scales, *times)
    return Point(leaning, dphi, log, frozenset((n.effect.slug, n.joints) for n in (*lean, *log)))


def regressor(at: Point, along: Prepared, samples: slice) -> np.ndarray:
    """Rigid-body regressor of some samples under the gravity found, shape (t, n, 10 n)."""
    if at.leaning is None:
        return along.regressor_at(samples)
    r = along.recording
    return np.asarray(dynamics.regressor_batch(at.leaning, r.q[samples], r.qd[samples], r.qdd[samples]))


def leaning(at: Point, along: Prepared) -> np.ndarray:
    """Torque of the shifted inertials by what gravity found differs from the model's, shape (T, n)."""
    if at.leaning is None:
        return np.zeros_like(along.nominal)
    parts = [(regressor(at, along, s) - along.regressor_at(s)) @ at.dphi for s in pieces(len(along.recording.t))]
    return np.concatenate(parts)


def logged(at: Point, x: np.ndarray, joints: np.ndarray, dt: float) -> np.ndarray:
    """What the log shows of torques, a copy where that is not the torques themselves.

    Args:
        at: The point.
        x: Torques, shape (T, any).
        joints: The joint of each, negative for what is in the log already, shape (any,).
        dt: Between samples [s].
    """
    for law in at.log:
        at_law = np.flatnonzero((joints >= 0) & (np.isin(joints, law.joints) | law.effect.place.everywhere))
        if not len(at_law):
            continue
        x = x.copy()
        for some in np.array_split(at_law, len(at_law) // AT_ONCE + 1):
            x[:, some] += _to_log(law, x[:, some], dt)
    return x


def counted_twice(at: Point, loads: Loads, dt: float) -> np.ndarray:
    """What laws of the log make of the explanation's torques: it is in their own columns and in all others', (T, n).

    Args:
        at: The point.
        loads: Of the explanation.
        dt: Between samples [s].
    """
    out, every = np.zeros_like(loads.total), np.arange(loads.total.shape[1])
    for law in at.log:
        on = every if law.effect.place.everywhere else np.array(law.joints)
        source = loads.scaled if law.effect.place.at is At.LOG_TIMING else loads.total
        out[:, on] += _to_log(law, source[:, on], dt)
    return out


def late(at: Point | None, x: np.ndarray, joints: np.ndarray, dt: float) -> np.ndarray:
    """Torques as late as the log has them, a copy where it has them late: what the log makes of them but for its scale.

    Args:
        at: The point; None where nothing was found yet.
        x: Torques, shape (T, any), in the scale of the log.
        joints: The joint of each, shape (any,).
        dt: Between samples [s].
    """
    return logged(at._replace(log=at.timing), x, joints, dt) if at else x


def delayed(at: Point | None, x: np.ndarray, dt: float) -> np.ndarray:
    """By how much logged torques change per second of delay more than was found, shape (T, n) [N m/s or N/s].

    Of a delay found it is the mean slope over that delay, its law's own column: a slope at its end beside it would let
    the two differ in what they take off fast torques.

    Args:
        at: The point; None where nothing was found yet.
        x: Torques, shape (T, n).
        dt: Between samples [s].
    """
    out = np.gradient(x, dt, axis=0)
    for law in at.timing if at else ():
        on = np.arange(x.shape[1]) if law.effect.place.everywhere else np.array(law.joints)
        out[:, on] = _to_log(dataclasses.replace(law, amplitudes=np.ones_like(law.amplitudes)), x[:, on], dt)
    return out


def _to_log(law: Named, x: np.ndarray, dt: float) -> np.ndarray:
    if law.effect.law.to_log is None:
        raise TypeError(f"{law.effect.slug} acts in the log, and its law has no `to_log`")
    return law.effect.law.to_log(x, dt, law.all_amplitudes(), law.shape)
