"""One Gram matrix: the evidence of any set of explanations without touching the data again.

With whitened rows y = X w + e, e ~ N(0, 1) and amplitudes w = W v, v ~ N(0, 1),

    log evidence(S) = 1/2 b' M^-1 b - 1/2 log det M,   M = 1 + W X'X W,  b = W X'y,

up to a constant that all sets share.  Inertial parameters are always in; they are eliminated once.
"""

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from scipy import linalg

from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.regression.rows import Stretch

WIDENINGS = 10  # rounds in which the priors of strong effects become as wide as those; three or four are usual
ROUNDING = 1e-12  # relative; a log of nonsense can make columns that are equal to a dozen digits


def grams(
    stretches: list[Stretch], columns: np.ndarray, noise: Noise, scale: np.ndarray, blocks: int
) -> np.ndarray:
    """Whitened Gram matrices [X | y]'[X | y] of blocks of the data, columns scaled by their prior standard deviation.

    Args:
        stretches: One per recording.
        columns: Which columns X is made of, shape (K,).
        noise: Whitening.
        scale: Prior standard deviation of each column's amplitude, shape (K,).
        blocks: Contiguous blocks per recording.

    Returns:
        Shape (recordings * blocks, K + 1, K + 1).
    """
    n, size = stretches[0].y.shape[1], len(columns) + 1
    total = np.zeros((len(stretches) * blocks, size, size))
    # Joints side by side: nearly all of the time is in products, and those hold no lock.
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for index, own in threads.map(partial(_grams_of_joint, stretches, columns, noise, scale, blocks), range(n)):
            total[:, index[:, None], index] += own
    return total


def _grams_of_joint(
    stretches: list[Stretch], columns: np.ndarray, noise: Noise, scale: np.ndarray, blocks: int, j: int
) -> tuple[np.ndarray, np.ndarray]:
    """Columns that are not zero throughout and y, and their Gram matrices by block."""
    own = [s.of(columns, j) for s in stretches]
    active = np.flatnonzero(np.any([np.any(x != 0.0, axis=0) for x in own], axis=0))
    out = []
    for s, x in zip(stretches, own, strict=True):
        A = np.concatenate([x[:, active] * scale[active], s.y[:, j : j + 1]], axis=1)
        A, usable = noise.whitened(A, j, s.recording, s.unsure[:, j]), noise.usable(s.use[:, j], j)
        # What a law errs by comes back with the motion: played again, it is no more evidence.
        A = A / np.sqrt(s.repeats)
        edges = np.linspace(0, len(A), blocks + 1).astype(int)
        for block in map(slice, edges[:-1], edges[1:]):
            part = A[block][usable[block]]
            out.append(part.T @ part)
    return np.append(active, len(columns)), np.stack(out)


def with_prior(G: np.ndarray, columns: int | None = None) -> np.ndarray:
    """Gram matrices (..., k, k) of amplitudes with their unit prior; far beyond it, what rounding leaves of them.

    Args:
        G: The Gram matrices.
        columns: How many of the first columns are amplitudes that data may say that much of; all by default.
    """
    far = ROUNDING * np.diagonal(G, axis1=-2, axis2=-1)
    far = np.where(np.arange(G.shape[-1]) < (G.shape[-1] if columns is None else columns), far, 0.0)
    return G + np.eye(G.shape[-1]) * (1.0 + far)[..., None]


def root(M: np.ndarray) -> np.ndarray:
    """Lower triangular L with L L' = M, (..., k, k), of Gram matrices with their prior: no eigenvalue is below 1.

    Where rounding leaves one below zero, as scales of many orders of magnitude can, it counts as 1.
    """
    try:
        return np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(M)
        _, R = np.linalg.qr(np.sqrt(np.maximum(values, 1.0))[..., :, None] * np.swapaxes(vectors, -2, -1))
        return np.swapaxes(R * np.sign(np.diagonal(R, axis1=-2, axis2=-1))[..., :, None], -2, -1)


