"""Delta-well swarm that tunes its own contraction by how often it succeeds."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, number
from irb140_jax.swarm.delta_well import between, jumped
from irb140_jax.swarm.draws import Draws
from irb140_jax.types import Scalar


class SelfTuningQpso(Rule):
    """x <- p +- a |m - x| ln(1/u);  ln a <- ln a + gain (share of particles that improved - target).

    Too many improvements say that the steps are timid, too few that they are wild: the one-fifth rule, for a swarm.
    The study names "self-tuning mechanisms" as future work and gives no equation.

    Attributes:
        first: Contraction a at the start.
        gain: Change of ln a per iteration and unit of share.
        target: Share of improvements at which a stays.
        least, most: Bounds of a; above 1.78 the swarm would fly apart.
        outside: How far a particle may leave the box, as a fraction of it.

    Source: Rechenberg (1973), Evolutionsstrategie, for the rule; Sun, Feng, Xu (2004) for the well.
    """

    first: Number = number(1.0)
    gain: Number = number(0.5)
    target: Number = number(0.2)
    least: Number = number(0.4)
    most: Number = number(1.2)
    outside: Number = number(0.0)

    def first_memory(self, particles: int, unknowns: int) -> Scalar:
        return jnp.log(self.first)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        attractor = lambda: between(swarm.pbest, swarm.gbest, draws)  # noqa: E731
        return jumped(swarm, attractor, jnp.mean(swarm.pbest, axis=1), jnp.exp(swarm.memory), self.outside, draws)

    def remember(self, swarm: Swarm, candidates: Float[Array, "d p"], fitness: Float[Array, " p"]) -> Swarm:
        share = jnp.mean((fitness < swarm.pbest_fitness).astype(float))
        first = jnp.isinf(swarm.gbest_fitness)  # at the start everything is an improvement
        tuned = swarm.memory + jnp.where(first, 0.0, self.gain * (share - self.target))
        tuned = jnp.clip(tuned, jnp.log(self.least), jnp.log(self.most))
        return Rule.remember(self, swarm, candidates, fitness).with_(memory=tuned)
