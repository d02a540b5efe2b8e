"""Quadratic drag: a torque against the motion that grows with the square of speed."""

import jax.numpy as jnp

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import Law, Parameter, Prior


def _columns(motion, joints, shape):
    qd = of_site(motion.qd, joints)
    return (jnp.abs(qd) * qd)[:, :, None]


EFFECT = Effect(
    slug="quadratic_drag",
    title="quadratic drag",
    needs="motion at clearly different speeds, up to the fastest",
    confused_with={"viscous_friction": "the same move at half and at full speed"},
    where="with the square of speed, {drag}, so only in the fast stretches",
    law=Law(
        equation="D |qd| qd",
        source="T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, ch. 6",
        parameters=(Parameter("drag", "{tau} (s/{q})^2", low=0.0),),
        columns=_columns,
    ),
    # A model has no quadratic drag that could be taken away.
    prior=Prior(lowest=(0.0,), dissipative=True),
)
