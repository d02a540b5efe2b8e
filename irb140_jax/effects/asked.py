"""What laws of servos have in common: the part of the torque asked for that the motor never gives."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from irb140_jax.effects.grids import between_neighbours
from irb140_jax.effects.motion import Asked, Motion, of_site
from irb140_jax.effects.records import At, Place, Prior
from irb140_jax.types import Samples

PLACE = Place(At.ASKED)
# Their torque is all of what their shape says; a fifth more or less is another law.
PRIOR = Prior(lowest=(0.8,), highest=(1.25,))


def not_given(
    motion: Motion, joints: Int[Array, " 1"], law: Callable[[Asked, Array, Array], Array], shape: Float[Array, " s"]
) -> Float[Array, "T 1 1"]:
    """A law's column; zero where commands are not known, as along a planned motion.

    Args:
        motion: The motion.
        joints: Of the site.
        law: From what the joint's servo is asked for, its speed, (T, 1) each, and the shape to the torque not given.
        shape: The shape.
    """
    qd = of_site(motion.qd, joints)
    if motion.asked is None:
        return jnp.zeros_like(qd)[:, :, None]
    torque, error = (of_site(x, joints) for x in (motion.asked.torque, motion.asked.error))
    return law(Asked(torque, error, motion.asked.kp[joints]), qd, shape)[:, :, None]


def finer(grid: np.ndarray, best: np.ndarray) -> np.ndarray:
    """The grid of one parameter around its best point; a first best may be off, so it may go anywhere nearby."""
    return between_neighbours(grid, best, beyond=2, reach=2)


def beyond_limit(excess: Array) -> tuple[np.ndarray, float]:
    """See `Law.silent`: a motor at its limit gives the same, whatever it is asked for."""
    return np.asarray(excess != 0.0), float(np.max(np.abs(np.asarray(excess)), initial=0.0))


def beyond(x: Float[Array, "T 1"], low: Samples | float, high: Samples | float) -> Float[Array, "T 1"]:
    """What of x is below low or above high."""
    return x - jnp.clip(x, low, high)
