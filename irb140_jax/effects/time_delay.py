"""Time delay: the torque and position channels of the log are shifted in time against each other."""

from irb140_jax.effects.base import Effect
from irb140_jax.effects.delay import EXPORT, PRIOR, SHAPES, law, mean_slopes
from irb140_jax.effects.records import At, Place, all_joints


def _columns(motion, joints, shape):
    """One delay between all torques and all positions; see `delay.law`."""
    return mean_slopes(motion.t, motion.scaled_rate, shape[0])[:, :, None]


EFFECT = Effect(
    slug="time_delay",
    title="a time delay between torque and position",
    needs="fast motion of several joints",
    confused_with={
        "actuator_lag": "fast motion of several joints: a delay is the same for all of them",
        "viscous_friction": "the same move at two frequencies: the phase shift of a delay grows with frequency",
    },
    where="positions are logged {delay:ms} after the torque they belong to",
    law=law("tau(t + delay) - tau(t) on every joint", _columns),
    place=Place(At.LOG_TIMING, all_joints, everywhere=True),
    prior=PRIOR,
    shapes=SHAPES,
    export=EXPORT,
)
