"""Coulomb friction: a torque of constant size that opposes the motion."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint


class CoulombFriction(AbstractEffect):
    """tau = Fc sign(qd)."""

    slug = "coulomb_friction"
    title = "Coulomb friction"
    equation = "Fc sign(qd)"
    source = "C. A. Coulomb, Theorie des machines simples, 1785; Armstrong-Helouvry et al., Automatica 30(7), 1994"
    parameters = (Parameter("coulomb", "{tau}", low=0.0),)
    variants = ((0,),)
    confused_with = {
        "stribeck_friction": "a series of constant speeds from very slow to fast, in both directions",
        "load_dependent_friction": "the same speeds under several gravity loads or payloads",
        "asymmetric_friction": "the same path in both directions, with pauses at the same posture",
        "viscous_friction": "the same move at two speeds",
    }
    needs = "motion that reverses direction"
    ordinary = True
    friction = True
    dissipative = True
    mjcf = "joint frictionloss"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return of_site(motion.direction, joints)[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["coulomb"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return -np.asarray(robot.frictionloss)[joints]

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "frictionloss", joints[0], w[0])

    def where(self, names, values, units):
        level = f"{values['coulomb']:.3g} {units['coulomb']}"
        return f"{names}: a step from -{level} to {level} at every reversal of the motion, whatever the speed"


def dry_friction_columns(motion, joints, second):
    """Columns [sign(qd), second], the shape shared by friction laws that refine Coulomb's, (T, m, 2)."""
    return jnp.stack([of_site(motion.direction, joints), second], axis=-1)
