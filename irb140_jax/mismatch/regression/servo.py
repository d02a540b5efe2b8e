"""Nuisance columns of servos: what their torque errs by where gains and the time of a command are not exactly known.

The torque of a log of commands is made, tau = Kp (qdes - q) - Kd qd, so it errs in known directions beside its scale:

    d tau / d Kd = -(qd - qddes)          one class with viscous friction
    d tau / d delay = -Kp d(qdes)/dt      one class with a lag of the drive, where the command is all that changes fast

The delay has a part that all recordings share, one of each joint, and one of each recording: its phase, for a log
begins at any moment of a controller's cycle.

An error of Kp is a torque scale; its width joins that of `GAIN_JOINT`.  The scale is not that of the term with Kd: of a
stated Kp that is 1 + g times the real one, while Kd is right, the made torque is (1 + g) tau + g Kd (qd - qddes).
"""

import numpy as np

from irb140_jax.recordings.condition import Conditioned

NAMES = ("kd", "command")  # a joint's own columns, in their order


def servo_columns(motion: Conditioned, j: int) -> np.ndarray:
    """Columns of one joint in prior units, logged less real torque, shape (T, 2); (T, 0) where torque was logged."""
    servo = motion.servo
    if servo is None:
        return np.zeros((len(motion.t), 0))
    damping = servo.drive.kd_width[j] * _against(motion)[:, j]
    late = servo.drive.time_width * np.nan_to_num(servo.drive.kp[j]) * _of_command(motion)[:, j]
    return np.stack([damping, late], axis=1)


def common_columns(motion: Conditioned, beside: np.ndarray) -> np.ndarray:
    """Delays of all joints' commands alike in prior units, shape (T, n, P + 1); (T, n, 0) where torque was logged.

    Args:
        motion: Of one recording.
        beside: How each recording's phase counts in this one, shape (P,); the delay of all comes last.
    """
    servo = motion.servo
    if servo is None:
        return np.zeros((*motion.q.shape, 0))
    late = (np.nan_to_num(servo.drive.kp) * _of_command(motion))[..., None]
    return late * np.append(servo.drive.phase_width * beside, servo.drive.common_delay_width)


def damping_of_scale(motion: Conditioned) -> np.ndarray:
    """What a wrong Kp makes beside the torque's scale, per unit of the scale [N m or N], (T, n); 0 of logged torque."""
    servo = motion.servo
    if servo is None:
        return np.zeros_like(motion.q)
    return np.nan_to_num(servo.drive.kd) * _against(motion)


def scale_width(motion: Conditioned, j: int) -> float:
    """Relative standard deviation of a servo's Kp; zero where torque was logged."""
    return 0.0 if motion.servo is None else float(np.nan_to_num(motion.servo.drive.kp_width[j]))


def _against(motion: Conditioned) -> np.ndarray:
    """Speed that Kd acts against, as late as the torque comes [rad/s or m/s], shape (T, n)."""
    assert motion.servo is not None
    return _lagging(motion, motion.qd - motion.servo.asked_speed)


def _of_command(motion: Conditioned) -> np.ndarray:
    """Derivative of commanded positions, as late as the torque comes [rad/s or m/s], shape (T, n)."""
    assert motion.servo is not None
    return _lagging(motion, motion.servo.command_rate)


def _lagging(motion: Conditioned, x: np.ndarray) -> np.ndarray:
    """Anything along a motion, (T, n), later by the lag of its drive."""
    assert motion.servo is not None
    lag = motion.servo.drive.lag
    return np.stack([np.interp(motion.t - lag, motion.t, c) for c in x.T], axis=1) if lag else x
