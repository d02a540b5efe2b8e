"""Encoder offset: the zero of a joint is wrong."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.native import with_joint

LARGEST = 0.5  # [rad or m]; beyond it first order is wrong, and a person sees it


class EncoderOffset(AbstractEffect):
    """q_logged = q + offset: tau(q_logged - offset) - tau(q_logged), to first order, on every joint."""

    slug = "encoder_offset"
    title = "a wrong encoder zero"
    equation = "-offset d tau/d q_j"
    source = "Hollerbach, Khalil, Gautier, Springer Handbook of Robotics, 2016, ch. 6"
    parameters = (Parameter("offset", "{q}"),)
    variants = ((0,),)
    confused_with = {
        "torque_offset": "postures in which the derivative of the gravity torque by position changes sign",
        "gravity_tilt": "a sweep of the first joint over its range",
        "gravity_spring": "the whole range of the joint: a spring torque is linear in position, gravity torque is not",
    }
    needs = (
        "postures in which the derivative of the gravity torque by this joint's position changes sign, or a check of "
        "the zero mark"
    )
    leans_on_inertials = True
    everywhere = True
    mjcf = "the joint's ref"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return -jnp.take(motion.rigid.by_q, joints, axis=2)

    def lowest(self, robot, joints):
        return np.full(1, -LARGEST)

    def highest(self, robot, joints):
        return np.full(1, LARGEST)

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["offset"]]), np.zeros(0)

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "reference", joints[0], w[0])

    def where(self, names, values, units):
        offset = f"{values['offset']:.3g} {units['offset']}"
        return f"{names}: wherever the torque changes with this joint's position; its zero is off by {offset}"
