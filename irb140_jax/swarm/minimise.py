"""Run swarms: seeds x particles x iterations as one compiled scan over one batched array."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh
from jaxtyping import Array, Float, Key

from irb140_jax.errors import InputError
from irb140_jax.sharding import sweep
from irb140_jax.swarm.base import Clock, History, Rule, Swarm, recorded
from irb140_jax.swarm.draws import Draws, Generator
from irb140_jax.types import Scalar

# Fitness of a candidate (d,) at a share of the iterations done, t/T.  A pytree: its arrays are inputs of the program.
Objective = Callable[[Float[Array, " d"], Scalar], Scalar]


class Minima(NamedTuple):
    """What the swarms of s seeds found.

    Attributes:
        x: Best candidates, shape (s, d).
        fitness: Their fitness, shape (s,); inf where every fitness was NaN.
        history: Of the start and each iteration, arrays of shape (s, iterations + 1).
        swarm: The state at the end.
    """

    x: Float[Array, "s d"]
    fitness: Float[Array, " s"]
    history: History
    swarm: Swarm


class Steady(eqx.Module):
    """A fitness that does not change with the iterations, as an `Objective`."""

    fitness: Callable[[Float[Array, " d"]], Scalar]

    def __call__(self, x: Float[Array, " d"], progress: Scalar) -> Scalar:
        return self.fitness(x)


def minimise(
    objective: Objective, rule: Rule, lower: Float[Array, " d"], upper: Float[Array, " d"], *, keys: Key[Array, " s"],
    particles: int = 120, iterations: int = 150, generator: Generator = "hash", mesh: Mesh | None = None,
) -> Minima:  # fmt: skip
    """Best of box-bounded unknowns by swarms of several seeds.

    Another seed, box, or number of the rule or objective needs no new program; another number of seeds does.

    Args:
        objective: Fitness of one candidate, see `Steady` for one without a schedule.  NaN never becomes a best.
        rule: How the swarm moves, with its settings.
        lower: Lower ends of the box, shape (d,).
        upper: Upper ends, shape (d,).
        keys: A key for every seed, see `seed_keys`.
        particles: Size of a swarm.
        iterations: Steps after the first placing.
        generator: Random numbers by "hash" (fast) or "threefry".
        mesh: Devices to share the seeds among, along the mesh's first axis; the result is the same.

    Returns:
        The minima, one a seed.

    Raises:
        InputError: The box is empty or of the wrong shape, or there are too few particles, iterations or seeds.
    """
    lower, upper = _checked(lower, upper, particles, iterations)
    return sweep(_one_seed, keys, objective, rule, lower, upper, particles, iterations, generator, mesh=mesh)


def _checked(lower: Any, upper: Any, particles: int, iterations: int) -> tuple[Array, Array]:
    low, high = np.asarray(lower, float), np.asarray(upper, float)
    if low.shape != high.shape or low.ndim != 1:
        raise InputError(f"box: lower {low.shape} and upper {high.shape}; give two arrays of one shape (d,)")
    wrong = np.flatnonzero(~(np.isfinite(low) & np.isfinite(high) & (low < high)))
    if wrong.size:
        i = wrong[0]
        raise InputError(f"box: unknown {i} lies in [{low[i]}, {high[i]}]; give finite bounds, the lower one below")
    if particles < 2 or iterations < 1:
        raise InputError(f"{particles} particles, {iterations} iterations; give at least 2 particles and 1 iteration")
    return jnp.asarray(low), jnp.asarray(high)


def _one_seed(key, objective, rule: Rule, lower, upper, particles: int, iterations: int, generator: Generator):
    """Algorithms 1 and 2 for one swarm; its start is iteration 0, in which nothing moves: compiled once."""

    def step(swarm: Swarm, iteration: Array):
        clock, draws = Clock(iteration, iterations), Draws(key, iteration, generator)
        moved = _moved(rule, swarm, clock, draws)
        candidates = rule.candidates(moved.position, draws)
        fitness = jax.vmap(objective, (1, None))(lower[:, None] + (upper - lower)[:, None] * candidates, clock.progress)
        kept = rule.remember(moved, candidates, jnp.where(jnp.isnan(fitness), jnp.inf, fitness))
        return kept, recorded(kept)

    start = _placed(rule, particles, lower.shape[0], Draws(key, jnp.asarray(0), generator))
    last, history = lax.scan(step, start, jnp.arange(iterations + 1))
    return Minima(lower + (upper - lower) * last.solution, last.gbest_fitness, history, last)


def _placed(rule: Rule, particles: int, unknowns: int, draws: Draws) -> Swarm:
    """A swarm at its start, not yet evaluated."""
    position, velocity = rule.start(particles, unknowns, draws)
    nothing = jnp.full(particles, jnp.inf)
    return Swarm(
        position, velocity, position, nothing, position[:, 0], nothing[0], jnp.full(unknowns, 0.5), jnp.asarray(0),
        rule.first_memory(particles, unknowns),
    )  # fmt: skip


def _moved(rule: Rule, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
    """The swarm after its move; at the start, as it is.  What a move leaves alone stays out of the branch, uncopied."""
    names = ("position", "velocity", "stalled", "memory")
    parts = lambda swarm: {name: getattr(swarm, name) for name in names}  # noqa: E731
    move = lambda: parts(rule.move(swarm, clock, draws))  # noqa: E731
    return swarm.with_(**lax.cond(draws.iteration > 0, move, lambda: parts(swarm)))
