"""From what the stages found to a diagnosis and to the data of the report's drawings."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.effects.torque_gain import EFFECT as TORQUE_GAIN
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.corrected.native import native_gap
from irb140_jax.mismatch.motion import MotionFit
from irb140_jax.mismatch.output import views
from irb140_jax.mismatch.output.findings import torque_scale_finding
from irb140_jax.mismatch.output.inertials import link_shifts
from irb140_jax.mismatch.output.link_encoders import link_encoder_notes
from irb140_jax.mismatch.output.notes import (
    discrepancy_notes,
    friction_notes,
    gap_notes,
    inertial_notes,
    left_notes,
    notes,
    recording_notes,
    rest_notes,
    slight_notes,
    timing_notes,
    unproved_notes,
)
from irb140_jax.mismatch.output.open_effects import OpenEffect, open_effects, open_notes
from irb140_jax.mismatch.output.servos import (
    command_notes,
    gain_notes,
    harmful_notes,
    motion_notes,
    of_servos,
    servo_sentence,
)
from irb140_jax.mismatch.output.summary import open_sentence, summary, verdict
from irb140_jax.mismatch.records import rounded
from irb140_jax.mismatch.regression.sensor_noise import coarse_positions
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.result import Diagnosis, Finding, Fit, Provenance, Unexplained
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.blocked import Blocked
from irb140_jax.mismatch.validation.competitors import Axis
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.testable import Seen, not_testable, shows_no_friction
from irb140_jax.mismatch.validation.undecided_joints import torque_size, undecidable
from irb140_jax.mismatch.validation.unexplained import Structure, When, Where, narrowest, shortest
from irb140_jax.mismatch.validation.unexplained_time import mostly_unexplained
from irb140_jax.recordings.condition import Commanded
from irb140_jax.robot import Robot

NO_FRICTION_SHOWS = (
    "friction of a usual size would show on no joint above what the sensors leave: record with finer positions or less "
    "noise, or longer"
)


@dataclasses.dataclass(frozen=True)
class Found:
    """What the stages of a diagnosis found, before it is put into words.

    Attributes:
        data: Model and recordings.
        uncertainty: Relative standard deviation of the inertials.
        sensors: What torque sensors and encoders leave in the comparison, shape (n,) each [N m or N].
        ex: The explanation.
        proof: Errors on unseen data.
        findings: Named effects.
        rest: Structure that no effect explains.
        slight: The same, where it is little of the joint's torque.
        seen: How well every other effect could be seen.
        model: The corrected model.
        harmful: Joints whose discrepancy is left out because it makes the error larger, shape (n,).
        beyond: What corrected.xml lacks of the model's torque along each recording, (T, n) [N m or N]; None where
            unknown.
        servo: Commands and drive as they were given, where the recordings held these in place of torque.
        fit: Of servos to the motion, whose numbers the model has.
    """

    data: Comparison
    uncertainty: float
    sensors: tuple[np.ndarray, np.ndarray]
    ex: Explanation
    proof: HeldOut
    findings: Sequence[Finding]
    rest: Sequence[Structure]
    slight: Sequence[Structure]
    seen: Seen
    model: CorrectedModel
    harmful: np.ndarray
    beyond: Sequence[np.ndarray] | None
    servo: Commanded | None = None
    fit: MotionFit | None = None


def document(of: Found, origin: Provenance) -> Diagnosis:
    """The diagnosis."""
    robot, scatter = of.data.robot, np.hypot(*of.sensors)
    logged = [s.tau for s in of.ex.data.stretches]
    located = {s.joint for s in of.rest}
    missing = undecidable(robot, of.proof, logged, scatter, of.data.band, located)
    weighed = any(r.payload for r in of.data.smooth)
    found = of_servos(of.ex, of.servo, [*of.findings, *torque_scale_finding(robot, of.ex, weighed)])
    fit, shifts = fit_by_joint(robot, of.proof, scatter), link_shifts(robot, of.ex)
    effects = of.ex.lib.effects | ({TORQUE_GAIN.slug: TORQUE_GAIN} if of.ex.scaled else {})
    blind = shows_no_friction(of.seen, effects)
    kind = verdict(of.ex, of.proof, found, of.rest, missing, blind)
    moving = fit_by_joint(robot, of.proof, scatter, at_rest=False)
    lacks = [*missing.values(), *([NO_FRICTION_SHOWS] if blind else [])]
    open_ = open_effects(of.ex, found)
    said = summary(kind, found, of.rest, moving, shifts, robot, len(of.data.recordings), lacks, effects, open_)
    return rounded(Diagnosis(
        verdict=kind,
        findings=tuple(found),
        unexplained=tuple(_unexplained(robot, s, of.data.names) for s in of.rest),
        not_testable=not_testable(robot, found, of.seen, effects.values()),
        fit=fit,
        notes=tuple(_notes(of, missing, torque_size(of.proof, logged), open_)),
        provenance=origin,
        summary=said + servo_sentence(of.data.recordings),
    ))  # fmt: skip


def with_time_left_out(
    diagnosis: Diagnosis, when: str, rest: Sequence[Structure], data: Comparison
) -> Diagnosis:
    """The diagnosis of all but a short time in which nothing explains the torque of most joints, with that said.

    Args:
        diagnosis: Of all else.
        when: The time in words.
        rest: What nothing explained before that was left out.
        data: Model and recordings, as they were then.
    """
    brief = mostly_unexplained(rest)
    joints = ", ".join(data.robot.joint_names[s.joint] for s in brief)
    said = (
        f"Nothing explains most of the torque of {joints} {when}; this time is left out of everything else that is "
        "said, and what is named is of the rest."
    )
    return _with_unexplained(diagnosis, [_unexplained(data.robot, s, data.names) for s in brief], [said])


def with_joints_blocked(
    diagnosis: Diagnosis, stops: Sequence[Blocked], robot: Robot, *, left_out: bool
) -> Diagnosis:
    """The diagnosis, and which joints something stops; `left_out` where it is of all other times."""
    left, said = [], []
    for s in stops:
        name, (angle, unit) = robot.joint_names[s.joint], ("m", "N") if robot.is_slide[s.joint] else ("rad", "N m")
        times = f"{len(s.times)} times" if len(s.times) > 1 else "once"
        where = f"stands still at {s.position:.4g} {angle}, {times}, under up to {s.torque:.3g} {unit} more than the " \
                f"model needs there, while {s.usual:.3g} {unit} RMS move it elsewhere"  # fmt: skip
        left.append(Unexplained((name,), f"{name}: {where}: a contact, as with an end stop", None, None))
        said.append(f"{name} {where}: it is blocked, by an end stop, an obstacle or a cable." + (
            " This time is left out of all else that is said." if left_out else ""))  # fmt: skip
    return _with_unexplained(diagnosis, left, said) if left else diagnosis


def _with_unexplained(diagnosis: Diagnosis, left: Sequence[Unexplained], said: Sequence[str]) -> Diagnosis:
    """The diagnosis with more that is unexplained, and sentences on it in the first notes and in the summary."""
    silent = diagnosis.verdict in ("no_mismatch", "parameters_only")
    return rounded(dataclasses.replace(
        diagnosis, verdict="unexplained" if silent else diagnosis.verdict,
        unexplained=(*left, *diagnosis.unexplained), notes=(*said, *diagnosis.notes),
        summary=" ".join([diagnosis.summary, *said]),
    ))  # fmt: skip


def document_of_nothing(
    data: Comparison, reason: str, seen: Seen, effects: Sequence[Effect], uncertainty: float, origin: Provenance
) -> Diagnosis:
    """The diagnosis where no joint could be compared: undecided, nothing refitted, and every effect open.

    Args:
        data: Model and recordings.
        reason: Why, a sentence without its full stop.
        seen: Every effect at every site, none of which could be seen.
        effects: The library.
        uncertainty: Relative standard deviation of the inertials.
        origin: Where the diagnosis comes from.
    """
    robot = data.robot
    unjudged = notes(data, uncertainty, np.zeros(robot.n, dtype=bool))
    return rounded(Diagnosis(
        verdict="undecided",
        findings=(),
        unexplained=(),
        not_testable=not_testable(robot, (), seen, effects),
        fit={name: Fit() for name in robot.joint_names},
        notes=(f"{reason}.", *data.servo_notes, *data.notes, *unjudged),
        provenance=origin,
        summary=f"{open_sentence(len(data.recordings), robot)} {reason}.",
    ))  # fmt: skip


def report_views(of: Found, said: tuple[str, ...], motion: dict[str, Any] | None) -> views.Views:
    """What the report draws.

    Args:
        of: What was found.
        said: Notes of the diagnosis.
        motion: The proof in motion.
    """
    robot, ex, proof = of.data.robot, of.ex, of.proof
    return rounded(views.Views(
        robot.joint_names, tuple(of.data.names), views.maps(robot, ex, proof),
        views.motions(robot, ex, proof, of.data.names), views.ranking(robot, ex), views.spectra(robot, ex, proof),
        views.unexplained_torques(robot, ex, proof, of.rest), link_shifts(robot, ex), said, motion,
    ))  # fmt: skip


def fit_by_joint(robot: Robot, proof: HeldOut, scatter: np.ndarray, *, at_rest: bool = True) -> dict[str, Fit]:
    """Errors on unseen data, in all rows or while the joint moves, and the sensors' scatter; none where not judged."""
    columns = (*(proof.rmse(x, at_rest=at_rest) for x in (proof.nominal, proof.refit, proof.corrected)), scatter)
    return {
        name: Fit(*(float(column[j]) for column in columns)) if proof.judged[j] else Fit()
        for j, name in enumerate(robot.joint_names)
    }


