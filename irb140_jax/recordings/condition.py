"""From a raw log to smooth, evenly spaced motion: resampling, despiking, differentiation, bandwidth.

Both sides of the torque equation later pass the same low-pass (`Band.low_pass`), so that what it removes is removed
from measurement and model alike.
"""

import dataclasses
import functools

import jax.numpy as jnp
import numpy as np
from scipy import interpolate, ndimage, signal
from scipy.signal import windows

from irb140_jax import dynamics
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot

MAX_TORQUE_BAND = 20.0  # Hz; above this, arms are not rigid and motor torque holds mostly current ripple
MIN_TORQUE_BAND = 4.0  # Hz; friction reversals are steps, a narrower band would blur them into the inertia
WORKING_RATE = 200.0  # Hz; columns are evaluated at least this often
SLOW = 3.0  # Hz; below, model and log may differ by the very friction that is looked for
INCOHERENT = 0.05  # share of the model's torque that may be noise: what biases parameters by as much
REST = 0.1  # s that a joint must stay where it is to rest: a reversal takes less
CERTAIN = 1.5  # times the noise that a spectrum must exceed before any of it counts as signal: its own scatter
AT_ONCE = 32  # low-passed rows in one product: about as long as the filter
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
        taps, count = self.low_pass(), len(self.kept(len(x)))
        flat = x.reshape(len(x), -1)
        out = np.zeros((count, flat.shape[1]))
        # A few rows of the filter's matrix at a time: products of matrices, where sample by sample would be slow.
        filters = np.zeros((AT_ONCE, (AT_ONCE - 1) * self.step + len(taps)))
        for i, row in enumerate(filters):
            row[i * self.step : i * self.step + len(taps)] = taps
        for first in range(0, count, AT_ONCE):
            part = flat[first * self.step :][: filters.shape[1]]
            out[first : first + AT_ONCE] = filters[: count - first, : len(part)] @ part
        return out.reshape(count, *x.shape[1:])

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
        began: Time of the log's first row [s]; the smoother leaves out the first samples.
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
    began: float = 0.0


def choose_band(recordings: list[Recording], robot: Robot) -> Band:
    """The band in which positions carry motion, and the model's torque means something, in all recordings alike.

    Two limits: the positions' spectrum must stand above their noise, and differentiated positions must not fill the
    model's torque with what the logged torque knows nothing of (noise, play, flexibility), for regressors that hold
    noise bias every parameter towards zero.
    """
    top, rates = [], []
    for recording in recordings:
        t, q, _, _ = _even(recording)
        rate = (len(t) - 1) / (t[-1] - t[0])
        rates.append(rate)
        density = _density(recording, t, rate)
        top.append([_signal_limit(x, d, rate) for x, d in zip(q.T, density, strict=True)])
    # The fastest recording decides; within it, the middling joint: a still joint says nothing, a noisy one too much.
    limit = max((float(np.median([f for f in row if f > 0] or [0.0])) for row in top), default=0.0)
    slowest = float(min(rates))
    highest = max(min(MAX_TORQUE_BAND, slowest / 6.0), 1.0)
    band = _band(float(np.clip(2.0 * limit, min(MIN_TORQUE_BAND, highest), highest)), slowest)
    coherent = _coherent_limit([condition(r, band) for r in recordings], robot, band)
    return _band(max(min(band.torque, coherent), min(MIN_TORQUE_BAND, highest)), slowest)


def _band(torque: float, rate: float) -> Band:
    """The band with this torque cut-off for recordings of this rate."""
    working = min(max(WORKING_RATE, 8.0 * torque), rate)
    return Band(torque, min(1.6 * torque, 0.4 * rate), working, max(1, int(working / (2.2 * torque))))


