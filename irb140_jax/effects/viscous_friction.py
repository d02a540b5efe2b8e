"""Viscous friction: a torque that opposes the motion and grows in proportion to speed."""

import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint


class ViscousFriction(AbstractEffect):
    """tau = Fv qd."""

    slug = "viscous_friction"
    title = "viscous friction"
    equation = "Fv qd"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994"
    parameters = (Parameter("viscous", "{tau} s/{q}", low=0.0),)
    variants = ((0,),)
    confused_with = {
        "coulomb_friction": "the same move at two speeds",
        "time_delay": "the same move at two frequencies: the phase shift of a delay grows with frequency",
        "transmission_coupling": "motion of each of the two joints while the other one rests",
    }
    needs = "motion at clearly different speeds"
    ordinary = True
    friction = True
    dissipative = True
    mjcf = "joint damping"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return of_site(motion.qd, joints)[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["viscous"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return -np.asarray(robot.damping)[joints]

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "damping", joints[0], w[0])

    def where(self, names, values, units):
        viscous = f"{values['viscous']:.3g} {units['viscous']}"
        return f"{names}: in proportion to speed, {viscous}, so mostly where the joint is fast"
