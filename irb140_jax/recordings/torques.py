"""What the nominal model says of a motion, at rest and moving: the yardstick of the checks."""

from typing import NamedTuple

import numpy as np

from irb140_jax.dynamics import inverse_dynamics_batch
from irb140_jax.robot import Robot


class Torques(NamedTuple):
    """What the nominal model says of a motion: shape (SAMPLES, n) each, [N m or N].

    Attributes:
        gravity: Torque at rest in the same poses.
        moving: What motion adds to it.
    """

    gravity: np.ndarray
    moving: np.ndarray

    @property
    def total(self) -> np.ndarray:
        return self.gravity + self.moving


def nominal_torques(robot: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> Torques:
    """Gravity and motion torque of the nominal model along a motion, arrays of shape (SAMPLES, n)."""
    still = np.zeros(q.shape)
    gravity = np.asarray(inverse_dynamics_batch(robot, q, still, still))
    total = np.asarray(inverse_dynamics_batch(robot, q, qd, qdd))
    return Torques(gravity, total - gravity)
