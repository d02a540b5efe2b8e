"""Columns whose prior has a width that nobody knows: inertials, delays of channels, and effects that are `tied`.

The evidence is a sum over widths about the one that was stated.
"""

import numpy as np
from scipy import special

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import root, with_prior

WIDTHS = 2.0**settings.WIDTH_OCTAVES  # of a prior over the one that was stated
_FALL = -np.log1p(settings.WIDTH_OCTAVES**2)
LOG_PRIOR = _FALL - special.logsumexp(_FALL)  # a Cauchy distribution over octaves, cut off


def evidences_by_width(H: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Log evidence and prior of each width of each prior whose width is not known, shape (WIDTHS, ...).

    Args:
        H: Gram matrix of columns and y, which comes last, shape (k + 1, k + 1).
        unknown: Which columns have the first of these priors, which the second and so on, shape (priors, k).  Of a
            prior that no column has one width stands for all.
    """
    known = np.flatnonzero(~unknown.any(axis=0))
    groups = [known, *map(np.flatnonzero, unknown)]
    order = np.concatenate([*groups, [len(H) - 1]])
    left, value = H[np.ix_(order, order)], np.zeros(())
    for number, group in enumerate(groups):
        k = len(group)
        if number:
            scale = np.ones((len(WIDTHS) if k else 1, left.shape[-1]))
            scale[:, :k] = WIDTHS[:, None] if k else 1.0
            left = left[..., None, :, :] * (scale[:, :, None] * scale[:, None, :])
            value = value[..., None] + (LOG_PRIOR if k else 0.0)
        # The others get a prior, too, so that rounding leaves a root, and lose it again.
        L = root(with_prior(left, k))
        value = value - np.log(np.diagonal(L, axis1=-2, axis2=-1)[..., :k]).sum(axis=-1)
        rest = L[..., k:, k:]
        left = rest @ np.swapaxes(rest, -2, -1) - np.eye(rest.shape[-1])
    return value + 0.5 * (H[-1, -1] - left[..., 0, 0])


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
