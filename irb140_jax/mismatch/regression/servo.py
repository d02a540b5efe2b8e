"""Nuisance columns of servos: what their torque errs by where gains and the time of a command are not exactly known.

The torque of a log of commands is made, tau = Kp (qdes - q) - Kd qd, so it errs in known directions beside its scale:

    d tau / d Kd = -(qd - qddes)          one class with viscous friction
    d tau / d delay = -Kp d(qdes)/dt      one class with a lag of the drive, where the command is all that changes fast

An error of Kp is a torque scale; its width joins that of `GAIN_JOINT`.
"""

import numpy as np

from irb140_jax.recordings.condition import Conditioned

NAMES = ("kd", "command")  # a joint's own columns, in their order


def servo_columns(motion: Conditioned, j: int) -> np.ndarray:
    """Columns of one joint in prior units, logged less real torque, shape (T, 2); (T, 0) where torque was logged."""
    servo = motion.servo
    if servo is None:
        return np.zeros((len(motion.t), 0))
    damping = servo.drive.kd_width[j] * (motion.qd[:, j] - servo.asked_speed[:, j])
    late = servo.own_delay_width * np.nan_to_num(servo.drive.kp[j]) * servo.command_rate[:, j]
    return np.stack([damping, late], axis=1)


def common_columns(motion: Conditioned) -> np.ndarray:
    """A delay of all commands alike in prior units, shape (T, n, 1); (T, n, 0) where torque was logged."""
    servo = motion.servo
    if servo is None:
        return np.zeros((*motion.q.shape, 0))
    return (servo.drive.common_delay_width * np.nan_to_num(servo.drive.kp) * servo.command_rate)[..., None]


def scale_width(motion: Conditioned, j: int) -> float:
    """Relative standard deviation of a servo's Kp; zero where torque was logged."""
    return 0.0 if motion.servo is None else float(np.nan_to_num(motion.servo.drive.kp_width[j]))
