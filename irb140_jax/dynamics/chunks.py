"""Running a function of samples over long recordings: piece by piece, compiled once for any length."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

# Samples at a time: the intermediate results of so many stay in the second-level cache.
CHUNK = 1000
# Longest piece handed to XLA at once; two sizes, CHUNK and SEGMENT, are all that is ever compiled.
SEGMENT = 20 * CHUNK

Kernel = Callable[..., Float[Array, "c ..."]]


def in_chunks(kernel: Kernel, given: Any, samples: tuple[Float[Array, "T ..."], ...]) -> Float[Array, "T ..."]:
    """kernel(given, *samples) for samples along the first axis, CHUNK of them at a time.

    Arrays are padded with zeros to whole chunks.  Under a trace (jit, grad, vmap) the number of chunks is part of the
    program; otherwise a new number of samples needs no new program.

    Args:
        kernel: Maps arrays of CHUNK samples, (CHUNK, ...), to one such array.  Compiled once per function object.
        given: Pytree passed on as it is.
        samples: Arrays of T samples.
    """
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves((given, samples))):
        return _traced(kernel, given, samples)
    arrays = [np.asarray(x, float) for x in samples]
    size = arrays[0].shape[0]
    pieces = [_piece(kernel, given, [x[k : k + SEGMENT] for x in arrays]) for k in range(0, max(size, 1), SEGMENT)]
    if len(pieces) == 1:
        return jnp.asarray(pieces[0])
    result = np.empty((size, *pieces[0].shape[1:]))
    for k, piece in enumerate(pieces):
        result[k * SEGMENT : (k + 1) * SEGMENT] = piece
    return jnp.asarray(result)


def _piece(kernel: Kernel, given: Any, arrays: list[np.ndarray]) -> np.ndarray:
    size = arrays[0].shape[0]
    chunks = -(-size // CHUNK)
    room = CHUNK if chunks <= 1 else SEGMENT
    padded = [_padded(x, chunks * CHUNK, room) for x in arrays]
    return np.asarray(_loop(kernel, given, padded, np.int32(chunks)))[:size]


def _padded(x: np.ndarray, used: int, room: int) -> np.ndarray:
    """The array in one of `room` samples; zeros up to `used`, beyond it nobody looks."""
    if x.shape[0] == room:
        return x
    result = np.empty((room, *x.shape[1:]))
    result[: x.shape[0]] = x
    result[x.shape[0] : used] = 0.0
    return result


@partial(jax.jit, static_argnums=0)
def _loop(kernel: Kernel, given: Any, arrays: list[Array], chunks: Array) -> Array:
    """The first `chunks` chunks of the result; their number is not part of the program."""
    part = lambda k: [lax.dynamic_slice_in_dim(x, k * CHUNK, CHUNK) for x in arrays]  # noqa: E731
    shape = jax.eval_shape(lambda: kernel(given, *part(0)))
    result = jnp.zeros((arrays[0].shape[0], *shape.shape[1:]), shape.dtype)
    step = lambda k, out: lax.dynamic_update_slice_in_dim(out, kernel(given, *part(k)), k * CHUNK, 0)  # noqa: E731
    return lax.fori_loop(0, chunks, step, result)


def _traced(kernel: Kernel, given: Any, samples: tuple[Array, ...]) -> Array:
    size = samples[0].shape[0]
    if size <= CHUNK:
        return kernel(given, *samples)
    chunks = -(-size // CHUNK)
    padded = [jnp.pad(x, [(0, chunks * CHUNK - size)] + [(0, 0)] * (x.ndim - 1)) for x in samples]
    stacked = [x.reshape(chunks, CHUNK, *x.shape[1:]) for x in padded]
    _, result = lax.scan(lambda carry, part: (carry, kernel(given, *part)), None, stacked)
    return result.reshape(chunks * CHUNK, *result.shape[2:])[:size]
