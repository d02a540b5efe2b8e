"""Gains and delay of a servo by the nominal model: where none are stated, these are all that there is to go by.

    Kp (qdes(t - delay) - q) = m + Fc sign(qd) + (Kd + Fv) qd + J qdd + c

m is the torque of the nominal model; none of Kp, Fc, Kd + Fv and J is negative.  The delay is found first, with what is
known of Kd and of friction beforehand, and from that part of the motion which goes with the command.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg, special
from scipy.optimize import nnls

from irb140_jax.recordings.delayed_commands import delayed_commands
from irb140_jax.recordings.drive import GAIN_WIDTH, Drive
from irb140_jax.recordings.glance import at_a_glance, glance
from irb140_jax.recordings.payload import carrying
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torques import nominal_torques
from irb140_jax.robot import Robot

MOVING = 0.03  # of a joint's top speed: slower rows say nothing of the direction of friction
FAR_FROM_LIMIT = 0.9  # of the torque limit, from which smoothed rows hold some that the limit cut
PIECES = 8  # of all recordings, one of which at a time is left out to know how sure an estimate is
LONGEST, COARSE, FINE = 0.12, 5e-3, 5e-4  # s: delays that are tried, first in coarse steps, then in fine ones
BEFORE = np.arange(-0.02, 0.2, 0.01)  # s before a row at which commands are looked at
CLEAR = 3.0  # standard deviations from which a delay is one
# Shares of a joint's torque: standard deviations of what dry and viscous friction, a rotor and an offset that the model
# lacks take, and what is left beside them.  On light legs a rotor is nearly all that a motor moves.
LACKING, LEFT = (0.3, 0.3, 1.0, 0.3), 0.03
KD_UNSTATED_WIDTH = 0.5  # relative standard deviation of an estimated Kd, which holds the joint's own viscous friction
DISTINCT = 1e-8  # least singular value of instruments, of the largest
NONNEGATIVE = 3  # how many of them can't be negative
SETTLED = 5  # rounds in which noise and fit agree


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
        command: What the joint was told at each of `BEFORE`, smoothed alike, shape (times, R).
        kp, kd: Stated gains, NaN where none are, shape (R,).
    """

    model: np.ndarray
    other: np.ndarray
    error: np.ndarray
    command: np.ndarray
    kp: np.ndarray
    kd: np.ndarray


def rows_of_joints(
    servos: Sequence[Recording], drives: Sequence[Drive], robot: Robot, delays: Sequence[float] = (0.0,)
) -> list[Rows]:
    """Rows in which each joint moves, smoothed alike, with errors at some delays [s]."""
    parts: list[list[Rows]] = [[] for _ in range(robot.n)]
    for r, d in zip(servos, drives, strict=True):
        seen = glance(r)
        total = nominal_torques(carrying(robot, r.payload), seen.q, seen.qd, seen.qdd).total
        at = delayed_commands(r, d)
        smooth = lambda x, r=r, at=at: at_a_glance(r.t, at(x))  # noqa: E731
        late, told = [smooth(x) - seen.q for x in delays], [smooth(x) for x in BEFORE]
        for j in range(robot.n):
            qd = seen.qd[:, j]
            asked = np.nan_to_num(d.kp[j]) * np.abs(late[0][:, j])
            use = (np.abs(qd) > MOVING * np.abs(qd).max()) & (asked < FAR_FROM_LIMIT * d.limit[j])
            slow, one = 0.02 * np.abs(qd).max() + 1e-12, np.ones_like(qd)
            other = np.stack([qd, np.tanh(qd / slow), seen.qdd[:, j], one, -one], axis=1)
            error = np.stack([x[use, j] for x in late])
            gains = np.full((2, int(use.sum())), [[d.kp[j]], [d.kd[j]]])
            before = np.stack([x[use, j] for x in told])
            parts[j].append(Rows(total[use, j], other[use], error, before, *gains))
    return [_joined(joint) for joint in parts]


def _joined(parts: Sequence[Rows]) -> Rows:
    """Rows of one joint, those of each recording behind those of the one before."""
    return Rows(
        model=np.concatenate([part.model for part in parts]),
        other=np.concatenate([part.other for part in parts]),
        error=np.concatenate([part.error for part in parts], axis=1),
        command=np.concatenate([part.command for part in parts], axis=1),
        kp=np.concatenate([part.kp for part in parts]),
        kd=np.concatenate([part.kd for part in parts]),
    )


def estimated_delay(
    servos: Sequence[Recording], drives: Sequence[Drive], robot: Robot, uncertainty: float
) -> tuple[float, float]:
    """Delay of all commands alike beyond what is stated [s], 0 where none is clear: where the search begins.

    On slow motion a late command looks like viscous friction, Kp times the delay of it at every joint.  So what is
    known beforehand decides: how well Kd is known, how large friction usually is, and that the delay is one.

    Args:
        servos: Logs of commands.
        drives: What is stated of the servos, one a log.
        robot: The nominal model.
        uncertainty: Relative standard deviation of its inertials.

    Returns:
        The delay, and the standard deviation that it has because joints disagree on it by more than each leaves open.
    """
    def log_evidence(delays: np.ndarray) -> np.ndarray:
        rows = rows_of_joints(servos, drives, robot, delays.tolist())
        return np.stack([_log_evidence(r, uncertainty) for r in rows])

    coarse = np.arange(0.0, LONGEST, COARSE)
    of_joints = log_evidence(coarse)
    if apart := _of_joints_apart(coarse, of_joints):
        return apart
    first = coarse[np.argmax(of_joints.sum(axis=0))]
    fine = np.arange(max(first - COARSE, 0.0), first + COARSE + 0.5 * FINE, FINE)
    odds = log_evidence(fine).sum(axis=0)
    best, weight = fine[np.argmax(odds)], np.exp(odds - odds.max())
    spread = float(max(np.sqrt(weight @ (fine - best) ** 2 / weight.sum()), FINE))
    return float(best) if best > CLEAR * spread else 0.0, 0.0


