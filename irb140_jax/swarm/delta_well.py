"""Quantum-behaved particle swarm in the usual sense: particles in a delta potential well, without velocity."""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, number
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.schedule import Schedule, linear
from irb140_jax.swarm.stored import stored
from irb140_jax.types import Scalar


class DeltaWellQpso(Rule):
    """x <- p +- a(t) |m - x| ln(1/u),  p = f pbest + (1 - f) gbest,  m = mean of all pbest,  f, u ~ U(0, 1).

    Attributes:
        contraction: a(t); below 1.78 a particle stays bounded.
        outside: How far a particle may leave the box, as a fraction of it.

    Source: Sun, Feng, Xu (2004), Particle swarm optimization with particles having quantum behavior.
    """

    contraction: Schedule = linear(1.0, 0.5)
    outside: Number = number(0.0)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        attractor = lambda: between(swarm.pbest, swarm.gbest, draws)  # noqa: E731
        mean = jnp.mean(swarm.pbest, axis=1)
        return jumped(swarm, attractor, mean, self.contraction(clock), self.outside, draws)


def between(own: Float[Array, "d p"], others: Float[Array, " d"], draws: Draws) -> Float[Array, "d p"]:
    """Random points between each particle's own attractor and the common one; takes slot 0."""
    f = draws.uniforms(0, own.shape)
    return f * own + (1.0 - f) * others[:, None]


def jumped(
    swarm: Swarm, attractor: Callable[[], Float[Array, "d p"]], mean: Float[Array, " d"], contraction: Scalar,
    outside: Number, draws: Draws,
) -> Swarm:  # fmt: skip
    """The swarm after a jump drawn from the wells around the attractors; takes slot 1.

    One number serves for sign and size, as |2u - 1| is again uniform and independent of the sign.
    """

    def position() -> Float[Array, "d p"]:
        u = 2.0 * draws.uniforms(1, swarm.position.shape) - 1.0
        size = contraction * jnp.abs(mean[:, None] - swarm.position) * -jnp.log(jnp.abs(u))
        return jnp.clip(attractor() + jnp.sign(u) * size, -outside, 1.0 + outside)

    x = stored(draws.iteration, position)
    return swarm.at(x, x - swarm.position)
