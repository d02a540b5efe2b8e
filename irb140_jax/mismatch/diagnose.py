"""The whole path: recordings and a model in; verdict, findings, corrected model and held-out proof out."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from irb140_jax.effects import Effect
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.effects.torque_gain import EFFECT as TORQUE_GAIN
from irb140_jax.errors import InputError, RecordingError
from irb140_jax.mismatch.columns.torques import Named, scaled
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.corrected.native import beyond_file, native_gap
from irb140_jax.mismatch.experiment_design.nothing_compared import all_open
from irb140_jax.mismatch.experiment_design.undecided import undecided
from irb140_jax.mismatch.motion import proof_in_motion
from irb140_jax.mismatch.motion.windows import spans
from irb140_jax.mismatch.output import views
from irb140_jax.mismatch.output.findings import findings, ranking, torque_scale_finding, torque_scale_odds
from irb140_jax.mismatch.output.notes import discrepancy_notes, friction_notes, gap_notes, inertial_notes, notes
from irb140_jax.mismatch.output.provenance import provenance
from irb140_jax.mismatch.output.servos import (
    command_notes,
    harmful_discrepancy,
    harmful_notes,
    of_servos,
    servo_sentence,
    without_negligible,
)
from irb140_jax.mismatch.output.summary import inertial_views, summary, unexplained_entry, verdict
from irb140_jax.mismatch.regression.discrepancy import Discrepancy
from irb140_jax.mismatch.regression.gaussian import Posterior
from irb140_jax.mismatch.regression.nuisances import feature_coefficients
from irb140_jax.mismatch.regression.sensor_noise import coarse_positions, scatter_by_sensor
from irb140_jax.mismatch.regression.sufficient_data import comparable, too_little, usable_rows
from irb140_jax.mismatch.result import Result
from irb140_jax.mismatch.selection.explain import explain
from irb140_jax.mismatch.selection.explanation import Explanation, fitted
from irb140_jax.mismatch.selection.selected import NAMED
from irb140_jax.mismatch.validation.held_out import HeldOut, Refit, held_out, recordings_of_blocks, refitted
from irb140_jax.mismatch.validation.testable import Site, not_testable, reference, visibility
from irb140_jax.mismatch.validation.undecided_joints import torque_size, undecidable
from irb140_jax.mismatch.validation.unexplained import Unexplained, unexplained
from irb140_jax.recordings.channels import with_lost_torque_marked
from irb140_jax.recordings.check import MIN_SAMPLES, MOVING
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repeats import without_copies
from irb140_jax.recordings.servo import with_servo_torques
from irb140_jax.robot import Robot

SCHEMA = 2  # of diagnosis.json


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
    # Thousands of small solves: a second BLAS thread costs more in waking up than it does.
    with threadpool_limits(1, "blas"):
        return _diagnosed(robot, recordings, config or DiagnoseConfig(), progress)


def _diagnosed(
    robot: Robot, recordings: Sequence[Recording], config: DiagnoseConfig, progress: Callable[[str], None]
) -> Result:
    moves = np.where(robot.is_slide, MOVING[1], MOVING[0])
    recordings, servo_notes = with_servo_torques(recordings, robot, config.inertial_uncertainty)
    recordings = [with_lost_torque_marked(_finite(r), moves, robot) for r in recordings]
    recordings, twice = without_copies(recordings)
    progress("smoothing and differentiating the positions")
    band, recordings, smooth, again = comparable(robot, recordings)
    if reason := too_little(smooth, band):
        return _without_comparison(robot, recordings, smooth, band, config, reason, [*servo_notes, *twice, *again])
    parts = scatter_by_sensor(robot, recordings, smooth, band)
    scatter = np.hypot(*parts)
    ex = explain(robot, smooth, band, config.effects, config.inertial_uncertainty, scatter, progress)
    ex = without_negligible(ex, smooth[0].servo)
    ex = dataclasses.replace(ex, scaled=torque_scale_odds(ex)[1] >= NAMED)
    progress("proving on data that the fit did not see")
    refit = refitted(ex)
    proof = held_out(ex, refit)
    progress("looking for structure that no effect explains")
    rest = unexplained(ex, proof)
    found = findings(robot, ex)
    model = _model(robot, ex, refit, proof, band, config.known_joints or robot.joint_names)
    model = dataclasses.replace(model, drive=recordings[0].drive)
    logged = [s.tau for s in ex.data.stretches]
    laws = dataclasses.replace(model, discrepancy=None)  # which the file can't hold, as a note of its own says
    by_laws = [torques_along(laws, r).corrected for r in smooth]
    corrected = [band.apply(torque) for torque in by_laws]
    if smooth[0].servo is not None and model.discrepancy is not None:
        harmful = harmful_discrepancy(model, smooth, corrected)
        servo_notes += harmful_notes(robot, harmful)
        proof = proof.without_discrepancy(harmful)
        model = dataclasses.replace(model, discrepancy=model.discrepancy.on(~harmful))
    lacking = list(dict.fromkeys(n.effect.title for n in model.named if n.effect.export.not_in_mjcf))
    beyond = beyond_file(model, smooth, by_laws)
    gap = None if beyond is None else native_gap(beyond, band)
    gap = gap_notes(robot, gap, torque_size(proof, logged), lacking)
    matters = reference(ex.lib, ex.scales, band.rate)
    seen = visibility(ex, matters)
    usual = notes(robot, smooth, band, config.inertial_uncertainty, usable_rows(smooth, band), proof.judged)
    origin = provenance(robot, recordings, config.options, config.words)
    missing = undecidable(robot, proof, logged, scatter, band)
    open_joints = [f"{sentence[0].upper()}{sentence[1:]}." for sentence in missing.values()]
    unnamed = inertial_notes(ex, config.inertial_uncertainty) + friction_notes(ex, [r.source for r in smooth])
    unnamed += discrepancy_notes(robot, proof) + command_notes(ex, smooth[0].servo)
    coarse = coarse_positions(robot, *parts, proof.judged)
    said = [*servo_notes, *open_joints, *unnamed, *coarse, *twice, *again, *usual, *gap]
    every = of_servos(ex, smooth[0].servo, [*found, *torque_scale_finding(robot, ex)])
    diagnosis = _document(robot, ex, proof, scatter, every, rest, missing, seen, said, origin)
    diagnosis["summary"] += servo_sentence(recordings)
    open_ = undecided(ex, found, seen, matters, band, config.inertial_uncertainty)
    progress("simulating motions that the fit did not see")
    motion = _motion(robot, ex, proof, refit.loose, band, smooth, recordings, beyond)
    return Result(diagnosis, model, _views(robot, ex, proof, recordings, said) | {"motion": motion}, open_)


def _motion(
    robot: Robot, ex: Explanation, proof: HeldOut, loose: tuple[int, ...], band: Band, smooth: Sequence[Conditioned],
    recordings: Sequence[Recording], beyond: Sequence[np.ndarray] | None,
) -> dict[str, Any] | None:  # fmt: skip
    """The proof in motion; None where a joint's torque was lost or never logged, so that nothing can be simulated."""
    lost = any(r.torque_lost is not None and r.torque_lost.any() for r in recordings)
    if beyond is None or lost or smooth[0].servo is not None:
        return None
    unseen = spans([fold.blocks for fold in proof.folds], recordings_of_blocks(ex), [s.t for s in ex.data.stretches])

    def of_fold(k: int) -> CorrectedModel:
        fold = proof.folds[k]
        return _fitted_model(robot, ex, fold.refit, loose, fold.corrected, fold.scale, band)

    return rounded(proof_in_motion(robot, of_fold, unseen, smooth, beyond))


