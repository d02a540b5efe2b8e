"""Load-dependent friction: friction of a gear that grows with the torque it transmits."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint


class LoadDependentFriction(AbstractEffect):
    """tau = (Fc + mu |transmitted torque|) sign(qd)."""

    slug = "load_dependent_friction"
    title = "friction that grows with load"
    equation = "(Fc + mu |load|) sign(qd)"
    source = "Hamon, Gautier, Garrec, IROS 2010; Duclusaud et al., arXiv 2410.08650"
    parameters = (Parameter("load_coefficient", "1", low=0.0), Parameter("coulomb", "{tau}", low=0.0))
    contains = ("coulomb_friction",)
    variants = ((0, 1), (1,))  # some gears rub next to nothing without load
    confused_with = {
        "coulomb_friction": "the same speed under several gravity loads or payloads",
        "position_dependent_friction": "the same positions with another payload",
        "torque_gain": "the same loads at rest",
    }
    needs = "motion in both directions under clearly different loads"
    friction = True
    dissipative = True
    mjcf = "joint frictionloss, for its constant part"
    not_in_mjcf = "the part that grows with the load is left out: frictionloss does not depend on load"

    def columns(self, motion, joints, shape):
        load = jnp.abs(of_site(motion.load, joints))
        return dry_friction_columns(motion, joints, load * of_site(motion.direction, joints))

    def physical(self, w, shape):
        return jnp.stack([w[1], w[0]])

    def amplitudes(self, values):
        return np.array([values["coulomb"], values["load_coefficient"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.array([-float(robot.frictionloss[joints[0]]), 0.0])

    def in_model(self, robot, joints, w, shape):
        return with_joint(robot, "frictionloss", joints[0], w[0])

    def where(self, names, values, units):
        return (
            f"{names}: against the motion, {values['coulomb']:.3g} {units['coulomb']} plus "
            f"{100 * values['load_coefficient']:.3g} % of the transmitted torque"
        )
