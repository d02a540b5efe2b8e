"""Joint elasticity: a spring between motor and link; the logged positions are those of the motor."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from irb140_jax.effects.base import ALIKE, Effect
from irb140_jax.effects.grids import between_neighbours, geometric_grid
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes

DAMPING = 0.05  # of the link on its spring, relative to critical: what harmonic drives show (Spong; Tuttle and Seering)
MODES = (6.0, 80.0)  # Hz; softer is no robot, stiffer moves nothing below 20 Hz
# Neighbours are a resonance's width apart, at half its power: coarser, and none between them has its amplitude.
POINTS = 1 + int(np.ceil(np.log(MODES[1] / MODES[0]) / np.log1p(2.0 * DAMPING)))
NUMERICAL_DAMPING = 0.05  # Newmark's gamma beyond 1/2: takes out modes that the samples can't follow


def _columns(motion, joints, shape):
    """q_link = q - u, with u the deflection of the spring: M d2u/dt2 + (d tau/dqd + D) du/dt + (d tau/dq + K) u = tau.

    The link swings on its spring, so u is simulated along the motion by Newmark's rule for a compliance 1/K on the
    grid; the amplitude is one where the grid has the right one.
    """
    rigid, dt = motion.rigid, motion.t[1] - motion.t[0]
    at = lambda x: jnp.take(x, joints, axis=2)[:, :, 0]  # noqa: E731
    own = lambda x: jnp.take(at(x), joints, axis=1)[:, 0]  # noqa: E731
    load, mass = jnp.take(motion.carried, joints, axis=1)[:, 0], own(rigid.mass)
    damping = 2.0 * DAMPING * jnp.sqrt(shape[0] * mass) + shape[0] * own(rigid.by_qd)
    v = _swing(load, shape[0] * mass, damping, 1.0 + shape[0] * own(rigid.by_q), dt)
    bend, rate, curve = (x[:, None] for x in v)
    return -shape[0] * (at(rigid.by_q) * bend + at(rigid.by_qd) * rate + at(rigid.mass) * curve)[:, :, None]


def _grid(scales, joints):
    soft, stiff = (1.0 / (float(scales.inertia[joints[0]]) * (2.0 * np.pi * f) ** 2) for f in MODES)
    return geometric_grid(stiff, soft, POINTS)


def _swing(load, mass, damping, spring, dt):
    """Solution v, dv/dt, d2v/dt2 of mass d2v + damping dv + spring v = load, each (T,), bent by the load at first."""
    gamma = 0.5 + NUMERICAL_DAMPING
    beta = 0.25 * (gamma + 0.5) ** 2

    def step(state, now):
        v, rate, curve = state
        force, m, d, k = now
        v_ahead = v + dt * rate + dt**2 * (0.5 - beta) * curve
        rate_ahead = rate + dt * (1.0 - gamma) * curve
        new = (force - d * rate_ahead - k * v_ahead) / (m + gamma * dt * d + beta * dt**2 * k)
        state = (v_ahead + beta * dt**2 * new, rate_ahead + gamma * dt * new, new)
        return state, state

    begin = (load[0] / spring[0], (load[1] / spring[1] - load[0] / spring[0]) / dt, jnp.zeros_like(load[0]))
    return lax.scan(step, begin, (load, mass, damping, spring))[1]


EFFECT = Effect(
    slug="joint_elasticity",
    title="a flexible transmission",
    needs="fast motion near the first resonance, or large gravity torques of both signs",
    confused_with={
        "rotor_inertia": "a chirp through the first resonance",
        "actuator_lag": "a chirp through the first resonance",
        "encoder_offset": "postures with gravity torques of both signs",
    },
    where="where the torque changes quickly and where gravity deflects the joint; its stiffness is {stiffness}",
    law=Law(
        equation="-(d tau/dq_j u + d tau/dqd_j du/dt + M_j d2u/dt2), K u + D du/dt = torque at the link",
        source="M. W. Spong, Modeling and control of elastic joint robots, ASME JDSMC 109, 1987",
        parameters=(Parameter("stiffness", "{tau}/{q}", low=0.0),),
        columns=_columns,
        to_physical=lambda w, shape: 1.0 / (jnp.where(w == 0.0, 1e-12, w) * shape),
        from_physical=lambda values: (np.ones(1), np.array([1.0 / values["stiffness"]])),
    ),
    place=Place(At.DRIVE, everywhere=True),
    prior=Prior(lowest=(1.0 / ALIKE,), highest=(ALIKE,), of_rigid_body=True),
    shapes=Shapes(grid=_grid, finer=between_neighbours),
    export=Export(
        not_in_mjcf="it is left out: a flexible joint needs a second joint in the model",
        history="depends on the motion of the link, which is a state of its own",
    ),
)