def _unexplained(robot: Robot, s: Structure, recordings: Sequence[str]) -> Unexplained:
    name, unit = robot.joint_names[s.joint], robot.torque_units[s.joint]
    where = f"{name}: {s.rms:.3g} {unit} RMS that no effect explains; it depends on {s.variable}"
    mostly = _mostly(robot, s.axis, s.where, s.when, recordings)
    return Unexplained((name,), "; ".join([where, *mostly]), s.share, s.p_value)


def _mostly(robot: Robot, axis: Axis, where: Where | None, when: When | None, recordings: Sequence[str]) -> list[str]:
    """Where and when most of an error is, as far as that is told."""
    out = []
    if where:
        place = views.range_of(robot, axis, where.begin, where.end)
        out.append(f"{100 * where.share:.0f} % of the squared error is at a {place}")
    if when:
        time = f"from {when.begin:.4g} to {when.end:.4g} s of {recordings[when.recording]}"
        out.append(f"{100 * when.share:.0f} % of the squared error is {time}")
    return out


def _mostly_of_joint(of: Found, j: int) -> list[str]:
    """Where and when most of what the corrected model leaves of a joint is."""
    stretches, axis = of.ex.data.stretches, Axis("q", j)
    left = [np.where(u, x, 0.0)[:, j] for u, x in zip(of.proof.use, of.proof.corrected, strict=True)]
    when = shortest(stretches, left, j)
    where = None if when else narrowest(stretches, left, axis)  # in a short time few positions are visited
    return _mostly(of.data.robot, axis, where, when, of.data.names)


