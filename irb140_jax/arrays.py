"""From NumPy to JAX."""

import jax
import numpy as np
from jax import Array


def on_device(x: np.ndarray) -> Array:
    """An array of NumPy as one of JAX: a copy, where `jnp.asarray` compiles a program for each new shape."""
    return jax.device_put(np.asarray(x, dtype=float))
