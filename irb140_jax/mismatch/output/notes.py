"""What a person should know beside the verdict: repairs, assumptions, warnings, joints that were not judged."""

from collections.abc import Callable, Collection, Sequence

import numpy as np

from irb140_jax.effects import At
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.records import digits
from irb140_jax.mismatch.regression.nuisances import SCALED
from irb140_jax.mismatch.regression.sufficient_data import Comparison, mostly_lost
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.selection.late_channels import delays_beside
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.testable import Seen
from irb140_jax.mismatch.validation.unexplained import Structure
from irb140_jax.recordings.payload import Payload
from irb140_jax.robot import Robot

FRICTION_LEVELS = SCALED.index("slope")  # friction of each recording about the mean over all
# What each block of the discrepancy depends on, in the order of `SCALED`.
GOES_WITH = ("its position", "its speed", "its position, speed and load together", "what it does around reversals")


def notes(data: Comparison, uncertainty: float, judged: np.ndarray) -> list[str]:
    """What every diagnosis says, a sentence each.

    Args:
        data: The model and the conditioned recordings, which have notes of their own.
        uncertainty: Relative standard deviation of the inertials.
        judged: Joints of which enough rows tell, shape (n,).
    """
    robot, band = data.robot, data.band
    out = [f"Model {robot.name}: {_sentence(note)}" for note in robot.notes]
    out += [f"{r.source}: {_sentence(note)}" for r in data.smooth for note in r.notes]
    out += [f"{r.source}: {_payload_note(r.payload)}" for r in data.smooth if r.payload]
    for name, count, lost, enough in zip(robot.joint_names, data.rows, mostly_lost(data.smooth), judged, strict=True):
        if not enough:
            why = f"dead or frozen channels and gaps leave {count} usable rows of it" if lost else (
                f"it moves in only {count} usable rows; record motion of this joint")
            out.append(f"{name} is not judged: {why}.")
    out.append(
        f"The model's inertial parameters are assumed to be right to {100 * uncertainty:.3g} %, one standard deviation "
        "(--inertial-uncertainty)."
    )
    if not judged.any():
        return list(dict.fromkeys(out))
    out.append(
        f"Model and recordings are compared below {band.torque:.3g} Hz; positions were smoothed with a bandwidth of "
        f"{band.position:.3g} Hz and differentiated. Errors on unseen data are over all rows; everything else leaves "
        "out those in which a joint rests, because dry friction is undetermined there."
    )
    return list(dict.fromkeys(out))


def rest_notes(robot: Robot, proof: HeldOut, scatter: np.ndarray) -> list[str]:
    """A note where most of the corrected model's squared error, beyond the sensors' scatter, is while a joint rests."""
    squares = [
        sum(np.sum(np.where(rows, x, 0.0) ** 2, axis=0) for x, rows in zip(proof.corrected, each, strict=True))
        for each in (proof.recorded, proof.use)
    ]
    errors, out = [proof.rmse(x) for x in (proof.nominal, proof.refit, proof.corrected)], []
    large = proof.rmse(proof.corrected, at_rest=True) > settings.ABOVE_NOISE * scatter
    for j in np.flatnonzero(proof.judged & large & (squares[0] > 2.0 * squares[1])):
        unit = robot.torque_units[j]
        nominal, refit, corrected = (f"{x[j]:.3g}" for x in errors)
        out.append(
            f"Most of the error of {robot.joint_names[j]} is in rows in which it rests, where dry friction is "
            f"undetermined. While it moves, the error on unseen data is {nominal} {unit} with the model as given, "
            f"{refit} with refitted inertials and {corrected} with the corrected model."
        )
    return out


def left_notes(
    robot: Robot, proof: HeldOut, scatter: np.ndarray, torque: np.ndarray, told: Collection[int],
    mostly: Callable[[int], Sequence[str]] = lambda _: (),
) -> list[str]:  # fmt: skip
    """A note on joints whose error is more than the sensors' scatter, where nothing says what it depends on.

    Args:
        robot: The nominal model.
        proof: Errors on unseen data.
        scatter: Of the sensors, shape (n,) [N m or N].
        torque: Size of the joints' torque, shape (n,).
        told: Joints of which something else is said.
        mostly: Where and when most of a joint's error is.
    """
    left, much = proof.rmse(proof.corrected), _much_left(proof, scatter, torque)
    said = [
        ", ".join([_size(robot, int(j), left[j], left[j] / max(torque[j], 1e-300)), *mostly(int(j))])
        for j in np.flatnonzero(proof.judged & much)
        if j not in told
    ]
    if not said:
        return []
    return [
        "Not all of the torque is explained, and what the rest depends on was not found. While the joint "
        f"moves, the corrected model leaves more than the noise of the sensors on unseen data: {'; '.join(said)}."
    ]


