"""Rotor inertia: the inertia of the motor, multiplied by the square of the gear ratio."""

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior

EFFECT = Effect(
    slug="rotor_inertia",
    title="rotor inertia",
    needs="high acceleration of the joint while the joints before it move too",
    confused_with={
        "joint_elasticity": "a chirp through the first resonance",
        "actuator_lag": "reversals at several accelerations: a lag shifts the step of friction in time",
    },
    where="in proportion to the joint's own acceleration, {inertia}",
    law=Law(
        equation="J qdd",
        source="Khalil and Dombre, Modeling, Identification and Control of Robots, 2002, ch. 9",
        parameters=(Parameter("inertia", "{tau} s^2/{q}", low=0.0),),
        columns=lambda motion, joints, shape: of_site(motion.qdd, joints)[:, :, None],
    ),
    place=Place(At.DRIVE),
    prior=Prior(lowest=("armature",)),
    export=Export(mjcf="joint armature", in_model=adds_to("armature")),
)
