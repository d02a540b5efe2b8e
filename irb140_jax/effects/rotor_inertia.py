"""Rotor inertia: the inertia of the motor, multiplied by the square of the gear ratio."""

import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint


class RotorInertia(AbstractEffect):
    """tau = J qdd, J on the joint side."""

    slug = "rotor_inertia"
    title = "rotor inertia"
    equation = "J qdd"
    source = "Khalil and Dombre, Modeling, Identification and Control of Robots, 2002, ch. 9"
    parameters = (Parameter("inertia", "{tau} s^2/{q}", low=0.0),)
    variants = ((0,),)
    confused_with = {
        "joint_elasticity": "a chirp through the first resonance",
        "actuator_lag": "reversals at several accelerations: a lag shifts the step of friction in time",
    }
    needs = "high acceleration of the joint while the joints before it move too"
    transmission = True
    mjcf = "joint armature"
    not_in_mjcf = ""

    def columns(self, motion, joints, shape):
        return of_site(motion.qdd, joints)[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["inertia"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return -np.asarray(robot.armature)[joints]

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "armature", joints[0], w[0])

    def where(self, names, values, units):
        return f"{names}: in proportion to the joint's own acceleration, {values['inertia']:.3g} {units['inertia']}"
