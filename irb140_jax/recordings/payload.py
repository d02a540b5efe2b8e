"""A mass of known size that the tool carried during a recording: it fixes the scale of all torques.

The same arm with a mass that a balance has weighed and without it: what the mass adds to the torque is known, whatever
the links weigh, so that a wrong torque constant can no longer be taken for links that are all too heavy.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.arrays import on_device
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
    """The robot with a known body on its tool, or as it is where there is none."""
    if payload is None:
        return robot
    return with_phi(robot, robot.phi.at[-1].add(on_device(_inertials(robot, payload, np.zeros(3)))))


def inertials_per_metre(robot: Robot, payload: Payload) -> np.ndarray:
    """How the last link's inertial parameters change as the body moves along each axis of the tool, shape (10, 3).

    Per metre, at where it was found.  They are parabolas of its place, of which a central difference is the slope.
    """
    there = lambda x: _inertials(robot, payload, x)  # noqa: E731
    return np.stack([0.5 * (there(axis) - there(-axis)) for axis in np.eye(3)], axis=1)


def distinct(carried: Sequence[Payload | None]) -> list[Payload]:
    """What the tool carried in any of some recordings, once each, in the order of the recordings."""
    return [*dict.fromkeys(payload for payload in carried if payload)]


def _inertials(robot: Robot, payload: Payload, moved: np.ndarray) -> np.ndarray:
    """Inertial parameters of the body in the frame of the last link, shape (10,), moved along the tool's axes [m]."""
    from_tool = np.asarray(robot.tool_rotation) @ (np.add(payload.at, payload.off) + moved)
    return payload.mass * np.asarray(about_origin(robot.tool_position + from_tool))[:, 0]
