"""How estimates and runs are judged: equation 30, plateaus, and tests between two sets of runs."""

from typing import NamedTuple

import numpy as np
from scipy import stats

# Share of a link's largest value below which an entry is zero: round-off of a file reader's principal axes.
ROUND_OFF = 1e-9


def sought(reference: np.ndarray) -> np.ndarray:
    """Which parameters can be sought: a percentage of zero, or a box as wide as a share of it, is not defined.

    Args:
        reference: See `link_parameters`, shape (d,).

    Returns:
        True where an entry is not zero beside the largest of its link's, centres and inertias apart; bool, shape (d,).
    """
    x = np.abs(np.asarray(reference))
    k = len(x) // 9
    by_link = (x[: 3 * k].reshape(k, 3), x[3 * k :].reshape(k, 6))
    return np.concatenate([(v > ROUND_OFF * v.max(axis=1, keepdims=True)).ravel() for v in by_link])


def mape(
    x: np.ndarray, reference: np.ndarray, counted: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Mean absolute percentage error of centres of mass and of inertias, 100/n sum |x_i/x_ref,i - 1|.

    Args:
        x: Estimates, shape (s, d), see `link_parameters`.
        reference: Shape (d,).
        counted: Which entries count, shape (d,); default those that are not zero, see `sought`.

    Returns:
        Of the centres of mass and of the inertias [%], shape (s,) each; NaN where none of them counts, as the error is
        not defined then.

    Source: the study's equation 30.
    """
    reference = np.asarray(reference)
    chosen = sought(reference) if counted is None else np.asarray(counted)
    error = 100.0 * np.abs(np.asarray(x)[..., chosen] / reference[chosen] - 1.0)
    centres = int(np.count_nonzero(chosen[: len(reference) // 3]))
    return _mean(error[..., :centres]), _mean(error[..., centres:])


def _mean(error: np.ndarray) -> np.ndarray:
    """Over the last axis; NaN, without a warning, where it is empty."""
    return error.mean(axis=-1) if error.shape[-1] else np.full(error.shape[:-1], np.nan)


def plateau(best: np.ndarray, remaining: float = 0.01) -> int:
    """First iteration from which a curve of best fitness falls by no more than this share of its whole fall.

    Args:
        best: Best fitness of the start and each iteration, shape (iterations + 1,).
        remaining: Share of the fall that is still to come; 0.01 is where a curve on a linear axis looks flat.
    """
    fall = best[0] - best[-1]
    return int(np.argmax(best - best[-1] <= remaining * fall)) if fall > 0 else 0


class Comparison(NamedTuple):
    """Two sets of runs against each other.

    Attributes:
        p_value: Mann-Whitney, two-sided.
        superiority: Share of pairs in which a run of the first set is lower; 0.5 is no difference.
        cohen_d: Difference of means in pooled standard deviations, positive where the first is lower.
        welch_p: Welch's t test, two-sided.
    """

    p_value: float
    superiority: float
    cohen_d: float
    welch_p: float


def compared(first: np.ndarray, second: np.ndarray) -> Comparison:
    """Is the first set of final values lower than the second?"""
    a, b = np.asarray(first, float), np.asarray(second, float)
    test = stats.mannwhitneyu(a, b, alternative="two-sided")
    pooled = np.sqrt(0.5 * (a.var(ddof=1) + b.var(ddof=1)))
    difference = b.mean() - a.mean()
    cohen = difference / pooled if pooled > 0 else np.inf * np.sign(difference) if difference else 0.0
    welch = float(np.asarray(stats.ttest_ind(a, b, equal_var=False))[1]) if pooled > 0 else float(difference == 0)
    superiority = 1.0 - float(test.statistic) / (len(a) * len(b))
    return Comparison(float(test.pvalue), superiority, float(cohen), welch)
