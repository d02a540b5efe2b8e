"""A mass of known size that the tool carried during a recording: it fixes the scale of all torques.

The same arm with a mass that a balance has weighed and without it: what the mass adds to the torque is known, whatever
the links weigh, so that a wrong torque constant can no longer be taken for links that are all too heavy.
"""

import dataclasses

import jax.numpy as jnp
import numpy as np

from irb140_jax.robot import Robot, about_origin, with_phi


@dataclasses.dataclass(frozen=True)
class Payload:
    """A body on the tool which the model does not hold, small beside its distance from the joints.

    Attributes:
        mass: What it weighs [kg].
        at: Where its centre of mass is said to be, from the tool along the tool's axes [m].
        off: How much further it was found to be [m].
    """

    mass: float
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    off: tuple[float, float, float] = (0.0, 0.0, 0.0)


def carrying(robot: Robot, payload: Payload | None) -> Robot:
    """The robot with a known body on its tool, or as it is."""
    if payload is None:
        return robot
    c = _centre(robot, payload)
    held = about_origin(robot.tool_position) @ jnp.asarray(payload.mass * np.concatenate([[1.0], c, _square(c, c)]))
    return with_phi(robot, robot.phi.at[-1].add(held))


def inertials_per_metre(robot: Robot, payload: Payload) -> np.ndarray:
    """How the inertial parameters of the last link change as the body moves along each axis of the tool, (10, 3)."""
    c, axes = _centre(robot, payload), np.asarray(robot.tool_rotation).T
    moved = np.stack([np.concatenate([[0.0], axis, 2.0 * _square(c, axis)]) for axis in axes], axis=1)
    return payload.mass * np.asarray(about_origin(robot.tool_position)) @ moved


def _centre(robot: Robot, payload: Payload) -> np.ndarray:
    """From the tool, along the axes of the last link [m]."""
    return np.asarray(robot.tool_rotation) @ np.add(payload.at, payload.off)


def _square(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(a . b) 1 - (a b' + b a') / 2 as Ixx, Ixy, Ixz, Iyy, Iyz, Izz."""
    return (a @ b * np.eye(3) - 0.5 * (np.outer(a, b) + np.outer(b, a)))[np.triu_indices(3)]
