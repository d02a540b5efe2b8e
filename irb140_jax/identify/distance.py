"""Equation 20 of the study: squared distance to parameters that are known, and a penalty that grows."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.errors import InputError
from irb140_jax.swarm.base import Number, number
from irb140_jax.types import Scalar

Units = Literal["normalised", "si", "mm", "mm_all"]
Violation = Literal["squared", "absolute"]


class Penalty(eqx.Module):
    """lambda(t) P(x), lambda = weight (offset + t/T)^power ratio^(t/T), P of how far x lies outside the box; by entry.

    The study says that the weight grows with the iterations and punishes bound violations, no more.  Customary forms:
    offset 0, power 1: linear; offset 1, power k: polynomial; power 0, ratio > 1: geometric.  A violation is taken as
    a fraction of the box.

    Attributes:
        weight: Of the penalty.
        offset, power, ratio: How it grows.
        violation: P is the sum over the entries of the violations "squared", or of their "absolute" values.
    """

    weight: Number = number(1.0)
    offset: Number = number(0.0)
    power: Number = number(1.0)
    ratio: Number = number(1.0)
    violation: Violation = eqx.field(static=True, default="squared")

    def __call__(self, outside: Float[Array, " d"], progress: Scalar) -> Float[Array, " d"]:
        grown = self.weight * (self.offset + progress) ** self.power * self.ratio**progress
        return grown * (outside**2 if self.violation == "squared" else outside)


class ParameterDistance(eqx.Module):
    """J(x) = sum_i |c_i - c_i,ref|^2 + |I_i - I_i,ref|^2 + lambda(t) P(x), each entry multiplied by its unit.

    Nothing in it comes from a measurement: its minimum is the reference.

    Attributes:
        reference: x_ref, see `link_parameters`.
        unit: Factor of each entry, shape (d,).
        lower, upper: The box, shape (d,).
        penalty: Of leaving it.

    Source: the study's equation 20.
    """

    reference: Float[Array, " d"]
    unit: Float[Array, " d"]
    lower: Float[Array, " d"]
    upper: Float[Array, " d"]
    penalty: Penalty

    def __call__(self, x: Float[Array, " d"], progress: Scalar) -> Scalar:
        beyond = jnp.maximum(jnp.maximum(self.lower - x, x - self.upper), 0.0) / (self.upper - self.lower)
        terms = self.residual(x) ** 2 + self.penalty(beyond, progress)
        # As a product: XLA's sum over so few entries takes a CPU three times as long.
        return terms @ jnp.ones_like(terms)

    def residual(self, x: Float[Array, " d"]) -> Float[Array, " d"]:
        """What is squared, penalty apart."""
        return self.unit * (x - self.reference)


def parameter_distance(
    reference: Float[Array, " d"], lower: Float[Array, " d"], upper: Float[Array, " d"], *, units: Units = "normalised",
    penalty: Penalty | None = None, centres: int | None = None,
) -> ParameterDistance:  # fmt: skip
    """Equation 20 with a reading of its units.

    Args:
        reference: x_ref, see `link_parameters`, or some of them in that order; of a robot's, `Unknowns.distance`.
        lower, upper: The box, shape (d,).
        units: "normalised": each entry divided by its reference; "si": m and kg m^2; "mm": mm and kg m^2; "mm_all":
            mm and kg mm^2.
        penalty: Of leaving the box.
        centres: How many entries, the first, are centres of mass; default a third.

    Raises:
        InputError: An entry of the reference is zero where it would have to divide.
    """
    is_com = jnp.arange(reference.shape[0]) < (reference.shape[0] // 3 if centres is None else centres)
    if units == "normalised":
        if not bool(jnp.all(reference != 0)):
            raise InputError("units 'normalised' divide by the reference, which has a zero; give 'si' or 'mm', or "
                             "leave it out: identify.unknowns(robot, links).distance(...)")
        unit = 1.0 / jnp.abs(reference)
    else:
        com, inertia = {"si": (1.0, 1.0), "mm": (1e3, 1.0), "mm_all": (1e3, 1e6)}[units]
        unit = jnp.where(is_com, com, inertia)
    return ParameterDistance(reference, unit, lower, upper, Penalty() if penalty is None else penalty)


def box(
    reference: Float[Array, " d"], width: float, *, place: Float[Array, " d"] | float = 0.5
) -> tuple[Float[Array, " d"], Float[Array, " d"]]:
    """Box of +-width |x_ref| around the reference, or one in which the reference lies elsewhere.

    Args:
        reference: x_ref, shape (d,).
        width: Half of the box's width, as a fraction of |x_ref|.
        place: Where in the box the reference lies: 0 lower end, 0.5 middle, 1 upper end; shape (d,) or one for all.

    Returns:
        Lower and upper ends, shape (d,).
    """
    half = width * jnp.abs(reference)
    lower = reference - 2.0 * half * place
    return lower, lower + 2.0 * half
