"""A number that changes with the iterations, as inertia weights and contraction coefficients do."""

import equinox as eqx
import jax.numpy as jnp

from irb140_jax.swarm.base import Clock, Number, number
from irb140_jax.types import Scalar


class Schedule(eqx.Module):
    """w(t) = (first - (first - last) t/T) factor^(t-1), iterations t = 1 ... T.

    One form for all, so that trying another schedule compiles nothing anew.  Equation 18 of the study is factor = 1.

    Attributes:
        first: w at the start.
        last: w at the end of a linear decrease.
        factor: Damping per iteration.
    """

    first: Number = number()
    last: Number = number()
    factor: Number = number(1.0)

    def __call__(self, clock: Clock) -> Scalar:
        decay = self.factor ** (jnp.asarray(clock.iteration, float) - 1.0)
        return (self.first - (self.first - self.last) * clock.progress) * decay


def constant(value: float) -> Schedule:
    """w(t) = value."""
    return Schedule(value, value)


def linear(first: float, last: float) -> Schedule:
    """w(t) = first - (first - last) t/T."""
    return Schedule(first, last)


def damped(first: float, factor: float) -> Schedule:
    """w(t) = first factor^(t-1)."""
    return Schedule(first, first, factor)
