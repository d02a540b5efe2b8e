"""Time delay: the torque and position channels of the log are shifted in time against each other."""

import numpy as np

from irb140_jax.effects.delay import AbstractDelay, mean_slopes


class TimeDelay(AbstractDelay):
    """One delay between all torques and all positions; see `AbstractDelay`."""

    slug = "time_delay"
    title = "a time delay between torque and position"
    equation = "tau(t + delay) - tau(t) on every joint"
    confused_with = {
        "actuator_lag": "fast motion of several joints: a delay is the same for all of them",
        "viscous_friction": "the same move at two frequencies: the phase shift of a delay grows with frequency",
    }
    needs = "fast motion of several joints"
    everywhere = True

    def sites(self, robot):
        return np.arange(robot.n)[None, :]

    def columns(self, motion, joints, shape):
        return mean_slopes(motion.t, motion.scaled_rate, shape[0])[:, :, None]

    def where(self, names, values, units):
        return f"{names}: positions are logged {1e3 * values['delay']:.3g} ms after the torque they belong to"
