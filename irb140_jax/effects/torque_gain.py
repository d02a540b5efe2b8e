"""Torque gain: the torque constant of the drive differs from the one that the log assumes."""

import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_gear

LARGEST = 3.0  # beyond, a column holds another unit or another side of the gear


class TorqueGain(AbstractEffect):
    """real torque = gain x logged torque, so the log holds (1/gain - 1) x real torque beyond the model."""

    slug = "torque_gain"
    title = "a wrong torque constant"
    equation = "(1/gain - 1) tau_model"
    source = "Gautier and Briot, Global identification of joint drive gains, JMR 6(2), 2014"
    parameters = (Parameter("gain", "1", low=1 / LARGEST, high=LARGEST),)
    variants = ((0,),)
    confused_with = {
        "payload": "the same motion with and without a known payload",
        "rotor_inertia": "postures with large gravity torque: a gain scales gravity torque, a rotor does not",
        "load_dependent_friction": "the same loads at rest",
    }
    logged = 1
    typical = 0.1  # what torque constants are known to
    needs = "large gravity torque on this joint and on others with the same links, or a known payload"
    mjcf = "the gear of the actuator"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return of_site(motion.total, joints)[:, :, None]

    def passed_on(self, x, dt, w, shape):
        return w[0] * x

    def physical(self, w, shape):
        return 1.0 / (1.0 + w)

    def amplitudes(self, values):
        return np.array([1.0 / values["gain"] - 1.0]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.full(1, 1.0 / LARGEST - 1.0)

    def highest(self, robot, joints):
        return np.full(1, LARGEST - 1.0)

    def in_model(self, robot, joints, w, shape):
        return with_gear(robot, joints[0], 1.0 / (1.0 + w[0]))

    def where(self, names, values, units):
        return (
            f"{names}: in proportion to the whole torque; the real torque is {values['gain']:.3g} times the logged one"
        )
