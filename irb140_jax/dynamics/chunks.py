"""Running a function of samples over long recordings: piece by piece, compiled once for any length."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import Tracer
from jaxtyping import Array, Float

from irb140_jax.arrays import on_device
from irb140_jax.compiler import QUICK

# Samples at a time: the intermediate results of so many stay in the second-level cache.
CHUNK = 1000
# Longest piece handed to XLA at once; two sizes, CHUNK and SEGMENT, are all that is ever compiled.
SEGMENT = 20 * CHUNK

Kernel = Callable[..., Float[Array, "c ..."]]
Batch = Float[Array | np.ndarray, "T ..."]


def in_chunks(kernel: Kernel, given: Any, samples: tuple[Batch, ...]) -> Float[Array, "T ..."]:
    """kernel(given, *samples) for samples along the first axis, CHUNK of them at a time.

    Arrays are padded with zeros to whole chunks.  Under a trace (jit, grad, vmap) the number of chunks is part of the
    program; otherwise a new number of samples needs no new program.

    Args:
        kernel: Maps arrays of CHUNK samples, (CHUNK, ...), to one such array.  Compiled once per function object.
        given: Pytree passed on as it is.
        samples: Arrays of T samples.
    """
    if is_traced(given, samples):
        return _traced(kernel, given, samples)
    arrays = [np.asarray(x, float) for x in samples]
    size = arrays[0].shape[0]
    pieces = [_piece(kernel, given, [x[k : k + SEGMENT] for x in arrays]) for k in range(0, max(size, 1), SEGMENT)]
    if len(pieces) == 1:
        return on_device(pieces[0])
    result = np.empty((size, *pieces[0].shape[1:]))
    for k, piece in enumerate(pieces):
        result[k * SEGMENT : (k + 1) * SEGMENT] = piece
    return on_device(result)


def sum_of_chunks(kernel: Kernel, given: Any, samples: tuple[Batch, ...]) -> Float[Array, "..."]:
    """Sum of kernel(given, *samples) over chunks of the samples, which the kernel sums over within a chunk.

    As `in_chunks`; samples that pad the last chunk are zero and must not add to the sum.
    """
    if is_traced(given, samples):
        return _traced_sum(kernel, given, samples)
    arrays = [np.asarray(x, float) for x in samples]
    starts = range(0, max(len(arrays[0]), 1), SEGMENT)
    pieces = [_piece_sum(kernel, given, [x[k : k + SEGMENT] for x in arrays]) for k in starts]
    return sum(pieces[1:], pieces[0])


def is_traced(*trees: Any) -> bool:
    """Whether any array in there is a tracer: then its size is all that can be known."""
    return any(isinstance(x, Tracer) for x in jax.tree.leaves(trees))


def _piece(kernel: Kernel, given: Any, arrays: list[np.ndarray]) -> np.ndarray:
    padded, chunks = _roomy(arrays)
    return np.asarray(_loop(kernel, given, padded, chunks))[: arrays[0].shape[0]]


def _piece_sum(kernel: Kernel, given: Any, arrays: list[np.ndarray]) -> Array:
    return _sum_loop(kernel, given, *_roomy(arrays))


def _roomy(arrays: list[np.ndarray]) -> tuple[list[np.ndarray], np.int32]:
    """The arrays in one of the two sizes that are compiled, and the number of chunks in use."""
    chunks = -(-arrays[0].shape[0] // CHUNK)
    room = CHUNK if chunks <= 1 else SEGMENT
    return [_padded(x, chunks * CHUNK, room) for x in arrays], np.int32(chunks)


def _padded(x: np.ndarray, used: int, room: int) -> np.ndarray:
    """The array in one of `room` samples; zeros up to `used`, beyond it nobody looks."""
    if x.shape[0] == room:
        return x
    result = np.empty((room, *x.shape[1:]))
    result[: x.shape[0]] = x
    result[x.shape[0] : used] = 0.0
    return result


@partial(jax.jit, static_argnums=0, compiler_options=QUICK)
def _loop(kernel: Kernel, given: Any, arrays: list[Array], chunks: Array) -> Array:
    """The first `chunks` chunks of the result; their number is not part of the program."""
    kernel = jax.jit(kernel, inline=True)  # traced once for its shape and for the loop
    shape = jax.eval_shape(lambda: kernel(given, *_chunk(arrays, 0)))
    result = jnp.zeros((arrays[0].shape[0], *shape.shape[1:]), shape.dtype)

    def step(k: Array, out: Array) -> Array:
        return lax.dynamic_update_slice_in_dim(out, kernel(given, *_chunk(arrays, k)), k * CHUNK, 0)

    return lax.fori_loop(0, chunks, step, result)


@partial(jax.jit, static_argnums=0, compiler_options=QUICK)
def _sum_loop(kernel: Kernel, given: Any, arrays: list[Array], chunks: Array) -> Array:
    """Sum over the first `chunks` chunks; their number is not part of the program."""
    kernel = jax.jit(kernel, inline=True)
    shape = jax.eval_shape(lambda: kernel(given, *_chunk(arrays, 0)))
    step = lambda k, total: total + kernel(given, *_chunk(arrays, k))  # noqa: E731
    return lax.fori_loop(0, chunks, step, jnp.zeros(shape.shape, shape.dtype))


def _chunk(arrays: list[Array], k: Array | int) -> list[Array]:
    return [lax.dynamic_slice_in_dim(x, k * CHUNK, CHUNK) for x in arrays]


def _traced(kernel: Kernel, given: Any, samples: tuple[Batch, ...]) -> Array:
    size = samples[0].shape[0]
    if size <= CHUNK:
        return kernel(given, *samples)
    _, result = lax.scan(lambda carry, part: (carry, kernel(given, *part)), None, _stacked(samples))
    return result.reshape(-1, *result.shape[2:])[:size]


def _traced_sum(kernel: Kernel, given: Any, samples: tuple[Batch, ...]) -> Array:
    if samples[0].shape[0] <= CHUNK:
        return kernel(given, *samples)
    stacked = _stacked(samples)
    shape = jax.eval_shape(lambda: kernel(given, *(x[0] for x in stacked)))
    start = jnp.zeros(shape.shape, shape.dtype)
    return lax.scan(lambda total, part: (total + kernel(given, *part), None), start, stacked)[0]


def _stacked(samples: tuple[Batch, ...]) -> list[Array]:
    """Samples in whole chunks, (T, ...) -> (chunks, CHUNK, ...), padded with zeros."""
    spare = -samples[0].shape[0] % CHUNK
    padded = [jnp.pad(x, [(0, spare)] + [(0, 0)] * (x.ndim - 1)) for x in samples]
    return [x.reshape(-1, CHUNK, *x.shape[1:]) for x in padded]