def _of_joints_apart(delays: np.ndarray, log_evidence: np.ndarray) -> tuple[float, float] | None:
    """Mean delay of joints that clearly disagree, and how much less sure it is than if they did not [s].

    Args:
        delays: Evenly spaced [s], shape (delays,).
        log_evidence: Of each joint, shape (n, delays).

    Returns:
        The mean, and the standard deviation that it has because they disagree [s]; None where they agree.

    Source: DerSimonian and Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986).
    """
    weight = special.softmax(log_evidence[np.ptp(log_evidence, axis=1) > 0.0], axis=1)
    others = len(weight) - 1
    if others < 1:
        return None
    own = weight @ delays
    # No joint's delay is known better than to the space between those that are tried.
    variance = np.sum(weight * (delays - own[:, None]) ** 2, axis=1) + (delays[1] - delays[0]) ** 2 / 12.0
    sure = 1.0 / variance
    pooled = sure @ own / sure.sum()
    excess = sure @ (own - pooled) ** 2 - others  # joints that agree have none, give or take the root of 2 `others`
    if excess < CLEAR * np.sqrt(2.0 * others):
        return None
    less_sure = 1.0 / (variance + excess / (sure.sum() - sure @ sure / sure.sum()))
    more = 1.0 / less_sure.sum() - 1.0 / sure.sum()
    return float(less_sure @ own / less_sure.sum()), float(np.sqrt(more))


def _log_evidence(rows: Rows, uncertainty: float) -> np.ndarray:
    """Log evidence of one joint's rows at every delay by Laplace's approximation, shape (delays,).

    Friction and a rotor are none below zero: without that, a delay has no lower side.  What is left is a function of
    the joint's state, so it is as often independent as the joint turns round.
    """
    kp, kd, kp_width, kd_width = rows.kp, rows.kd, GAIN_WIDTH, GAIN_WIDTH * np.nan_to_num(rows.kd)
    vague = bool(np.isnan(kd).any())  # then what goes with speed is no measure of the joint's torque
    if np.isnan(kp).any() or np.isnan(kd).any():
        found = estimated_gains(rows)
        # With the joint's viscous friction, and with what a late command adds.
        kd_width = np.where(np.isnan(kd), KD_UNSTATED_WIDTH * found.kd, kd_width)
        kd = np.where(np.isnan(kd), found.kd, kd)
        kp, kp_width = np.where(np.isnan(kp), found.kp, kp), found.spread if np.isnan(kp).any() else kp_width
    if not np.isfinite(kp).all() or not len(kp):
        return np.zeros(len(rows.error))
    qd, turned, qdd, one, _ = rows.other.T
    size = lambda x: float(np.sqrt(np.mean(x**2))) + 1e-300  # noqa: E731
    lacking = np.stack([share * x / size(x) for share, x in zip(LACKING, (turned, qd, qdd, one), strict=True)], axis=1)
    known = np.stack([np.hypot(uncertainty, kp_width) * rows.model, kd_width * qd], axis=1)
    turns = 1.0 + np.count_nonzero(np.diff(np.sign(qd)))
    asked = _instruments(rows)
    out = []
    for error in rows.error:
        given = kp * error - kd * qd
        torque, y = size(given - vague * qd * (qd @ given) / (qd @ qd + 1e-300)), given - rows.model
        X = asked.T @ np.column_stack([torque * lacking, known, y]) * np.sqrt(turns / len(y))
        R = np.asarray(np.linalg.qr(X, mode="r"))
        A, z, least = R[:, :-1], R[:, -1], (LEFT * torque) ** 2
        signed = np.concatenate([A, -A[:, NONNEGATIVE:]], axis=1)  # friction and rotors are none below zero
        noise = least
        for _ in range(SETTLED):  # noise that the rows themselves ask for, beside what is usual
            both = np.concatenate([signed, np.sqrt(noise) * np.eye(signed.shape[1])])
            w, off = nnls(both, np.concatenate([z, np.zeros(signed.shape[1])]))
            left = float(np.sum((z - signed @ w) ** 2))
            loss, noise = off**2 / noise, max(least, left / turns)
        out.append(-0.5 * (np.linalg.slogdet(np.eye(A.shape[1]) + A.T @ A / noise)[1] + loss + turns * np.log(noise)))
    return np.array(out)


def _instruments(rows: Rows) -> np.ndarray:
    """Orthonormal functions of one joint's command at several times before, shape (R, k).

    What pushes the joint is in its motion and in its position error, and no command knows of it: only what goes with
    the command tells of the servo (two-stage least squares; Gilson and Van den Hof, Automatica 41(2), 2005).
    """
    steps = np.diff(rows.command, axis=0)
    turned = np.tanh(steps[::4] / (0.02 * np.abs(steps).max() + 1e-300))
    # Commands of neighbouring times are nearly the same: what only rounding tells apart is no instrument.
    return linalg.orth(np.concatenate([np.ones((1, rows.command.shape[1])), rows.command, turned]).T, rcond=DISTINCT)


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
