"""Torque gain: the torque constant of the drive differs from the one that the log assumes."""

import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_gear
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior

LARGEST = 3.0  # beyond, a column holds another unit or another side of the gear


def _columns(motion, joints, shape):
    """real torque = gain x logged torque, so the log holds (1/gain - 1) x real torque beyond the model."""
    return of_site(motion.total, joints)[:, :, None]


def _sites(robot):
    # Of one joint alone it is the scale of its inertials.
    return np.arange(robot.n if robot.n > 1 else 0)[:, None]


EFFECT = Effect(
    slug="torque_gain",
    title="a wrong torque constant",
    needs="large gravity torque on this joint and on others with the same links, or a known payload",
    confused_with={
        "payload": "the same motion with and without a known payload",
        "rotor_inertia": "postures with large gravity torque: a gain scales gravity torque, a rotor does not",
        "load_dependent_friction": "the same loads at rest",
    },
    where="in proportion to the whole torque; the real torque is {gain:.3g} times the logged one",
    law=Law(
        equation="(1/gain - 1) tau_model",
        source="Gautier and Briot, Global identification of joint drive gains, JMR 6(2), 2014",
        parameters=(Parameter("gain", "1", low=1 / LARGEST, high=LARGEST),),
        columns=_columns,
        to_physical=lambda w, shape: 1.0 / (1.0 + w),
        from_physical=lambda values: (np.array([1.0 / values["gain"] - 1.0]), np.zeros(0)),
        to_log=lambda x, dt, w, shape: w[0] * x,
    ),
    place=Place(At.LOG_SCALE, _sites),
    # Typical is what torque constants are known to.
    prior=Prior(typical=0.1, tied=True, lowest=(1.0 / LARGEST - 1.0,), highest=(LARGEST - 1.0,)),
    export=Export(
        mjcf="the gear of the actuator, or the gains of a position servo",
        in_model=lambda robot, joints, w, shape: with_gear(robot, joints[0], 1.0 / (1.0 + w[0])),
    ),
)
