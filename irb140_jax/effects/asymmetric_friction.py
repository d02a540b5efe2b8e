"""Asymmetric friction: dry friction with a different level in each direction."""

import jax.numpy as jnp

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint, with_spring
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior


def _columns(motion, joints, shape):
    """tau = Fc+ for qd > 0, -Fc- for qd < 0."""
    s = of_site(motion.direction, joints)
    return jnp.stack([jnp.maximum(s, 0.0), jnp.minimum(s, 0.0)], axis=-1)


def _in_model(robot, joints, w, shape):
    level = with_joint(robot, "frictionloss", joints[0], 0.5 * (w[0] + w[1]))
    return with_spring(level, joints[0], 0.0, 0.5 * (w[0] - w[1]))


EFFECT = Effect(
    slug="asymmetric_friction",
    title="friction that differs by direction",
    needs="motion in both directions",
    confused_with={
        "torque_offset": "dwells: an offset stays at rest, friction does not",
        "coulomb_friction": "the same path in both directions, with pauses at the same posture",
    },
    where="{coulomb_pos} while moving in the positive direction, {coulomb_neg} in the negative direction",
    law=Law(
        equation="Fc+ for qd > 0, -Fc- for qd < 0",
        source="Armstrong-Helouvry, Control of Machines with Friction, 1991, ch. 2",
        parameters=(Parameter("coulomb_pos", "{tau}", low=0.0), Parameter("coulomb_neg", "{tau}", low=0.0)),
        columns=_columns,
        variants=((0, 1),),
        contains=("coulomb_friction",),
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=("frictionloss", "frictionloss"), dissipative=True),
    export=Export(
        mjcf="joint frictionloss for the mean of both directions, a constant spring torque for half their difference",
        not_in_mjcf="the difference between the two directions acts at rest too, as a constant torque",
        in_model=_in_model,
    ),
)
