"""Torques that act on the arm beside the motors'."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp

from irb140_jax.dynamics.scalar_arm import Scalars
from irb140_jax.dynamics.scalars import Number
from irb140_jax.dynamics.trig import sincos
from irb140_jax.types import Joints, Scalar


class AbstractDisturbance(eqx.Module):
    """A torque out of time and of what the motors give."""

    @abstractmethod
    def torque(self, t: Number, tau: Scalars) -> Scalars:
        """Joint torques added to the motors' tau at time t [s]; n scalars [N m or N]."""


class SinusoidalTorque(AbstractDisturbance):
    """d = (a + r tau) sin(2 pi f t + phase): a fixed amplitude, a share of the motor's momentary torque, or both.

    Attributes:
        amplitude: a [N m or N], shape (n,).
        share: r [1], shape (n,).
        frequency: f [Hz], shape ().
        phase: Phase of the sine at t = 0 [rad], shape ().
    """

    amplitude: Joints
    share: Joints
    frequency: Scalar
    phase: Scalar

    def torque(self, t: Number, tau: Scalars) -> Scalars:
        """Joint torques [N m or N], n scalars."""
        sine, _ = sincos(jnp.asarray(2.0 * jnp.pi * self.frequency * t + self.phase))
        amplitude, share = jnp.unstack(self.amplitude), jnp.unstack(self.share)
        return [(a + r * x) * sine for a, r, x in zip(amplitude, share, tau, strict=True)]


def no_disturbance(n: int) -> SinusoidalTorque:
    """A disturbance of zero, of the same kind as `SinusoidalTorque`, so that both run in one batch."""
    return SinusoidalTorque(jnp.zeros(n), jnp.zeros(n), jnp.ones(()), jnp.zeros(()))
