"""The corrected model that an explanation and the fits of its amplitudes make."""

import numpy as np

from irb140_jax.mismatch.columns.torques import Named, scaled
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.regression.discrepancy import Discrepancy
from irb140_jax.mismatch.regression.gaussian import Posterior
from irb140_jax.mismatch.regression.nuisances import feature_coefficients
from irb140_jax.mismatch.selection.explanation import Explanation, fitted
from irb140_jax.recordings.low_pass import Band


def fitted_model(
    ex: Explanation, refit: Posterior, loose: tuple[int, ...], post: Posterior, scale: float, band: Band
) -> CorrectedModel:
    """The model of a posterior: of all data, or of what is left of them without a fold.

    Args:
        ex: The explanation.
        refit: Inertials without effects.
        loose: Candidates of the refit: inertials wrong beyond their stated uncertainty.
        post: Inertials and amplitudes of the findings.
        scale: Torque scale less one.
        band: Of the comparison.
    """
    refitted_shift, _, _ = fitted(ex.data, refit, loose, ex.factor)
    dphi, members, amplitudes = fitted(ex.data, post, ex.chosen, ex.factor)
    robot = ex.lib.robot
    phi = np.asarray(robot.phi)
    named = [Named(c.effect, c.joints, c.variant, w, c.shape) for c, w in zip(members, amplitudes, strict=True)]
    phi_refit, phi_corrected = (phi + shift.reshape(phi.shape) for shift in (refitted_shift, dphi))
    rest_speed = ex.scales.rest_speed
    return CorrectedModel(robot, phi_refit, phi_corrected, scaled(robot.n, named, scale), band, rest_speed)


def discrepancy_carried(ex: Explanation, own: list[np.ndarray], carried: np.ndarray) -> Discrepancy | None:
    """The discrepancy at the joints where it helps on unseen motions; None where it does at none.

    Args:
        ex: The explanation.
        own: Amplitudes of each joint's own columns, from its `prediction`.
        carried: Which joints, shape (n,).
    """
    if not carried.any():
        return None
    return Discrepancy(ex.scales, feature_coefficients(ex.extra[0], own, carried))
