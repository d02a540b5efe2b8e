"""Torque offset: a constant torque, from current sensors, amplifiers or a spring preload."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_spring


class TorqueOffset(AbstractEffect):
    """tau = constant."""

    slug = "torque_offset"
    title = "constant torque offset"
    equation = "tau0"
    source = "Swevers, Verdonck, De Schutter, IEEE Control Systems 27(5), 2007"
    parameters = (Parameter("offset", "{tau}"),)
    variants = ((0,),)
    confused_with = {
        "encoder_offset": "postures in which the derivative of the gravity torque by position changes sign",
        "gravity_spring": "the whole range of the joint",
        "asymmetric_friction": "dwells: an offset stays at rest, friction does not",
    }
    transmission = True
    needs = "postures with clearly different gravity torque"
    mjcf = "joint stiffness and springref: a very soft spring with a large deflection"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return jnp.ones_like(of_site(motion.q, joints))[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["offset"]]), np.zeros(0)

    def in_model(self, robot, joints, w, shape):
        return with_spring(robot, joints[0], 0.0, w[0])

    def where(self, names, values, units):
        return f"{names}: {values['offset']:.3g} {units['offset']} at all positions, speeds and times"
