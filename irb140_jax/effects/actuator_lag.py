"""Actuator lag: the real torque follows the logged torque as a first-order low-pass does."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior


def _columns(motion, joints, shape):
    """T d(real)/dt + real = logged, so the log holds T d(tau)/dt beyond the model."""
    return of_site(motion.scaled_rate, joints)[:, :, None]


def _step(memory, q, tau, w, shape, dt):
    # Exact for a torque held over the step; a lag of zero lets it through at once.
    real = tau + (memory - tau) * jnp.where(w > 0.0, jnp.exp(-dt / jnp.where(w > 0.0, w, 1.0)), 0.0)
    return jnp.zeros((len(q), 1)), real, real


EFFECT = Effect(
    slug="actuator_lag",
    title="actuator lag",
    needs="fast changes of this joint's torque",
    confused_with={
        "time_delay": "fast motion of several joints: a delay is the same for all of them",
        "joint_elasticity": "a chirp through the first resonance",
        "viscous_friction": "the same move at two frequencies: the phase shift of a lag grows with frequency",
    },
    where="whenever the torque changes; the real torque comes {time_constant:ms} late",
    law=Law(
        equation="T d tau/dt",
        source="Khalil and Dombre, Modeling, Identification and Control of Robots, 2002",
        parameters=(Parameter("time_constant", "s", low=0.0),),
        columns=_columns,
        to_log=lambda x, dt, w, shape: w[0] * np.gradient(x, dt, axis=0),
    ),
    place=Place(At.LOG_TIMING),
    prior=Prior(lowest=(0.0,)),
    export=Export(
        not_in_mjcf="it is left out: MuJoCo can filter an actuator (dyntype), but then the torque depends on the past",
        history="depends on the torque commanded before",
        memory=lambda q, tau: tau,
        step=_step,
    ),
)
