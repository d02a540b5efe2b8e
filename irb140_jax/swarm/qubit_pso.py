"""The study's quantum particle swarm: velocities on the angles of qubits, equations 21 to 28 and Algorithm 2."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.swarm.base import Clock, Number, Rule, Swarm, clamped, number
from irb140_jax.swarm.decode import Amplitude, Bits, Decode
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.schedule import Schedule, constant
from irb140_jax.swarm.stored import stored

# pi in two parts, the first of 33 bits so that whole multiples of it are exact.
_PI_HIGH = math.floor(math.pi * 2.0**31) / 2.0**31
_PI_LOW = (math.pi - _PI_HIGH) + 1.2246467991473532e-16
# Taylor series of sin(y)/y in y^2, enough for |y| <= pi/2.
_SINE = [(-1.0) ** k / math.factorial(2 * k + 1) for k in range(12)]


class QubitPso(Rule):
    """dtheta <- w dtheta + c1 r1 (theta_pbest - theta) + c2 r2 (theta_gbest - theta),  theta <- theta + dtheta.

    A qubit is cos(theta)|0> + sin(theta)|1>; `decode` says how the angles become unknowns.  Where the best of all has
    not improved for `patience` iterations, a share of the particles is thrown off by up to `perturbation` (line 12 of
    Algorithm 2, which gives no numbers).

    Attributes:
        decode: `Amplitude()` (reading D1) or `Bits(n)` (D3; D2 with n = 1).
        inertia: w(t), as for `Pso`.
        c1: Pull of the particle's own best.
        c2: Pull of the best of all.
        velocity_limit: Largest |dtheta| [rad]; inf for none.
        spread: Angles at the start are uniform in (0, spread) [rad].
        lowest, highest: Angles are clamped to these [rad]; -inf, inf for free ones, as sin^2 has a period.
        patience: Iterations without improvement before a perturbation; inf for never.
        perturbation: Its largest size [rad].
        share: Share of the particles that is perturbed.
        collapse: Whether bests are kept as the bits measured, angles of 0 and pi/2, or as the angles before.
        one_is_beta: Whether |beta|^2 = sin^2 or |alpha|^2 = cos^2 is the probability of a 1.

    Source: the study's equations 21 to 28 and Algorithm 2.
    """

    decode: Decode = Amplitude()
    inertia: Schedule = constant(0.99)
    c1: Number = number(2.5)
    c2: Number = number(1.5)
    velocity_limit: Number = number(jnp.inf)
    spread: Number = number(0.5 * jnp.pi)
    lowest: Number = number(-jnp.inf)
    highest: Number = number(jnp.inf)
    patience: Number = number(10.0)
    perturbation: Number = number(0.05)
    share: Number = number(0.2)
    collapse: bool = eqx.field(static=True, default=False)
    one_is_beta: bool = eqx.field(static=True, default=True)

    def coordinates(self, unknowns: int) -> int:
        return self.decode.angles(unknowns)

    def start(self, particles: int, unknowns: int, draws: Draws):
        theta = self.spread * draws.uniforms(0, (self.coordinates(unknowns), particles))
        return theta, jnp.zeros_like(theta)

    def candidates(self, position: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        beta = stored(draws.iteration, lambda: squared_sine(position))
        return self.decode(beta if self.one_is_beta else 1.0 - beta, draws)

    def remember(self, swarm: Swarm, candidates: Float[Array, "d p"], fitness: Float[Array, " p"]) -> Swarm:
        if not self.collapse or not isinstance(self.decode, Bits):
            return super().remember(swarm, candidates, fitness)
        theta = jnp.where(self.decode.measured(candidates) == self.one_is_beta, 0.5 * jnp.pi, 0.0)
        kept = super().remember(swarm.with_(position=theta), candidates, fitness)
        return kept.with_(position=swarm.position)

    def move(self, swarm: Swarm, clock: Clock, draws: Draws) -> Swarm:
        theta, shape = swarm.position, swarm.position.shape

        def velocity() -> Float[Array, "k p"]:
            own = self.c1 * draws.uniforms(0, shape) * (swarm.pbest - theta)
            social = self.c2 * draws.uniforms(1, shape) * (swarm.gbest[:, None] - theta)
            return clamped(self.inertia(clock) * swarm.velocity + own + social, self.velocity_limit)

        v = stored(draws.iteration, velocity)
        stuck = swarm.stalled >= self.patience
        thrown = stuck & (draws.uniforms(3, (shape[1],)) < self.share)

        throw = self.perturbation * (2.0 * draws.uniforms(2, shape) - 1.0)
        position = jnp.clip(theta + v + jnp.where(thrown, throw, 0.0), self.lowest, self.highest)
        return swarm.at(position, v, stalled=jnp.where(stuck, 0, swarm.stalled))


def squared_sine(theta: Float[Array, "*s"]) -> Float[Array, "*s"]:
    """sin^2(theta) by plain arithmetic, which XLA does several at a time, unlike the library's sine.

    Its period pi is taken off in two parts, which keeps 15 digits for angles up to some 1e5 rad.
    """
    turns = jnp.round(theta / jnp.pi)
    y = (theta - turns * _PI_HIGH) - turns * _PI_LOW
    square = y * y
    series = jnp.full_like(y, _SINE[-1])
    for coefficient in _SINE[-2::-1]:
        series = series * square + coefficient
    return square * series * series
