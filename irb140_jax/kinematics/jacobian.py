"""Geometric Jacobians (equations 4 to 7, 11, 12).

All follow from one fact.  With z_j the axis of joint j and p_j its origin, joint j moves a point p of a later link by
z_j x (p - p_j) if it is a hinge and by z_j if it is a slide.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.kinematics.forward import link_frames
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import moves
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints


class LinkJacobians(NamedTuple):
    """Jacobians of every link's centre of mass, in base axes.

    Attributes:
        linear: Jv, velocity of link i's centre per speed of joint j [m or 1], shape (n links, n joints, 3).
        angular: Jw, its angular velocity per speed of joint j [1 or 0], shape (n links, n joints, 3).
        rotation: Orientation of the links, shape (n, 3, 3).
        centre: Centres of mass [m], shape (n, 3).
    """

    linear: Float[Array, "n n 3"]
    angular: Float[Array, "n n 3"]
    rotation: Float[Array, "n 3 3"]
    centre: Float[Array, "n 3"]


@shape_checked
def jacobian(robot: Robot, q: Joints) -> Float[Array, "6 n"]:
    """Geometric Jacobian of the tool in world axes, [v; w] = J(q) qd.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        J, velocity of the tool's origin over its angular velocity, shape (6, n).

    Source: equations 4 to 6 of the study; Siciliano et al., Robotics (2009), equation 3.30.
    """
    rotation, origin = link_frames(robot, q)
    axis = _rotate(rotation, robot.axis)
    tool = origin[-1] + rotation[-1] @ robot.tool_position
    slide = np.array(robot.is_slide)[:, None]
    linear = jnp.where(slide, axis, cross(axis, tool - origin))
    angular = jnp.where(slide, 0.0, axis)
    if not robot.is_chain:  # joints of other branches don't move the tool
        linear, angular = (jnp.where(moves(robot.parent)[-1][:, None], x, 0.0) for x in (linear, angular))
    return jnp.concatenate([robot.base_rotation @ linear.T, robot.base_rotation @ angular.T])


def joint_velocities(robot: Robot, q: Joints, twist: Float[Array, " 6"]) -> Joints:
    """Joint speeds that move the tool as asked, qd = J^+ [v; w]; the inverse J^-1 where the arm has six joints.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).
        twist: Velocity of the tool's origin [m/s] over its angular velocity [rad/s], world axes, shape (6,).

    Returns:
        qd [rad/s or m/s], shape (n,); grows without bound near a singularity, the formula has no damping.

    Source: equation 7 of the study.
    """
    J = jacobian(robot, q)
    return jnp.linalg.solve(J, twist) if robot.n == 6 else jnp.linalg.lstsq(J, twist)[0]


def link_jacobians(robot: Robot, q: Joints) -> LinkJacobians:
    """Jacobians of the links' centres of mass: z_j x (p_ci - p_j) and z_j where joint j moves link i, else 0.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Source: equations 11 and 12 of the study, with a column z_j over 0 for a slide.
    """
    rotation, origin = link_frames(robot, q)
    axis = _rotate(rotation, robot.axis)
    centre = origin + _rotate(rotation, robot.com)
    moved, slide = _masks(robot)
    lever = centre[:, None, :] - origin[None, :, :]
    linear = jnp.where(moved, jnp.where(slide, axis, cross(axis[None], lever)), 0.0)
    angular = jnp.where(moved & ~slide, axis[None], 0.0)
    return LinkJacobians(linear, angular, rotation, centre)


def cross(a: Float[Array, "*#batch 3"], b: Float[Array, "*#batch 3"]) -> Float[Array, "*batch 3"]:
    """Cross product over the last axis.

    Args:
        a: Left vectors, shape (..., 3).
        b: Right vectors, shape (..., 3).
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return jnp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _rotate(rotation: Float[Array, "n 3 3"], v: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Vectors from link axes to base axes, shape (n, 3)."""
    return jnp.sum(rotation * v[:, None, :], axis=-1)


def _masks(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Whether joint j moves link i, shape (n, n, 1), and whether joint j is a slide, shape (1, n, 1)."""
    return moves(robot.parent)[:, :, None], np.array(robot.is_slide)[None, :, None]
