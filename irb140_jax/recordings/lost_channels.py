"""Rows in which a channel of torque or position is dead or frozen."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from irb140_jax.recordings.glance import ENDS, Glance, glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repair import longest_run
from irb140_jax.recordings.smooth import white_noise
from irb140_jax.recordings.torque_shape import BADLY, CHANGED, WELL, explained
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.robot import Robot

FROZEN = 0.5  # s that a torque must hold one value while its joint moves, or a position while its torque changes
FROZEN_RUNS = 10.0  # times as long as it holds any other value: a coarse sensor repeats itself more evenly
MOVED = 0.05  # of the joint's travel that it must move meanwhile
OFF = 0.5  # of the torque that a joint needs elsewhere: with less, it moves with its drive off


def with_lost_torque_marked(recording: Recording, least_travel: np.ndarray, robot: Robot) -> Recording:
    """The recording with the rows marked in which a channel of torque or position is dead or frozen.

    Args:
        recording: With torque.
        least_travel: Below it, a joint counts as standing still [rad or m], shape (n,).
        robot: The nominal model: where a drive is switched off, torque is rightly zero, and the model knows.

    Returns:
        The same with `torque_lost`, and a note for every channel concerned.
    """
    if recording.is_servo_log:
        return recording  # its torque was made, not logged
    lost, notes = np.zeros(recording.tau.shape, dtype=bool), list(recording.notes)
    for j, name in enumerate(recording.joint_names):
        rows = _frozen(recording.t, recording.q[:, j], recording.tau[:, j], least_travel[j])
        if not rows.any() or (not rows.all() and _switched_off(recording, rows, j, robot)):
            continue
        lost[rows, j] = True
        value, i = recording.tau[rows, j][0], np.flatnonzero(rows)
        if rows.all():
            notes.append(f"tau.{name} is {value:.4g} in every row though the joint moves: a dead channel. {name} is "
                         "not judged; the others are. Log its torque or current, or map the column that holds it")
        else:
            when = f"from {recording.t[i[0]]:.4g} s to {recording.t[i[-1]]:.4g} s"
            notes.append(f"tau.{name} is frozen at {value:.4g} {when} though the joint moves: these rows of {name} are "
                         "left out")
    for rows, joints, said in _dead_positions(recording, least_travel, robot, np.flatnonzero(~lost.any(axis=0))):
        lost[np.ix_(rows, joints)] = True
        notes.append(said)
    if not lost.any():
        return recording
    return dataclasses.replace(recording, torque_lost=lost, notes=tuple(dict.fromkeys(notes)))


def _dead_positions(
    recording: Recording, least_travel: np.ndarray, robot: Robot, joints: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, str]]:
    """Rows, joints whose torque can't be judged in them, and a sentence, for positions that stop while torque goes on.

    A joint that is held has the torque that the model needs there, or a constant one under its brake.  Where no row
    shows the joint moving, stiction may hide this, so that others are lost only if theirs is not explained either.
    """
    still = {}
    for j in map(int, joints):
        q, tau = recording.q[:, j], recording.tau[:, j]
        rows = _frozen(recording.t, tau, q if np.ptp(q) >= least_travel[j] else np.zeros_like(q), 0.0)
        if rows.any() and (rows.all() or np.std(tau[rows]) > OFF * np.std(tau[~rows])):
            still[j] = rows
    if not still:
        return
    seen = glance(recording)
    model = nominal_torques(robot, seen.q, seen.qd, seen.qdd)
    for j, rows in still.items():
        inside = _at(seen, recording, rows)
        here, needs = seen._replace(q=seen.q[inside], qd=seen.qd[inside], tau=seen.tau[inside]), model.total[inside, j]
        told = explained(here, Torques(model.gravity[inside], model.moving[inside]), np.ones(robot.n, dtype=bool))
        change, noise = np.std(here.tau[:, j]), white_noise(recording.t, recording.tau[:, j])
        if told[j] > BADLY or change < max(np.std(needs), noise):
            continue
        step = np.eye(robot.n)[j]
        moved = nominal_torques(robot, seen.q + step, seen.qd + step, seen.qdd + step).total - model.total
        reach = np.abs(moved).max(axis=0)
        touched = reach > 1e-9 * np.abs(model.total).max()
        name, unit = recording.joint_names[j], robot.torque_units[j]
        by = f"while tau.{name} changes by {np.ptp(here.tau[:, j]):.3g} {unit}, which no joint held there needs"
        if not rows.all():
            t = recording.t[rows]
            near = (recording.t > t[0] - ENDS) & (recording.t < t[-1] + ENDS)
            yield near, np.flatnonzero(touched), (
                f"q.{name} is frozen at {recording.q[rows, j][0]:.4g} from {t[0]:.4g} s to {t[-1]:.4g} s {by}: its "
                "channel may be dead there, or something blocks the joint; these rows are left out, of all joints "
                "whose torque depends on it")
            continue
        others = (reach > CHANGED * np.std(here.tau, axis=0)) & (np.arange(robot.n) != j) & (seen.travel > least_travel)
        suffer = bool(np.any(told[others] < WELL))
        left = f", nor are the joints whose torque depends on where {name} is" if suffer else ""
        yield rows, np.flatnonzero(touched) if suffer else np.array([j]), (
            f"q.{name} stays at {np.median(recording.q[:, j]):.4g} in every row {by}: its channel may be dead. {name} "
            f"is not judged{left}. Log its position, or map the column that holds it")


def _at(seen: Glance, recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Which samples of a quick look lie in these rows."""
    return np.interp(seen.t, recording.t, rows.astype(float)) > 0.5


def _switched_off(recording: Recording, rows: np.ndarray, j: int, robot: Robot) -> bool:
    """Whether torque is zero in these rows and the model, too, needs hardly any, beside what it needs in the others."""
    if recording.tau[rows, j][0] != 0.0:
        return False
    seen = glance(recording)
    needed = nominal_torques(robot, seen.q, seen.qd, seen.qdd).total[:, j]
    inside = _at(seen, recording, rows)
    rms = lambda x: float(np.sqrt(np.mean(x**2))) if len(x) else 0.0  # noqa: E731
    return rms(needed[inside]) < OFF * rms(needed[~inside])


def _frozen(t: np.ndarray, q: np.ndarray, tau: np.ndarray, least: float) -> np.ndarray:
    """Rows of tau's longest run of one value, if it is far longer than any other and q moves in it."""
    if np.ptp(q) < least:
        return np.zeros(len(t), dtype=bool)
    if np.ptp(tau) == 0.0:
        return np.ones(len(t), dtype=bool)
    same = np.concatenate([[False], tau[1:] == tau[:-1]])
    length, start = longest_run(same)
    rows = np.zeros(len(t), dtype=bool)
    rows[max(start - 1, 0) : start + length] = True
    next_longest = longest_run(same & ~rows)[0]
    moved = np.ptp(q[rows]) if rows.any() else 0.0
    sure = length > FROZEN_RUNS * (next_longest + 1) and t[rows][-1] - t[rows][0] > FROZEN and moved > MOVED * np.ptp(q)
    return rows if sure else np.zeros(len(t), dtype=bool)
