"""Transmission coupling: friction between parts of two joints that turn relative to each other, as in a wrist."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site
from irb140_jax.robot.tree import path


class TransmissionCoupling(AbstractEffect):
    """tau_i = f(v), tau_j = s f(v) with v = qd_i + s qd_j, s = +-1, f(v) = viscous v [+ coulomb sign(v)]."""

    slug = "transmission_coupling"
    title = "friction between two coupled joints"
    equation = "viscous (qd_i + s qd_j) [+ coulomb sign(qd_i + s qd_j)] on joint i, s times that on joint j"
    source = "Khalil and Dombre 2002, ch. 9 (Staubli wrist); Gautier, Dynamic identification of robots, ICRA 1997"
    parameters = (Parameter("viscous", "{tau} s/{q}", low=0.0), Parameter("coulomb", "{tau}", low=0.0))
    variants = ((0,), (0, 1))
    confused_with = {"viscous_friction": "motion of each of the two joints while the other one rests"}
    needs = "motion of both joints at speeds that are not in proportion"
    friction = True
    dissipative = True
    not_in_mjcf = (
        "it is left out: it would need a fixed tendon over both joints (damping, frictionloss)"
    )

    def sites(self, robot):
        # Joints of different branches share no transmission.
        pairs = [
            (i, j) for j in range(robot.n) for i in path(robot.parent, j)[:-1] if robot.is_slide[i] == robot.is_slide[j]
        ]
        pairs.sort()
        return np.array(pairs, dtype=int).reshape(-1, 2)

    def shapes(self, scales, joints):
        return np.array([[1.0], [-1.0]])

    def columns(self, motion, joints, shape):
        qd, rest = of_site(motion.qd, joints), jnp.take(motion.rest_speed, joints)
        sign = jnp.stack([jnp.ones(()), shape[0]])
        relative = qd @ sign
        friction = jnp.stack([relative, jnp.tanh(relative / jnp.linalg.norm(rest))], axis=-1)
        return friction[:, None, :] * sign[None, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["viscous"], values.get("coulomb", 0.0)]), np.array([values.get("sign", 1.0)])

    def lowest(self, robot, joints):
        return np.zeros(2)

    def where(self, names, values, units):
        viscous = f"{values['viscous']:.3g} {units['viscous']}"
        return f"{names}: on both joints, in proportion to their relative speed, {viscous}"
