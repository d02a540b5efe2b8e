"""Gravity spring: a counterbalance, a cable or a dress pack that pulls the joint towards a rest position."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_spring
from irb140_jax.effects.records import Export, Law, Parameter, Prior


def _columns(motion, joints, shape):
    """tau = k (q - rest)."""
    q = of_site(motion.q, joints)
    return jnp.stack([q, jnp.ones_like(q)], axis=-1)


EFFECT = Effect(
    slug="gravity_spring",
    title="a spring between two links",
    needs="the whole range of the joint, in several postures of the others",
    confused_with={
        "torque_offset": "the whole range of the joint",
        "encoder_offset": "the whole range of the joint: a spring torque is linear in position, gravity torque is not",
    },
    where="{stiffness} times the distance from {rest}, at any speed",
    law=Law(
        equation="k (q - rest)",
        source="Khalil and Dombre 2002, ch. 9",
        parameters=(Parameter("stiffness", "{tau}/{q}"), Parameter("rest", "{q}")),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[0], -w[1] / jnp.where(w[0] == 0.0, 1.0, w[0])]),
        from_physical=lambda values: (values["stiffness"] * np.array([1.0, -values["rest"]]), np.zeros(0)),
        variants=((0, 1),),
        own=(0,),
        contains=("torque_offset",),
        empirical=True,
    ),
    prior=Prior(lowest=("stiffness", -np.inf)),  # no spring pushes away from its rest
    export=Export(
        mjcf="joint stiffness and springref",
        in_model=lambda robot, joints, w, shape: with_spring(robot, joints[0], w[0], w[1]),
    ),
)
