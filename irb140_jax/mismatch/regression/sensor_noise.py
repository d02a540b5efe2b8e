"""The noise that torque sensors and encoders leave in the comparison with the model."""

from collections.abc import Sequence

import equinox as eqx
import jax
import numpy as np

from irb140_jax import dynamics
from irb140_jax.arrays import on_device
from irb140_jax.mismatch import settings
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.sensors import torque_scatter
from irb140_jax.robot import Robot

POSES = 100  # of a recording, over which the mass matrix is averaged

_masses = eqx.filter_jit(jax.vmap(dynamics.mass_matrix, in_axes=(None, 0)))


def scatter_by_sensor(
    robot: Robot, recordings: Sequence[Recording], smooth: Sequence[Conditioned], band: Band
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations that torque sensors and encoders leave in the comparison, shape (n,) each [N m or N].

    Torque noise is measured above the frequencies of the motion; encoder noise in the accelerations is multiplied by
    the mass matrix.  Both are independent, so their squares add.
    """
    by_torque, by_encoder = [], []
    for raw, r in zip(recordings, smooth, strict=True):
        poses = on_device(r.q[np.linspace(0, len(r.q) - 1, POSES).astype(int)])
        square = np.mean(np.asarray(_masses(robot, poses)) ** 2, axis=0)
        shaken = np.zeros(robot.n) if r.shaken is None else r.shaken
        by_torque.append(torque_scatter(raw, band) ** 2)
        by_encoder.append(square @ shaken**2)
    return np.sqrt(np.mean(by_torque, axis=0)), np.sqrt(np.mean(by_encoder, axis=0))


def coarse_positions(robot: Robot, by_torque: np.ndarray, by_encoder: np.ndarray, judged: np.ndarray) -> list[str]:
    """A note where the encoders, and not the torque sensors, limit what can be seen: `settings.COARSE` times as loud.

    Args:
        robot: The nominal model.
        by_torque, by_encoder: From `scatter_by_sensor`, shape (n,) [N m or N].
        judged: Joints of which enough rows tell, shape (n,).
    """
    coarse = np.flatnonzero(judged & (by_encoder > settings.COARSE * by_torque))
    if not len(coarse):
        return []
    each = ", ".join(
        f"{robot.joint_names[j]} ({by_encoder[j]:.2g} {robot.torque_units[j]} from positions, "
        f"{by_torque[j]:.2g} from torque)" for j in coarse
    )  # fmt: skip
    return [
        "Positions are coarse: their noise limits what can be seen more than the noise of the torque does, on "
        f"{each}. Log positions with more digits or a finer encoder; a friction, offset or inertia smaller than this "
        "noise stays hidden."
    ]
