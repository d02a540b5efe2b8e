"""Many runs of one computation as one program, on one device or shared among several."""

from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental import multihost_utils
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import PyTree

from irb140_jax.errors import InputError


def sweep(one: Callable[..., PyTree], lanes: PyTree, *common: Any, mesh: Mesh | None = None) -> PyTree:
    """one(lane, *common) for every lane: seeds of a swarm, parameter sets of a rollout, starts of a descent.

    Lanes don't hear of each other, so that nothing is exchanged and each result is that of the lane alone.  Numbers in
    `common` are inputs of the program, so that other ones need no new program; what `one` closes over is part of it,
    and another function is another program.

    Args:
        one: Of one lane and what all share; keep the same function between calls.
        lanes: A pytree of arrays (or keys), lanes along their first axis.
        common: What all lanes share; arrays, and settings which are part of the program.
        mesh: Devices to share the lanes among, along the mesh's first axis; default the one device there is.  Where
            they can't share evenly, the last lane is computed some more times, and left out of the results.

    Returns:
        The results, lanes along the first axis; with a mesh they stay where they were computed, unless its devices
        can't share them evenly.

    Raises:
        InputError: Lanes of different numbers, or none.
    """
    count = _count(lanes)
    if mesh is None:
        return _sweep(one, lanes, common)
    axis, devices = mesh.axis_names[0], mesh.devices.shape[0]
    spare = -count % devices
    shared = _placed(_padded(lanes, spare), NamedSharding(mesh, PartitionSpec(axis)))
    found = _sweep_on(mesh, axis, one, shared, _placed(common, NamedSharding(mesh, PartitionSpec())))
    # An array that devices share evenly can't be cut unevenly where it is: each process takes a whole copy.
    whole = lambda x: jnp.asarray(multihost_utils.process_allgather(x, tiled=True)[:count])  # noqa: E731
    return jax.tree.map(whole, found) if spare else found


def _padded(lanes: PyTree, spare: int) -> PyTree:
    """The lanes, the last one so many times more."""
    if not spare:
        return lanes
    return jax.tree.map(lambda x: jnp.concatenate([x, jnp.repeat(x[-1:], spare, axis=0)]), lanes)


def _count(lanes: PyTree) -> int:
    shapes = [np.shape(x) for x in jax.tree.leaves(lanes)]
    counts = {shape[0] if shape else 0 for shape in shapes}
    if len(counts) != 1 or 0 in counts:
        raise InputError(f"lanes of shapes {shapes}: give arrays whose first axes are as long, at least 1")
    return counts.pop()


def _placed(tree: PyTree, sharding: NamedSharding) -> PyTree:
    """The tree with its arrays laid out like this; each process gives the devices of its own machine their part."""

    def placed(x: Any) -> Any:
        if not eqx.is_array(x):
            return x
        if jnp.issubdtype(x.dtype, jax.dtypes.prng_key):
            return jax.random.wrap_key_data(placed(jax.random.key_data(x)), impl=jax.random.key_impl(x))
        values = np.asarray(x)
        return jax.make_array_from_callback(values.shape, sharding, lambda index: values[index])

    return jax.tree.map(placed, tree)


@eqx.filter_jit
def _sweep(one: Callable[..., PyTree], lanes: PyTree, common: tuple) -> PyTree:
    return jax.vmap(lambda lane: one(lane, *common))(lanes)


@eqx.filter_jit
def _sweep_on(mesh: Mesh, axis: str, one: Callable[..., PyTree], lanes: PyTree, common: tuple) -> PyTree:
    arrays, static = eqx.partition(common, eqx.is_array)
    own = PartitionSpec(axis)
    body = lambda lanes, arrays: _sweep(one, lanes, eqx.combine(arrays, static))  # noqa: E731
    # Without the check, which some loops don't pass: what leaves a device is that device's lanes by construction.
    shared = partial(jax.shard_map, mesh=mesh, in_specs=(own, PartitionSpec()), out_specs=own, check_vma=False)
    return shared(body)(lanes, arrays)