def recording_notes(
    robot: Robot, proof: HeldOut, recordings: Sequence[int], names: Sequence[str], scatter: np.ndarray,
    torque: np.ndarray,
) -> list[str]:  # fmt: skip
    """A note on each recording that holds most of the error of some joints, though fewer than half of the rows.

    Args:
        robot: The nominal model.
        proof: Errors on unseen data.
        recordings: Which recording each array of it is of.
        names: Of the recordings.
        scatter: Of the sensors, shape (n,) [N m or N].
        torque: Size of the joints' torque, shape (n,).
    """
    size = (len(names), robot.n)
    squares, rows = np.zeros(size), np.zeros(size)
    for i, r, use in zip(recordings, proof.corrected, proof.use, strict=True):
        squares[i] += np.sum(np.where(use, r, 0.0) ** 2, axis=0)
        rows[i] += use.sum(axis=0)
    share = squares / np.maximum(squares.sum(axis=0), 1e-300)
    much = proof.judged & _much_left(proof, scatter, torque)
    alone = much & (share >= settings.MOST_OF_ERROR) & (2.0 * rows < rows.sum(axis=0))
    return [
        f"Most of the squared error of the corrected model on unseen data, while the joint moves, is in {name}: "
        + ", ".join(f"{100 * share[i, j]:.0f} % on {robot.joint_names[j]}" for j in np.flatnonzero(alone[i]))
        + ". Either the motion differs there, or the machine did, with another tool, load or zero: diagnose the other "
        "recordings without this one."
        for i, name in enumerate(names)
        if alone[i].any()
    ]


