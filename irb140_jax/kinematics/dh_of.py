"""The Denavit-Hartenberg table of any serial robot, read off the axes of its joints."""

from typing import NamedTuple

import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.kinematics.dh import DHTable
from irb140_jax.kinematics.forward import link_frames
from irb140_jax.robot import Robot

# Sine of the angle between axes [1] and distance between them [m] below which they count as parallel or crossing.
PARALLEL = 1e-9


class DHView(NamedTuple):
    """A robot's table and where its ends are, T_world_tool(q) = T_world_first dh_forward(table, q) T_last_tool.

    Attributes:
        table: One row a joint.
        T_world_first: Frame 0, whose z is the first joint's axis, in the world, shape (4, 4).
        T_last_tool: The tool in frame n, which has the tool's origin, shape (4, 4).
    """

    table: DHTable
    T_world_first: np.ndarray
    T_last_tool: np.ndarray


def dh_of(robot: Robot) -> DHView:
    """Standard (distal) Denavit-Hartenberg parameters of a robot.

    Where the text book leaves a choice: parallel axes get d = 0; where axes cross, x is turned by less than 90 degrees;
    the last frame has the direction of the last axis and the origin of the tool.

    Args:
        robot: Serial chain of n hinges and slides, with concrete numbers.

    Raises:
        RobotError: The robot branches.

    Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics (2009), section 2.8.2.
    """
    if not robot.is_chain:
        raise RobotError(
            f"robot '{robot.name}' branches; a Denavit-Hartenberg table is of a chain: load it with the joints of one "
            "arm"
        )
    axes, points, T_tool = _lines(robot)
    z = axes[0]
    base = np.asarray(robot.base_position)
    first = frame = _frame(points[0] + z * ((base - points[0]) @ z), _across(z, np.asarray(robot.base_rotation)), z)
    rows = []
    # Towards each next joint, and at the end towards the tool's origin along the last axis' direction.
    for z_next, point in zip([*axes[1:], axes[-1]], [*points[1:], T_tool[:3, 3]], strict=True):
        last = len(rows) == robot.n - 1
        row, frame = _step(frame, z_next, point, last)
        rows.append(row)
    theta, d, a, alpha = np.array(rows).T
    slide, reference = np.array(robot.is_slide, float), np.asarray(robot.reference)
    table = DHTable(theta - reference * (1.0 - slide), d - reference * slide, a, alpha, slide)
    return DHView(table, first, np.linalg.solve(frame, T_tool))


def _lines(robot: Robot) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
    """Direction of and a point on every joint's axis, and the tool's pose, in the world at q = reference."""
    R_base, p_base = np.asarray(robot.base_rotation), np.asarray(robot.base_position)
    R, p = (np.asarray(x) for x in link_frames(robot, robot.reference))
    axes = [R_base @ R[i] @ np.asarray(robot.axis[i]) for i in range(robot.n)]
    points = [p_base + R_base @ p[i] for i in range(robot.n)]
    T_tool = np.eye(4)
    T_tool[:3, :3] = R_base @ R[-1] @ np.asarray(robot.tool_rotation)
    T_tool[:3, 3] = points[-1] + R_base @ R[-1] @ np.asarray(robot.tool_position)
    return axes, points, T_tool


def _step(frame: np.ndarray, z_next: np.ndarray, point: np.ndarray, last: bool) -> tuple[tuple, np.ndarray]:
    """theta, d, a, alpha from a frame to the next, whose z axis is given by direction and point, and that frame."""
    x, y, z, origin = frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3]
    normal = np.cross(z, z_next)
    between = point - origin
    if np.linalg.norm(normal) < PARALLEL:
        foot = origin + z * (between @ z) if last else origin
        target = point if last else point - z_next * (between @ z_next)
    else:
        # Feet of the common normal: origin + s z + a n = point + u z_next.
        n = normal / np.linalg.norm(normal)
        s, _, u = np.linalg.solve(np.stack([z, n, -z_next], axis=1), between)
        foot, target = origin + s * z, point + u * z_next
    link = target - foot
    if np.linalg.norm(link) > PARALLEL:
        x_next = link / np.linalg.norm(link)
    elif np.linalg.norm(normal) < PARALLEL:
        x_next = x
    else:
        x_next = normal / np.linalg.norm(normal)
        x_next = x_next if x_next @ x > -PARALLEL else -x_next
    theta = np.arctan2(x_next @ y, x_next @ x)
    alpha = np.arctan2(np.cross(z, z_next) @ x_next, z @ z_next)
    return (theta, (foot - origin) @ z, np.linalg.norm(link), alpha), _frame(target, x_next, z_next)


def _across(z: np.ndarray, R_base: np.ndarray) -> np.ndarray:
    """Unit vector square to z, as near to the base's x as may be (to its y for an axis along x)."""
    for column in R_base.T:
        x = column - (column @ z) * z
        if np.linalg.norm(x) > 0.5:
            return x / np.linalg.norm(x)
    raise AssertionError("one of three axes is square to any direction, or nearly")


def _frame(origin: np.ndarray, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = origin
    return T
