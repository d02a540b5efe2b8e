"""Payload: a mass on the last link that the model doesn't know."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.robot import with_phi


class Payload(AbstractEffect):
    """tau = Y_last phi_payload: mass, first moment and inertia added to the last link."""

    slug = "payload"
    title = "an unmodelled payload"
    equation = "Y_last(q, qd, qdd) [m, m c, I]"
    source = "Khalil, Gautier, Lemoine, Identification of the payload inertial parameters, ICRA 2007"
    parameters = (Parameter("mass", "kg", low=0.0),)
    variants = (tuple(range(10)),)
    confused_with = {
        "gravity_tilt": "the same poses with and without a known mass",
        "torque_gain": "a known payload, on and off",
    }
    needs = "gravity and acceleration of the last link in several orientations"
    mjcf = "the last link's inertial"
    everywhere = True
    not_in_mjcf = ""
    own = tuple(range(10))

    def sites(self, robot):
        return np.arange(robot.n)[None, :]

    def columns(self, motion, joints, shape):
        return motion.rigid.last_link

    def physical(self, w, shape):
        return w[:1]

    def amplitudes(self, values):
        c = np.array([values.get(k, 0.0) for k in "xyz"])
        inertia = c @ c * np.eye(3) - np.outer(c, c)
        return values["mass"] * np.concatenate([[1.0], c, inertia[np.triu_indices(3)]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.concatenate([[0.0], np.full(9, -np.inf)])

    def likely(self, robot):
        return self.amplitudes({"mass": 1.0, **dict(zip("xyz", np.asarray(robot.tool_position), strict=True))})[0]

    def in_model(self, robot, joints, w, shape):
        return with_phi(robot, robot.phi.at[-1].add(jnp.asarray(w)))

    def where(self, names, values, units):
        return f"{names}: in the weight and inertia of the last link, {values['mass']:.3g} kg more than the model knows"