def eliminated(H: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Gram matrix after marginalising some columns (unit prior), and the log determinant that this costs."""
    if len(columns) == 0:
        return H, 0.0
    chol = root(with_prior(H[np.ix_(columns, columns)]))
    half = linalg.solve_triangular(chol, H[columns], lower=True)
    # What is left of a column that these explain but for a trace may be less than it was rounded by.
    return H - half.T @ half + np.diag(ROUNDING * np.diag(H)), 2.0 * float(np.log(np.diag(chol)).sum())


@dataclasses.dataclass(frozen=True)
class Posterior:
    """Amplitudes of a set: mean and covariance, in units of their prior standard deviation."""

    columns: np.ndarray
    mean: np.ndarray
    cov: np.ndarray


def posterior(
    H: np.ndarray, columns: np.ndarray, named: Sequence[slice] = (), prior: np.ndarray | None = None
) -> Posterior:
    """Posterior of the given columns from a Gram matrix whose last column is y.

    The prior says what was to be expected before anything was found; but a named effect that comes
    out larger gets one as wide as its largest amplitude.  Otherwise what it shares with the inertials would be theirs:
    a payload of twenty times the expected one would lose most of its mass to the links.

    Args:
        H: The Gram matrix, in prior units.
        columns: Which of its columns.
        named: Amplitudes of each named effect, among `columns`.
        prior: Standard deviations of the prior, in units of those that were stated; these by default.
    """
    G, b = H[np.ix_(columns, columns)], H[columns, -1]
    prior = np.ones(len(columns)) if prior is None else prior
    width = prior
    for _ in range(WIDENINGS):
        wide = width[:, None] * width
        cov = wide * linalg.cho_solve((root(with_prior(wide * G)), True), np.eye(len(columns)))
        mean = cov @ b
        last, width = width, prior.copy()
        for part in named:
            width[part] = np.maximum(prior[part], float(np.max(np.abs(mean[part]))))
        if np.allclose(width, last, rtol=0.01):
            break
    return Posterior(columns, mean, cov)


@dataclasses.dataclass(frozen=True)
class Layout:
    """Candidates with equally many amplitudes: which they are, and their columns in a Gram matrix (candidates, k)."""

    which: np.ndarray
    columns: np.ndarray


def layouts(candidates: Sequence[Candidate], offset: int) -> tuple[Layout, ...]:
    """Group candidates by their number of amplitudes, so that each group is one batched solve."""
    sizes = np.array([len(c.columns) for c in candidates])
    out = []
    for k in np.unique(sizes):
        which = np.flatnonzero(sizes == k)
        out.append(Layout(which, np.stack([candidates[int(i)].columns for i in which]) + offset))
    return tuple(out)


def gain_of(H: np.ndarray, columns: np.ndarray) -> float:
    """Log evidence that one group of amplitudes adds."""
    L = root(with_prior(H[np.ix_(columns, columns)]))
    v = linalg.solve_triangular(L, H[columns, -1], lower=True)
    return 0.5 * float(v @ v) - float(np.log(np.diag(L)).sum())


def log_odds_of_any(mean: float, std: float, prior: float) -> float:
    """Log odds that a parameter is not zero, from its posterior and the width of its prior (Savage and Dickey)."""
    return float(0.5 * (mean / std) ** 2 + np.log(std / prior))


def log_odds_of_some(mean: np.ndarray, cov: np.ndarray, prior: np.ndarray) -> float:
    """Log odds that parameters are not all zero.

    Args:
        mean, cov: Of the posterior, shape (k,) and (k, k).
        prior: Standard deviations before, of mean zero, shape (k,).

    Source: Dickey, The weighted likelihood ratio, Annals of Mathematical Statistics 42(1), 1971.
    """
    L = linalg.cholesky(cov, lower=True)
    away = linalg.solve_triangular(L, mean, lower=True)
    return float(0.5 * away @ away + np.log(np.diag(L)).sum() - np.log(prior).sum())
