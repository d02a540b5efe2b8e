"""How close a pose is to a singular one (equation 32)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.kinematics.jacobian import jacobian
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, Scalar


def singular_values(robot: Robot, q: Joints) -> Float[Array, " k"]:
    """Singular values of the geometric Jacobian, largest first.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        min(6, n) values; metres and radians stand side by side, so they depend on the unit of length.
    """
    return jnp.linalg.svd(jacobian(robot, q), compute_uv=False)


def condition_number(robot: Robot, q: Joints) -> Scalar:
    """Condition number of the Jacobian in the 2-norm, kappa = ||J|| ||J^-1|| = s_max / s_min.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        kappa >= 1, shape (); infinite at a singularity.

    Source: equation 32 of the study, which does not say which norm.
    """
    s = singular_values(robot, q)
    smallest = jnp.where(s[-1] == 0.0, 1.0, s[-1])
    return jnp.where(s[-1] == 0.0, jnp.inf, s[0] / smallest)
