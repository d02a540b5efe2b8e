"""The noise of each joint's torque equation: an autoregression and a level per recording.

Differentiated encoder noise rises with frequency, and rows must be whitened before least squares or evidence are
right.  What the model can't follow is the other way round: large at low frequency.  Whitening that would amplify the
high frequencies, where no friction law is exact (a reversal is not a step), and bias every level down.  So the noise
spectrum used never falls with frequency: whitening where noise rises, ordinary least squares at the level of the worst
frequency where it falls.  Both are then conservative.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import linalg, signal

from irb140_jax.mismatch import settings

ORDER = 10  # lags; at about twice the band this spans a quarter of a second
SPECTRUM = 256  # points of the spectrum
RIDGE = 1e-3
ROUNDS = 5  # in which noise and what some rows are unsure by beside it are told apart


@dataclasses.dataclass(frozen=True)
class Noise:
    """Whitening of every joint's rows.

    Attributes:
        ar: Coefficients of the whitening filter (leading 1), shape (n, ORDER + 1).
        level: Standard deviation of the innovations, shape (recordings, n) [N m or N].
        total: Standard deviation of the noise itself in the band, shape (recordings, n) [N m or N].
        alike: Correlation time of each joint's residual [rows], shape (n,); see `correlation_time`.
    """

    ar: np.ndarray
    level: np.ndarray
    total: np.ndarray
    alike: np.ndarray

    def whitened(self, x: np.ndarray, joint: int, recording: int, unsure: np.ndarray | float = 0.0) -> np.ndarray:
        """Rows of one joint (axis 0) with white noise of unit variance; only `usable` ones are to be used.

        Args:
            x: The rows, shape (R, ...).
            joint, recording: Of the rows.
            unsure: Standard deviation of what they are unsure by beside the noise, shape (R,) [N m or N].
        """
        louder = spread(unsure, self.total[recording, joint])
        x = x / np.reshape(louder, np.shape(louder) + (1,) * (x.ndim - np.ndim(louder)))
        return signal.lfilter(self.ar[joint], [1.0], x, axis=0) / self.level[recording, joint]

    def usable(self, use: np.ndarray, joint: int) -> np.ndarray:
        """Rows that count together with all the lags that the joint's whitening looks back on, shape (R,)."""
        lags = int(np.flatnonzero(self.ar[joint])[-1])
        runs = np.convolve(use.astype(int), np.ones(lags + 1, dtype=int))[: len(use)]
        return runs == lags + 1


def spread(unsure: np.ndarray | float, total: np.ndarray | float) -> np.ndarray:
    """Standard deviation of a row over that of the noise, where `unsure` [N m or N] comes on top of the noise."""
    return np.sqrt(1.0 + (np.asarray(unsure) / total) ** 2)


def noise_from_residuals(
    residuals: list[np.ndarray], use: list[np.ndarray], dof: np.ndarray, unsure: list[np.ndarray] | None = None
) -> Noise:
    """Fit the noise model.

    Args:
        residuals: Per recording, (R, n) [N m or N].
        use: Per recording, the rows to count, (R, n).
        dof: Parameters already fitted to each joint's rows, shape (n,).
        unsure: Per recording, what rows are unsure by beside the noise, (R, n) [N m or N]; by default nothing.

    Returns:
        The noise model; levels never fall below 1e-9 of a unit, so that noise-free input stays finite.
    """
    n, unsure = residuals[0].shape[1], unsure or [np.zeros_like(r) for r in residuals]
    ar, alike = np.zeros((n, ORDER + 1)), np.ones(n)
    level, total = np.zeros((len(residuals), n)), np.zeros((len(residuals), n))
    for j in range(n):
        counts = np.array([int(u[:, j].sum()) for u in use])
        sizes = [_size(r[u[:, j], j], b[u[:, j], j]) for r, u, b in zip(residuals, use, unsure, strict=True)]
        scale = _beside_others(np.array(sizes), counts)
        # Each recording counts by its shape, not by its size: the loudest must not decide the colour.
        acov, counted = np.zeros((2, ORDER + 1)), []
        for r, u, b, s in zip(residuals, use, unsure, scale, strict=True):
            if u[:, j].any():
                counted.append(np.where(u[:, j], r[:, j] / (s * spread(b[:, j], s)), 0.0))
                acov += _autocovariance(counted[-1], u[:, j])
        alike[j] = correlation_time(counted)
        ar[j], innovation = _whitener(_per_pair(*acov))
        rows = int(counts.sum())
        total[:, j] = np.sqrt(max(rows, 1) / max(rows - dof[j], 0.2 * rows, 1.0)) * scale
        level[:, j] = total[:, j] * innovation
    return Noise(ar, np.maximum(level, 1e-9), np.maximum(total, 1e-9), alike)


