"""From qubit angles to unknowns: the map that the study leaves open (readings D1, D2, D3)."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from irb140_jax.errors import InputError
from irb140_jax.swarm.draws import Draws


class Decode(eqx.Module):
    """How angles become candidates in units of the box."""

    @abc.abstractmethod
    def angles(self, unknowns: int) -> int:
        """Number of angles for so many unknowns."""

    @abc.abstractmethod
    def __call__(self, ones: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        """Candidates, given the probability with which each qubit is measured as 1."""


class Amplitude(Decode):
    """D1: no collapse, the unknown is the probability itself, p = lower + (upper - lower) sin^2(theta)."""

    def angles(self, unknowns: int) -> int:
        return unknowns

    def __call__(self, ones: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        return ones


class Bits(Decode):
    """D3: so many qubits an unknown, measured by equation 28 and read as a binary number; D2 is one qubit an unknown.

    bit = 1 if r < |beta|^2, r ~ U(0, 1);  p = lower + (upper - lower) sum_b bit_b 2^(n-1-b) / (2^n - 1)

    Attributes:
        number: Qubits an unknown, n.
    """

    number: int = eqx.field(static=True, default=12)

    def __check_init__(self):
        if not 1 <= self.number <= 52:
            raise InputError(f"Bits: {self.number} qubits an unknown; give 1 to 52, as a float64 holds no more")

    def angles(self, unknowns: int) -> int:
        return unknowns * self.number

    def __call__(self, ones: Float[Array, "k p"], draws: Draws) -> Float[Array, "d p"]:
        bits = draws.uniforms(100, ones.shape) < ones
        places = 2.0 ** np.arange(self.number - 1, -1, -1)[:, None]
        whole = jnp.where(bits.reshape(-1, self.number, ones.shape[1]), places, 0.0).sum(axis=1)
        return whole / (2.0**self.number - 1.0)  # divided last, as whole numbers are summed without rounding

    def measured(self, candidates: Float[Array, "d p"]) -> Bool[Array, "k p"]:
        """The bits of these candidates."""
        whole = jnp.round(candidates * (2.0**self.number - 1.0)).astype(int)[:, None]
        bits = (whole & 2 ** np.arange(self.number - 1, -1, -1)[:, None]) > 0
        return bits.reshape(-1, candidates.shape[1])
