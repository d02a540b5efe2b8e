"""Encoder offset: the zero of a joint is wrong."""

import jax.numpy as jnp

from irb140_jax.effects.base import Effect
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import Export, Law, Parameter, Place, Prior

LARGEST = 0.5  # [rad or m]; beyond it first order is wrong, and a person sees it


def _columns(motion, joints, shape):
    """q_logged = q + offset: tau(q_logged - offset) - tau(q_logged), to first order, on every joint."""
    return -jnp.take(motion.rigid.by_q, joints, axis=2)


EFFECT = Effect(
    slug="encoder_offset",
    title="a wrong encoder zero",
    needs=(
        "postures in which the derivative of the gravity torque by this joint's position changes sign, or a check of "
        "the zero mark"
    ),
    confused_with={
        "torque_offset": "postures in which the derivative of the gravity torque by position changes sign",
        "gravity_tilt": "a sweep of the first joint over its range",
        "gravity_spring": "the whole range of the joint: a spring torque is linear in position, gravity torque is not",
    },
    where="wherever the torque changes with this joint's position; its zero is off by {offset}",
    law=Law(
        equation="-offset d tau/d q_j",
        source="Hollerbach, Khalil, Gautier, Springer Handbook of Robotics, 2016, ch. 6",
        parameters=(Parameter("offset", "{q}"),),
        columns=_columns,
    ),
    place=Place(everywhere=True),
    prior=Prior(lowest=(-LARGEST,), highest=(LARGEST,), of_rigid_body=True),
    export=Export(mjcf="the joint's ref", in_model=adds_to("reference")),
)