def _notes(of: Found, missing: dict[int, str], torque: np.ndarray, open_: Sequence[OpenEffect]) -> list[str]:
    """All notes, what matters most first; `torque` is the size of the joints' torque, shape (n,)."""
    robot, judged = of.data.robot, of.proof.judged
    gap = None if of.beyond is None else native_gap(of.beyond, of.data.band)
    lacking = [(n.effect.title, n.joints) for n in of.model.named if n.effect.export.not_in_mjcf]
    channels = timing_notes(of.ex) if of.servo is None else [
        *motion_notes(robot, of.fit), *gain_notes(of.ex, of.servo), *command_notes(of.ex, of.servo)]
    open_joints = [f"{'; '.join([x[0].upper() + x[1:], *_mostly_of_joint(of, j)])}." for j, x in missing.items()]
    recorded = [s.recording for s in of.ex.data.stretches]
    scatter, told = np.hypot(*of.sensors), {*missing, *(s.joint for s in (*of.rest, *of.slight))}
    return [
        *of.data.servo_notes, *link_encoder_notes(of.data, of.model, of.findings),
        *harmful_notes(robot, of.harmful), *open_joints,
        *recording_notes(robot, of.proof, recorded, of.data.names, scatter, torque),
        *open_notes(open_), *rest_notes(robot, of.proof, scatter), *slight_notes(robot, of.slight),
        *left_notes(robot, of.proof, scatter, torque, told, partial(_mostly_of_joint, of)),
        *unproved_notes(of.ex, of.seen, servo=of.servo is not None), *inertial_notes(of.ex, of.uncertainty),
        *friction_notes(of.ex, of.data.names, judged),
        *channels, *discrepancy_notes(of.ex, of.proof), *coarse_positions(robot, *of.sensors, judged), *of.data.notes,
        *notes(of.data, of.uncertainty, judged), *gap_notes(robot, gap, torque, lacking),
    ]  # fmt: skip
