"""Particle swarm with Clerc and Kennedy's constriction: a stable choice of coefficients on the same problem."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, clamped, number
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.stored import stored


class ConstrictedPso(Rule):
    """v <- chi (v + c r1 (pbest - x) + c r2 (gbest - x)),  chi = 2 / (2c - 2 + sqrt(4c^2 - 8c)),  x <- x + v.

    With c = 2.05 that is w = 0.7298, c1 = c2 = 1.4962.

    Attributes:
        c: Pull of either best, more than 2.
        velocity_limit: Largest |v| as a fraction of the box.
        outside: How far a particle may leave the box, as a fraction of it.

    Source: Clerc and Kennedy (2002), The particle swarm: explosion, stability, and convergence.
    """

    c: Number = number(2.05)
    velocity_limit: Number = number(1.0)
    outside: Number = number(0.0)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        x, shape = swarm.position, swarm.position.shape
        chi = 2.0 / (2.0 * self.c - 2.0 + jnp.sqrt(4.0 * self.c**2 - 8.0 * self.c))

        def velocity() -> Float[Array, "d p"]:
            pull = draws.uniforms(0, shape) * (swarm.pbest - x) + draws.uniforms(1, shape) * (swarm.gbest[:, None] - x)
            return clamped(chi * (swarm.velocity + self.c * pull), self.velocity_limit)

        v = stored(draws.iteration, velocity)
        return swarm.at(jnp.clip(x + v, -self.outside, 1.0 + self.outside), v)
