"""A second stage for small networks: Levenberg-Marquardt on the position error, in double precision."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from irb140_jax.learned.judge import position_errors
from irb140_jax.learned.mlp import KinematicMlp
from irb140_jax.learned.samples import Samples
from irb140_jax.learned.task import Task
from irb140_jax.types import Scalar, Vec3

# Samples whose Jacobians are held at a time: some MB for hundreds of weights.
CHUNK = 500
# A step that helps divides the damping by 3, one that doesn't multiplies it by 4; Marquardt's rule with milder factors.
EASE, TIGHTEN = 3.0, 4.0


class Refinement(eqx.Module):
    """Where the second stage stands.

    Attributes:
        network: Its weights are in double precision.
        damping: Of the normal equations, in units of their diagonal.
    """

    network: KinematicMlp
    damping: Scalar


class Normal(NamedTuple):
    """Normal equations of the position errors r: J^T J, J^T r and |r|^2 [m^2] of w weights."""

    matrix: Float[Array, "w w"]
    slope: Float[Array, " w"]
    squares: Scalar


def begin_refinement(network: KinematicMlp) -> Refinement:
    """The state before the first step."""
    double = lambda x: x.astype(float) if eqx.is_inexact_array(x) else x  # noqa: E731
    return Refinement(jax.tree.map(double, network), jnp.full((), 1e-2))


@eqx.filter_jit
def refine(
    state: Refinement, task: Task, training: Samples, validation: Samples, steps: int
) -> tuple[Refinement, Float[Array, " steps"]]:
    """Some steps of (J^T J + damping diag(J^T J)) step = -J^T r.

    The cost of a step grows with the square of the number of weights, so that it suits hundreds of them: 50 neurons.
    A penalty of the task counts for nothing here.  `optimistix` would hold all Jacobians at once, over 1 GB.

    Args:
        state: Where to go on from, see `begin_refinement`.
        task: What is asked.
        training: Samples to learn from; those that do not fill a chunk of 500 are left out, unless all are fewer.
        validation: Samples to report on.
        steps: How many.

    Returns:
        The state then, and the mean position error on the validation samples after each step [m], shape (steps,).

    Source: Marquardt, J. SIAM 11 (1963); usual for networks of this size since Hagan and Menhaj, IEEE Trans. Neural
        Networks 5 (1994).
    """
    weights, unravel = ravel_pytree(eqx.filter(state.network.layers, eqx.is_array))
    static = eqx.filter(state.network.layers, eqx.is_array, inverse=True)
    size = min(CHUNK, len(training.q))
    pair = task.inputs(training), training.position
    chunks = tuple(x[: len(x) // size * size].reshape(-1, size, x.shape[1]) for x in pair)

    def network(w: Float[Array, " w"]) -> KinematicMlp:
        return eqx.tree_at(lambda n: n.layers, state.network, eqx.combine(unravel(w), static))

    def residual(w: Float[Array, " w"], x: Float[Array, " i"], position: Vec3) -> Vec3:
        return task.answer(network(w), x)[1] - position

    def squares(w: Float[Array, " w"]) -> Scalar:
        one = lambda pair: jnp.sum(jax.vmap(residual, (None, 0, 0))(w, *pair) ** 2)  # noqa: E731
        return jnp.sum(jax.lax.map(one, chunks))

    def normal(w: Float[Array, " w"]) -> Normal:
        def added(total: Normal, pair):
            r = jax.vmap(residual, (None, 0, 0))(w, *pair).ravel()
            J = jax.vmap(jax.jacrev(residual), (None, 0, 0))(w, *pair).reshape(len(r), -1)
            return Normal(total.matrix + J.T @ J, total.slope + J.T @ r, total.squares + r @ r), None

        nothing = Normal(jnp.zeros((len(w), len(w))), jnp.zeros(len(w)), jnp.zeros(()))
        return jax.lax.scan(added, nothing, chunks)[0]

    def step(carry, _):
        w, damping, here = carry
        diagonal = jnp.diag(here.matrix)
        # A neuron that no sample excites has no diagonal of its own.
        damped = here.matrix + damping * jnp.diag(diagonal + 1e-12 * jnp.max(diagonal))
        there = w - jnp.linalg.solve(damped, here.slope)
        better = squares(there) < here.squares
        moved = lambda: (there, damping / EASE, normal(there))  # noqa: E731
        carry = jax.lax.cond(better, moved, lambda: (w, damping * TIGHTEN, here))
        return carry, jnp.mean(position_errors(task, network(carry[0]), validation))

    (w, damping, _), errors = jax.lax.scan(step, (weights, state.damping, normal(weights)), None, steps)
    return Refinement(network(w), damping), errors
