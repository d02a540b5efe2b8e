"""Inverse kinematics: every solution of an arm with a spherical wrist like the IRB 140's, and one for any arm."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from irb140_jax.errors import RobotError
from irb140_jax.kinematics.forward import axis_rotation, forward_kinematics
from irb140_jax.kinematics.jacobian import jacobian
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, Mat3, Pose, Scalar, Vec3

# Joint axes at q = reference of the arms that `wrist_solutions` solves, and the directions that lengths may have.
AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], float)
LENGTHS = np.array([[0, 0, 1], [1, 0, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0], [0, 0, 0]], bool)
# Round-off that a model file may have in its axes and offsets.
EXACT = 1e-9
# Below this sine of the bend of the wrist, its outer axes are taken to be in line; the pose is off by no more than it.
STRAIGHT = 1e-11


class Solutions(NamedTuple):
    """Joint positions that reach a pose.

    Attributes:
        q: One row a branch: shoulder front and back, elbow up and down, wrist as is and flipped [rad], shape (8, 6).
        reachable: Whether the branch reaches the pose at all; else q is as near as its geometry gets, shape (8,).
        allowed: Whether it also lies within the joint limits, shape (8,).
    """

    q: Float[Array, "8 6"]
    reachable: Bool[Array, "8"]
    allowed: Bool[Array, "8"]


class Solution(NamedTuple):
    """Where an iteration ended.

    Attributes:
        q: Joint positions [rad or m], shape (n,).
        error: Norm of what is left, [m] and [rad] side by side, shape ().
        converged: Whether that is below the tolerance, shape ().
    """

    q: Joints
    error: Scalar
    converged: Bool[Array, ""]


def wrist_solutions(robot: Robot, T_world_tool: Pose, near: Joints | None = None) -> Solutions:
    """All joint positions at which the tool has this pose, in closed form.

    The wrist's centre, where the last three axes meet, fixes the first three joints; its distance from the shoulder
    is |(X, Z)| with X = a2 s2 + d4 c23, Z = a2 c2 - d4 s23, so sin q3 = (a2^2 + d4^2 - X^2 - Z^2) / (2 a2 d4).  The
    rotation left over is Rx(q4) Ry(q5) Rx(q6).

    Args:
        robot: An arm of the IRB 140's build: six hinges about z, y, y, x, y, x, the last three through one point, no
            sideways offsets; any lengths, any base and tool.
        T_world_tool: Pose wanted, shape (4, 4).
        near: Joint positions to stay near to [rad], shape (6,): picks full turns where the limits leave a choice, and
            q4 where the wrist is straight and only q4 + q6 is determined.  Default zeros.

    Returns:
        Eight branches.

    Raises:
        RobotError: The robot is built otherwise; `damped_least_squares` serves any.

    Source: Pieper, Roth (1969); lengths and signs of the study's equation 3 (see `dh.irb140_end_point`).
    """
    _refuse_other_builds(robot)
    near = jnp.zeros(6) if near is None else jnp.asarray(near)
    R, p = _last_frame(robot, T_world_tool)
    wrist = p - robot.position[0]
    branches = [(front, up, flip) for front in (1, -1) for up in (1, -1) for flip in (1, -1)]
    found = [_branch(robot, R, wrist, near - robot.reference, *branch) for branch in branches]
    travel, reachable = jnp.stack([q for q, _ in found]), jnp.stack([r for _, r in found])
    q = _within_turns(robot, travel + robot.reference, near)
    slack = 1e-12  # a limit itself is allowed, whatever the last bit says
    inside = jnp.all((q >= robot.lower - slack) & (q <= robot.upper + slack), axis=1)
    return Solutions(q, reachable, reachable & inside)


def nearest_solution(robot: Robot, T_world_tool: Pose, near: Joints) -> tuple[Joints, Bool[Array, ""]]:
    """The allowed solution of `wrist_solutions` that is nearest to given joint positions, and whether there is one.

    Args:
        robot: An arm of the IRB 140's build.
        T_world_tool: Pose wanted, shape (4, 4).
        near: Joint positions [rad], shape (6,).
    """
    q, _, allowed = wrist_solutions(robot, T_world_tool, near)
    distance = jnp.where(allowed, jnp.linalg.norm(q - near, axis=1), jnp.inf)
    return q[jnp.argmin(distance)], jnp.any(allowed)


def damped_least_squares(
    robot: Robot,
    T_world_tool: Pose,
    start: Joints,
    *,
    orientation: bool = True,
    limits: bool = False,
    tolerance: float = 1e-10,
    max_steps: int = 200,
) -> Solution:
    """Joint positions at which the tool has this pose, by steps dq = (J^T J + (|e|^2 / 2 + 1e-12) 1)^-1 J^T e.

    Damping by the squared error keeps steps short far away and near singularities, and lets Newton's speed come back
    at the end.

    Args:
        robot: Any arm with n joints.
        T_world_tool: Pose wanted, shape (4, 4).
        start: Where to begin [rad or m], shape (n,).
        orientation: Whether the tool's orientation counts, or its position alone.
        limits: Whether each step is held within the joint limits.
        tolerance: Error at which to stop [m, rad].
        max_steps: Steps after which to give up.

    Returns:
        Where it ended; for a pose out of reach, a point as near as it could find, not converged.

    Source: Sugihara, IEEE Trans. Robotics 27 (2011), 984-991.
    """

    def step(carry):
        q, e, count = carry
        J = jacobian(robot, q)[: 6 if orientation else 3]
        damping = 0.5 * e @ e + 1e-12
        q = q + jnp.linalg.solve(J.T @ J + damping * jnp.eye(robot.n), J.T @ e)
        q = jnp.clip(q, robot.lower, robot.upper) if limits else q
        return q, pose_error(robot, T_world_tool, q, orientation), count + 1

    unfinished = lambda carry: (jnp.linalg.norm(carry[1]) > tolerance) & (carry[2] < max_steps)  # noqa: E731
    first = (jnp.asarray(start, float), pose_error(robot, T_world_tool, start, orientation), 0)
    q, e, _ = jax.lax.while_loop(unfinished, step, first)
    return Solution(q, jnp.linalg.norm(e), jnp.linalg.norm(e) <= tolerance)


def pose_error(robot: Robot, T_world_tool: Pose, q: Joints, orientation: bool = True) -> Float[Array, " k"]:
    """What the tool lacks to this pose: translation [m] over rotation vector [rad], world axes, shape (6,) or (3,).

    Args:
        robot: Arm with n joints.
        T_world_tool: Pose wanted, shape (4, 4).
        q: Joint positions [rad or m], shape (n,).
        orientation: Whether the rotation is in it.
    """
    T = forward_kinematics(robot, q)
    shift = T_world_tool[:3, 3] - T[:3, 3]
    return jnp.concatenate([shift, rotation_vector(T_world_tool[:3, :3] @ T[:3, :3].T)]) if orientation else shift


def rotation_vector(R: Mat3) -> Vec3:
    """Axis times angle of a rotation [rad], shape (3,); angle in [0, pi].

    By way of the quaternion whose largest part is computed first, so that it holds up at 0 and at pi alike.

    Args:
        R: Rotation, shape (3, 3).

    Source: Shepperd, J. Guidance and Control 1 (1978).
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    skew = jnp.stack([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    rows = [jnp.concatenate([(1.0 + trace)[None], skew])]
    for i in range(3):
        own = (R[i] + R[:, i]).at[i].set(1.0 + 2.0 * R[i, i] - trace)
        rows.append(jnp.concatenate([skew[i][None], own]))
    candidates = jnp.stack(rows)
    best = candidates[jnp.argmax(jnp.stack([trace, R[0, 0], R[1, 1], R[2, 2]]))]
    best = best * jnp.where(best[0] < 0.0, -1.0, 1.0)
    size = jnp.linalg.norm(best[1:])
    safe = jnp.where(size == 0.0, 1.0, size)
    return jnp.where(size == 0.0, 2.0 / best[0], 2.0 * jnp.arctan2(size, best[0]) / safe) * best[1:]


def _refuse_other_builds(robot: Robot) -> None:
    """Raise unless the robot is of the IRB 140's build."""
    whole = robot.n == 6 and robot.is_chain and not any(robot.is_slide)
    if whole:
        with jax.ensure_compile_time_eval():
            rotation, axis, position = (np.asarray(x) for x in (robot.rotation, robot.axis, robot.position))
        parallel = np.abs(rotation - np.eye(3)).max() < EXACT and np.abs(axis - AXES).max() < EXACT
        # The wrist's own offset along x only moves its centre, and joint 1's origin may be anywhere on its axis.
        straight = np.abs(np.where(LENGTHS, 0.0, position)[1:]).max() < EXACT
        whole = bool(parallel and straight)
    if not whole:
        raise RobotError(
            f"robot '{robot.name}' is not built like the IRB 140 (hinges about z, y, y, x, y, x, spherical wrist, "
            "no sideways offsets); use damped_least_squares, which serves any arm"
        )


def _last_frame(robot: Robot, T_world_tool: Pose) -> tuple[Mat3, Vec3]:
    """Orientation and origin of the last link's frame in the base."""
    R_base = robot.base_rotation.T @ T_world_tool[:3, :3]
    R = R_base @ robot.tool_rotation.T
    p = robot.base_rotation.T @ (T_world_tool[:3, 3] - robot.base_position)
    return R, p - R @ robot.tool_position


def _branch(
    robot: Robot, R: Mat3, wrist: Vec3, near: Joints, front: int, up: int, flip: int
) -> tuple[Joints, Bool[Array, ""]]:
    """Joint angles of one branch and whether it reaches the wrist's centre."""
    a1, a2, d4 = robot.position[1, 0], robot.position[2, 2], robot.position[3, 0]
    q1 = jnp.arctan2(front * wrist[1], front * wrist[0])
    X, Z = front * jnp.hypot(wrist[0], wrist[1]) - a1, wrist[2]
    sine = (a2**2 + d4**2 - X**2 - Z**2) / (2.0 * a2 * d4)
    bend = jnp.arcsin(jnp.clip(sine, -1.0, 1.0))
    q3 = bend if up == 1 else jnp.pi - bend
    A, B = a2 - d4 * jnp.sin(q3), d4 * jnp.cos(q3)
    q2 = jnp.arctan2(A * X - B * Z, B * X + A * Z)
    z, y = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 1.0, 0.0])
    left = (axis_rotation(z, q1) @ axis_rotation(y, q2 + q3)).T @ R
    q4, q5, q6 = _wrist(left, near[3], flip)
    # A pose on the border of the workspace must count as reachable: its sine is 1 give or take round-off.
    return jnp.stack([q1, q2, q3, q4, q5, q6]), jnp.abs(sine) <= 1.0 + 1e-12


