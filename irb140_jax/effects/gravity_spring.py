"""Gravity spring: a counterbalance, a cable or a dress pack that pulls the joint towards a rest position."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_spring


class GravitySpring(AbstractEffect):
    """tau = k (q - rest)."""

    slug = "gravity_spring"
    title = "a spring between two links"
    equation = "k (q - rest)"
    source = "Khalil and Dombre 2002, ch. 9"
    parameters = (Parameter("stiffness", "{tau}/{q}"), Parameter("rest", "{q}"))
    contains = ("torque_offset",)
    variants = ((0, 1),)
    confused_with = {
        "torque_offset": "the whole range of the joint",
        "encoder_offset": "the whole range of the joint: a spring torque is linear in position, gravity torque is not",
    }
    needs = "the whole range of the joint, in several postures of the others"
    mjcf = "joint stiffness and springref"
    not_in_mjcf = ""
    own = (0,)

    def columns(self, motion, joints, shape):
        q = of_site(motion.q, joints)
        return jnp.stack([q, jnp.ones_like(q)], axis=-1)

    def physical(self, w, shape):
        return jnp.stack([w[0], -w[1] / jnp.where(w[0] == 0.0, 1.0, w[0])])

    def amplitudes(self, values):
        return values["stiffness"] * np.array([1.0, -values["rest"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.array([-float(robot.stiffness[joints[0]]), -np.inf])  # no spring pushes away from its rest

    def in_model(self, robot, joints, w, shape):
        return with_spring(robot, joints[0], w[0], w[1])

    def where(self, names, values, units):
        return (
            f"{names}: {values['stiffness']:.3g} {units['stiffness']} times the distance from "
            f"{values['rest']:.3g} {units['rest']}, at any speed"
        )