def _without_comparison(
    robot: Robot, recordings: Sequence[Recording], smooth: Sequence[Conditioned], band: Band, config: DiagnoseConfig,
    reason: str, repaired: list[str],
) -> Result:  # fmt: skip
    """The result where no joint could be compared: undecided, nothing refitted, and every effect open."""
    uncertainty, n = config.inertial_uncertainty, robot.n
    unjudged = notes(robot, smooth, band, uncertainty, usable_rows(smooth, band), np.zeros(n, dtype=bool))
    said = [f"{reason}.", *repaired, *unjudged]
    phi, rest_speed = np.asarray(robot.phi), np.max([r.rest_speed for r in smooth], axis=0)
    model = CorrectedModel(robot, phi, phi, (), band, rest_speed, config.known_joints or robot.joint_names)
    questions, seen = all_open(robot, config.effects, smooth, band, uncertainty)
    columns = ("rmse_nominal", "rmse_refit", "rmse_corrected", "noise_floor")
    many, joints = len(recordings), f"{n} joint{'s' if n != 1 else ''}"
    diagnosis = rounded({
        "schema": SCHEMA, "verdict": "undecided", "findings": [], "unexplained": [],
        "not_testable": not_testable(robot, set(), seen, config.effects),
        "fit": {name: dict.fromkeys(columns) for name in robot.joint_names},
        "notes": said,
        "provenance": provenance(robot, recordings, config.options, config.words),
        "summary": f"{many} recording{'s' if many != 1 else ''} of {joints} can't tell whether the model leaves "
                   f"anything out. {reason}.",
    })  # fmt: skip
    views = {"joints": list(robot.joint_names), "recordings": [r.source for r in recordings], "notes": said}
    empty = {"maps": {}, "motions": [], "ranking": [], "residual_spectrum": {}, "inertials": []}
    return Result(diagnosis, model, views | empty, questions)


