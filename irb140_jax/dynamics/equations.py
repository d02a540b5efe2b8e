"""Equations of motion from M, C and g (equation 16)."""

import jax.scipy.linalg

from irb140_jax.dynamics.coriolis import coriolis_matrix
from irb140_jax.dynamics.gravity import gravity_torque
from irb140_jax.dynamics.mass import mass_matrix
from irb140_jax.robot import Robot
from irb140_jax.types import Joints


def forward_dynamics_christoffel(robot: Robot, q: Joints, qd: Joints, tau: Joints) -> Joints:
    """Joint accelerations of the bare rigid body, qdd = M^-1 (tau - C qd - g), as the study writes them.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
        tau: Joint torques [N m or N], shape (n,); less `passive_torque`, which equation 16 does not know.

    Returns:
        qdd [rad/s^2 or m/s^2], shape (n,).

    Source: equation 16 of the study.
    """
    force = tau - coriolis_matrix(robot, q, qd) @ qd - gravity_torque(robot, q)
    return jax.scipy.linalg.solve(mass_matrix(robot, q), force, assume_a="pos")
