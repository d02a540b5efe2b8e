"""Joint-space mass matrix by a sum of Jacobians (equations 8 and 10)."""

import jax.numpy as jnp

from irb140_jax.dynamics.composite import by_order, composite, momenta, pairs, placed_links
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import JointMatrix, Joints


@shape_checked
def mass_matrix(robot: Robot, q: Joints) -> JointMatrix:
    """Mass matrix M(q) = sum_i m_i Jv_i^T Jv_i + Jw_i^T I_i Jw_i, plus the rotors' armature on the diagonal.

    The sum over links is done first (see `composite`): M_jk = v_j . f_k + w_j . n_k where joint j
    carries joint k, and f_k, n_k are the
    momenta of all that joint k carries at its unit speed.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        M, symmetric positive definite [kg m^2, kg m or kg], shape (n, n).

    Source: equations 8 and 10 of the study; Siciliano et al., Robotics (2009), equation 7.32.
    """
    links = placed_links(robot, q)
    linear, angular = momenta(links, composite(robot, links))
    M = pairs((links.v, linear), (links.w, angular))
    return by_order(M, M.T, robot.parent) + jnp.diag(robot.armature)
