"""What stands between the torque on the joint and the one that is logged; all along time, shape (T,) or (T, n)."""

import numpy as np
from scipy import signal


def asked_of_lag(tau: np.ndarray, dt: float, time: float) -> np.ndarray:
    """Torque that has to be asked for, so that a drive makes `tau`: its answer is (1 + s time/10)/(1 + s time)."""
    b, a = signal.bilinear([time, 1.0], [0.1 * time, 1.0], fs=1.0 / dt)
    z = signal.lfilter_zi(b, a) * tau[0]
    return signal.lfilter(b, a, tau, zi=z)[0]


def asked_of_saturating(tau: np.ndarray, most: float) -> np.ndarray:
    """Logged current times torque constant, of a motor whose torque is most tanh(current / most)."""
    return most * np.arctanh(np.clip(tau / most, -0.995, 0.995))


def filtered(tau: np.ndarray, dt: float, cut: float) -> np.ndarray:
    """A drive's own filter on what it logs: second order, critically damped, causal, at `cut` [Hz]."""
    w = 2.0 * np.pi * cut
    b, a = signal.bilinear([w * w], [1.0, 2.0 * w, w * w], fs=1.0 / dt)
    z = signal.lfilter_zi(b, a)
    return np.stack([signal.lfilter(b, a, x, zi=z * x[0])[0] for x in tau.T], axis=1)


def late(t: np.ndarray, x: np.ndarray, delays: np.ndarray) -> np.ndarray:
    """Channels that show what was `delays` ago, by resampling: x(t - delay), shape (T, n)."""
    return np.stack([np.interp(t - d, t, c) for d, c in zip(delays, x.T, strict=True)], axis=1)
