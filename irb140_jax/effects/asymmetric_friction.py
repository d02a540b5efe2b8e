"""Asymmetric friction: dry friction with a different level in each direction."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint, with_spring


class AsymmetricFriction(AbstractEffect):
    """tau = Fc+ for qd > 0, -Fc- for qd < 0."""

    slug = "asymmetric_friction"
    title = "friction that differs by direction"
    equation = "Fc+ for qd > 0, -Fc- for qd < 0"
    source = "Armstrong-Helouvry, Control of Machines with Friction, 1991, ch. 2"
    parameters = (Parameter("coulomb_pos", "{tau}", low=0.0), Parameter("coulomb_neg", "{tau}", low=0.0))
    contains = ("coulomb_friction",)
    variants = ((0, 1),)
    confused_with = {
        "torque_offset": "dwells: an offset stays at rest, friction does not",
        "coulomb_friction": "the same path in both directions, with pauses at the same posture",
    }
    needs = "motion in both directions"
    friction = True
    dissipative = True
    mjcf = "joint frictionloss for the mean of both directions, a constant spring torque for half their difference"
    not_in_mjcf = "the difference between the two directions acts at rest too, as a constant torque"

    def columns(self, motion, joints, shape):
        s = of_site(motion.direction, joints)
        return jnp.stack([jnp.maximum(s, 0.0), jnp.minimum(s, 0.0)], axis=-1)

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["coulomb_pos"], values["coulomb_neg"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return -np.repeat(np.asarray(robot.frictionloss)[joints], 2)

    def in_model(self, robot, joints, w, shape):
        level = with_joint(robot, "frictionloss", joints[0], 0.5 * (w[0] + w[1]))
        return with_spring(level, joints[0], 0.0, 0.5 * (w[0] - w[1]))

    def where(self, names, values, units):
        return (
            f"{names}: {values['coulomb_pos']:.3g} {units['coulomb_pos']} while moving in the positive direction, "
            f"{values['coulomb_neg']:.3g} {units['coulomb_neg']} in the negative direction"
        )
