"""The proof in motion of a diagnosis, and a fit to the motion: each fold's models on what the fold left out."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from irb140_jax.mismatch.corrected.fitted import fitted_model
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.corrected.native import beyond_file
from irb140_jax.mismatch.motion.fit import MotionFit, fit_to_motion
from irb140_jax.mismatch.motion.laws import without_those
from irb140_jax.mismatch.motion.proof import proof_in_motion
from irb140_jax.mismatch.motion.windows import Span, spans
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.held_out import HeldOut, recordings_of_blocks


def fitted_in_motion(
    data: Comparison, ex: Explanation, proof: HeldOut, loose: tuple[int, ...], model: CorrectedModel
) -> MotionFit | None:
    """A fit to the positions of servos; None where it is of no use, or nothing is named that could be wrong.

    Args:
        data: Model and recordings, with drives as they were found.
        ex: The explanation.
        proof: The fits without each fold.
        loose: Candidates of the refit: inertials wrong beyond their stated uncertainty.
        model: The corrected model of the torque.
    """
    if data.servo is None or not model.named or any(r.payload for r in data.smooth):
        return None
    of_fold, blocks = _of_folds(data, ex, proof, loose), [fold.blocks for fold in proof.folds]
    return fit_to_motion(data, ex, of_fold, blocks, _spans(ex, proof), model)


def motion_unseen(
    data: Comparison, ex: Explanation, proof: HeldOut, loose: tuple[int, ...], model: CorrectedModel,
    beyond: Sequence[np.ndarray] | None, fit: MotionFit | None = None,
) -> dict[str, Any] | None:  # fmt: skip
    """What motion.json holds; None where a joint's torque was lost, so that nothing can be simulated.

    Args:
        data: Model and recordings.
        ex: The explanation.
        proof: The fits without each fold.
        loose: Candidates of the refit: inertials wrong beyond their stated uncertainty.
        model: The corrected model, of all recordings.
        beyond: What corrected.xml can't hold of it along each recording, from `beyond_file`; None where unknown.
        fit: The fit to the motion, whose models those are then.
    """
    lost = any(r.torque_lost is not None and r.torque_lost.any() for r in data.recordings if not r.is_servo_log)
    if beyond is None or lost:
        return None
    if (bare := without_those(model)) is not model:
        beyond = beyond_file(bare, data.smooth, [torques_along(bare, r).corrected for r in data.smooth])
        assert beyond is not None  # or it would have been None before
    of_fold = _of_folds(data, ex, proof, loose)
    own = (lambda k: fit.of_fold.get(k) or of_fold(k)) if fit else of_fold
    return proof_in_motion(data.robot, own, _spans(ex, proof), data.smooth, beyond)


def _of_folds(
    data: Comparison, ex: Explanation, proof: HeldOut, loose: tuple[int, ...]
) -> Callable[[int], CorrectedModel]:
    """From the number of a fold to the model of the torque that has not seen it."""

    def of_fold(k: int) -> CorrectedModel:
        fold = proof.folds[k]
        return fitted_model(ex, fold.refit, loose, fold.corrected, fold.scale, data.band)

    return of_fold


def _spans(ex: Explanation, proof: HeldOut) -> list[Span]:
    """Stretches of time that the folds leave out."""
    return spans([fold.blocks for fold in proof.folds], recordings_of_blocks(ex), [s.t for s in ex.data.stretches])
