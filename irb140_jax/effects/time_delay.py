"""Time delay: torque and position channels of the log are out of step."""

import numpy as np

from irb140_jax.effects.base import AbstractEffect, Parameter


class TimeDelay(AbstractEffect):
    """q_logged(t) = q(t - delay): the logged torque belongs to a later motion, tau + delay d tau/dt."""

    slug = "time_delay"
    title = "torque and position out of step"
    equation = "delay d tau/dt on every joint"
    source = "Ljung, System Identification, 1999, ch. 4"
    parameters = (Parameter("delay", "s"),)
    variants = ((0,),)
    confused_with = {
        "actuator_lag": "a delay acts on all joints alike",
        "viscous_friction": "two excitation frequencies: the phase of a delay grows with frequency",
    }
    needs = "fast motion of several joints"
    everywhere = True
    history = "is in the clocks of the log, which shows a torque beside an earlier position"
    not_in_mjcf = "it is in the clocks of the log, not in the arm"

    def sites(self, robot):
        return np.arange(robot.n)[None, :]

    def columns(self, motion, joints, shape):
        return motion.total_rate[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["delay"]]), np.zeros(0)

    def where(self, names, values, units):
        return f"{names}: positions are logged {1e3 * values['delay']:.3g} ms after the torque they belong to"
