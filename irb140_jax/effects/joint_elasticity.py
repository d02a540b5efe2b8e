"""Joint elasticity: a spring between motor and link; positions are the motor's."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter


class JointElasticity(AbstractEffect):
    """q_link = q - u, u = tau/K, which changes the torque by -(d tau/dq u + d tau/dqd du/dt + M d2u/dt2)."""

    slug = "joint_elasticity"
    title = "a flexible transmission"
    equation = "-(d tau/dq_j u + d tau/dqd_j du/dt + M_j d2u/dt2), u = tau_j/K"
    source = "M. W. Spong, Modeling and control of elastic joint robots, ASME JDSMC 109, 1987, to first order in 1/K"
    parameters = (Parameter("stiffness", "{tau}/{q}", low=0.0),)
    variants = ((0,),)
    confused_with = {
        "rotor_inertia": "a chirp through the first resonance",
        "actuator_lag": "a chirp through the first resonance",
        "encoder_offset": "postures with gravity of either sign",
    }
    needs = "fast motion near the first resonance, or large gravity of either sign"
    leans_on_inertials = True
    everywhere = True
    history = "bends with the rate of its load, which takes a state of the link beside that of the motor"
    not_in_mjcf = "it is left out: a flexible joint takes a second joint, and the model another size"

    def columns(self, motion, joints, shape):
        rigid = motion.rigid
        bend, rate, curve = (jnp.take(x, joints, axis=1) for x in (motion.load, motion.load_rate, motion.load_curve))
        at = lambda x: jnp.take(x, joints, axis=2)[:, :, 0]  # noqa: E731
        return -(at(rigid.by_q) * bend + at(rigid.by_qd) * rate + at(rigid.mass) * curve)[:, :, None]

    def physical(self, w, shape):
        return 1.0 / jnp.where(w == 0.0, 1e-12, w)

    def amplitudes(self, values):
        return np.array([1.0 / values["stiffness"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.zeros(1)

    def where(self, names, values, units):
        stiffness = f"{values['stiffness']:.3g} {units['stiffness']}"
        return f"{names}: where its torque changes quickly and where gravity bends it; {stiffness}"
