"""Load-dependent friction: friction of a gear that grows with the torque it transmits."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior


def _columns(motion, joints, shape):
    """tau = (Fc + mu |transmitted torque|) sign(qd)."""
    load = jnp.abs(of_site(motion.load, joints))
    return dry_friction_columns(motion, joints, load * of_site(motion.direction, joints))


EFFECT = Effect(
    slug="load_dependent_friction",
    title="friction that grows with load",
    needs="motion in both directions under clearly different loads",
    confused_with={
        "coulomb_friction": "the same speed under several gravity loads or payloads",
        "position_dependent_friction": "the same positions with another payload",
        "torque_gain": "the same loads at rest",
    },
    where="against the motion, {coulomb} plus {load_coefficient:%} of the transmitted torque",
    law=Law(
        equation="(Fc + mu |load|) sign(qd)",
        source="Hamon, Gautier, Garrec, IROS 2010; Duclusaud et al., arXiv 2410.08650",
        parameters=(Parameter("load_coefficient", "1", low=0.0), Parameter("coulomb", "{tau}", low=0.0)),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[1], w[0]]),
        from_physical=lambda values: (np.array([values["coulomb"], values["load_coefficient"]]), np.zeros(0)),
        variants=((0, 1), (1,)),  # some gears rub next to nothing without load
        contains=("coulomb_friction",),
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=("frictionloss", 0.0), dissipative=True),
    export=Export(
        mjcf="joint frictionloss, for its constant part",
        not_in_mjcf="the part that grows with the load is left out: frictionloss does not depend on load",
        in_model=adds_to("frictionloss"),
    ),
)
