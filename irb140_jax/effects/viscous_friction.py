"""Viscous friction: a torque that opposes the motion and grows in proportion to speed."""

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior

EFFECT = Effect(
    slug="viscous_friction",
    title="viscous friction",
    needs="motion at clearly different speeds",
    confused_with={
        "coulomb_friction": "the same move at two speeds",
        "time_delay": "the same move at two frequencies: the phase shift of a delay grows with frequency",
        "transmission_coupling": "motion of each of the two joints while the other one rests",
    },
    where="in proportion to speed, {viscous}, so mostly where the joint is fast",
    law=Law(
        equation="Fv qd",
        source="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
        parameters=(Parameter("viscous", "{tau} s/{q}", low=0.0),),
        columns=lambda motion, joints, shape: of_site(motion.qd, joints)[:, :, None],
    ),
    place=Place(At.FRICTION),
    prior=Prior(ordinary=True, lowest=("damping",), dissipative=True),
    export=Export(mjcf="joint damping", in_model=adds_to("damping")),
)
