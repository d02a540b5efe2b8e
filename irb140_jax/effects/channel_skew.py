"""Channel skew: one joint's torque is logged early or late, relative to its position and to the other torques."""

import numpy as np

from irb140_jax.effects.delay import AbstractDelay, mean_slopes
from irb140_jax.effects.motion import of_site


class ChannelSkew(AbstractDelay):
    """A delay of one joint's torque alone: channels that are polled one after the other; see `AbstractDelay`."""

    slug = "channel_skew"
    title = "a torque channel out of step"
    equation = "tau(t + delay) - tau(t) on one joint"
    confused_with = {
        "actuator_lag": "fast motion of this joint: a lag takes off the more, the faster the torque changes",
        "time_delay": "fast motion of several joints: a delay is the same for all of them",
        "viscous_friction": "the same move at two frequencies: the phase shift of a delay grows with frequency",
    }
    needs = "fast motion of this joint"

    def sites(self, robot):
        # Of one joint alone it is the delay between torque and position.
        return np.arange(robot.n if robot.n > 1 else 0)[:, None]

    def columns(self, motion, joints, shape):
        return mean_slopes(motion.t, of_site(motion.scaled_rate, joints), shape[0])[:, :, None]

    def where(self, names, values, units):
        early = "early" if values["delay"] > 0.0 else "late"
        return f"{names}: its torque is logged {1e3 * abs(values['delay']):.3g} ms {early} relative to its position"
