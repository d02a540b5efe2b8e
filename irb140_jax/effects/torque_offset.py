"""Torque offset: a constant torque, from current sensors, amplifiers or a spring preload."""

import jax.numpy as jnp

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_spring
from irb140_jax.effects.records import At, Export, Law, Parameter, Place

EFFECT = Effect(
    slug="torque_offset",
    title="constant torque offset",
    needs="postures with clearly different gravity torque",
    confused_with={
        "encoder_offset": "postures in which the derivative of the gravity torque by position changes sign",
        "gravity_spring": "the whole range of the joint",
        "asymmetric_friction": "dwells: an offset stays at rest, friction does not",
    },
    where="{offset} at all positions, speeds and times",
    law=Law(
        equation="tau0",
        source="Swevers, Verdonck, De Schutter, IEEE Control Systems 27(5), 2007",
        parameters=(Parameter("offset", "{tau}"),),
        columns=lambda motion, joints, shape: jnp.ones_like(of_site(motion.q, joints))[:, :, None],
    ),
    place=Place(At.DRIVE),
    export=Export(
        mjcf="joint stiffness and springref: a very soft spring with a large deflection",
        in_model=lambda robot, joints, w, shape: with_spring(robot, joints[0], 0.0, w[0]),
    ),
)
