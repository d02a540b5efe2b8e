"""What the sensors scatter by, seen where the arm does not move: never what a wrong model leaves."""

import numpy as np

from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.low_pass import Band, kernels
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.smooth import white_noise


def torque_scatter(recording: Recording, band: Band) -> np.ndarray:
    """Standard deviation of a log's torque noise below the band's cut-off, shape (n,) [N m or N].

    The smaller of two medians, either taken for white noise: of the periodogram's upper half, of which cogging and hum
    fill few frequencies, and of how far samples are off their neighbours, of which reversals and spikes fill few
    samples.  What a controller has low-passed before it was logged counts as it came.
    """
    step = float(np.median(np.diff(recording.t)))
    if recording.is_servo_log and recording.drive is not None:
        return _servo_scatter(recording, recording.drive, band, step)
    taper = np.hanning(len(recording.t))[:, None]
    alive = np.ones(recording.tau.shape, bool) if recording.torque_lost is None else ~recording.torque_lost
    tau = np.where(alive, recording.tau, 0.0)
    power = np.abs(np.fft.rfft((tau - tau.mean(axis=0)) * taper, axis=0)) ** 2 / np.sum(taper**2)
    # The median of a chi-squared variable of two degrees of freedom is log 2 of its mean.
    variance = np.median(power[len(power) // 2 :], axis=0) / np.log(2.0)
    off = np.array([white_noise(recording.t[a], x[a]) for a, x in zip(alive.T, recording.tau.T, strict=True)])
    variance = np.minimum(variance, off**2)
    return np.sqrt(variance * np.sum(kernels(min(band.torque, 0.4 / step), 1.0 / step)[0] ** 2))


def _servo_scatter(recording: Recording, drive: Drive, band: Band, step: float) -> np.ndarray:
    """What the encoder's noise leaves in Kp (qdes - q) - Kd qd below the cut-off, shape (n,); commands have none."""
    white = np.array([white_noise(recording.t, x) for x in recording.q.T])
    level, rate, _ = kernels(min(band.torque, 0.4 / step), 1.0 / step)
    gains = np.nan_to_num(drive.kp), np.nan_to_num(drive.kd)
    return white * np.sqrt(gains[0] ** 2 * np.sum(level**2) + gains[1] ** 2 * np.sum(rate**2))
