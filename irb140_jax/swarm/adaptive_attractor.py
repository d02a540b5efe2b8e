"""Delta-well swarm whose attractors adapt: from everyone's own best to the few best of all, as the swarm agrees."""

import jax.numpy as jnp

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, number
from irb140_jax.swarm.delta_well import between, jumped
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.schedule import Schedule, linear


class AdaptiveAttractorQpso(Rule):
    """x <- p +- a(t) |m - x| ln(1/u) with p = f pbest + (1 - f) e and m the mean of the pbest weighted by rank.

    e is a mean of all pbest whose weights fall with rank, exp(-rank / (p s)); s shrinks from `elite` to nothing with
    t/T, so that early on the swarm follows its better part and at the end gbest alone.  The study names "adaptive
    attractor dynamics" as future work and gives no equation.

    Attributes:
        contraction: a(t).
        elite: Share of the particles that forms the first attractor.
        tilt: Weight of the best in m, 1 + tilt, falling linearly to 1 - tilt of the worst.
        outside: How far a particle may leave the box, as a fraction of it.

    Source: weights by rank: Xi, Sun, Xu (2008), An improved quantum-behaved particle swarm with weighted mean best.
    """

    contraction: Schedule = linear(1.0, 0.5)
    elite: Number = number(0.2)
    tilt: Number = number(0.5)
    outside: Number = number(0.0)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        particles = len(swarm.pbest_fitness)
        fitness = swarm.pbest_fitness
        # Ranks by counting: cheaper to compile than a sort; equal ones in the order of their numbers.
        number_of = jnp.arange(particles)
        before = (fitness[None] < fitness[:, None]) | (
            (fitness[None] == fitness[:, None]) & (number_of[None] < number_of[:, None])
        )
        rank = jnp.sum(before, axis=1)
        width = jnp.maximum(self.elite * particles * (1.0 - clock.progress), 1e-3)
        weight = jnp.exp(-rank / width)
        centre = swarm.pbest @ weight / jnp.sum(weight)
        by_rank = 1.0 + self.tilt * (1.0 - 2.0 * rank / (particles - 1.0))
        mean = swarm.pbest @ by_rank / particles
        attractor = lambda: between(swarm.pbest, centre, draws)  # noqa: E731
        return jumped(swarm, attractor, mean, self.contraction(clock), self.outside, draws)