def _coherent_limit(smooth: list["Conditioned"], robot: Robot, band: Band) -> float:
    """Highest frequency [Hz] up to which the model's torque is not filled with what the log and friction don't show.

    Of the model's torque m, the part incoherent with the logged torque and the direction of motion is summed from
    `SLOW` upwards; it must stay below `INCOHERENT` of the whole power, for every joint.  What friction a regression
    below `SLOW` finds is taken off the logged torque first: where friction rules, m and the log would not match at all.
    """
    window = int(band.rate)  # one second: resolves 1 Hz
    f = np.fft.rfftfreq(window, 1.0 / band.rate)
    spectra = np.zeros((robot.n, len(f), 4, 4), dtype=complex)
    taper = np.hanning(window)[:, None]
    phi = np.asarray(robot.phi).ravel()
    for r in smooth:
        Y = np.asarray(dynamics.regressor_batch(robot, *(jnp.asarray(x) for x in (r.q, r.qd, r.qdd))))
        m = Y @ phi + np.asarray(robot.armature) * r.qdd
        direction = np.tanh(r.qd / r.rest_speed)
        friction = np.concatenate([direction, r.qd], axis=1)
        slow = _filtered(np.concatenate([r.tau, m, r.qdd, friction], axis=1), _kernels(SLOW, band.rate)[0], odd=False)
        for j in range(robot.n):
            inputs = np.concatenate([slow[:, [robot.n + j, 2 * robot.n + j]], slow[:, 3 * robot.n :]], axis=1)
            inputs = np.concatenate([inputs, np.ones((len(inputs), 1))], axis=1)
            w = np.linalg.lstsq(inputs, slow[:, j], rcond=1e-6)[0]
            x = np.stack([m[:, j], r.tau[:, j] - friction @ w[2:-1], direction[:, j], r.tau[:, j]], axis=1)
            for start in range(0, len(x) - window + 1, window // 2):
                piece = x[start : start + window]
                F = np.fft.rfft((piece - piece.mean(axis=0)) * taper, axis=0)
                spectra[j] += np.einsum("fa,fb->fab", F.conj(), F)
    limit = band.torque
    for s in spectra[:, 1:]:
        power, inputs, cross = s[:, 0, 0].real, s[:, 1:3, 1:3], s[:, 1:3, 0]
        if power.sum() <= 0:
            continue
        ridge = 1e-9 * np.trace(inputs, axis1=1, axis2=2).real[:, None, None] + 1e-300
        known = np.einsum(
            "fa,fa->f", cross.conj(), np.linalg.solve(inputs + ridge * np.eye(2), cross[..., None])[..., 0]
        )
        unknown = np.where(f[1:] > SLOW, np.clip(power - known.real, 0.0, None), 0.0)
        # Noise in a model torque that is small beside the logged one does no harm.
        share = np.cumsum(unknown) / np.maximum(np.cumsum(power), np.cumsum(s[:, 3, 3].real))
        over = np.flatnonzero(share > INCOHERENT)
        if len(over):
            limit = min(limit, float(f[1:][over[0]]))
    return limit


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
    white = _white_density(recording, raw_rate)
    q, speed_noise = _without_noise(q, white, raw_rate, h1, resampled=t is not recording.t)
    smoothed = [_filtered(q, k, odd=True) for k in (h, h1, h2)]
    tau = _filtered(tau, anti_alias, odd=False)
    keep = slice(None) if pad else slice(half, len(t) - half)
    grid = np.arange(t[keep][0], t[keep][-1] + 1e-9, 1.0 / band.rate)
    q, qd, qdd, tau = (_at(grid, t, x) for x in (*smoothed, tau))
    rest_speed = np.maximum(np.maximum(3.0 * speed_noise, 0.003 * np.abs(qd).max(axis=0, initial=0.0)), 1e-6)
    slow = ndimage.minimum_filter1d((np.abs(qd) < rest_speed).astype(float), int(REST * band.rate) | 1, axis=0)
    stuck = _at(grid, recording.t, _within_a_step(recording).astype(float))
    resting = ndimage.maximum_filter1d(np.maximum(slow, stuck), int(2 * REST * band.rate) | 1, axis=0) > 0.5
    # A gap spoils what the smoother and, later, the low-pass reach from it; half their length holds most of that.
    reach = (int(np.ceil(half / raw_rate * band.rate)) + (len(band.low_pass()) - 1) // 2) // 2
    lost = ndimage.maximum_filter1d((np.interp(grid, t, missing.astype(float)) > 0).astype(int), 2 * reach + 1) > 0
    notes = list(recording.notes)
    if spikes:
        notes.append(f"{spikes} torque spikes were replaced by the median of their neighbours")
    usable, began = ~resting & ~lost[:, None], float(recording.t[0])
    return Conditioned(recording.source, grid, q, qd, qdd, tau, usable, rest_speed, tuple(notes), began)


def _within_a_step(recording: Recording) -> np.ndarray:
    """Rows around which a joint's position stays within one step of its encoder for `REST`, shape (T, n).

    A joint that sticks while its encoder flickers between two counts would otherwise seem to move back and forth.
    """
    step = np.array([np.min(d[d > 0], initial=np.inf) for d in np.abs(np.diff(recording.q, axis=0)).T])
    window = int(REST / np.median(np.diff(recording.t))) | 1
    span = ndimage.maximum_filter1d(recording.q, window, axis=0) - ndimage.minimum_filter1d(recording.q, window, axis=0)
    return span < 1.5 * step


def _without_noise(
    q: np.ndarray, white: np.ndarray, rate: float, h1: np.ndarray, *, resampled: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Wiener's smoother: every frequency of every joint's position weighted by the share of it that is signal.

    What is optimal for q is so for its derivatives too.  Without it, encoder noise between the motion's highest
    frequency and the band's would fill qdd.

    Args:
        q: Positions on an even grid, shape (T, n).
        white: Power density of their white noise [rad^2/Hz or m^2/Hz], shape (n,).
        rate: Samples per second.
        h1: Taps of the differentiator that follows.
        resampled: Whether the spectrum's top no longer shows the noise.

    Returns:
        Positions, shape (T, n), and the standard deviation of the noise in their speeds, shape (n,).

    Source: N. Wiener, Extrapolation, Interpolation and Smoothing of Stationary Time Series, 1949.
    """
    reach = min(len(q) - 1, int(2.0 * rate))
    longer = np.pad(q, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    trend = np.linspace(0.0, 1.0, len(longer))[:, None] * (longer[-1] - longer[0]) + longer[0]
    spectrum = np.fft.rfft(longer - trend, axis=0)
    f = np.fft.rfftfreq(len(longer), 1.0 / rate)
    out, noise = np.empty_like(q), np.zeros(q.shape[1])
    for j in range(q.shape[1]):
        share, floor, at = _signal_share(q[:, j], white[j] if resampled else 0.0, rate)
        weight = np.interp(f, at, share)
        out[:, j] = (np.fft.irfft(spectrum[:, j] * weight, len(longer)) + trend[:, j])[reach : reach + len(q)]
        response = np.abs(np.fft.rfft(h1, 8192)) * np.interp(np.fft.rfftfreq(8192, 1.0 / rate), at, share)
        # Jerks fill the top of the spectrum, but few samples.
        floor = min(floor, white[j])
        noise[j] = np.sqrt(floor * np.sum(response**2) * rate / 8192)
    return out, noise


def _signal_share(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Share of the signal in a position's power at each frequency, density of its white noise, frequencies [Hz]."""
    f, p, floor = _spectrum(x, density, rate)
    smooth = ndimage.uniform_filter1d(p, 5, mode="nearest")
    share = np.clip(1.0 - CERTAIN * floor / np.maximum(smooth, 1e-300), 0.0, 1.0)
    share[f < 1.0] = 1.0  # below, windows of four seconds can't tell
    return share, floor, f


def _spectrum(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Frequencies [Hz], power density of a position, and that of its white noise: as known, or as seen at the top."""
    window = windows.kaiser(min(len(x), int(4 * rate)), 14.0)
    f, p = signal.welch(x, rate, window=window, detrend="linear")
    return f, p, max(float(np.median(p[f > 0.6 * f[-1]])), density)


def _density(recording: Recording, even: np.ndarray, rate: float) -> np.ndarray:
    """Power density of the white noise in positions that had to be resampled [rad^2/Hz or m^2/Hz], else 0, shape (n,).

    Resampling smooths the noise, so that its spectrum's top no longer shows it.
    """
    if even is recording.t:
        return np.zeros(recording.q.shape[1])
    return _white_density(recording, rate)


def _white_density(recording: Recording, rate: float) -> np.ndarray:
    """Power density of the white noise in positions at this rate [rad^2/Hz or m^2/Hz], shape (n,)."""
    return np.array([2.0 * white_noise(recording.t, x) ** 2 / rate for x in recording.q.T])


def white_noise(t: np.ndarray, x: np.ndarray) -> float:
    """Standard deviation of the white part of a smooth signal, unevenly sampled or not.

    Every sample is compared with the quintic through its six neighbours; the median is robust to the signal.
    """
    if len(x) < 20:
        return 0.0
    places, last = (0, 1, 2, 4, 5, 6), len(x) - 6
    near = [t[i : last + i] - t[3:-3] for i in places]
    weights = np.stack([
        np.prod([near[m] / (near[m] - near[k]) for m in range(6) if m != k], axis=0) for k in range(6)
    ])  # fmt: skip
    values = np.stack([x[i : last + i] for i in places])
    off = (x[3:-3] - np.sum(weights * values, axis=0)) / np.sqrt(1.0 + np.sum(weights**2, axis=0))
    moving = off[np.ptp(values, axis=0) > 0]  # at rest, a coarse encoder shows no noise
    return float(np.median(np.abs(moving)) / 0.6745) if len(moving) > 10 else 0.0


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


@functools.cache
def _kernels(cutoff: float, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Taps of a windowed-sinc low-pass and of its first and second time derivative.

    The derivatives are least squares over all frequencies to w H and w^2 H of the low-pass H, errors taken relative to
    1/w and 1/w^2: differentiating the windowed sinc itself leaves steps at its ends, worth 3 % of qdd inside the band.
    """
    half = max(int(np.ceil(2.0 * rate / cutoff)), 2)
    k = np.arange(-half, half + 1)
    x = k / rate
    h = np.sinc(2 * cutoff * x) * np.i0(KAISER_BETA * np.sqrt(np.clip(1.0 - (k / half) ** 2, 0.0, None)))
    h = h / h.sum()
    w = np.linspace(0.0, np.pi * rate, 16 * half)
    response, weight = np.cos(np.outer(w, x)) @ h, 1.0 / (w + 0.5 * np.pi / x[-1])
    odd, even = 2.0 * np.sin(np.outer(w, x[half + 1 :])), 2.0 * (np.cos(np.outer(w, x[half + 1 :])) - 1.0)
    b = np.linalg.lstsq(weight[:, None] * odd, weight * w * response, rcond=None)[0]
    c = np.linalg.lstsq(weight[:, None] ** 2 * even, -(weight**2) * w**2 * response, rcond=None)[0]
    h1, h2 = np.concatenate([b[::-1], [0.0], -b]), np.concatenate([c[::-1], [-2.0 * c.sum()], c])
    # Exact on what they must be exact on: constants, ramps (h, h1) and parabolas (h2).
    return h, -h1 / (h1 @ x), h2 * 2.0 / (h2 @ x**2)


def _filtered(x: np.ndarray, taps: np.ndarray, *, odd: bool) -> np.ndarray:
    """Zero-phase FIR along axis 0, ends reflected (about the end point when `odd`)."""
    half = (len(taps) - 1) // 2
    extended = np.pad(x, ((half, half), (0, 0)), mode="reflect", reflect_type="odd" if odd else "even")
    return signal.oaconvolve(extended, taps[:, None], mode="valid", axes=0)


def _signal_limit(x: np.ndarray, density: float, rate: float) -> float:
    """Frequency [Hz] up to which a position's spectrum stands above its noise; 0 for a joint at rest."""
    if np.ptp(x) == 0:
        return 0.0
    f, p, floor = _spectrum(x, density, rate)
    above = np.flatnonzero(p > 10.0 * floor)
    return float(f[above[-1]]) if len(above) else 0.0


def _despiked(tau: np.ndarray) -> tuple[np.ndarray, int]:
    """Replace isolated outliers by the local median; steps and flat tops stay."""
    middle = ndimage.median_filter(tau, size=(7, 1), mode="nearest")
    off = np.abs(tau - middle)
    scale = 1.4826 * np.median(off, axis=0) + 1e-3 * np.ptp(tau, axis=0)
    spike = off > 10.0 * scale
    return np.where(spike, middle, tau), int(spike.sum())
