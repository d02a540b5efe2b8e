"""Tests between two sets of runs, and how well their difference is known."""

import numpy as np
from scipy import stats

from irb140_jax import identify

CONFIDENCE = 0.95
RESAMPLES = 9999


def difference(first: np.ndarray, second: np.ndarray) -> dict[str, float]:
    """Is the first set lower: Mann-Whitney, effect sizes, and a bootstrap interval of the difference of means.

    Returns:
        The fields of `identify.Comparison`, and `difference` = mean(second) - mean(first) with `low` and `high`, the
        ends of its percentile interval.
    """
    a, b = np.asarray(first, float), np.asarray(second, float)
    gap = lambda x, y, axis: np.mean(y, axis=axis) - np.mean(x, axis=axis)  # noqa: E731
    found = stats.bootstrap(
        (a, b), gap, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile",
        rng=np.random.default_rng(0), vectorized=True,
    ).confidence_interval  # fmt: skip
    own = {"difference": float(b.mean() - a.mean()), "low": float(found.low), "high": float(found.high)}
    return identify.compared(a, b)._asdict() | own


def interval(values: np.ndarray) -> tuple[float, float]:
    """Bootstrap interval of the mean."""
    x = np.asarray(values, float)
    if np.ptp(x) == 0.0:
        return float(x[0]), float(x[0])
    found = stats.bootstrap(
        (x,), np.mean, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile",
        rng=np.random.default_rng(0), vectorized=True,
    ).confidence_interval  # fmt: skip
    return float(found.low), float(found.high)
