"""The noise of logged positions, and Wiener's smoother that takes it out before they are differentiated."""

import numpy as np
from scipy import ndimage, signal, special
from scipy.signal import windows

from irb140_jax.recordings.recording import Recording

BEYOND = 2.0  # [s] for which a recording is continued beyond its ends
ROUNDS = 4  # in which that is smoothed; ten are better by a tenth
QUARTIC = 4  # the polynomial that tells the acceleration at an end ...
ENDS = 0.5  # ... from so many periods of the highest frequency in the motion ...
SHORTEST, LONGEST = 0.1, 1.0  # ... but not less, nor more [s]
WINDOW = 4.0  # [s] of the spectrum's windows
CERTAIN = 1.3  # times the noise that a spectrum must exceed before any of it counts as signal: its own scatter
BINS = 5  # of the spectrum that are averaged ...
FREEDOM = 4.2  # ... and how many degrees of freedom they have together in each of Kaiser's windows
CHANCE = 1e-6  # with which noise alone is as high as the top of a run of frequencies that counts as signal


def without_noise(
    q: np.ndarray, white: np.ndarray, rate: float, differentiators: tuple[np.ndarray, np.ndarray], *, resampled: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Wiener's smoother: every frequency of every joint's position weighted by the share of it that is signal.

    What is optimal for q is so for its derivatives too.  Without it, encoder noise between the motion's highest
    frequency and the band's would fill qdd.  Beyond its ends
    a recording goes on as its own spectrum has it (`_goes_on`).

    Args:
        q: Positions on an even grid, shape (T, n).
        white: Power density of their white noise [rad^2/Hz or m^2/Hz], shape (n,).
        rate: Samples per second.
        differentiators: Taps of those that follow, to the first and the second derivative.
        resampled: Whether the spectrum's top no longer shows the noise.

    Returns:
        Positions, with as many beyond either end as the differentiator reaches, shape (T + len(h1) - 1, n); and the
        standard deviation of the noise in their speeds and accelerations, shape (2, n).

    Source: N. Wiener, Extrapolation, Interpolation and Smoothing of Stationary Time Series, 1949.
    """
    half = (len(differentiators[0]) - 1) // 2
    reach = max(min(len(q) - 1, int(BEYOND * rate)), half)
    out, noise = np.empty((len(q) + 2 * half, q.shape[1])), np.zeros((2, q.shape[1]))
    f = np.fft.rfftfreq(len(q) + 2 * reach, 1.0 / rate)
    for j in range(q.shape[1]):
        share, floor, at = signal_share(q[:, j], white[j] if resampled else 0.0, rate)
        longer = _goes_on(q[:, j], rate, reach, np.interp(f, at, share))
        out[:, j] = longer[reach - half : reach + len(q) + half]
        weight = np.interp(np.fft.rfftfreq(8192, 1.0 / rate), at, share)
        # Jerks fill the top of the spectrum, but few samples.
        floor = min(floor, white[j])
        for k, taps in enumerate(differentiators):
            response = np.abs(np.fft.rfft(taps, 8192)) * weight
            noise[k, j] = np.sqrt(floor * np.sum(response**2) * rate / 8192)
    return out, noise


def _goes_on(x: np.ndarray, rate: float, reach: int, weight: np.ndarray) -> np.ndarray:
    """A position smoothed, with `reach` samples before and after that it most likely had, shape (T + 2 reach,).

    It is reflected about its ends, bent by twice the acceleration there, which a reflection would turn round: a step of
    qdd fills the spectrum, and what the smoother takes from that rings for half a second.  What lies beyond the ends is
    then replaced by what the smoother makes of it, a few times: expectation maximisation with missing samples.
    """
    longer = np.pad(x, reach, mode="reflect", reflect_type="odd")
    seconds = np.arange(reach, 0, -1) / rate
    bent = seconds**2 * np.cos(0.5 * np.pi * seconds / seconds[0]) ** 2 if reach else seconds
    longer[:reach] += _acceleration(x, rate) * bent
    longer[len(longer) - reach :] += _acceleration(x[::-1], rate) * bent[::-1]
    for _ in range(ROUNDS):
        longer[reach : reach + len(x)] = x
        trend = np.linspace(longer[0], longer[-1], len(longer))
        longer = np.fft.irfft(np.fft.rfft(longer - trend) * weight, len(longer)) + trend
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


def signal_share(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Share of the signal in a position's power at each frequency, density of its white noise, frequencies [Hz]."""
    f, p, floor = spectrum_of(x, density, rate)
    smooth = np.maximum(ndimage.uniform_filter1d(p, BINS, mode="nearest"), 1e-300)
    share = np.clip(1.0 - CERTAIN * floor / smooth, 0.0, 1.0)
    share[f < 1.0] = 1.0  # below, windows of four seconds can't tell
    # Of hundreds of frequencies some stand out by chance; differentiated twice, those would be what is loudest.
    count = max(2 * len(x) // _window(x, rate) - 1, 1)  # windows; their median is less than their mean
    sure = floor * 2 * count / special.chdtri(2 * count, 0.5) * special.chdtri(FREEDOM * count, CHANCE)
    runs = np.cumsum(np.diff(share > 0.0, prepend=True))
    top = np.asarray(ndimage.maximum(np.where(f < 1.0, np.inf, smooth), runs, np.arange(runs[-1] + 1)))
    return np.where((top > sure / (FREEDOM * count))[runs], share, 0.0), floor, f


def _window(x: np.ndarray, rate: float) -> int:
    """Samples of a window of the spectrum."""
    return min(len(x), int(WINDOW * rate))


def spectrum_of(x: np.ndarray, density: float, rate: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Frequencies [Hz], power density of a position, and that of its white noise: as known, or as seen at the top."""
    window = windows.kaiser(_window(x, rate), 14.0)
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
