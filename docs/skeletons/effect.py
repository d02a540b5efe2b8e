"""Quadratic drag: a torque against the motion that grows with the square of speed."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site


class QuadraticDrag(AbstractEffect):
    """tau = D |qd| qd."""

    slug = "quadratic_drag"
    title = "quadratic drag"
    equation = "D |qd| qd"
    source = "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, ch. 6"
    parameters = (Parameter("drag", "{tau} (s/{q})^2", low=0.0),)
    variants = ((0,),)
    confused_with = {"viscous_friction": "the same move at half and at full speed"}
    needs = "motion at clearly different speeds, up to the fastest"
    dissipative = True

    def columns(self, motion, joints, shape):
        qd = of_site(motion.qd, joints)
        return (jnp.abs(qd) * qd)[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["drag"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.zeros(1)  # a model has no quadratic drag that could be taken away

    def where(self, names, values, units):
        return f"{names}: with the square of speed, {values['drag']:.3g} {units['drag']}, so only in the fast stretches"
