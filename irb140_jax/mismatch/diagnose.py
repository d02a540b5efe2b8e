"""The whole path: recordings and a model in; verdict, findings, corrected model and held-out proof out."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from irb140_jax.allocator import give_back
from irb140_jax.compilation_cache import make_room_for_programs
from irb140_jax.effects import Effect
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from irb140_jax.mismatch.corrected.fitted import discrepancy_carried, fitted_model
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.corrected.native import beyond_file
from irb140_jax.mismatch.experiment_design.nothing_compared import all_open
from irb140_jax.mismatch.experiment_design.undecided import undecided
from irb140_jax.mismatch.motion import MotionFit, fitted_in_motion, motion_unseen
from irb140_jax.mismatch.output.document import (
    Found,
    document,
    document_of_nothing,
    report_views,
    with_joints_blocked,
    with_time_left_out,
)
from irb140_jax.mismatch.output.findings import findings
from irb140_jax.mismatch.output.provenance import provenance
from irb140_jax.mismatch.output.servos import by_known_payload, harmful_discrepancy, without_negligible
from irb140_jax.mismatch.output.store import Result
from irb140_jax.mismatch.output.views import Views
from irb140_jax.mismatch.regression.sensor_noise import scatter_by_sensor
from irb140_jax.mismatch.regression.sufficient_data import Comparison, comparison, payloads_taken_off, too_little
from irb140_jax.mismatch.result import Diagnosis
from irb140_jax.mismatch.selection.explain import explain
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.blocked import Blocked, blocked
from irb140_jax.mismatch.validation.held_out import HeldOut, Refit, held_out, refitted, unproved
from irb140_jax.mismatch.validation.testable import reference, visibility
from irb140_jax.mismatch.validation.undecided_joints import made_worse
from irb140_jax.mismatch.validation.unexplained import Structure, unexplained
from irb140_jax.mismatch.validation.unexplained_time import common_time, without
from irb140_jax.recordings.drive import PAYLOAD
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot


@dataclasses.dataclass(frozen=True)
class DiagnoseConfig:
    """Options of a diagnosis.

    Attributes:
        inertial_uncertainty: Relative standard deviation of the model's inertial parameters.
        effects: The library; by default every effect of the catalogue.  Others may stand beside them or in their place.
        words: What the command line said beside the recordings and the uncertainty, to be kept in the diagnosis:
            `--robot arm.xml`.
        known_joints: Every joint of the model's file, where the robot is a part of it; see `CorrectedModel`.
    """

    inertial_uncertainty: float = 0.05
    effects: tuple[Effect, ...] = tuple(CATALOGUE.values())
    words: tuple[str, ...] = ()
    known_joints: tuple[str, ...] = ()

    def __post_init__(self):
        for effect in self.effects:
            if not isinstance(effect, Effect):
                raise InputError(f"effects: got {effect!r}; allowed are `Effect` objects, as `CATALOGUE` holds them")
        slugs = [effect.slug for effect in self.effects]
        if twice := {slug for slug in slugs if slugs.count(slug) > 1}:
            raise InputError(f"effects: {', '.join(sorted(twice))} given twice; the search tells them by their slugs")

    @property
    def options(self) -> dict[str, Any]:
        """The options by name, as they are kept in the diagnosis."""
        everything = set(self.effects) == set(CATALOGUE.values())
        effects = "all" if everything else [e.slug for e in self.effects]
        return {"inertial_uncertainty": self.inertial_uncertainty, "effects": effects}


@dataclasses.dataclass(frozen=True)
class _Task:
    """What is to be diagnosed.

    Attributes:
        robot: The nominal model.
        recordings: Of this robot.
        config: Options.
        progress: Told what is being done, a few words at a time.
        whole: How long all was recorded [s] where some time is left out already, else zero.
    """

    robot: Robot
    recordings: Sequence[Recording]
    config: DiagnoseConfig
    progress: Callable[[str], None]
    whole: float

    def of(self, recordings: Sequence[Recording], recorded: float) -> "_Task":
        """The same of other rows, where so much had been recorded [s]."""
        return dataclasses.replace(self, recordings=recordings, whole=max(self.whole, recorded))


class Corrected(NamedTuple):
    """A corrected model and how it fares.

    Attributes:
        data: The recordings, those of commands with the torque of the drives that were found.
        model: The model.
        proof: Its errors on unseen data.
        harmful: Joints of servos whose discrepancy is left out of both because it makes the error larger, shape (n,).
        by_laws: The model's torque without any discrepancy along each recording, (T, n) [N m or N].
    """

    data: Comparison
    model: CorrectedModel
    proof: HeldOut
    harmful: np.ndarray
    by_laws: list[np.ndarray]


def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    config: DiagnoseConfig | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Result:
    """Locate, name, model and prove what a rigid-body model leaves out.

    Args:
        robot: The nominal model.
        recordings: At least one, of this robot.
        config: Options.
        progress: Told what is being done, a few words at a time.

    Returns:
        The result; the same input gives the same result to 6 significant digits.

    Raises:
        RecordingError: A recording is too short for any filter, or holds what is no number.
    """
    make_room_for_programs()  # hundreds of robots in one process would crash it
    # Thousands of small solves: a second BLAS thread costs more in waking up than it does.
    with threadpool_limits(1, "blas"):
        return _diagnosed(_Task(robot, recordings, config or DiagnoseConfig(), _giving_back(progress), whole=0.0))


def _giving_back(progress: Callable[[str], None]) -> Callable[[str], None]:
    """What is told of each stage, after memory that the last one left free was given back."""

    def told(stage: str) -> None:
        give_back()
        progress(stage)

    return told


def _diagnosed(task: _Task) -> Result:
    """See `diagnose`."""
    robot, progress = task.robot, task.progress
    data = comparison(robot, task.recordings, task.config.inertial_uncertainty, progress)
    if reason := too_little(data.smooth, data.band):
        return _nothing_compared(data, task.config, reason)
    stops = blocked(robot, data.smooth)
    if stops and (others := _other_times(stops, data, task)):
        progress("once more, without the times at which something stops a joint")
        result = _diagnosed(task.of(others, data.seconds))
        if result.diagnosis.verdict != "undecided":
            blocks = with_joints_blocked(result.diagnosis, stops, robot, left_out=True)
            return _of_all(data, task.config, result, blocks)
    sensors = scatter_by_sensor(robot, data.recordings, data.smooth, data.band)
    ex = _explained(data, sensors, task)
    if data.servo is not None and any(ex.payloads) and PAYLOAD not in data.servo.drive.said:
        progress("once more, in torque of the Kp that the known payload shows")
        known = by_known_payload(ex, data.servo, task.recordings, data.recordings)
        return _diagnosed(dataclasses.replace(task, recordings=known))
    return _proved(data.placed(ex.payloads), ex, sensors, stops, task)


def _proved(
    data: Comparison, ex: Explanation, sensors: tuple[np.ndarray, np.ndarray], stops: Sequence[Blocked], task: _Task
) -> Result:
    """The result of an explanation, or of another one where the motion of servos speaks against what it names."""
    robot, config, progress = task.robot, task.config, task.progress
    progress("proving on data that the fit did not see")
    refit = refitted(ex)
    ex = ex if data.servo else dataclasses.replace(ex, rigid=refit.posterior)
    logged, left = [s.tau for s in ex.data.stretches], held_out(ex, refit)
    corrected = _corrected(data, ex, refit, left, config)
    # Without them others may make it worse, too.
    harms = lambda proof: made_worse(proof, logged, np.hypot(*sensors), data.servo is None)  # noqa: E731
    while (fewer := ex.not_only_on(harms(corrected.proof))).chosen != ex.chosen:
        ex, left = fewer, held_out(fewer, refit)
        corrected = _corrected(data, ex, refit, left, config)
    progress("looking for structure that no effect explains")
    rest, slight = unexplained(ex, left, np.hypot(*sensors))
    if (result := _without_unexplained_time(data, ex, left, rest, task)) is not None:
        return result
    if data.servo is not None:
        progress("fitting the model to the motion of the servos")
    stated, fit = data.servo, fitted_in_motion(corrected.data, ex, left, refit.loose, corrected.model)
    if fit and ex.without_sites and (barred := [site for site in fit.unneeded if site not in ex.unproved]):
        progress("searching sets of explanations without what the motion speaks against")
        fewer = without_negligible(ex.without_sites(barred), data.servo)
        return _proved(data, fewer, sensors, stops, task)
    found = findings(robot, ex, fit.amplitudes if fit else {}, rest)
    data, model, proof, harmful, by_laws = _in_motion(data, ex, corrected, left, fit) if fit else corrected
    bare = data
    if any(r.payload for r in data.smooth):  # the file that is written holds none
        bare = payloads_taken_off(data)
        by_laws = [torques_along(model, r).corrected for r in bare.smooth]
    beyond = beyond_file(model, bare.smooth, by_laws)
    matters = reference(ex.lib, ex.scales, data.band.rate)
    seen = visibility(ex, matters)
    of = Found(data, config.inertial_uncertainty, sensors, ex, proof, found, rest, slight, seen, model, harmful, beyond,
               stated, fit)  # fmt: skip
    diagnosis = document(of, provenance(robot, data.recordings, config.options, config.words))
    diagnosis = with_joints_blocked(diagnosis, stops, robot, left_out=False)
    open_ = undecided(ex, found, seen, matters, data.band, config.inertial_uncertainty)
    progress("simulating motions that the fit did not see")
    motion = motion_unseen(bare, ex, proof, refit.loose, model, beyond, fit)
    return Result(diagnosis, model, report_views(of, diagnosis.notes, motion), open_)


def _other_times(stops: Sequence[Blocked], data: Comparison, task: _Task) -> list[Recording] | None:
    """The recordings without the times at which something stops a joint; None where less than half of all stays."""
    times = [(data.names[i], begin, end) for s in stops for i, begin, end in s.times]
    kept = data.seconds - sum(end - begin for _, begin, end in times)
    return without(task.recordings, times) if 2.0 * kept > max(task.whole, data.seconds) else None


def _of_all(data: Comparison, config: DiagnoseConfig, result: Result, diagnosis: Diagnosis) -> Result:
    """The result of some of the time of recordings with a diagnosis that says so, as one of the whole recordings."""
    origin = provenance(data.robot, data.recordings, config.options, config.words)
    diagnosis = dataclasses.replace(diagnosis, provenance=origin)
    views = dataclasses.replace(result.views, notes=diagnosis.notes)
    return dataclasses.replace(result, diagnosis=diagnosis, views=views)


def _without_unexplained_time(
    data: Comparison, ex: Explanation, proof: HeldOut, rest: Sequence[Structure], task: _Task
) -> Result | None:
    """The result of all but a short time in which nothing explains most joints; None where there is no such time.

    At least half of all that was recorded stays.
    """
    when = common_time(rest, int(proof.judged.sum()), data.seconds)
    if when is None or 2.0 * (data.seconds - (when.end - when.begin)) < max(task.whole, data.seconds):
        return None
    others = without(task.recordings, [(data.names[when.recording], when.begin, when.end)])
    if others is None:
        return None
    said = f"from {when.begin:.4g} to {when.end:.4g} s of {data.names[when.recording]}"
    task.progress(f"once more, without what nothing explains {said}")
    result = _diagnosed(task.of(others, data.seconds))
    if result.diagnosis.verdict == "undecided":
        return None
    return _of_all(data, task.config, result, with_time_left_out(result.diagnosis, said, rest, data))


def _nothing_compared(data: Comparison, config: DiagnoseConfig, reason: str) -> Result:
    """The result where no joint could be compared: undecided, nothing refitted, and every effect open."""
    robot, smooth, band, uncertainty = data.robot, data.smooth, data.band, config.inertial_uncertainty
    phi, rest_speed = np.asarray(robot.phi), np.max([r.rest_speed for r in smooth], axis=0)
    model = CorrectedModel(robot, phi, phi, (), band, rest_speed, config.known_joints or robot.joint_names)
    effects = _searched(config, data)
    questions, seen = all_open(robot, effects, smooth, band, uncertainty)
    origin = provenance(robot, data.recordings, config.options, config.words)
    diagnosis = document_of_nothing(data, reason, seen, effects, uncertainty, origin)
    views = Views(robot.joint_names, tuple(data.names), notes=diagnosis.notes)
    return Result(diagnosis, model, views, questions)


def _searched(config: DiagnoseConfig, data: Comparison) -> tuple[Effect, ...]:
    """The effects that there can be in logs of this kind; what a servo lacks of its law shows where that is known."""
    known = data.servo is None or data.servo.drive.is_known
    there = (e for e in config.effects if e.place.is_in(servo=data.servo is not None))
    return tuple(e for e in there if known or not e.place.of_servos)


def _explained(data: Comparison, sensors: tuple[np.ndarray, np.ndarray], task: _Task) -> Explanation:
    """What the model leaves out, with one scale of all torques where that is probable."""
    scatter, uncertainty = np.hypot(*sensors), task.config.inertial_uncertainty
    later = lambda times: data.later(times).smooth  # noqa: E731
    effects = _searched(task.config, data)
    ex = explain(data.robot, data.smooth, data.band, effects, uncertainty, scatter, task.progress, unproved, later)
    return without_negligible(ex, data.servo)


def _corrected(
    data: Comparison, ex: Explanation, refit: Refit, proof: HeldOut, config: DiagnoseConfig
) -> Corrected:
    """The corrected model, with the discrepancy where that helps on unseen motions."""
    post, scale, own = ex.prediction()
    model = dataclasses.replace(
        fitted_model(ex, refit.posterior(), refit.loose, post, scale, data.band),
        known_joints=config.known_joints or data.robot.joint_names,
    )
    if data.servo is None:
        return _predicted(data, ex, model, proof)
    kd, late = ex.of_drives(own).T
    later = data.servo.drive.time_width * late
    model = dataclasses.replace(model, drive=data.servo.drive.found(ex.times, later, kd))
    return _predicted(data.later(ex.times, later, kd), ex, model, proof)


def _in_motion(data: Comparison, ex: Explanation, before: Corrected, proof: HeldOut, fit: MotionFit) -> Corrected:
    """The same with numbers that were fitted to the motion.

    Args:
        data: Model and recordings, with drives as they were given.
        ex: The explanation.
        before: What was found in the torque.
        proof: Errors on unseen data, as the fit to the torque left them.
        fit: The fit to the motion.
    """
    assert data.servo is not None and before.model.drive is not None
    stated, drive = data.servo.drive, fit.to_drive(before.model.drive)
    kd = np.divide(drive.kd - stated.kd, stated.kd_width, out=np.zeros_like(drive.kd), where=stated.kd_width > 0.0)
    later = drive.delay - stated.delay - ex.times.delay + fit.later
    # What commands lose in simulations, which hold no lag, is not lost again.
    lag = np.clip(ex.times.lag - fit.later, 0.0, ex.times.lag)
    times = dataclasses.replace(ex.times, lag=float(lag))
    model = dataclasses.replace(fit.model, drive=stated.found(times, later, kd))
    data = data.later(times, later, kd)
    apart = [data.band.apply(now.tau - r.tau) for now, r in zip(data.smooth, before.data.smooth, strict=True)]
    # What the torque's own numbers leave is not what these leave.
    none = proof.without_discrepancy(np.ones(data.robot.n, dtype=bool))
    return _predicted(data, ex, model, none.as_predicted([-x for x in apart]))


def _predicted(data: Comparison, ex: Explanation, model: CorrectedModel, proof: HeldOut) -> Corrected:
    """A model of laws with the discrepancy where that helps on unseen motions, and its errors there."""
    post, scale, own = ex.prediction()
    by_laws = [torques_along(model, r).corrected for r in data.smooth]
    # The errors that are told are those of the model that predicts, not of its linearisation.
    proof = proof.as_predicted(ex.beyond_columns(post, scale, by_laws, data.band))
    discrepancy, harmful = discrepancy_carried(ex, own, proof.carried), np.zeros(data.robot.n, dtype=bool)
    if data.servo is not None and discrepancy is not None:
        without = [data.band.apply(torque) for torque in by_laws]
        harmful = harmful_discrepancy(dataclasses.replace(model, discrepancy=discrepancy), data.smooth, without)
        discrepancy, proof = discrepancy.on(~harmful), proof.without_discrepancy(harmful)
    return Corrected(data, dataclasses.replace(model, discrepancy=discrepancy), proof, harmful, by_laws)