def _finite(recording: Recording) -> Recording:
    """The recording, if it is made of numbers, and of as many as a file must hold.

    Raises:
        RecordingError: It isn't.
    """
    if len(recording.t) < MIN_SAMPLES:
        raise RecordingError(
            f"{recording.source}: too short: {len(recording.t)} samples; allowed is {MIN_SAMPLES} samples at least: "
            "record a longer motion"
        )
    for name in ("t", "q", "tau"):
        bad = np.argwhere(~np.isfinite(getattr(recording, name)))
        if len(bad):
            column = name if name == "t" else f"{name}.{recording.joint_names[bad[0][1]]}"
            raise RecordingError(
                f"{recording.source}: {column}, sample {bad[0][0] + 1}: not a finite number; a diagnosis needs time, "
                "positions and torque in every sample: read the file with read_recording, which mends a few gaps"
            )
    return recording


def _model(
    robot: Robot, ex: Explanation, refit: Refit, proof: HeldOut, band: Band, known: tuple[str, ...]
) -> CorrectedModel:
    post, scale, own = ex.prediction()
    model = _fitted_model(robot, ex, refit.posterior(), refit.loose, post, scale, band)
    discrepancy = None
    if proof.carried.any():
        discrepancy = Discrepancy(ex.scales, feature_coefficients(ex.extra[0], own, proof.carried))
    return dataclasses.replace(model, known_joints=known, discrepancy=discrepancy)


def _fitted_model(
    robot: Robot, ex: Explanation, refit: Posterior, loose: tuple[int, ...], post: Posterior, scale: float, band: Band
) -> CorrectedModel:
    """The model of a posterior: of all data, or of what is left of them without a fold."""
    refitted_shift, _, _ = fitted(ex.data, refit, loose, ex.factor)
    dphi, members, amplitudes = fitted(ex.data, post, ex.chosen, ex.factor)
    phi = np.asarray(robot.phi)
    named = [Named(c.effect, c.joints, c.variant, w, c.shape) for c, w in zip(members, amplitudes, strict=True)]
    phi_refit, phi_corrected = (phi + shift.reshape(phi.shape) for shift in (refitted_shift, dphi))
    rest_speed = ex.scales.rest_speed
    return CorrectedModel(robot, phi_refit, phi_corrected, scaled(robot.n, named, scale), band, rest_speed)


def _document(
    robot: Robot, ex: Explanation, proof: HeldOut, scatter: np.ndarray, found: list[dict[str, Any]],
    rest: list[Unexplained], missing: dict[int, str], seen: dict[Site, tuple[float, int]], said: list[str],
    origin: dict[str, Any],
) -> dict[str, Any]:  # fmt: skip
    fit, effects = _fit(robot, proof, scatter), [TORQUE_GAIN, *ex.lib.effects.values()]
    titles = {effect.slug: effect.title for effect in effects}
    inertials = inertial_views(robot, ex)
    kind = verdict(ex, proof, found, rest, missing)
    sources = [r["file"] for r in origin["recordings"]]
    return rounded({
        "schema": SCHEMA,
        "verdict": kind,
        "findings": found,
        "unexplained": [unexplained_entry(robot, u) for u in rest],
        "not_testable": not_testable(robot, {f["effect"] for f in found}, seen, effects),
        "fit": fit,
        "notes": said,
        "provenance": origin,
        "summary": summary(kind, found, rest, fit, inertials, robot, sources, [*missing.values()], titles),
    })  # fmt: skip


def _fit(robot: Robot, proof: HeldOut, scatter: np.ndarray) -> dict[str, dict[str, float | None]]:
    """Errors on unseen data and what the sensors scatter by, by joint; none where a joint was not judged."""
    columns = {
        "rmse_nominal": proof.rmse(proof.nominal), "rmse_refit": proof.rmse(proof.refit),
        "rmse_corrected": proof.rmse(proof.corrected), "noise_floor": scatter,
    }  # fmt: skip
    return {
        name: {key: float(column[j]) if proof.judged[j] else None for key, column in columns.items()}
        for j, name in enumerate(robot.joint_names)
    }


def _views(
    robot: Robot, ex: Explanation, proof: HeldOut, recordings: Sequence[Recording], said: list[str]
) -> dict[str, Any]:
    names = [r.source for r in recordings]
    return rounded({
        "joints": list(robot.joint_names),
        "recordings": names,
        "maps": views.maps(robot, ex, proof),
        "motions": views.motions(robot, ex, proof, names),
        "ranking": ranking(robot, ex),
        "residual_spectrum": views.spectra(robot, ex, proof),
        "inertials": inertial_views(robot, ex),
        "notes": said,
    })  # fmt: skip


def rounded(x: Any, digits: int = 6) -> Any:
    """Numbers to `digits` significant digits, so that the same input gives the same file."""
    if isinstance(x, dict):
        return {k: rounded(v, digits) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [rounded(v, digits) for v in x]
    if isinstance(x, float | np.floating):
        value = float(x)
        return float(f"{value:.{digits}g}") if math.isfinite(value) else None
    return x.item() if isinstance(x, np.generic) else x
