"""Position-dependent friction: a stretch of the joint's range that rubs more."""

import itertools

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint

CENTRES, WIDTHS = 8, 3  # grid points of the two shape parameters


class PositionDependentFriction(AbstractEffect):
    """tau = Fc (1 + depth exp(-((q - centre)/width)^2)) sign(qd)."""

    slug = "position_dependent_friction"
    title = "friction that varies along the joint's range"
    equation = "Fc (1 + depth exp(-((q - centre)/width)^2)) sign(qd)"
    source = "Armstrong, Friction: experimental determination, modeling and compensation, ICRA 1988"
    parameters = (
        Parameter("coulomb", "{tau}", low=0.0),
        Parameter("depth", "1", low=-1.0),
        Parameter("centre", "{q}"),
        Parameter("width", "{q}", low=0.0),
    )
    contains = ("coulomb_friction",)
    variants = ((0, 1),)
    confused_with = {
        "load_dependent_friction": "the same positions with another payload",
        "torque_ripple": "the same stretch in both directions: friction changes sign, ripple does not",
    }
    needs = "motion in both directions over the whole range of the joint"
    friction = True
    dissipative = True
    adds_up = True
    mjcf = "joint frictionloss, for its constant part"
    not_in_mjcf = "the change along the range is left out: frictionloss knows no position"

    def shapes(self, scales, joints):
        low, high = float(scales.low[joints[0]]), float(scales.high[joints[0]])
        span = max(high - low, 1e-9)
        centres = low + span * np.linspace(0.05, 0.95, CENTRES)
        return np.array(list(itertools.product(centres, span * np.geomspace(0.06, 0.3, WIDTHS))))

    def refines(self):
        return True

    def finer(self, grid, best):
        centres, widths = np.unique(grid[:, 0]), np.unique(grid[:, 1])
        step = np.min(np.diff(centres)) if len(centres) > 1 else best[1]
        ratio = np.sqrt(widths[1] / widths[0]) if len(widths) > 1 else 1.1
        near = best[0] + step * np.linspace(-1.0, 1.0, CENTRES)
        return np.array(list(itertools.product(near, best[1] * np.geomspace(1 / ratio, ratio, WIDTHS))))

    def columns(self, motion, joints, shape):
        bump = jnp.exp(-(((of_site(motion.q, joints) - shape[0]) / shape[1]) ** 2))
        return dry_friction_columns(motion, joints, bump * of_site(motion.direction, joints))

    def physical(self, w, shape):
        return jnp.stack([w[0], w[1] / jnp.where(w[0] == 0.0, 1.0, w[0]), shape[0], shape[1]])

    def amplitudes(self, values):
        coulomb = values["coulomb"]
        return np.array([coulomb, coulomb * values["depth"]]), np.array([values["centre"], values["width"]])

    def lowest(self, robot, joints):
        return np.array([-float(robot.frictionloss[joints[0]]), -np.inf])

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "frictionloss", joints[0], w[0])

    def where(self, names, values, units):
        return (
            f"{names}: friction of {values['coulomb']:.3g} {units['coulomb']} changes by "
            f"{100 * values['depth']:.3g} % around {values['centre']:.3g} {units['centre']}"
        )
