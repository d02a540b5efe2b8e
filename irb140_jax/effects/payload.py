"""Payload: a mass on the last link that is not in the model."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.robot import about_origin, with_phi

REACH = 0.1  # [m] about which what is held lies off the tool: ties moments and inertias to the mass where data don't
SIZES = np.repeat([1.0, REACH, REACH**2], [1, 3, 6])


class Payload(AbstractEffect):
    """tau = Y_tool phi_payload: mass, first moment and inertia of a body held by the last link, about the tool."""

    slug = "payload"
    title = "an unmodelled payload"
    equation = "Y_tool(q, qd, qdd) [m, m c, I]"
    source = "Khalil, Gautier, Lemoine, Identification of the payload inertial parameters, ICRA 2007"
    parameters = (Parameter("mass", "kg", low=0.0),)
    variants = (tuple(range(10)),)
    confused_with = {
        "gravity_tilt": "the same poses with and without a known mass",
        "torque_gain": "the same motion with and without a known payload",
    }
    needs = "motion of the last link in several orientations, slow and fast"
    mjcf = "the last link's inertial"
    everywhere = True
    not_in_mjcf = ""
    tied = True
    own = tuple(range(10))

    def sites(self, robot):
        return np.arange(robot.n)[None, :]

    def columns(self, motion, joints, shape):
        return motion.rigid.held * SIZES

    def physical(self, w, shape):
        return w[:1]

    def amplitudes(self, values):
        c = np.array([values.get(k, 0.0) for k in "xyz"])
        inertia = c @ c * np.eye(3) - np.outer(c, c)
        return values["mass"] * np.concatenate([[1.0], c, inertia[np.triu_indices(3)]]) / SIZES, np.zeros(0)

    def lowest(self, robot, joints):
        return np.concatenate([[0.0], np.full(9, -np.inf)])

    def likely(self, robot):
        del robot
        return self.amplitudes({"mass": 1.0})[0]

    def in_model(self, robot, joints, w, shape):
        return with_phi(robot, robot.phi.at[-1].add(about_origin(robot.tool_position) @ jnp.asarray(w * SIZES)))

    def where(self, names, values, units):
        return f"{names}: in the weight and inertia of the last link, {values['mass']:.3g} kg more than in the model"