def correlation_time(series: Sequence[np.ndarray]) -> float:
    """Correlation time of stationary signals [rows]: their autocorrelation summed over both sides to its first zero.

    It is the spectrum at the lowest frequencies over its mean.  The variance of a mean over many rows is larger by this
    factor than it would be with white noise of the same size.

    Args:
        series: Shape (R,) each.

    Source: Priestley, Spectral Analysis and Time Series, 1981, sec. 5.3: variance of the mean of a stationary process.
    """
    products = np.zeros(max((len(x) for x in series), default=1))
    for x in series:
        spectrum = np.abs(np.fft.rfft(x, 2 * len(x))) ** 2
        products[: len(x)] += np.fft.irfft(spectrum)[: len(x)]
    if products[0] <= 0.0:
        return 1.0
    together = products / products[0]
    crossing = int(np.argmax(together <= 0.0)) or len(together)
    return float(max(2.0 * together[:crossing].sum() - 1.0, 1.0))


def ridge(A: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients with a standard normal prior, the noise's variance found from what they leave.

    Args:
        A: Columns in units of their prior standard deviation, shape (R, K).
        y: What they should add up to, shape (R,).

    Returns:
        Coefficients, shape (K,), and how many of them the data determine.

    Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4(3), 1992.
    """
    values, vectors = np.linalg.eigh(A.T @ A)
    values, projected = np.clip(values, 0, None), vectors.T @ (A.T @ y)
    variance, dof = float(np.mean(y**2)) * 0.1 + 1e-18, 0.0
    for _ in range(10):
        w = projected / (values + variance)
        rss = y @ y - 2 * w @ projected + (w**2) @ values
        dof = float(np.sum(values / (values + variance)))
        variance = max(rss, 1e-18 * (y @ y)) / max(len(y) - dof, 0.2 * len(y)) + 1e-24
    return vectors @ (projected / (values + variance)), dof


def _size(residual: np.ndarray, unsure: np.ndarray) -> float:
    """Standard deviation of the noise in a residual that is unsure by more in some rows; 0 without rows."""
    size = whole = float(np.sqrt(np.mean(residual**2))) if len(residual) else 0.0
    for _ in range(ROUNDS if whole > 0.0 else 0):
        size = max(float(np.sqrt(np.mean((residual / spread(unsure, size)) ** 2))), settings.LEAST_NOISE * whole)
    return size


def _beside_others(sizes: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Noise of each recording, (recordings,), where one more row shows the middling one; 1 where none has any.

    Of few rows nearly any law leaves nothing, which is no measure of noise; without rows it is the middling one.

    Source: Kass and Wasserman, JASA 90 (1995): a prior that is worth one observation.
    """
    known = sizes > 0.0
    usual = float(np.median(sizes[known])) if known.any() else 1.0
    return np.sqrt((usual**2 + rows * sizes**2) / (1.0 + rows))


def _autocovariance(x: np.ndarray, use: np.ndarray) -> np.ndarray:
    """Sums over the usable rows: lagged products and numbers of pairs, lags 0..ORDER, shape (2, ORDER + 1)."""
    masked = np.where(use, x, 0.0)
    products = [masked[lag:] @ masked[: len(x) - lag] for lag in range(ORDER + 1)]
    return np.array([products, [np.sum(use[lag:] & use[: len(use) - lag]) for lag in range(ORDER + 1)]])


def _per_pair(products: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Autocovariances per pair; as they are where gaps leave few pairs or the estimate has a spectrum below zero."""
    covariances = products * pairs[0] / np.maximum(pairs, 1)
    possible = np.linalg.eigvalsh(linalg.toeplitz(covariances))[0] > 0.0
    return covariances if possible and pairs[-1] > settings.ENOUGH_LAGS * pairs[0] else products


def _whitener(acov: np.ndarray) -> tuple[np.ndarray, float]:
    """Whitening filter for a spectrum that never falls with frequency, and its innovation for unit variance."""
    if acov[0] <= 0:
        return np.eye(1, ORDER + 1)[0], 1.0
    acov = acov / acov[0]
    a, variance = _yule_walker(acov)
    response = np.abs(np.fft.rfft(a, SPECTRUM)) ** 2
    rising = np.maximum.accumulate(variance / response)
    acov = np.fft.irfft(rising, SPECTRUM)[: ORDER + 1]
    acov = acov / acov[0]
    a, variance = _yule_walker(acov)
    if np.abs(a[1:]).max() < settings.NEGLIGIBLE_LAG:
        return np.eye(1, ORDER + 1)[0], float(np.sqrt(acov[0]))
    return a, float(np.sqrt(variance))


def _yule_walker(acov: np.ndarray) -> tuple[np.ndarray, float]:
    """Autoregression with these autocovariances; a small ridge keeps it from amplifying what the low-pass removed."""
    damped = acov.copy()
    damped[0] *= 1.0 + RIDGE
    a = linalg.solve_toeplitz(damped[:-1], damped[1:])
    return np.concatenate([[1.0], -a]), float(max(damped[0] - a @ damped[1:], 1e-9 * damped[0]))
