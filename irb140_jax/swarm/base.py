"""What all swarms share: state, clock, the greedy memory of Algorithms 1 and 2, and what an update rule must say.

A swarm lives in units of its box: 0 is the lower bound of an unknown, 1 the upper.  The rules of the study do not
change under that scaling, and clamps become fractions of the range.  Particles are along the last axis: a processor
takes several at a time, and 27 unknowns would leave a remainder.
"""

import abc
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from irb140_jax.swarm.draws import Draws
from irb140_jax.types import Scalar

# What a setting is given as; `number` makes an array of it.
Number = Scalar | float


def number(*default: float) -> Any:
    """Field of a rule that is a number: an array, so that another value needs no new program."""
    convert = lambda x: jnp.asarray(x, float)  # noqa: E731
    return eqx.field(converter=convert, default=default[0]) if default else eqx.field(converter=convert)


class Clock(NamedTuple):
    """Where the run is: iteration 1 ... iterations; 0 while the swarm is placed."""

    iteration: Array | int
    iterations: int

    @property
    def progress(self) -> Scalar:
        """Share of the iterations done, t/T."""
        return jnp.asarray(self.iteration, float) / self.iterations


S = TypeVar("S", bound="Swarm")  # typing.Self would stop the check of shapes at import


class Swarm(eqx.Module):
    """State of one swarm of p particles with k coordinates each, searching d unknowns (k = d unless it is coded).

    Attributes:
        position: Coordinates of the particles, shape (k, p).
        velocity: Last step of each particle, shape (k, p).
        pbest: Coordinates at which each particle did best, shape (k, p).
        pbest_fitness: Its fitness there, shape (p,); inf before the first number.
        gbest: Coordinates of the best of all, shape (k,).
        gbest_fitness: Its fitness.
        solution: The candidate evaluated there, in units of the box, shape (d,).
        stalled: Iterations since the best of all last improved.
        memory: What else the rule remembers.
    """

    position: Float[Array, "k p"]
    velocity: Float[Array, "k p"]
    pbest: Float[Array, "k p"]
    pbest_fitness: Float[Array, " p"]
    gbest: Float[Array, " k"]
    gbest_fitness: Scalar
    solution: Float[Array, " d"]
    stalled: Int[Array, ""]
    memory: Any = None

    def at(self: S, position: Float[Array, "k p"], velocity: Float[Array, "k p"], **changes: Any) -> S:
        """The swarm moved there."""
        return self.with_(position=position, velocity=velocity, **changes)

    def with_(self: S, **changes: Any) -> S:
        """The swarm with these attributes changed."""
        names = tuple(changes)
        where = lambda swarm: [getattr(swarm, name) for name in names]  # noqa: E731
        return eqx.tree_at(where, self, list(changes.values()), is_leaf=lambda x: x is None)


class Rule(eqx.Module):
    """How a swarm moves.  A new one is a file with a subclass: `move`, and what else differs from the plain case."""

    @abc.abstractmethod
    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        """The swarm after one step: new positions and velocities, not yet evaluated.  Slots of `draws` from 0."""

    def coordinates(self, unknowns: int) -> int:
        """Number of coordinates of a particle."""
        return unknowns

    def start(self, particles: int, unknowns: int, draws: Draws) -> tuple[Float[Array, "k p"], Float[Array, "k p"]]:
        """Positions and velocities at the start: uniform in the box, at rest."""
        position = draws.uniforms(0, (self.coordinates(unknowns), particles))
        return position, jnp.zeros_like(position)

    def first_memory(self, particles: int, unknowns: int) -> Any:
        """`Swarm.memory` at the start."""
        return None

    def candidates(self, position: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        """What is evaluated, in units of the box.  Slots of `draws` from 100."""
        return position

    def remember(self, swarm: Swarm, candidates: Float[Array, "d p"], fitness: Float[Array, " p"]) -> Swarm:
        """Keep what is better than before, as in lines 10 and 11 of Algorithms 1 and 2."""
        better = fitness < swarm.pbest_fitness
        # The least of all, not fitness[i]: gathering a number takes a tenth of the program's compile time.
        i, least = jnp.argmin(fitness), jnp.min(fitness)
        improved = least < swarm.gbest_fitness
        keep = lambda new, old: jnp.where(improved, new, old)  # noqa: E731
        return swarm.with_(
            pbest=jnp.where(better, swarm.position, swarm.pbest),
            pbest_fitness=jnp.where(better, fitness, swarm.pbest_fitness),
            gbest=keep(swarm.position[:, i], swarm.gbest),
            gbest_fitness=keep(least, swarm.gbest_fitness),
            solution=keep(candidates[:, i], swarm.solution),
            stalled=keep(0, swarm.stalled + 1),
        )


class History(NamedTuple):
    """What is recorded of the start and each iteration; arrays of shape (iterations + 1,).

    Attributes:
        best: Best fitness so far.
        velocity: Mean size of a coordinate's step.
        diversity: Standard deviation over the particles, mean over the coordinates.
    """

    best: Float[Array, "*s t"]
    velocity: Float[Array, "*s t"]
    diversity: Float[Array, "*s t"]


def recorded(swarm: Swarm) -> History:
    """One entry of the history."""
    spread = jnp.mean(jnp.sqrt(jnp.maximum(_variance(swarm.position), 0.0)))
    speed = jnp.mean(jnp.mean(jnp.abs(swarm.velocity), axis=1))
    return History(swarm.gbest_fitness, speed, spread)


def _variance(x: Float[Array, "k p"]) -> Float[Array, " k"]:
    """Over the particles, in one pass; about the first of them, so that a swarm drawn together keeps its digits."""
    y = x - x[:, :1]
    mean = jnp.mean(y, axis=1)
    return jnp.mean(y * y, axis=1) - mean * mean


def clamped(x: Float[Array, "*s"], limit: Number) -> Float[Array, "*s"]:
    """x within +-limit; inf leaves it as it is."""
    return jnp.clip(x, -limit, limit)
