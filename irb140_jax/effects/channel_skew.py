"""Channel skew: one joint's torque is logged early or late, relative to its position and to the other torques."""

import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.delay import EXPORT, PRIOR, SHAPES, law, mean_slopes
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import At, Place


def _columns(motion, joints, shape):
    """A delay of one joint's torque alone: channels that are polled one after the other; see `delay.law`."""
    return mean_slopes(motion.t, of_site(motion.scaled_rate, joints), shape[0])[:, :, None]


def _sites(robot):
    # Of one joint alone it is the delay between torque and position.
    return np.arange(robot.n if robot.n > 1 else 0)[:, None]


def _where(values, units):
    early = "early" if values["delay"] > 0.0 else "late"
    return f"its torque is logged {1e3 * abs(values['delay']):.3g} ms {early} relative to its position"


EFFECT = Effect(
    slug="channel_skew",
    title="a torque channel out of step",
    needs="fast motion of this joint",
    confused_with={
        "actuator_lag": "fast motion of this joint: a lag takes off the more, the faster the torque changes",
        "time_delay": "fast motion of several joints: a delay is the same for all of them",
        "viscous_friction": "the same move at two frequencies: the phase shift of a delay grows with frequency",
    },
    where=_where,
    law=law("tau(t + delay) - tau(t) on one joint", _columns),
    place=Place(At.LOG_TIMING, _sites),
    prior=PRIOR,
    shapes=SHAPES,
    export=EXPORT,
)
