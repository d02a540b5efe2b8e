"""Stribeck friction: dry friction that is higher at very low speed."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.grids import geometric_grid
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint


class StribeckFriction(AbstractEffect):
    """tau = (Fc + (Fs - Fc) exp(-(qd/vs)^2)) sign(qd)."""

    slug = "stribeck_friction"
    title = "Stribeck friction"
    equation = "(Fc + (Fs - Fc) exp(-(qd/vs)^2)) sign(qd)"
    source = "R. Stribeck, VDI-Zeitschrift 46, 1902; Armstrong-Helouvry et al., Automatica 30(7), 1994"
    parameters = (
        Parameter("coulomb", "{tau}", low=0.0),
        Parameter("static", "{tau}", low=0.0),
        Parameter("stribeck_velocity", "{q}/s", low=1e-6),
    )
    contains = ("coulomb_friction",)
    variants = ((0, 1),)
    confused_with = {
        "coulomb_friction": "a series of constant speeds from very slow to fast, in both directions",
        "nonlinear_viscous_friction": "several constant speeds in the upper half of the speed range",
        "presliding_hysteresis": "very small motions: before it slips, presliding friction acts like a spring",
    }
    needs = "slow motion at constant speeds, below and above the Stribeck speed"
    friction = True
    dissipative = True
    mjcf = "joint frictionloss, for its constant part"
    not_in_mjcf = "the rise at low speed is left out: frictionloss does not depend on speed"

    def shapes(self, scales, joints):
        speed, rest = float(scales.speed[joints[0]]), float(scales.rest_speed[joints[0]])
        return geometric_grid(max(2.0 * rest, 0.003 * speed), 0.5 * speed, 12)

    def refines(self):
        return True

    def columns(self, motion, joints, shape):
        s = of_site(motion.direction, joints)
        return dry_friction_columns(motion, joints, jnp.exp(-((of_site(motion.qd, joints) / shape[0]) ** 2)) * s)

    def physical(self, w, shape):
        return jnp.stack([w[0], w[0] + w[1], shape[0]])

    def amplitudes(self, values):
        coulomb, static = values["coulomb"], values["static"]
        return np.array([coulomb, static - coulomb]), np.array([values["stribeck_velocity"]])

    def lowest(self, robot, joints):
        return np.array([-float(robot.frictionloss[joints[0]]), 0.0])

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "frictionloss", joints[0], w[0])

    def where(self, names, values, units):
        return (
            f"{names}: below about {values['stribeck_velocity']:.3g} {units['stribeck_velocity']} "
            f"friction rises from {values['coulomb']:.3g} to {values['static']:.3g} {units['static']}"
        )
