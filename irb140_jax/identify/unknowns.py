"""Which parameters of a robot's links are sought: a product of inertia that is zero has no percentage and no box."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.identify.distance import ParameterDistance, Penalty, Units, box, parameter_distance
from irb140_jax.identify.judge import mape, sought
from irb140_jax.identify.parameters import link_parameters
from irb140_jax.robot import Robot


class Unknowns(eqx.Module):
    """The parameters of some links, and which of them are sought: u of d; the others stay as they are.

    Attributes:
        reference: All parameters, see `link_parameters`, shape (d,).
        sought: Which are sought, d of them; see `identify.sought`.
        names: Of all parameters, d of them: cx1 ... Izz3.
    """

    reference: Float[Array, " d"]
    sought: tuple[bool, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)

    @property
    def place(self) -> np.ndarray:
        """Where those sought stand among all, shape (u,)."""
        return np.flatnonzero(self.sought)

    @property
    def start(self) -> Float[Array, " u"]:
        """Reference values of those sought."""
        return self.reference[self.place]

    def full(self, unknowns: Float[Array, "*s u"]) -> Float[Array, "*s d"]:
        """All parameters, with these values of those sought."""
        every = jnp.broadcast_to(self.reference, (*unknowns.shape[:-1], len(self.sought)))
        return every.at[..., self.place].set(unknowns)

    def mape(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Equation 30 of estimates of all parameters (s, d), over those sought; see `identify.mape`."""
        return mape(x, np.asarray(self.reference), np.array(self.sought))

    def box(
        self, width: float, *, place: Float[Array, " d"] | float = 0.5
    ) -> tuple[Float[Array, " u"], Float[Array, " u"]]:
        """Lower and upper ends of those sought, shape (u,) each.

        Args:
            width: Half of the box's width, as a fraction of the reference.
            place: Where in the box the reference lies, see `identify.box`; shape (d,) or one for all.
        """
        lower, upper = box(self.reference, width, place=place)
        return lower[self.place], upper[self.place]

    def distance(
        self, width: float, *, place: Float[Array, " d"] | float = 0.5, units: Units = "normalised",
        penalty: Penalty | None = None,
    ) -> ParameterDistance:  # fmt: skip
        """Equation 20 as a function of those sought, shape (u,).

        Args:
            width: Half of the box's width, as a fraction of the reference.
            place: Where in the box the reference lies, shape (d,) or one for all.
            units: See `parameter_distance`.
            penalty: Of leaving the box.
        """
        centres = int(np.sum(self.sought[: len(self.sought) // 3]))
        lower, upper = self.box(width, place=place)
        return parameter_distance(self.start, lower, upper, units=units, penalty=penalty, centres=centres)


def unknowns(robot: Robot, links: Sequence[int]) -> Unknowns:
    """What can be sought of these links: all of `link_parameters` but what is zero.

    Args:
        robot: Arm with n joints.
        links: Which of its links, counted from 0.

    Raises:
        InputError: A link there is not, or one twice.
    """
    x = link_parameters(robot, links)
    return Unknowns(x, tuple(sought(np.asarray(x)).tolist()), parameter_names(links))


def parameter_names(links: Sequence[int]) -> tuple[str, ...]:
    """Names of `link_parameters` in its order, links counted from 1: cx1, cy1 ... Iyz3, Izz3."""
    elements = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
    centres = [f"c{axis}{i + 1}" for i in links for axis in "xyz"]
    return (*centres, *(f"{element}{i + 1}" for i in links for element in elements))
