"""Results that are computed once.

XLA on a CPU computes again, for each result that needs it, whatever results share, and drops
`lax.optimization_barrier`; random numbers are most of a swarm's work.  It can't fuse through a branch, so what is to be
stored is the branch taken of a `lax.cond` whose predicate is always true but only known at run time.
"""

from collections.abc import Callable
from typing import TypeVar

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

Result = TypeVar("Result")


def stored(iteration: Array, compute: Callable[[], Result]) -> Result:
    """Result of the function, stored before anything uses it.

    Args:
        iteration: Number of the iteration, which is never negative and the same for all swarms of a batch.
        compute: Returns a pytree of arrays.
    """
    shapes = jax.eval_shape(compute)
    return lax.cond(iteration >= 0, compute, lambda: jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes))
