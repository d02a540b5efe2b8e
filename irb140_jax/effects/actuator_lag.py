"""Actuator lag: the real torque follows the logged torque as a first-order low-pass does."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter
from irb140_jax.effects.motion import of_site


class ActuatorLag(AbstractEffect):
    """T d(real)/dt + real = logged, so the log holds T d(tau)/dt beyond the model."""

    slug = "actuator_lag"
    title = "actuator lag"
    equation = "T d tau/dt"
    source = "Khalil and Dombre, Modeling, Identification and Control of Robots, 2002"
    parameters = (Parameter("time_constant", "s", low=0.0),)
    variants = ((0,),)
    confused_with = {
        "time_delay": "fast motion of several joints: a delay is the same for all of them",
        "joint_elasticity": "a chirp through the first resonance",
        "viscous_friction": "the same move at two frequencies: the phase shift of a lag grows with frequency",
    }
    logged = 2
    needs = "fast changes of this joint's torque"
    history = "depends on the torque commanded before"
    steps = True
    not_in_mjcf = (
        "it is left out: MuJoCo can filter an actuator (dyntype), but then the torque depends on the past"
    )

    def columns(self, motion, joints, shape):
        return of_site(motion.scaled_rate, joints)[:, :, None]

    def passed_on(self, x, dt, w, shape):
        return w[0] * np.gradient(x, dt, axis=0)

    def memory(self, q, tau):
        return tau

    def step(self, memory, q, tau, w, shape, dt):
        # Exact for a torque held over the step; a lag of zero lets it through at once.
        real = tau + (memory - tau) * jnp.where(w > 0.0, jnp.exp(-dt / jnp.where(w > 0.0, w, 1.0)), 0.0)
        return jnp.zeros((len(q), 1)), real, real

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["time_constant"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.zeros(1)

    def where(self, names, values, units):
        late = f"{1e3 * values['time_constant']:.3g} ms"
        return f"{names}: whenever the torque changes; the real torque comes {late} late"
