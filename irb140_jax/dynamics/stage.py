"""Cutting a long scalar program into stages whose results are stored.

XLA fuses each result of a program with everything it depends on, and computes again, for each of them, whatever they
share: in a recursion along a chain that work doubles with every link.  It drops `lax.optimization_barrier` on a CPU.
What it can't fuse through is a branch, so a stage is the branch taken of a `lax.cond` whose predicate is always true
but only known at run time.  Inverse dynamics of six joints gets some 50 times faster by it.
"""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float

Result = TypeVar("Result")


@jax.custom_batching.custom_vmap
def _true(x: Float[Array, ""]) -> Bool[Array, ""]:
    return ~(x < -jnp.inf)


@_true.def_vmap
def _true_of_a_batch(axis_size, in_batched, x):
    # One predicate for the whole batch: a batched one would turn the branch into a selection, which is fused through.
    return _true(x[0]), False


def always(*arrays: Array) -> Bool[Array, ""]:
    """True, for any values (NaN and infinity too), but not known to XLA unless all these arrays are constants."""
    first = [x.reshape(-1)[0] for x in arrays]
    return _true(lax.stop_gradient(sum(first[1:], first[0])))


def staged(predicate: Bool[Array, ""], stage: Callable[[], Result]) -> Result:
    """Result of the function, stored before anything uses it.

    Args:
        predicate: From `always`.
        stage: Returns a pytree of arrays and of Python floats; the latter, known at trace time, stay so.
    """
    seen = {}

    def taken() -> list[Array]:
        leaves, seen["tree"] = jax.tree.flatten(stage())
        seen["leaves"] = leaves
        return [x for x in leaves if not isinstance(x, float)]

    def not_taken() -> list[Array]:
        return [jnp.zeros(x.shape, x.dtype) for x in seen["leaves"] if not isinstance(x, float)]

    arrays = iter(lax.cond(predicate, taken, not_taken))
    return jax.tree.unflatten(seen["tree"], [x if isinstance(x, float) else next(arrays) for x in seen["leaves"]])
