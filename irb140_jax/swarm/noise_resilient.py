"""Delta-well swarm for noisy fitness: bests are measured again, and believed by their mean, not by their luck."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, number
from irb140_jax.swarm.delta_well import between, jumped
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.schedule import Schedule, linear


class NoiseResilientQpso(Rule):
    """A random share of the particles measures its own pbest again instead of jumping; pbest fitness is the mean.

    A greedy swarm keeps whichever candidate was lucky, for ever.  Here every pbest is measured again now and then and
    the leader is the pbest of least mean, so luck averages out; the number of evaluations stays the same.  The study
    names "noise-resilient architectures" as future work and gives no equation.

    Attributes:
        contraction: a(t) of the well.
        again: Share of the particles that measure again in an iteration.
        outside: How far a particle may leave the box, as a fraction of it.

    Source: resampling as in Jin and Branke (2005), Evolutionary optimization in uncertain environments, sec. II.
    """

    contraction: Schedule = linear(1.0, 0.5)
    again: Number = number(0.3)
    outside: Number = number(0.0)

    def first_memory(self, particles: int, unknowns: int):
        """How often each pbest was measured, and who measures again now."""
        return jnp.zeros(particles), jnp.zeros(particles, bool)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        attractor = lambda: between(swarm.pbest, swarm.gbest, draws)  # noqa: E731
        mean = jnp.mean(swarm.pbest, axis=1)
        moved = jumped(swarm, attractor, mean, self.contraction(clock), self.outside, draws)
        again = draws.uniforms(2, swarm.pbest_fitness.shape) < self.again
        x = jnp.where(again, swarm.pbest, moved.position)
        return swarm.at(x, x - swarm.position, memory=(swarm.memory[0], again))

    def remember(self, swarm: Swarm, candidates: Float[Array, "d p"], fitness: Float[Array, " p"]) -> Swarm:
        count, again = swarm.memory
        known = jnp.where(count > 0, swarm.pbest_fitness, 0.0)
        mean = jnp.where(jnp.isfinite(fitness), (count * known + fitness) / (count + 1.0), swarm.pbest_fitness)
        better = ~again & (fitness < swarm.pbest_fitness)
        pbest = jnp.where(better, swarm.position, swarm.pbest)
        pbest_fitness = jnp.where(better, fitness, jnp.where(again, mean, swarm.pbest_fitness))
        count = jnp.where(better, 1.0, count + again)
        i, least = jnp.argmin(pbest_fitness), jnp.min(pbest_fitness)
        improved = least < swarm.gbest_fitness
        return swarm.with_(
            pbest=pbest, pbest_fitness=pbest_fitness, gbest=pbest[:, i], gbest_fitness=least,
            solution=pbest[:, i], stalled=jnp.where(improved, 0, swarm.stalled + 1), memory=(count, again),
        )  # fmt: skip
