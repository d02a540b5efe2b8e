"""The study's quantum particle swarm with its bits as choices: reading D4 of the map that the text leaves open."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, clamped, number
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.qubit_pso import squared_sine
from irb140_jax.swarm.schedule import Schedule, constant, linear


class TwoAttractorsQpso(Rule):
    """Angles move by equations 26 and 27; each unknown's measured bit (28) chooses one of two values near a best.

    A coordinate is three numbers: an angle, the value of a measured 0, the value of a measured 1.  With one attractor
    these values are the particle's own best less and plus the step; with two they are its own best and the best of
    all, each blurred by up to the step.  The text gives neither values nor step.

    Attributes:
        both: Whether the bit chooses between two bests, or between two sides of one.
        step: s(t), as a fraction of the box.
        inertia, c1, c2, velocity_limit: Of the angles, as for `QubitPso`.

    Source: the study's equations 26 to 28; the values are ours.
    """

    both: bool = eqx.field(static=True, default=False)
    step: Schedule = linear(0.1, 0.0)
    inertia: Schedule = constant(0.99)
    c1: Number = number(2.5)
    c2: Number = number(1.5)
    velocity_limit: Number = number(jnp.inf)

    def coordinates(self, unknowns: int) -> int:
        return 3 * unknowns

    def start(self, particles: int, unknowns: int, draws: Draws):
        shape = (unknowns, particles)
        value = draws.uniforms(1, shape)
        position = jnp.concatenate([0.5 * jnp.pi * draws.uniforms(0, shape), value, value])
        return position, jnp.zeros_like(position)

    def candidates(self, position: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        theta, zero, one = jnp.split(position, 3)
        return jnp.where(draws.uniforms(100, theta.shape) < squared_sine(theta), one, zero)

    def remember(self, swarm: Swarm, candidates: Float[Array, "d p"], fitness: Float[Array, " p"]) -> Swarm:
        theta = jnp.split(swarm.position, 3)[0]
        kept = super().remember(
            swarm.with_(position=jnp.concatenate([theta, candidates, candidates])), candidates, fitness
        )
        return kept.with_(position=swarm.position)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        theta = jnp.split(swarm.position, 3)[0]
        (own_theta, own, _), (best_theta, best, _) = jnp.split(swarm.pbest, 3), jnp.split(swarm.gbest[:, None], 3)
        pull = self.c1 * draws.uniforms(0, theta.shape) * (own_theta - theta)
        pull = pull + self.c2 * draws.uniforms(1, theta.shape) * (best_theta - theta)
        v = clamped(self.inertia(clock) * jnp.split(swarm.velocity, 3)[0] + pull, self.velocity_limit)
        s = self.step(clock)
        if self.both:
            blur = lambda slot: s * (2.0 * draws.uniforms(slot, theta.shape) - 1.0)  # noqa: E731
            zero, one = own + blur(2), best + blur(3)
        else:
            zero, one = own - s, own + s
        angles = jnp.clip(theta + v, 0.0, 0.5 * jnp.pi)
        position = jnp.concatenate([angles, jnp.clip(zero, 0.0, 1.0), jnp.clip(one, 0.0, 1.0)])
        return swarm.at(position, jnp.concatenate([v, 0.0 * v, 0.0 * v]))
