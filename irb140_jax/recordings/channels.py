"""What is wrong with whole channels: dead, frozen, exchanged or reversed columns, another unit or side.

Hypotheses of a line each, tried where the model as given explains a recording badly.  One is believed only if it turns
nearly nothing explained into nearly all: the model is allowed to be wrong, that is what the program is for.
"""

import dataclasses
import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from irb140_jax.effects.encoder_offset import LARGEST
from irb140_jax.recordings.glance import ENDS, SAMPLES, Glance, glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repair import longest_run
from irb140_jax.recordings.smooth import white_noise
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.robot import Robot

FROZEN = 0.5  # s that a torque must hold one value while its joint moves, or a position while its torque changes
FROZEN_RUNS = 10.0  # times as long as it holds any other value: a coarse sensor repeats itself more evenly
MOVED = 0.05  # of the joint's travel that it must move meanwhile
OFF = 0.5  # of the torque that a joint needs elsewhere: with less, it moves with its drive off
WELL, BADLY = 0.9, 0.6  # shares of a torque's variance that the model explains under a true hypothesis, and as given
BETTER = 5.0  # times less that is left unexplained under a true hypothesis
SURE = 0.97  # share that suffices on two joints at least, however well the model as given explains
CHANGED = 0.05  # of the share by which a joint is concerned by a hypothesis
ZERO_STEP = 0.4  # rad between zeros tried; the nearest is 0.2 rad off, which leaves 2 % of gravity
LATEST = 0.4  # s by which a torque may come late
ALIKE = 1.5  # largest over smallest of factors that are one
ORDER = "put the columns in order, or exchange them with --columns FILE.toml"
FAR_OFF = 5.0  # times too large or small, alike on most joints, that no wrong mass explains; 4 times that if not alike


class Doubt(NamedTuple):
    """Something wrong with whole channels.

    Attributes:
        kind: What: "reversed torque", "reversed position", "reversed axis", "exchanged torque", "exchanged positions",
            "gravity", "zero", "late", "unit".
        joints: Indices of the joints concerned.
        said: A sentence that names the columns.
        remedy: What would mend it.
        scale: Factors, by column, that would; empty where none do.
    """

    kind: str
    joints: tuple[int, ...]
    said: str
    remedy: str
    scale: dict[str, float]


# --- dead and frozen channels ----------------------------------------------------------------------------------------


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
        inside = _at_glance(recording, rows)
        here, needs = seen._replace(q=seen.q[inside], qd=seen.qd[inside], tau=seen.tau[inside]), model.total[inside, j]
        told = explained(here, Torques(model.gravity[inside], model.moving[inside]), np.ones(robot.n, dtype=bool))
        change, noise = np.std(here.tau[:, j]), white_noise(recording.t, recording.tau[:, j])
        if told[j] > BADLY or change < max(np.std(needs), noise):
            continue
        step = np.eye(robot.n)[j]
        moved = nominal_torques(robot, seen.q + step, seen.qd + step, seen.qdd + step).total - model.total
        reach = np.abs(moved).max(axis=0)
        touched = reach > 1e-9 * np.abs(model.total).max()
        name, unit = recording.joint_names[j], "N" if robot.is_slide[j] else "N m"
        by = f"while tau.{name} changes by {np.ptp(here.tau[:, j]):.3g} {unit}, which no joint held there needs"
        if not rows.all():
            t = recording.t[rows]
            near = (recording.t > t[0] - ENDS) & (recording.t < t[-1] + ENDS)
            yield near, np.flatnonzero(touched), (
                f"q.{name} is frozen at {recording.q[rows, j][0]:.4g} from {t[0]:.4g} s to {t[-1]:.4g} s {by}: its "
                "channel may be dead there; these rows are left out, of all joints whose torque depends on it")
            continue
        others = (reach > CHANGED * np.std(here.tau, axis=0)) & (np.arange(robot.n) != j) & (seen.travel > least_travel)
        suffer = bool(np.any(told[others] < WELL))
        left = f", nor are the joints whose torque depends on where {name} is" if suffer else ""
        yield rows, np.flatnonzero(touched) if suffer else np.array([j]), (
            f"q.{name} stays at {np.median(recording.q[:, j]):.4g} in every row {by}: its channel may be dead. {name} "
            f"is not judged{left}. Log its position, or map the column that holds it")


