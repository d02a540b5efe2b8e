"""Keeping away from singular poses: the condition number as a penalty (equations 32 and 33)."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.kinematics import cross, jacobian
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, Scalar

Form = Literal["log", "hinge", "sigmoid"]
# Smallest det(J J^T) [m^6] told from zero: kappa stays below some 1e8, so that its logarithm has a gradient.
FLAT = 1e-22


def frobenius_condition_number(robot: Robot, q: Joints) -> Scalar:
    """Condition number of the tool's translation in the Frobenius norm, kappa = ||J|| ||J^+||, without an SVD.

    With A = J J^T it is sqrt(tr A tr A^-1), and tr A^-1 = ((tr A)^2 - tr A^2) / (2 det A) for three rows.  It lies
    between that of the 2-norm and three times it; at best it is 3.

    Args:
        robot: Arm with n >= 3 joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        kappa, shape (); some 1e8 at a singularity.

    Source: equation 32 of the study, which does not say which norm; this one is smooth.
    """
    J = jacobian(robot, q)[:3]
    A = J @ J.T
    trace, square = jnp.trace(A), jnp.sum(A * A)
    det = A[0] @ cross(A[1], A[2])
    return jnp.sqrt(0.5 * trace * (trace**2 - square) / jnp.maximum(det, FLAT))


class ConditionPenalty(eqx.Module):
    """What a pose costs beyond a threshold of its condition number.

    The study's words are "a penalizing function influenced by the activation dynamics and the condition number"; its
    threshold is lost, and so is its form:

    - "log", weight max(0, log(kappa / threshold)): ours; pulls evenly, however near the pose is to a singular one;
    - "hinge", weight max(0, kappa / threshold - 1): the few samples nearest to a singularity outweigh all others;
    - "sigmoid", weight sigma(kappa / threshold - 1): lets go of those samples.

    Attributes:
        weight: Cost beside the position's, [m] where that is a mean absolute error, [m^2] a mean square.
        threshold: Condition number in the Frobenius norm from which it counts.
        form: One of the above.
    """

    weight: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1e-3)
    threshold: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=20.0)
    form: Form = eqx.field(static=True, default="log")

    def __call__(self, kappa: Scalar) -> Scalar:
        """Cost of one pose."""
        beyond = kappa / self.threshold
        if self.form == "log":
            return self.weight * jnp.maximum(jnp.log(beyond), 0.0)
        if self.form == "hinge":
            return self.weight * jnp.maximum(beyond - 1.0, 0.0)
        return self.weight * jax.nn.sigmoid(beyond - 1.0)
