"""Kinetic and potential energy."""

import jax.numpy as jnp

from irb140_jax.dynamics.composite import placed_links
from irb140_jax.dynamics.mass import mass_matrix
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints, Scalar


@shape_checked
def kinetic_energy(robot: Robot, q: Joints, qd: Joints) -> Scalar:
    """Kinetic energy T = 1/2 qd^T M(q) qd, rotors included.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).

    Returns:
        T [J], shape ().
    """
    return 0.5 * qd @ mass_matrix(robot, q) @ qd


@shape_checked
def potential_energy(robot: Robot, q: Joints) -> Scalar:
    """Potential energy of gravity, V = -sum_i m_i g0 . c_i, zero at the base's origin; springs are not in it.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        V [J], shape ().
    """
    return -jnp.sum(robot.mass * (placed_links(robot, q).centre @ robot.gravity))


def spring_energy(robot: Robot, q: Joints) -> Scalar:
    """Energy in the model's joint springs, 1/2 sum_i k_i (q_i - rest_i)^2.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        Energy [J], shape ().
    """
    return 0.5 * jnp.sum(robot.stiffness * (q - robot.springref) ** 2)
