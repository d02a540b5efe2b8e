"""Classical particle swarm optimisation: equations 17 to 19 and Algorithm 1 of the study."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, clamped, number
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.schedule import Schedule, constant
from irb140_jax.swarm.stored import stored


class Pso(Rule):
    """v <- w(t) v + c1 r1 (pbest - x) + c2 r2 (gbest - x),  x <- x + v.

    Defaults are the study's where it gives numbers.  It does not say whether x or v are clamped.

    Attributes:
        inertia: w(t): equation 18 `linear(0.99, 0.4)`, section 3 `constant(0.99)`, or `damped(1.0, 0.99)`.
        c1: Pull of the particle's own best.
        c2: Pull of the best of all.
        velocity_limit: Largest |v| as a fraction of the box; inf for none.
        outside: How far a particle may leave the box, as a fraction of it: 0 clamps it to the box, inf lets it go.
        start_speed: Largest |v| at the start, as a fraction of the box.

    Source: the study's equations 17 to 19; Shi and Eberhart (1998), A modified particle swarm optimizer.
    """

    inertia: Schedule = constant(0.99)
    c1: Number = number(2.5)
    c2: Number = number(1.5)
    velocity_limit: Number = number(jnp.inf)
    outside: Number = number(0.0)
    start_speed: Number = number(0.0)

    def start(self, particles: int, unknowns: int, draws: Draws):
        shape = (unknowns, particles)
        return draws.uniforms(0, shape), self.start_speed * (2.0 * draws.uniforms(1, shape) - 1.0)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        x, shape = swarm.position, swarm.position.shape

        def velocity() -> Float[Array, "d p"]:
            own = self.c1 * draws.uniforms(0, shape) * (swarm.pbest - x)
            social = self.c2 * draws.uniforms(1, shape) * (swarm.gbest[:, None] - x)
            return clamped(self.inertia(clock) * swarm.velocity + own + social, self.velocity_limit)

        v = stored(draws.iteration, velocity)
        return swarm.at(jnp.clip(x + v, -self.outside, 1.0 + self.outside), v)