def _wrist(left: Mat3, near: Scalar, flip: int) -> tuple[Scalar, Scalar, Scalar]:
    """Angles of left = Rx(q4) Ry(q5) Rx(q6); q4 is `near` where the axes of q4 and q6 are in line."""
    bent = jnp.hypot(left[1, 0], left[2, 0])
    q5 = jnp.arctan2(flip * bent, left[0, 0])
    q4 = jnp.where(bent < STRAIGHT, near, jnp.arctan2(flip * left[1, 0], -flip * left[2, 0]))
    # q6 from what is left when q4 is undone: exact for any q4, and so accurate near the singularity.
    c, s = jnp.cos(q4), jnp.sin(q4)
    q6 = jnp.arctan2(-(c * left[1, 2] + s * left[2, 2]), c * left[1, 1] + s * left[2, 1])
    return q4, q5, q6


def _within_turns(robot: Robot, q: Float[Array, "8 6"], near: Joints) -> Float[Array, "8 6"]:
    """Full turns added so that each angle is as near as may be to `near` among those within the limits."""
    turn = 2.0 * jnp.pi
    close = q + turn * jnp.round((near - q) / turn)
    fewest, most = jnp.ceil((robot.lower - close) / turn - 1e-12), jnp.floor((robot.upper - close) / turn + 1e-12)
    return close + turn * jnp.where(fewest <= most, jnp.clip(0.0, fewest, most), 0.0)
