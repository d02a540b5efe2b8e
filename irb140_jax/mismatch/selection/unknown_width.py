"""Columns whose prior has a width that nobody knows: the inertials', and those of effects that are `tied`.

The evidence is a sum over widths about the one that was stated.
"""

import numpy as np
from scipy import special

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import cholesky_diagonals, root, with_prior

WIDTHS = 2.0**settings.WIDTH_OCTAVES  # of a prior over the one that was stated
_FALL = -np.log1p(settings.WIDTH_OCTAVES**2)
LOG_PRIOR = _FALL - special.logsumexp(_FALL)  # a Cauchy distribution over octaves, cut off


def evidences_by_width(H: np.ndarray, inertials: int, tied: np.ndarray) -> np.ndarray:
    """Log evidence and prior of each width of the inertials' prior and of that of tied columns, (WIDTHS, WIDTHS or 1).

    Args:
        H: Gram matrix of the inertials, then of other columns, then y.
        inertials: How many inertials there are.
        tied: Which of the columns are tied.
    """
    order = np.append(np.argsort(tied, kind="stable"), len(tied))
    scale = np.ones((len(WIDTHS), len(H)))
    scale[:, :inertials] = WIDTHS[:, None]
    M = with_prior(H[np.ix_(order, order)] * (scale[:, :, None] * scale[:, None, :]))
    k = int(np.count_nonzero(tied))
    if not k:
        return (_log_evidences(M) + LOG_PRIOR)[:, None]
    # What is left of the tied columns and y beside all others is the same at each of their widths.
    L = np.array([root(m) for m in M])
    free = len(tied) - k
    left = L[:, free:, free:] @ L[:, free:, free:].swapaxes(1, 2)
    explained = M[:, -1, -1] - left[:, -1, -1]
    by_inertials = LOG_PRIOR + 0.5 * explained - np.log(L[:, range(free), range(free)]).sum(axis=1)
    left = left - np.eye(k + 1)
    scales = np.pad(np.repeat(WIDTHS[:, None], k, axis=1), ((0, 0), (0, 1)), constant_values=1.0)
    by_tied = [_log_evidences(with_prior(left * np.outer(s, s))) for s in scales]
    return by_inertials[:, None] + np.transpose(by_tied) + LOG_PRIOR


def _log_evidences(M: np.ndarray) -> np.ndarray:
    """Log evidence of amplitudes from Gram matrices with their prior (b, k + 1, k + 1) whose last column is y, (b,).

    The last pivot of a Cholesky factor that has y in it is what is left of y.
    """
    diagonal = cholesky_diagonals(M)
    explained = M[:, -1, -1] - diagonal[:, -1] ** 2
    return 0.5 * explained - np.log(diagonal[:, :-1]).sum(axis=1)


def added_by_tied(M: np.ndarray, rhs: np.ndarray, is_mass: bool) -> tuple[float, np.ndarray]:
    """Log evidence that tied columns add over all widths of their prior, and their mean at the most probable one.

    Args:
        M, rhs: 1 + X'X, shape (k, k), and X'y, shape (k,), of the columns X in units of the stated prior.
        is_mass: Whether the first is not below zero.

    Returns:
        The log evidence, and the mean, shape (k,): zero where the first is a mass, which no bound rules out then.
    """
    size, axes = np.linalg.eigh(M - np.eye(len(M)))
    over, along = np.outer(WIDTHS**2, np.maximum(size, 0.0)), WIDTHS[:, None] * (axes.T @ rhs)
    gain = 0.5 * np.sum(along**2 / (1.0 + over) - np.log1p(over), axis=1) + LOG_PRIOR
    best = int(np.argmax(gain))
    weight = WIDTHS[best] * axes / (1.0 + over[best])
    mean, total = weight @ along[best], float(np.logaddexp.reduce(gain))
    if not is_mass:
        return total, mean
    std = np.sqrt(np.sum(WIDTHS[best] ** 2 * axes[0] ** 2 / (1.0 + over[best])))
    return total + float(above_zero(mean[0], std)), np.zeros_like(rhs)


def above_zero(mean: np.ndarray, std: np.ndarray) -> np.ndarray:
    """Log of the probability by mean and standard deviation, (k,) each, of being above zero, over the prior's half."""
    return special.log_ndtr(mean / std) + np.log(2.0)


def truncated(mean: np.ndarray, cov: np.ndarray, at: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of a Gaussian where one of its variables is not below zero.

    Source: Johnson, Kotz, Balakrishnan, Continuous Univariate Distributions 1, 1994, sec. 13.10.1.
    """
    std = float(np.sqrt(cov[at, at]))
    z = mean[at] / std
    ratio = float(np.exp(-0.5 * z**2 - special.log_ndtr(z)) / np.sqrt(2.0 * np.pi))
    along = cov[:, at] / std
    return mean + ratio * along, cov - ratio * (ratio + z) * np.outer(along, along)
