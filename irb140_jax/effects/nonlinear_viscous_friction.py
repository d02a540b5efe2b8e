"""Nonlinear viscous friction: lubricant that thins or thickens with speed."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.grids import between_neighbours
from irb140_jax.effects.motion import of_site


class NonlinearViscousFriction(AbstractEffect):
    """tau = k |qd|^a sign(qd)."""

    slug = "nonlinear_viscous_friction"
    title = "nonlinear viscous friction"
    equation = "k |qd|^a sign(qd)"
    source = "Waiboer, Aarts, Jonker, Multibody System Dynamics 14, 2005; Bittencourt et al., IROS 2010"
    parameters = (Parameter("coefficient", "{tau} (s/{q})^a", low=0.0), Parameter("exponent", "1", low=0.4, high=3.0))
    contains = ("viscous_friction",)
    absorbs = False  # k |qd|^a + d qd has no exponent of its own
    variants = ((0,),)
    confused_with = {
        "thermal_friction_drift": "the same move cold and warm",
        "stribeck_friction": "several constant speeds in the upper half of the speed range",
        "viscous_friction": "constant speeds over the whole speed range",
    }
    needs = "constant speeds over the whole speed range"
    friction = True
    dissipative = True
    not_in_mjcf = "it is left out: joint damping is proportional to speed"

    def shapes(self, scales, joints):
        return np.array([0.4, 0.5, 0.65, 0.8, 1.3, 1.6, 1.9, 2.3, 3.0])[:, None]

    def refines(self):
        return True

    def finer(self, grid, best):
        # Of a law that bends more than any on the grid, dry or viscous friction would be left over.
        return between_neighbours(grid, best, beyond=True)

    def columns(self, motion, joints, shape):
        # Powers of |qd| have no slope at rest: the rounded sign keeps them smooth.
        qd = of_site(motion.qd, joints)
        size = jnp.sqrt(qd**2 + 1e-4 * jnp.take(motion.rest_speed, joints) ** 2)
        return (size ** shape[0] * of_site(motion.direction, joints))[:, :, None]

    def physical(self, w, shape):
        return jnp.stack([w[0], shape[0]])

    def amplitudes(self, values):
        return np.array([values["coefficient"]]), np.array([values["exponent"]])

    def lowest(self, robot, joints):
        return np.zeros(1)

    def where(self, names, values, units):
        how = "less" if values["exponent"] < 1 else "more"
        return f"{names}: at all speeds; it grows {how} than linearly, as speed to the power {values['exponent']:.2g}"
