"""What every left-out effect is: torque along a motion, linear in amplitudes w, nonlinear in a few shape parameters s.

    tau_effect(t) = Phi(q, qd, qdd, load, t; s) w

One file of this folder holds one effect, by the name `EFFECT`; `catalogue.py` finds it there.  From that file come the
screen, the fit, the report, the corrected model, the docs table and the contract tests.
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from irb140_jax.effects.records import NO_SHAPE, NOT_IN_MJCF, Export, Law, Place, Prior, Shapes, Values
from irb140_jax.errors import InputError
from irb140_jax.robot import Robot

# Times the torque that the shape of a simulated link accounts for: beyond, it stands in for something else, as a spring
# of a quarter of its bend does for what smoothing takes off accelerations.
ALIKE = 2.0


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Effect:
    """A kind of left-out physics.

    Attributes:
        slug: Name in the vocabulary; never changes meaning.
        title: A few words for a person.
        needs: The motion that would show it, without a full stop.
        confused_with: Slug of a look-alike -> the motion which separates the two.
        where: At which positions, speeds, loads, times or frequencies it acts, the rest of a sentence: with parameters
            in braces, {name} for value and unit, or a function of values and units by name.
        law: Its torque along a motion.
        place: Where it acts.
        prior: What is to be expected of it before any recording.
        shapes: Which shapes it may have.
        export: What a corrected model and a simulation can do with it.
    """

    slug: str
    title: str
    needs: str
    confused_with: dict[str, str] = dataclasses.field(default_factory=dict)
    where: str | Callable[[Values, dict[str, str]], str]
    law: Law
    place: Place = Place()
    prior: Prior = Prior()
    shapes: Shapes = NO_SHAPE
    export: Export = NOT_IN_MJCF

    def __post_init__(self):
        law, prior, shapes, export = self.law, self.prior, self.shapes, self.export
        rules = {
            f"bounds for each of the law's {law.width} columns, or none": all(
                len(x) in (0, law.width) for x in (prior.lowest, prior.highest)),
            "a proportion for each of the law's own columns, or none": len(prior.proportion) in (0, len(law.own)),
            "`to_log` in laws of the log and in no others": (law.to_log is not None) == self.place.at.of_any_torque,
            "`silent` in laws of servos and in no others": (law.silent is not None) == self.place.of_servos,
            "`from_physical` where there is `to_physical`": law.to_physical is None or law.from_physical is not None,
            "`around` where there is `scan`": (shapes.scan is None) == (shapes.around is None),
            "`at_shape` where a shape `follows`": shapes.follows is None or prior.at_shape is not None,
            "`history` and `memory` where there is `step`": not export.step or bool(export.history and export.memory),
        }  # fmt: skip
        for rule, is_kept in rules.items():
            if not is_kept:
                raise InputError(f"effect {self.slug!r}: an effect has {rule}; see docs/adding-an-effect.md")

    def bounds(self, robot: Robot, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest admissible amplitude of each column at a site, shapes (k,)."""
        return self.prior.bounds(robot, joints, self.law.width)

    def sentence(self, names: str, values: Values, units: dict[str, str]) -> str:
        """Where it acts, of joints by these names, with values and units of the parameters."""
        if not isinstance(self.where, str):
            return f"{names}: {self.where(values, units)}"
        return f"{names}: {self.where.format(**{k: _Shown(v, units[k]) for k, v in values.items()})}"

    def __repr__(self) -> str:
        return f"Effect({self.slug})"


class _Shown(NamedTuple):
    """A parameter in a sentence: 3 digits and the unit, or in the unit that its format asks for."""

    value: float
    unit: str

    def __format__(self, spec: str) -> str:
        others = {"": (1.0, self.unit), "%": (100.0, "%"), "ms": (1e3, "ms"), "deg": (np.degrees(1.0), "deg")}
        if spec not in others:
            return format(self.value, spec)
        factor, unit = others[spec]
        return f"{factor * self.value:.3g} {unit}"


def separating_motion(one: Effect, other: Effect) -> str | None:
    """The motion that separates two look-alikes, by the word of either."""
    return one.confused_with.get(other.slug) or other.confused_with.get(one.slug)
