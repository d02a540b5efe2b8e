"""From a raw log to smooth, evenly spaced motion: resampling, despiking, differentiation, bandwidth.

Both sides of the torque equation later pass the same low-pass (`Band.low_pass`), so that what it removes is removed
from measurement and model alike.
"""

import dataclasses
import warnings

import numpy as np
from scipy import interpolate, ndimage, signal

from irb140_jax.recordings.recording import Recording

MAX_TORQUE_BAND = 20.0  # Hz; above this, arms are not rigid and motor torque holds mostly current ripple
MIN_TORQUE_BAND = 4.0  # Hz; friction reversals are steps, a narrower band would blur them into the inertia
WORKING_RATE = 200.0  # Hz; columns are evaluated at least this often
KAISER_BETA = 6.0  # about 63 dB in the stop band: below the noise of any torque log


@dataclasses.dataclass(frozen=True)
class Band:
    """The frequencies the comparison uses.

    Attributes:
        torque: Cut-off of the low-pass on both sides of the equation [Hz].
        position: Cut-off of the smoother that differentiates q [Hz].
        rate: Rate at which motion and columns are evaluated [Hz].
        step: Every `step`-th low-passed sample is kept.
    """

    torque: float
    position: float
    rate: float
    step: int

    def low_pass(self) -> np.ndarray:
        """Taps of the symmetric low-pass at `rate`."""
        return _kernels(self.torque, self.rate)[0]

    def apply(self, x: np.ndarray) -> np.ndarray:
        """Low-pass along axis 0 and keep every `step`-th sample; the filter's ends are left out."""
        taps = self.low_pass()
        if len(x) < len(taps) + self.step:
            return x[:0]
        flat = np.ascontiguousarray(x.reshape(len(x), -1))
        full = signal.upfirdn(taps, flat, down=1, axis=0) if self.step == 1 else None
        if full is not None:
            y = full[len(taps) - 1 : len(x)]
        else:
            # Shift so that the kept samples start where the filter is filled, then let upfirdn skip the rest.
            pad = (-(len(taps) - 1)) % self.step
            padded = np.concatenate([np.zeros((pad, flat.shape[1])), flat])
            y = signal.upfirdn(taps, padded, down=self.step, axis=0)
            y = y[(len(taps) - 1 + pad) // self.step : (len(padded) - 1) // self.step + 1]
        return y.reshape(len(y), *x.shape[1:])

    def kept(self, length: int) -> np.ndarray:
        """Indices of the samples that `apply` keeps."""
        half = (len(self.low_pass()) - 1) // 2
        return np.arange(half, length - half, self.step)


@dataclasses.dataclass(frozen=True)
class Conditioned:
    """A recording on an even grid, smoothed and differentiated.

    Attributes:
        source: The recording's name.
        t: Time [s], shape (T,).
        q, qd, qdd: Smoothed motion, shape (T, n).
        tau: Logged torque without spikes, anti-aliased to the grid [N m or N], shape (T, n).
        usable: False where a joint rests (dry friction is undetermined there) or samples are missing, shape (T, n).
        rest_speed: Speed that encoder noise can't tell from rest, shape (n,).
        notes: Repairs, as sentences.
    """

    source: str
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    usable: np.ndarray
    rest_speed: np.ndarray
    notes: tuple[str, ...]


def choose_band(recordings: list[Recording]) -> Band:
    """The band in which the positions carry motion rather than noise, the same for all recordings."""
    top, rates = [], []
    for recording in recordings:
        t, q, _, _ = _even(recording)
        rate = (len(t) - 1) / (t[-1] - t[0])
        rates.append(rate)
        top.append([_signal_limit(q[:, j], rate) for j in range(q.shape[1])])
    # The fastest recording decides; within it, the middling joint: a still joint says nothing, a noisy one too much.
    limit = float(np.max(np.nanmedian(np.where(np.array(top) > 0, top, np.nan), axis=1), initial=0.0))
    slowest = float(min(rates))
    torque = float(np.clip(2.0 * limit, MIN_TORQUE_BAND, min(MAX_TORQUE_BAND, slowest / 6.0)))
    position = min(1.6 * torque, 0.4 * slowest)
    rate = max(WORKING_RATE, 8.0 * torque)
    rate = min(rate, slowest)
    return Band(torque, position, rate, max(1, int(rate / (2.2 * torque))))


def condition(recording: Recording, band: Band, *, pad: bool = False) -> Conditioned:
    """Even grid, despiked torque, smoothed and differentiated motion.

    Args:
        recording: The raw log.
        band: From `choose_band`.
        pad: Extend the ends by reflection instead of leaving out what the filter can't fill (for predictions, which
            owe a value to every row).

    Returns:
        The conditioned recording, without the ends that the smoother can't fill unless `pad`.
    """
    t, q, tau, missing = _even(recording)
    raw_rate = (len(t) - 1) / (t[-1] - t[0])
    tau, spikes = _despiked(tau)
    h, h1, h2 = _kernels(band.position, raw_rate)
    half = (len(h) - 1) // 2
    anti_alias = _kernels(min(0.4 * band.rate, 0.45 * raw_rate), raw_rate)[0]
    smoothed = [_filtered(q, k, odd=True) for k in (h, h1, h2)]
    tau = _filtered(tau, anti_alias, odd=False)
    keep = slice(None) if pad else slice(half, len(t) - half)
    grid = np.arange(t[keep][0], t[keep][-1] + 1e-9, 1.0 / band.rate)
    q, qd, qdd, tau = (_at(grid, t, x) for x in (*smoothed, tau))
    rest_speed = resting_speed(recording, qd, h1)
    resting = ndimage.minimum_filter1d((np.abs(qd) < rest_speed).astype(int), int(0.1 * band.rate) | 1, axis=0)
    resting = ndimage.maximum_filter1d(resting, int(0.2 * band.rate) | 1, axis=0).astype(bool)
    lost = np.interp(grid, t, missing.astype(float)) > 0
    notes = list(recording.notes)
    if spikes:
        notes.append(f"{spikes} torque spikes were replaced by the median of their neighbours")
    return Conditioned(
        recording.source, grid, q, qd, qdd, tau, ~resting & ~lost[:, None], rest_speed, tuple(notes)
    )


def resting_speed(recording: Recording, qd: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Speed below which direction is a guess: encoder noise through the differentiator, or 0.3 % of top speed."""
    noise = np.array([_white_noise(recording.q[:, j]) for j in range(recording.q.shape[1])])
    speed = np.abs(qd).max(axis=0) if len(qd) else np.zeros(recording.q.shape[1])
    return np.maximum(np.maximum(3.0 * noise * np.linalg.norm(taps), 0.003 * speed), 1e-6)


def _even(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """t, q, tau on an even grid and the rows that lie in a gap."""
    t, dt = recording.t, np.diff(recording.t)
    step = float(np.median(dt))
    if np.max(np.abs(dt - step)) < 0.02 * step:
        return t, recording.q, recording.tau, np.zeros(len(t), dtype=bool)
    rate_step = (t[-1] - t[0]) / max(round((t[-1] - t[0]) / step), 1)
    grid = t[0] + rate_step * np.arange(round((t[-1] - t[0]) / rate_step) + 1)
    grid[-1] = t[-1]
    q = interpolate.CubicSpline(t, recording.q)(grid)
    tau = _at(grid, t, recording.tau)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    return grid, q, tau, dt[after - 1] > max(5 * step, 0.02)


def _at(grid: np.ndarray, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    return interpolate.make_interp_spline(t, x, k=1)(grid)


def _kernels(cutoff: float, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Taps of a windowed-sinc low-pass and of its first and second time derivative."""
    half = max(int(np.ceil(2.0 * rate / cutoff)), 2)
    fine = 32
    s = np.arange(-half * fine, half * fine + 1) / (fine * rate)
    inside = np.clip(1.0 - (s * rate / half) ** 2, 0.0, None)
    h = 2 * cutoff * np.sinc(2 * cutoff * s) * np.i0(KAISER_BETA * np.sqrt(inside)) / np.i0(KAISER_BETA)
    h1 = np.gradient(h, s)
    h2 = np.gradient(h1, s)
    h, h1, h2 = (x[::fine] / rate for x in (h, h1, h2))
    x = np.arange(-half, half + 1) / rate
    # Exact on what they must be exact on: constants, ramps (h, h1) and parabolas (h2).
    h = h / h.sum()
    h1 = -(h1 - h1.mean()) / (h1 @ x)
    h2 = h2 - h2.mean()
    h2 = h2 * 2.0 / (h2 @ x**2)
    return h, h1, h2


def _filtered(x: np.ndarray, taps: np.ndarray, *, odd: bool) -> np.ndarray:
    """Zero-phase FIR along axis 0, ends reflected (about the end point when `odd`)."""
    half = (len(taps) - 1) // 2
    extended = np.pad(x, ((half, half), (0, 0)), mode="reflect", reflect_type="odd" if odd else "even")
    return signal.oaconvolve(extended, taps[:, None], mode="valid", axes=0)


def _white_noise(x: np.ndarray) -> float:
    """Standard deviation of the white part of a smooth signal, from its third differences (robust to the signal)."""
    d = np.diff(x, 3)
    moving = d[np.abs(np.diff(x)[1:-1]) > 0] if np.any(np.diff(x)) else d
    if len(moving) < 10:
        return 0.0
    return float(np.median(np.abs(moving)) / 0.6745 / np.sqrt(20.0))


def _signal_limit(x: np.ndarray, rate: float) -> float:
    """Frequency [Hz] up to which a position's spectrum stands above its noise; 0 for a joint at rest."""
    if np.ptp(x) == 0:
        return 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        f, p = signal.welch(x, rate, nperseg=min(len(x), int(4 * rate)), detrend="linear", window=("kaiser", 14.0))
    floor = np.median(p[f > 0.6 * f[-1]])
    above = np.flatnonzero(p > 10.0 * floor)
    return float(f[above[-1]]) if len(above) else 0.0


def _despiked(tau: np.ndarray) -> tuple[np.ndarray, int]:
    """Replace isolated outliers by the local median; steps and flat tops stay."""
    middle = ndimage.median_filter(tau, size=(7, 1), mode="nearest")
    off = np.abs(tau - middle)
    scale = 1.4826 * np.median(off, axis=0) + 1e-3 * np.ptp(tau, axis=0)
    spike = off > 10.0 * scale
    return np.where(spike, middle, tau), int(spike.sum())
