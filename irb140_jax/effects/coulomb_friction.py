"""Coulomb friction: a torque of constant size that opposes the motion."""

import jax.numpy as jnp

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior


def dry_friction_columns(motion, joints, second):
    """Columns [sign(qd), second], the shape shared by friction laws that refine Coulomb's, (T, m, 2)."""
    return jnp.stack([of_site(motion.direction, joints), second], axis=-1)


EFFECT = Effect(
    slug="coulomb_friction",
    title="Coulomb friction",
    needs="motion that reverses direction",
    confused_with={
        "stribeck_friction": "a series of constant speeds from very slow to fast, in both directions",
        "load_dependent_friction": "the same speeds under several gravity loads or payloads",
        "asymmetric_friction": "the same path in both directions, with pauses at the same posture",
        "viscous_friction": "the same move at two speeds",
    },
    where="a step from -{coulomb} to {coulomb} at every reversal of the motion, whatever the speed",
    law=Law(
        equation="Fc sign(qd)",
        source="C. A. Coulomb, Theorie des machines simples, 1785; Armstrong-Helouvry et al., Automatica 30(7), 1994",
        parameters=(Parameter("coulomb", "{tau}", low=0.0),),
        columns=lambda motion, joints, shape: of_site(motion.direction, joints)[:, :, None],
    ),
    place=Place(At.FRICTION),
    prior=Prior(ordinary=True, lowest=("frictionloss",), dissipative=True),
    export=Export(mjcf="joint frictionloss", in_model=adds_to("frictionloss")),
)