def _much_left(proof: HeldOut, scatter: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Joints whose error is material and more than the sensors' scatter, shape (n,)."""
    left = proof.rmse(proof.corrected)
    return left > np.maximum(settings.MATERIAL_TORQUE * torque, settings.ABOVE_NOISE * scatter)


def slight_notes(robot: Robot, slight: Sequence[Structure]) -> list[str]:
    """A note on structure that no effect explains, where it is little of a joint's torque and more than noise.

    Args:
        robot: The nominal model.
        slight: That structure.
    """
    if not slight:
        return []
    said = [f"{_size(robot, s.joint, s.rms, s.of_torque)}, which depends on {s.variable}" for s in slight]
    return [
        f"Less than {100 * settings.MATERIAL_TORQUE:g} % of the torque, but more than the noise of the sensors, is "
        f"structure that no effect explains: {'; '.join(said)}."
    ]


def _size(robot: Robot, j: int, rms: float, of_torque: float) -> str:
    return (f"{robot.joint_names[j]} {digits(rms)} {robot.torque_units[j]} RMS "
            f"({digits(100 * of_torque, 2)} % of its torque)")


def inertial_notes(ex: Explanation, uncertainty: float) -> list[str]:
    """A note where the inertials look wrong by clearly more than was stated."""
    width = ex.space.width(ex.chosen, ex.hyper)
    if width <= 1.0:
        return []
    return [
        f"The recordings suit inertial parameters that are wrong by about {100 * width * uncertainty:.0f} % better "
        f"than the {100 * uncertainty:.3g} % that were stated; the diagnosis allows for it."
    ]


def unproved_notes(ex: Explanation, seen: Seen, *, servo: bool) -> list[str]:
    """A note for every effect that the search found and motions, of servos simulated ones too, speak against.

    What is not testable is said to be that, and no more; but a simulation may tell what torque does not.
    """
    names, out = ex.lib.robot.joint_names, []
    several = len(np.unique(ex.data.motions)) > 1
    there = " on motions that the fit did not see" * several + ", or in simulations from the commands" * servo
    for slug, joints in (x for x in ex.unproved if servo or x not in seen or seen[x][0] >= settings.VISIBLE):
        title = ex.lib.effects[slug].title
        out.append(
            f"{title[0].upper()}{title[1:]} on {', '.join(names[j] for j in joints)} would fit the torque of these "
            f"recordings, but the laws that are named err more with it{there}: it is not named."
        )
    return out


def gap_notes(
    robot: Robot, gap: np.ndarray | None, torque: np.ndarray, left_out: Sequence[tuple[str, tuple[int, ...]]]
) -> list[str]:
    """A note for every joint at which `corrected.xml` gives another torque than the corrected model.

    Args:
        robot: The nominal model.
        gap: The difference, shape (n,), or None where it isn't known.
        torque: Size of the joints' torque, shape (n,).
        left_out: Titles and joints of effects that MJCF can't hold, or not whole.
    """
    if gap is None:
        return ["corrected.xml could not be compared with the corrected model: MuJoCo reads other joints from it."]

    def reason(j: int) -> str:
        here = [title for title, joints in left_out if j in joints] or [title for title, _ in left_out]
        if not here:
            return "a link of the given model has inertial parameters that no body can have, and the file keeps them"
        return f"the file can't hold all of {', '.join(dict.fromkeys(here))}"

    return [
        f"On {robot.joint_names[j]} the torque of corrected.xml differs from that of the corrected model by "
        f"{gap[j]:.3g} {robot.torque_units[j]} RMS ({100 * gap[j] / torque[j]:.0f} % of the joint's torque): "
        f"{reason(j)}. To predict torque, use `irb140 predict`."
        for j in range(robot.n)
        if gap[j] > settings.NOTABLE_GAP * torque[j] > 0.0
    ]


def friction_notes(ex: Explanation, names: Sequence[str], judged: np.ndarray) -> list[str]:
    """A note for every judged joint whose friction differs from recording to recording.

    Said where friction of its own for each recording is more probable than one for all, against the odds of any rare
    effect.

    Args:
        ex: The explanation.
        names: Of the recordings.
        judged: Joints of which enough rows tell, shape (n,).
    """
    out = []
    _, _, own = ex.prediction()
    for j, of_joint in enumerate(ex.hyper):
        one_level = (*of_joint[:FRICTION_LEVELS], 0, *of_joint[FRICTION_LEVELS + 1 :])
        alike = (*ex.hyper[:j], one_level, *ex.hyper[j + 1 :])
        gain = ex.space.log_evidence(ex.chosen, ex.hyper) - ex.space.log_evidence(ex.chosen, alike)
        levels = ex.extra[0].groups[j] == FRICTION_LEVELS
        if judged[j] and own[j][levels].any() and gain > -np.log(settings.RARE):
            units = ("N", "N s/m") if ex.lib.robot.is_slide[j] else ("N m", "N m s/rad")
            dry, fast = (own[j] * ex.extra[0].units[j])[levels].reshape(2, -1)
            said = ", ".join(
                f"{d:+.3g} {units[0]} dry and {v / ex.scales.speed[j]:+.3g} {units[1]} viscous in {name}"
                for d, v, name in zip(dry, fast, names, strict=True)
            )
            joint = ex.lib.robot.joint_names[j]
            out.append(f"The friction of {joint} differs between the recordings; relative to their mean: {said}.")
    return out


def timing_notes(ex: Explanation) -> list[str]:
    """A note where torque is logged early or late beside the positions, and no effect is named for it.

    A channel is listed where that is more probable than no error of its time (Savage and Dickey), against the odds of
    any rare effect.
    """
    space, named = ex.space, {j for c in ex.members if c.effect.place.at is At.LOG_TIMING for j in c.joints}
    found, off = delays_beside(space, ex.chosen, ex.hyper), []
    for j in np.flatnonzero(found.notable & (found.log_odds > 0.0)):
        if j not in named:
            way = "early" if found.early[j] > 0.0 else "late"
            # To one digit: of a shift in time, the fit knows the slope of the torque alone.
            off.append(f"{ex.lib.robot.joint_names[j]} about {digits(1e3 * abs(found.early[j]), 1)} ms {way}")
    if not off:
        return []
    return [f"Torque is logged early or late beside the positions: {', '.join(off)}. The fit allows for it."]


def discrepancy_notes(ex: Explanation, proof: HeldOut) -> list[str]:
    """A note where the corrected model holds torque that no effect explains: how much, and what it goes with."""
    if not proof.carried.any():
        return []
    own = ex.prediction()[2]
    said = [_discrepancy_of_joint(ex, int(j), own[j]) for j in np.flatnonzero(proof.carried)]
    return [
        "The corrected model adds torque that no effect explains, as a function of a joint's own motion, because this "
        f"lowers the error on unseen motions: on {'; on '.join(said)}. `irb140 predict` includes it; corrected.xml and "
        "load_corrected do not."
    ]


def _discrepancy_of_joint(ex: Explanation, j: int, own: np.ndarray) -> str:
    """A joint, the size of its discrepancy, and the block that makes most of it; from its own columns' coefficients."""
    group, robot = ex.extra[0].groups[j], ex.lib.robot
    use = [s.use[:, j] for s in ex.data.stretches]
    blocks = np.stack([
        np.concatenate([e.own[j][u][:, group == k] @ own[group == k] for e, u in zip(ex.extra, use, strict=True)])
        for k in range(len(GOES_WITH))
    ])  # fmt: skip
    most = int(np.argmax(np.mean(blocks**2, axis=1)))
    size, unit = float(np.sqrt(np.mean(blocks.sum(axis=0) ** 2))), robot.torque_units[j]
    return f"{robot.joint_names[j]} {digits(size)} {unit} RMS, most of it with {GOES_WITH[most]}"


def _payload_note(payload: Payload) -> str:
    place = f"{', '.join(f'{x:g}' for x in payload.at)} m from it" if any(payload.at) else "with its centre there"
    moved = ", ".join(f"{100 * x:.1f}" for x in payload.off)
    return (
        f"the tool carries {payload.mass:g} kg that the model does not hold, {place}, give or take "
        f"{100 * settings.PAYLOAD_PLACED:g} cm along each axis (--known-payload); the fit moves it by {moved} cm."
    )


def _sentence(note: str) -> str:
    note = note.strip()
    return note if note.endswith((".", "!", "?")) else f"{note}."
