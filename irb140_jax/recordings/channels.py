"""What is wrong with whole channels: exchanged or reversed columns, a zero, gravity, another unit or side.

Hypotheses of a line each, tried where the model as given explains a recording badly.  One is believed only if it turns
nearly nothing explained into nearly all: the model is allowed to be wrong, that is what the program is for.
"""

import itertools
from collections.abc import Iterator

import numpy as np

from irb140_jax.effects.encoder_offset import LARGEST
from irb140_jax.recordings.doubt import Doubt
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torque_shape import BADLY, BETTER, CHANGED, MIN_SHARE, WELL, explained, ratio_to_model
from irb140_jax.recordings.torque_units import unit_doubts
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.robot import Robot

SURE = 0.97  # share that suffices on two joints at least, however well the model as given explains
ZERO_STEP = 0.4  # rad between zeros tried; the nearest is 0.2 rad off, which leaves 2 % of gravity
ORDER = "put the columns in order, or exchange them with --columns FILE.toml"


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
            best = gain, doubt._replace(explained=after)
    return [best[1]] if best else unit_doubts(recording, seen, model, judged)


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
        # A torque many times that of the model is of inertials that are wrong: they may have either sign.
        if MIN_SHARE * ratio_to_model(seen._replace(tau=sign * seen.tau), model, j) < 1.0:
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
