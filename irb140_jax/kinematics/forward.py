"""Forward kinematics of a `Robot`: where its links and its tool are."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints, Mat3, Pose, Scalar, Vec3


def pose(rotation: Mat3, position: Vec3) -> Pose:
    """The homogeneous transform [[R, p], [0, 1]], shape (4, 4).

    Args:
        rotation: R, shape (3, 3).
        position: p [m], shape (3,).
    """
    bottom = jnp.array([[0.0, 0.0, 0.0, 1.0]])
    return jnp.concatenate([jnp.concatenate([rotation, position[:, None]], axis=1), bottom])


def axis_rotation(axis: Vec3, angle: Scalar) -> Mat3:
    """Rotation by an angle about a unit vector, R = cos 1 + sin S(a) + (1 - cos) a a^T.

    Args:
        axis: Unit vector a, shape (3,).
        angle: Angle [rad], shape ().

    Returns:
        R, shape (3, 3).

    Source: Rodrigues' formula; Siciliano et al., Robotics (2009), equation 2.25.
    """
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    zero = jnp.zeros_like(x)
    skew = jnp.stack([zero, -z, y, z, zero, -x, -y, x, zero]).reshape(3, 3)
    return c * jnp.eye(3) + s * skew + (1.0 - c) * axis[:, None] * axis[None, :]


def link_frames(robot: Robot, q: Joints) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Orientation and origin of every link's frame in the base.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        Rotations, shape (n, 3, 3), and origins [m], shape (n, 3), in base axes.
    """
    rotations, origins = [jnp.eye(3)], [jnp.zeros(3)]  # of the base, then the links
    travel = q - robot.reference
    for i in range(robot.n):
        R, p = rotations[robot.parent[i] + 1], origins[robot.parent[i] + 1]
        p = p + _apply(R, robot.position[i])
        R = _multiply(R, robot.rotation[i])
        if robot.is_slide[i]:
            p = p + travel[i] * _apply(R, robot.axis[i])
        else:
            R = _multiply(R, axis_rotation(robot.axis[i], travel[i]))
        rotations.append(R)
        origins.append(p)
    return jnp.stack(rotations[1:]), jnp.stack(origins[1:])


@shape_checked
def link_poses(robot: Robot, q: Joints) -> Float[Array, "n 4 4"]:
    """Pose of every link's frame in the world, T_world_link.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        The poses, shape (n, 4, 4).
    """
    rotations, origins = link_frames(robot, q)
    T_world_base = pose(robot.base_rotation, robot.base_position)
    return jnp.stack([T_world_base @ pose(rotations[i], origins[i]) for i in range(robot.n)])


@shape_checked
def forward_kinematics(robot: Robot, q: Joints) -> Pose:
    """Pose of the tool in the world, T_world_tool = T_world_base T_base_n T_n_tool.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        The pose, shape (4, 4).
    """
    rotations, origins = link_frames(robot, q)
    T_world_base = pose(robot.base_rotation, robot.base_position)
    return T_world_base @ pose(rotations[-1], origins[-1]) @ pose(robot.tool_rotation, robot.tool_position)


# Sums of products instead of `@`: XLA's CPU backend fuses them over a batch, but calls a routine per 3x3 matmul.
def _apply(R: Mat3, v: Vec3) -> Vec3:
    """R v, shape (3,)."""
    return R[:, 0] * v[0] + R[:, 1] * v[1] + R[:, 2] * v[2]


def _multiply(A: Mat3, B: Mat3) -> Mat3:
    """A B, shape (3, 3)."""
    return A[:, 0:1] * B[0:1, :] + A[:, 1:2] * B[1:2, :] + A[:, 2:3] * B[2:3, :]
