"""The noise of logged positions, and Wiener's smoother that takes it out before they are differentiated.

What one joint does moves the others: an arm that sticks and breaks free at one joint shakes all of them, most of them
by less than their encoders can tell.  Taken alone, such a joint would lose its part of the motion, and the torque that
belongs to it.  So what each joint's own spectrum does not keep is smoothed once more, all joints together, through the
cross-spectra of their positions.
"""

from typing import Any

import numpy as np
from scipy import signal, special
from scipy.signal import windows

from irb140_jax.recordings.recording import Recording

BEYOND = 2.0  # [s] for which a recording is continued beyond its ends
ROUNDS = 4  # in which that is smoothed; ten are better by a tenth
QUARTIC = 4  # the polynomial that tells the acceleration at an end ...
ENDS = 0.5  # ... from so many periods of the highest frequency in the motion ...
SHORTEST, LONGEST = 0.1, 1.0  # ... but not less, nor more [s]
WINDOW = 4.0  # [s] of the spectrum's windows
BINS = 2  # of the spectrum on either side that are averaged at least ...
BREADTH = 0.3  # ... and, of all joints together, as a share of the frequency: a matrix takes more lines to know
FEW = 10  # lowest lines of the spectrum, all signal: noise there is differentiated to next to nothing
CHANCE = 2.0  # scales of Tracy and Widom's law beyond the edge, which noise alone seldom reaches
AT_ONCE = 1 << 14  # frequencies
ROUNDING = 1e-12  # relative; below, eigenvalues are what rounding leaves


