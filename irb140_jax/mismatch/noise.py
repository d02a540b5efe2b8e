"""The noise of each joint's torque equation: an autoregression and a level per recording.

Sensor noise, differentiated encoder noise and what the model can't follow are all coloured; least squares and evidence
are only right on rows that have been whitened.
"""

import dataclasses

import numpy as np
from scipy import linalg, signal

ORDER = 10  # lags; at about twice the band this spans a quarter of a second


@dataclasses.dataclass(frozen=True)
class Noise:
    """Whitening of every joint's rows.

    Attributes:
        ar: Coefficients of the whitening filter (leading 1), shape (n, ORDER + 1).
        level: Standard deviation of the innovations, shape (recordings, n) [N m or N].
        total: Standard deviation of the noise itself in the band, shape (recordings, n) [N m or N].
    """

    ar: np.ndarray
    level: np.ndarray
    total: np.ndarray

    def whitened(self, x: np.ndarray, joint: int, recording: int) -> np.ndarray:
        """Rows of one joint (axis 0) with white noise of unit variance; the first ORDER rows are not to be used."""
        return signal.lfilter(self.ar[joint], [1.0], x, axis=0) / self.level[recording, joint]

    @staticmethod
    def usable(use: np.ndarray) -> np.ndarray:
        """Rows all of whose lags are usable, shape (R,)."""
        runs = np.convolve(use.astype(int), np.ones(ORDER + 1, dtype=int))[: len(use)]
        return runs == ORDER + 1


def noise_from_residuals(residuals: list[np.ndarray], use: list[np.ndarray], dof: np.ndarray) -> Noise:
    """Fit the noise model.

    Args:
        residuals: Per recording, (R, n) [N m or N].
        use: Per recording, the rows to count, (R, n).
        dof: Parameters already fitted to each joint's rows, shape (n,).

    Returns:
        The noise model; levels never fall below 1e-9 of a unit, so that noise-free input stays finite.
    """
    n = residuals[0].shape[1]
    ar = np.zeros((n, ORDER + 1))
    level, total = np.zeros((len(residuals), n)), np.zeros((len(residuals), n))
    for j in range(n):
        scale = [np.sqrt(np.mean(r[u[:, j], j] ** 2)) if u[:, j].any() else 0.0
                 for r, u in zip(residuals, use, strict=True)]  # fmt: skip
        # Each recording counts by its shape, not by its size: the loudest must not decide the colour.
        acov = sum(
            _autocovariance(r[:, j] / s, u[:, j])
            for r, u, s in zip(residuals, use, scale, strict=True)
            if s > 0
        )
        ar[j] = _whitener(np.atleast_1d(acov))
        rows = sum(int(u[:, j].sum()) for u in use)
        inflate = np.sqrt(rows / max(rows - dof[j], 0.2 * rows, 1.0))
        for r, (res, u) in enumerate(zip(residuals, use, strict=True)):
            white = signal.lfilter(ar[j], [1.0], res[:, j])[Noise.usable(u[:, j])]
            level[r, j] = inflate * (np.sqrt(np.mean(white**2)) if len(white) > 20 else 0.0)
            total[r, j] = inflate * scale[r]
    # A recording in which a joint never moves has no noise of its own: it takes the middling one.
    for x in (level, total):
        median = np.array([np.median(c[c > 0]) if np.any(c > 0) else 1.0 for c in x.T])
        np.copyto(x, median, where=x <= 0)
    return Noise(ar, np.maximum(level, 1e-9), np.maximum(total, 1e-9))


def _autocovariance(x: np.ndarray, use: np.ndarray) -> np.ndarray:
    """Sums of lagged products over pairs of usable rows, per pair, lags 0..ORDER, weighted by their number."""
    masked = np.where(use, x, 0.0)
    out = np.zeros(ORDER + 1)
    for lag in range(ORDER + 1):
        pairs = np.sum(use[lag:] & use[: len(use) - lag])
        out[lag] = masked[lag:] @ masked[: len(x) - lag] / max(pairs, 1) * use.sum()
    return out


def _whitener(acov: np.ndarray) -> np.ndarray:
    """Yule-Walker; a small ridge keeps the filter from amplifying what the low-pass has removed."""
    if acov.shape[0] != ORDER + 1 or acov[0] <= 0:
        return np.eye(1, ORDER + 1)[0]
    acov = acov / acov[0] * 0.999 ** np.arange(ORDER + 1)
    acov[0] = 1.001
    a = linalg.solve_toeplitz(acov[:-1], acov[1:])
    return np.concatenate([[1.0], -a])