def _at_glance(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """Which samples of a glance lie in these rows."""
    t = recording.t
    margin = min(ENDS, 0.1 * (t[-1] - t[0]))
    return np.interp(np.linspace(t[0] + margin, t[-1] - margin, SAMPLES), t, rows.astype(float)) > 0.5


def _switched_off(recording: Recording, rows: np.ndarray, j: int, robot: Robot) -> bool:
    """Whether torque is zero in these rows and the model, too, needs hardly any, beside what it needs in the others."""
    if recording.tau[rows, j][0] != 0.0:
        return False
    seen = glance(recording)
    needed = nominal_torques(robot, seen.q, seen.qd, seen.qdd).total[:, j]
    inside = _at_glance(recording, rows)
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


# --- hypotheses ------------------------------------------------------------------------------------------------------


def channel_doubts(
    recording: Recording, seen: Glance, robot: Robot, judged: np.ndarray, driven: np.ndarray
) -> list[Doubt]:
    """The likeliest thing that is wrong with whole channels, if the model as given explains badly and that well.

    Args:
        recording: For its names.
        seen: A quick look at it.
        robot: The nominal model.
        judged: Joints that move and have a living torque channel, shape (n,).
        driven: Those whose torque is not small beside the model's; of others only the size may be judged, shape (n,).

    Returns:
        Nothing, or one doubt: the simplest of those that explain.
    """
    model = nominal_torques(robot, seen.q, seen.qd, seen.qdd)
    given = explained(seen, model, judged)
    if not judged.any() or np.nanmin(np.where(judged, given, 1.0)) > SURE:
        return unit_doubts(recording, seen, model, judged)
    # What each hypothesis changes must be explained after it and not before, and nothing else may suffer.
    best: tuple[float, Doubt] | None = None
    for cost, doubt, after in _hypotheses(recording, seen, robot, model, judged):
        changed = judged & (np.abs(after - given) > CHANGED)
        if not changed.any() or np.any(changed & ~driven) or np.any(after[changed] < WELL):
            continue
        if np.mean(1.0 - given[changed]) < BETTER * np.mean(1.0 - after[changed]):
            continue
        several = changed.sum() > 1
        if np.mean(given[changed]) > BADLY and not (several and np.min(after[changed]) > SURE):
            continue
        # What another zero or a turned axis does to one joint alone, another centre of mass of its link does, too.
        if doubt.kind in ("zero", "reversed axis") and not several:
            continue
        gain = float(np.sum(np.log((1.0 - given[judged] + 0.01) / (1.0 - after[judged] + 0.01)))) - cost
        if gain > 0.0 and (best is None or gain > best[0] + 0.5):
            best = gain, doubt
    return [best[1]] if best else unit_doubts(recording, seen, model, judged)


def explained(seen: Glance, model: Torques, judged: np.ndarray, tau: np.ndarray | None = None) -> np.ndarray:
    """Share of each torque's variance that the model's torque, of any size, and the joint's friction explain, (n,)."""
    tau = seen.tau if tau is None else tau
    out = np.full(tau.shape[1], np.nan)
    for j in np.flatnonzero(judged):
        out[j] = _share(_features(seen.qd[:, j], model.total[:, j]), tau[:, j])
    return out


def _features(qd: np.ndarray, model: np.ndarray) -> np.ndarray:
    slow = 0.02 * np.abs(qd).max() + 1e-12
    return np.stack([model, qd, np.tanh(qd / slow)], axis=1)


def _share(features: np.ndarray, target: np.ndarray) -> float:
    """Share of the target's variance that a combination without negative amplitudes explains."""
    features, target = features - features.mean(axis=0), target - target.mean()
    power = target @ target
    if power <= 0.0:
        return 0.0
    Q, R = np.linalg.qr(features / np.maximum(np.linalg.norm(features, axis=0), 1e-300))
    inside = Q.T @ target
    return float((inside @ inside - nnls(R, inside)[1] ** 2) / power)


def _hypotheses(
    recording: Recording, seen: Glance, robot: Robot, model: Torques, judged: np.ndarray
) -> Iterator[tuple[float, Doubt, np.ndarray]]:
    """Every hypothesis with what it costs in plausibility and what is explained under it."""
    names, n = recording.joint_names, robot.n
    again = lambda q, qd, qdd: nominal_torques(robot, q, qd, qdd)  # noqa: E731
    for j in map(int, np.flatnonzero(judged)):
        sign = np.where(np.arange(n) == j, -1.0, 1.0)
        turned = seen._replace(q=sign * seen.q, qd=sign * seen.qd, qdd=sign * seen.qdd)
        other = again(turned.q, turned.qd, turned.qdd)
        tau, q = f"tau.{names[j]}", f"q.{names[j]}"
        yield 0.5, Doubt(
            "reversed torque", (j,), f"column {tau} of the wrong sign: the reversed torque is what the model and "
            "friction would need", f"map it with --columns and [scale] \"{tau}\" = -1", {tau: -1.0},
        ), explained(seen, model, judged, sign * seen.tau)  # fmt: skip
        yield 1.0, Doubt(
            "reversed position", (j,), f"column {q} of the wrong sign: with it reversed the model explains the torque",
            f"map it with --columns and [scale] \"{q}\" = -1", {q: -1.0},
        ), explained(turned, other, judged)  # fmt: skip
        yield 1.0, Doubt(
            "reversed axis", (j,), f"columns {q} and {tau} both count the other way round than the model's axis",
            f"map them with --columns and [scale] \"{q}\" = -1 and \"{tau}\" = -1, or turn the axis in the model",
            {q: -1.0, tau: -1.0},
        ), explained(turned, other, judged, sign * seen.tau)  # fmt: skip
    for a, b in itertools.combinations(range(n), 2):
        order = np.arange(n)
        order[[a, b]] = b, a
        pair = f"{names[a]} and {names[b]}"
        yield 1.0, Doubt(
            "exchanged torque", (a, b), f"torque columns look exchanged: tau.{names[b]} fits joint {names[a]}, "
            f"tau.{names[a]} fits joint {names[b]}", ORDER, {},
        ), explained(seen, model, judged & judged[order], seen.tau[:, order])  # fmt: skip
        if robot.is_slide[a] == robot.is_slide[b]:
            turned = seen._replace(q=seen.q[:, order], qd=seen.qd[:, order], qdd=seen.qdd[:, order])
            yield 1.5, Doubt(
                "exchanged positions", (a, b), f"position columns of {pair} look exchanged: the other way round the "
                "model explains the torque", ORDER, {},
            ), explained(turned, again(turned.q, turned.qd, turned.qdd), judged)  # fmt: skip
    # Of a joint alone, gravity turned round is a mass on the other side, and its zero is where that mass hangs.
    if judged.sum() > 1:
        yield 0.5, Doubt(
            "gravity", tuple(np.flatnonzero(judged).tolist()), "gravity in the model looks reversed: turned round, the "
            "model explains the torque", "turn `gravity` round in the model, or mend how its base is mounted", {},
        ), explained(seen, Torques(-model.gravity, model.moving), judged)  # fmt: skip
        for j in np.flatnonzero(judged & ~np.asarray(robot.is_slide)):
            yield from _zeros(recording, seen, robot, judged, int(j))


def _zeros(
    recording: Recording, seen: Glance, robot: Robot, judged: np.ndarray, j: int
) -> Iterator[tuple[float, Doubt, np.ndarray]]:
    """The best zero of a joint, if it is farther from the one given than a diagnosis reaches."""
    step = np.eye(robot.n)[j]

    def at(offset: float) -> np.ndarray:
        return explained(seen, nominal_torques(robot, seen.q + offset * step, seen.qd, seen.qdd), judged)

    tried = {z: at(z) for z in np.arange(-np.pi, np.pi, ZERO_STEP)}
    near = max(tried, key=lambda z: float(np.nansum(tried[z])))
    fine = {z: at(z) for z in near + np.linspace(-0.5, 0.5, 9) * ZERO_STEP}
    best = max(fine, key=lambda z: float(np.nansum(fine[z])))
    if abs(best) <= LARGEST:
        return
    name = recording.joint_names[j]
    # The first joint's zero is how the base is mounted.
    mounted = "" if judged[:j].any() else ", or how its base is mounted"
    yield 1.5, Doubt(
        "zero", (j,), f"the zero of q.{name} looks {best:+.2g} rad off: moved so far, the model explains the torque",
        f"map it with --columns and [offset] \"q.{name}\" = {best:.3g}, or mend the joint's reference in the model"
        f"{mounted}", {},
    ), fine[best]  # fmt: skip


def lateness(recording: Recording, seen: Glance, model: Torques, j: int) -> float:
    """Time by which a joint's torque must be moved ahead for the model to explain it [s], 0 where that doesn't help.

    Args:
        recording: The recording.
        seen: A quick look at it.
        model: Torque of the nominal model.
        j: The joint.
    """
    step = _step(recording, seen)
    # A slow wave turned round is nearly the wave half a period late.
    turned = _share(_features(seen.qd[:, j], model.total[:, j]), -seen.tau[:, j])
    best = 1.0 - min(1.0 - WELL, (1.0 - turned) / 2.0), 0
    return max(best, *((_share_later(seen, model, j, k), k) for k in range(1, int(LATEST / step) + 1)))[1] * step


def lateness_of_all(recording: Recording, seen: Glance, model: Torques, judged: np.ndarray) -> float:
    """Time by which all torques must be moved ahead for the model to explain most of them [s], below 0 if moved back.

    Returns:
        0 where that isn't clear.
    """
    step, joints = _step(recording, seen), np.flatnonzero(judged)
    shifts = np.arange(-int(LATEST / step), int(LATEST / step) + 1)
    left = 1.0 - np.array([[_share_later(seen, model, int(j), int(k)) for j in joints] for k in shifts])
    best = int(np.argmin(np.sum(np.log(left + 0.01), axis=1)))
    clear = (left[best] < 1.0 - WELL) & (BETTER * left[best] < left[shifts == 0][0])
    return float(shifts[best] * step) if 2 * clear.sum() > len(joints) else 0.0


def _step(recording: Recording, seen: Glance) -> float:
    whole = float(recording.t[-1] - recording.t[0])
    return (whole - 2.0 * min(ENDS, 0.1 * whole)) / (len(seen.tau) - 1)


def _share_later(seen: Glance, model: Torques, j: int, k: int) -> float:
    """Share of a joint's torque that is explained by the model k samples before."""
    rows = slice(0, len(seen.tau) - k) if k >= 0 else slice(-k, None)
    later = slice(k, None) if k >= 0 else slice(0, k)
    return _share(_features(seen.qd[:, j], model.total[:, j])[rows], seen.tau[later, j])


# --- units -----------------------------------------------------------------------------------------------------------


def unit_doubts(recording: Recording, seen: Glance, model: Torques, judged: np.ndarray) -> list[Doubt]:
    """Torque of the model's shape that is far too large or too small, on most joints or on some: another unit or side.

    Of some joints nothing is said below a factor of twenty: one may carry many times what the model gives it.
    """
    ratio = {int(j): r for j in np.flatnonzero(judged) if (r := ratio_to_model(seen, model, int(j))) > 0.0}
    doubted = ratio if 2 * len(ratio) > judged.sum() else {}
    sizes = np.array(list(doubted.values()))
    if not _far_off(sizes):
        one = lambda j: _far_off(np.array([ratio[j]])) and not _may_carry(seen, model, judged, j, ratio[j])  # noqa: E731
        doubted = {j: r for j, r in ratio.items() if one(j)}
        sizes = np.array(list(doubted.values()))
    if not doubted:
        return []
    names = [recording.joint_names[j] for j in doubted]
    middle, worst = float(np.exp(np.mean(np.log(sizes)))), int(np.argmax(np.abs(np.log(sizes))))
    factors = {f"tau.{name}": float(f"{1.0 / s:.3g}") for name, s in zip(names, sizes, strict=True)}
    listed = ", ".join(f"\"{k}\" = {v:g}" for k, v in factors.items())
    guess = "percent of the rated torque or mA" if middle > 1.0 else "motor side, ampere or a share of the rated"
    if _alike(sizes) and 800.0 < middle < 1250.0:
        guess = "mN m"
    others = [f"tau.{name}" for name in names if name != names[worst]]
    so_with = f", and so with {', '.join(others)}" if others else ""
    said = (
        f"column tau.{names[worst]} has the shape of the model's torque but is {sizes[worst]:.3g} times as large"
        f"{so_with}: this looks like {guess}; N m on the joint side are wanted"
    )
    remedy = (
        "multiply motor torque by the gear ratio, current by the torque constant too, percent by a hundredth of the "
        f"rated torque, with --columns and [scale]; near the model's torque would be {listed}"
    )
    return [Doubt("unit", tuple(doubted), said, remedy, factors)]


def _alike(sizes: np.ndarray) -> bool:
    return float(sizes.max() / sizes.min()) < ALIKE


def _far_off(sizes: np.ndarray) -> bool:
    """Whether torques so many times the model's are all too large or all too small for a wrong mass."""
    if not len(sizes):
        return False
    far = FAR_OFF if len(sizes) > 1 and _alike(sizes) else 4.0 * FAR_OFF
    middle = np.exp(np.mean(np.log(sizes)))
    return bool(middle > far and sizes.min() > FAR_OFF or middle < 1.0 / far and sizes.max() < 1.0 / FAR_OFF)


def _may_carry(seen: Glance, model: Torques, judged: np.ndarray, j: int, ratio: float) -> bool:
    """Whether a rotor or a load that the model leaves out may make this joint's torque so many times the model's."""
    size = np.std(seen.tau, axis=0)
    if ratio < 1.0 or judged.sum() == 1:
        return False
    # The joints below a load carry it, too, and a rotor's torque has the shape of the acceleration.
    rotor = _share(_features(seen.qd[:, j], seen.qdd[:, j]), seen.tau[:, j])
    given = _share(_features(seen.qd[:, j], model.total[:, j]), seen.tau[:, j])
    return bool(size[j] < np.delete(size * judged, j).max() or 1.0 - rotor < BETTER * (1.0 - given))


def ratio_to_model(seen: Glance, model: Torques, j: int) -> float:
    """How many times the model's torque the logged one is, without friction; 0 where they have little in common."""
    features = _features(seen.qd[:, j], model.total[:, j])
    centred, target = features - features.mean(axis=0), seen.tau[:, j] - seen.tau[:, j].mean()
    size = np.linalg.norm(centred, axis=0)
    if size[0] <= 0.0 or not target.any():
        return 0.0
    Q, R = np.linalg.qr(centred / np.maximum(size, 1e-300))
    w, missed = nnls(R, Q.T @ target)
    power = target @ target
    whole = (Q.T @ target) @ (Q.T @ target) - missed**2
    clear = whole > WELL * power and (w[0] ** 2) > 0.25 * power
    return float(w[0] / size[0]) if clear else 0.0
