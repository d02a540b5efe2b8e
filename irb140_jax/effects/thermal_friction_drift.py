"""Thermal friction drift: friction that changes as the joint warms up."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.grids import geometric_grid
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint

FASTEST = 10.0  # s: no gear warms faster; what settles sooner is something else


class ThermalFrictionDrift(AbstractEffect):
    """tau = Fv (1 - drop (1 - exp(-t/T))) qd, t since the recording began, cold."""

    slug = "thermal_friction_drift"
    title = "friction that changes as the joint warms up"
    equation = "Fv (1 - drop (1 - exp(-t/T))) qd"
    source = "Bittencourt et al., IROS 2010; Simoni et al., Robotics and CIM 31, 2015"
    parameters = (
        Parameter("viscous_cold", "{tau} s/{q}", low=0.0),
        Parameter("relative_drop", "1", low=-2.0, high=1.0),
        Parameter("time_constant", "s", low=0.0),
    )
    contains = ("viscous_friction",)
    variants = ((0, 1),)
    confused_with = {
        "nonlinear_viscous_friction": "the same move cold and warm",
        "viscous_friction": "the same move cold and warm",
    }
    needs = "the same motion repeated from cold until warm"
    friction = True
    dissipative = True
    mjcf = "joint damping, as it is once warm"
    not_in_mjcf = "the change is left out: damping does not depend on time"

    def shapes(self, scales, joints):
        duration = max(scales.duration, 1.0)
        return geometric_grid(max(0.05 * duration, FASTEST), max(2.0 * duration, 2.0 * FASTEST), 6)

    def refines(self):
        return True

    def columns(self, motion, joints, shape):
        qd = of_site(motion.qd, joints)
        warm = 1.0 - jnp.exp(-motion.t / shape[0])
        return jnp.stack([qd, -warm[:, None] * qd], axis=-1)

    def physical(self, w, shape):
        return jnp.stack([w[0], w[1] / jnp.where(w[0] == 0.0, 1.0, w[0]), shape[0]])

    def amplitudes(self, values):
        cold = values["viscous_cold"]
        return np.array([cold, cold * values["relative_drop"]]), np.array([values["time_constant"]])

    def lowest(self, robot, joints):
        return np.array([0.0, -np.inf])

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "damping", joints[0], w[0] - w[1])

    def where(self, names, values, units):
        return (
            f"{names}: {values['viscous_cold']:.3g} {units['viscous_cold']} at the start of a recording, "
            f"{100 * values['relative_drop']:.3g} % less once warm, with a time constant of "
            f"{values['time_constant']:.3g} s"
        )