def without_noise(
    q: np.ndarray, white: np.ndarray, rate: float, differentiators: tuple[np.ndarray, np.ndarray], *, resampled: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Wiener's smoother: of all joints' positions, at every frequency, the part that is signal.

    What is optimal for q is so for its derivatives too.  Without it, encoder noise between the motion's highest
    frequency and the band's would fill qdd.  Beyond its ends a recording goes on as its own spectrum has it
    (`_goes_on`).

    Args:
        q: Positions on an even grid, shape (T, n).
        white: Power density of their white noise [rad^2/Hz or m^2/Hz], shape (n,).
        rate: Samples per second.
        differentiators: Taps of those that follow, to the first and the second derivative.
        resampled: Whether the spectrum's top no longer shows the noise.

    Returns:
        Positions, with as many beyond either end as the differentiator reaches, shape (T + len(h1) - 1, n); and the
        standard deviation of the noise in their speeds and accelerations, shape (2, n).

    Source: N. Wiener, Extrapolation, Interpolation and Smoothing of Stationary Time Series, 1949, ch. 4.
    """
    half = (len(differentiators[0]) - 1) // 2
    reach = max(min(len(q) - 1, int(BEYOND * rate)), half)
    weights, floor, at = signal_weights(q, white if resampled else np.zeros_like(white), rate)
    longer = _goes_on(q, rate, reach, at, weights)
    noise, coarse = np.zeros((2, q.shape[1])), np.fft.rfftfreq(8192, 1.0 / rate)
    # Jerks fill the top of the spectrum, but few samples.
    passed = np.abs(_interpolated(coarse, at, weights)) ** 2 @ np.minimum(floor, white)
    for k, taps in enumerate(differentiators):
        response = np.abs(np.fft.rfft(taps, 8192))
        noise[k] = np.sqrt(response**2 @ passed * rate / 8192)
    return longer[reach - half : reach + len(q) + half], noise


def _interpolated(f: np.ndarray, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weights at other frequencies, shape (len(f), n, n)."""
    i = np.clip(np.searchsorted(at, f, side="right") - 1, 0, len(at) - 2)
    share = np.clip((f - at[i]) / (at[i + 1] - at[i]), 0.0, 1.0)[:, None, None]
    return (1.0 - share) * weights[i] + share * weights[i + 1]


def _weighted(spectrum: np.ndarray, f: np.ndarray, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Spectra (F, n) of the signal in positions with these spectra; some frequencies at a time, for the memory."""
    out = np.empty_like(spectrum)
    for part in (slice(i, i + AT_ONCE) for i in range(0, len(f), AT_ONCE)):
        out[part] = (_interpolated(f[part], at, weights) @ spectrum[part, :, None])[:, :, 0]
    return out


def _goes_on(x: np.ndarray, rate: float, reach: int, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Positions smoothed, with `reach` samples before and after that they most likely had, shape (T + 2 reach, n).

    They are reflected about their ends, bent by twice the acceleration there, which a reflection would turn round: a
    step of qdd fills the spectrum, and what the smoother takes from that rings for half a second.  What lies beyond the
    ends is then replaced by what the smoother makes of it, a few times: expectation maximisation with missing samples.
    """
    longer = np.pad(x, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    seconds = np.arange(reach, 0, -1) / rate
    bent = seconds**2 * np.cos(0.5 * np.pi * seconds / seconds[0]) ** 2 if reach else seconds
    for j, own in enumerate(x.T):
        longer[:reach, j] += _acceleration(own, rate) * bent
        longer[len(longer) - reach :, j] += _acceleration(own[::-1], rate) * bent[::-1]
    f = np.fft.rfftfreq(len(longer), 1.0 / rate)
    for _ in range(ROUNDS):
        longer[reach : reach + len(x)] = x
        trend = np.linspace(longer[0], longer[-1], len(longer))
        longer -= trend
        longer = np.fft.irfft(_weighted(np.fft.rfft(longer, axis=0), f, at, weights), len(longer), axis=0)
        longer += trend
    return longer


def _acceleration(x: np.ndarray, rate: float) -> float:
    """Second derivative at the first sample, by a quartic, shrunk by what noise there may be in it."""
    seconds = ENDS / max(signal_limit(x, 0.0, rate), ENDS / LONGEST)
    count = min(max(int(max(seconds, SHORTEST) * rate), QUARTIC + 4), len(x))
    if count < QUARTIC + 4:
        return 0.0
    powers = np.vander(np.arange(count) / count, QUARTIC + 1, increasing=True)
    w, rss = np.linalg.lstsq(powers, x[:count], rcond=None)[:2]
    variance = 4.0 * np.linalg.inv(powers.T @ powers)[2, 2] * float(np.sum(rss)) / (count - QUARTIC - 1)
    a = 2.0 * w[2]
    return float(a * max(1.0 - variance / max(a**2, 1e-300), 0.0) * (rate / count) ** 2)


def signal_weights(
    q: np.ndarray, density: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Weights of Wiener's smoother: first each joint's own, then all joints' together for what those took away.

    Args:
        q: Positions on an even grid, shape (T, n).
        density: Power density of their white noise where it is known, shape (n,); else as seen at the spectrum's top.
        rate: Samples per second.

    Returns:
        Weights of each joint's spectrum in each one's signal, shape (F, n, n); density of each joint's noise, shape
        (n,); frequencies [Hz], shape (F,).
    """
    n, length, window = q.shape[1], _window(q, rate), _taper(q, rate)
    starts = range(0, len(q) - length + 1, max(length - length // 2, 1))
    # From the first sample: rounding of a constant would pass for motion.
    spectra = np.stack([np.fft.rfft(signal.detrend(q[s : s + length] - q[0], axis=0) * window[:, None], axis=0)
                        for s in starts])  # fmt: skip
    P = 2.0 * np.einsum("kfi,kfj->fij", spectra, spectra.conj()) / (len(spectra) * rate * np.sum(window**2))
    f = np.fft.rfftfreq(length, 1.0 / rate)
    own = np.einsum("fii->fi", P).real
    # An average of so many periodograms has a median below its mean.
    middle = special.chdtri(2 * len(spectra), 0.5) / (2 * len(spectra))
    floor = np.maximum(np.median(own[f > 0.6 * f[-1]], axis=0) / middle, density)
    size = np.where(floor > 0.0, np.sqrt(floor), np.inf)  # no noise: the joint stands exactly still
    whitened = P / size[:, None] / size
    # How many periodograms' worth a line is: the window's taper widens it to several bins.
    count = len(spectra) * np.sum(window) ** 2 / (length * np.sum(window**2))
    alone = np.zeros_like(P)
    for j in range(n):
        alone[:, j, j] = _kept(whitened[:, j, j][:, None, None], count, 0.0)[:, 0, 0]
    together = np.sqrt(floor)[:, None] * _kept(whitened, count, BREADTH) / size
    weights = alone + (np.eye(n) - alone) @ together
    weights[:FEW] = np.eye(n)
    return weights, floor, f


def _kept(P: np.ndarray, count: float, breadth: float) -> np.ndarray:
    """What of spectra in units of their noise is signal, as weights of shape (F, k, k).

    Cross-spectra of noise alone have eigenvalues near one, and those that stand out belong to combinations of joints
    that move.  Of each 1 - edge / eigenvalue is kept.

    Args:
        P: Cross-spectra, shape (F, k, k).
        count: Periodograms that each line is worth.
        breadth: Share of the frequency over which lines are averaged, at least `BINS` on either side.

    Source: the edge: I. M. Johnstone, On the distribution of the largest eigenvalue in principal components analysis,
    Annals of Statistics 29(2), 2001.
    """
    n, bins = P.shape[1], np.arange(len(P))
    reach = np.maximum(BINS, (breadth * bins).astype(int))
    low, high = np.maximum(bins - reach, 0), np.minimum(bins + reach + 1, len(P))
    total = np.concatenate([np.zeros((1, n, n)), np.cumsum(P, axis=0)])
    values, vectors = np.linalg.eigh((total[high] - total[low]) / (high - low)[:, None, None])
    values = np.maximum(values, ROUNDING * values[:, -1:])
    N = count * (high - low)[:, None]
    edge = (np.sqrt(N) + np.sqrt(n)) ** 2 / N
    spread = (np.sqrt(N) + np.sqrt(n)) / N * (1.0 / np.sqrt(N) + 1.0 / np.sqrt(n)) ** (1.0 / 3.0)
    share = np.clip(1.0 - (edge + CHANCE * spread) / np.maximum(values, 1e-300), 0.0, 1.0)
    return np.einsum("fik,fk,fjk->fij", vectors, share, vectors.conj())


def _window(x: np.ndarray, rate: float) -> int:
    """Samples of a window of the spectrum."""
    return min(len(x), int(WINDOW * rate))


def _taper(x: np.ndarray, rate: float) -> np.ndarray:
    """Window of the spectrum: one that keeps strong slow motion out of the high frequencies."""
    return windows.kaiser(_window(x, rate), 14.0)


def spectrum_of(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Frequencies [Hz], power density of a position, and that of its white noise: as known, or as seen at the top."""
    window: Any = _taper(x, rate)  # SciPy's signature knows names of windows only
    f, p = signal.welch(x, rate, window=window, detrend="linear")
    return f, p, max(float(np.median(p[f > 0.6 * f[-1]])), density)


def noise_density(recording: Recording, even: np.ndarray, rate: float) -> np.ndarray:
    """Power density of the white noise in positions that had to be resampled [rad^2/Hz or m^2/Hz], else 0, shape (n,).

    Resampling smooths the noise, so that its spectrum's top no longer shows it.
    """
    if even is recording.t:
        return np.zeros(recording.q.shape[1])
    return white_density(recording, rate)


def white_density(recording: Recording, rate: float) -> np.ndarray:
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


def signal_limit(x: np.ndarray, density: float, rate: float) -> float:
    """Frequency [Hz] up to which a position's spectrum stands above its noise; 0 for a joint at rest."""
    if np.ptp(x) == 0:
        return 0.0
    f, p, floor = spectrum_of(x, density, rate)
    above = np.flatnonzero(p > 10.0 * floor)
    return float(f[above[-1]]) if len(above) else 0.0
