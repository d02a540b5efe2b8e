"""Is there enough to decide?  What the sensors scatter by, and joints of which the recordings can't tell."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax import dynamics
from irb140_jax.mismatch.prove import HeldOut
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.sensors import torque_scatter
from irb140_jax.robot import Robot

POSES = 100  # of a recording, over which the mass matrix is averaged
SECONDS = 3.0  # of motion that a joint must show: less is a few reversals, which any law fits
LARGE = 0.5  # of a joint's torque: what is left hides whatever the model may leave out
UNLIKE = 3.0  # times the sensors' scatter that can't be called noise any more ...
NOT_SMALL = 0.1  # ... where it is more than this share of the joint's torque


def sensor_scatter(
    robot: Robot, recordings: Sequence[Recording], smooth: Sequence[Conditioned], band: Band
) -> np.ndarray:
    """Standard deviation that torque and position sensors leave in the comparison, shape (n,) [N m or N].

    Torque noise as it is seen above the motion's frequencies, and encoder noise in the accelerations times the mass
    matrix.
    """
    power = []
    for raw, r in zip(recordings, smooth, strict=True):
        poses = jnp.asarray(r.q[np.linspace(0, len(r.q) - 1, POSES).astype(int)])
        square = np.mean(np.asarray(_masses(robot, poses)) ** 2, axis=0)
        shaken = np.zeros(robot.n) if r.shaken is None else r.shaken
        power.append(torque_scatter(raw, band) ** 2 + square @ shaken**2)
    return np.sqrt(np.mean(power, axis=0))


_masses = eqx.filter_jit(jax.vmap(dynamics.mass_matrix, in_axes=(None, 0)))


def torque_size(proof: HeldOut, torque: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviation of each joint's low-passed torque over the rows that count, shape (n,)."""
    out = np.zeros(len(proof.carried))
    for j in range(len(out)):
        values = np.concatenate([x[u[:, j], j] for x, u in zip(torque, proof.use, strict=True)])
        out[j] = np.std(values) if len(values) else 0.0
    return out


def undecidable(
    robot: Robot, proof: HeldOut, torque: Sequence[np.ndarray], scatter: np.ndarray, band: Band
) -> dict[int, str]:
    """Joints of which these recordings can't tell whether anything is left out, each with a sentence why.

    Args:
        robot: The nominal model.
        proof: Errors on unseen data.
        torque: Logged torque, low-passed, one array (R, n) per recording.
        scatter: What the sensors leave, shape (n,).
        band: Of the comparison.
    """
    size, left = torque_size(proof, torque), proof.rmse(proof.corrected)
    seconds = np.sum([u.sum(axis=0) for u in proof.use], axis=0) * band.step / band.rate
    out = {}
    for j in np.flatnonzero(proof.judged):
        name, unit = robot.joint_names[j], "N" if robot.is_slide[j] else "N m"
        if seconds[j] < SECONDS:
            out[int(j)] = (
                f"{name} moves for {seconds[j]:.2g} s only: record at least {SECONDS:g} s in which it moves, better "
                "20 s with a dozen reversals"
            )
        elif left[j] > LARGE * size[j]:
            out[int(j)] = (
                f"what is left on {name}, {left[j]:.3g} {unit}, is {100 * left[j] / max(size[j], 1e-300):.0f} % of its "
                "torque and may hide anything: check its columns and units, and record faster or longer motion"
            )
        elif left[j] > max(NOT_SMALL * size[j], UNLIKE * scatter[j]):
            out[int(j)] = (
                f"what is left on {name}, {left[j]:.3g} {unit}, is {left[j] / max(scatter[j], 1e-300):.2g} times what "
                "the sensors scatter by and no small part of its torque: check its columns, and record longer motion"
            )
    return out
