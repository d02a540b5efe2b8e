"""The proof in motion of a diagnosis: each fold's models on what the fold left out."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from irb140_jax.mismatch.corrected.fitted import fitted_model
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.corrected.native import beyond_file
from irb140_jax.mismatch.motion.laws import without_those
from irb140_jax.mismatch.motion.proof import proof_in_motion
from irb140_jax.mismatch.motion.windows import spans
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.held_out import HeldOut, recordings_of_blocks


def motion_unseen(
    data: Comparison, ex: Explanation, proof: HeldOut, loose: tuple[int, ...], model: CorrectedModel,
    beyond: Sequence[np.ndarray] | None,
) -> dict[str, Any] | None:  # fmt: skip
    """What motion.json holds; None where a joint's torque was lost, so that nothing can be simulated.

    Args:
        data: Model and recordings.
        ex: The explanation.
        proof: The fits without each fold.
        loose: Candidates of the refit: inertials wrong beyond their stated uncertainty.
        model: The corrected model, of all recordings.
        beyond: What corrected.xml can't hold of it along each recording, from `beyond_file`; None where unknown.
    """
    lost = any(r.torque_lost is not None and r.torque_lost.any() for r in data.recordings if not r.is_servo_log)
    if beyond is None or lost:
        return None
    if (bare := without_those(model)) is not model:
        beyond = beyond_file(bare, data.smooth, [torques_along(bare, r).corrected for r in data.smooth])
        assert beyond is not None  # or it would have been None before
    unseen = spans([fold.blocks for fold in proof.folds], recordings_of_blocks(ex), [s.t for s in ex.data.stretches])

    def of_fold(k: int) -> CorrectedModel:
        fold = proof.folds[k]
        return fitted_model(ex, fold.refit, loose, fold.corrected, fold.scale, data.band)

    return proof_in_motion(data.robot, of_fold, unseen, data.smooth, beyond)
