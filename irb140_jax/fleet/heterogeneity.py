"""Is a parameter the same in several diagnoses?  Estimates with standard deviations in, tests and intervals out."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

LEVEL = 0.05  # of a difference, after Holm; and of calling something the same


class Pooled(NamedTuple):
    """One value for all, where they may differ beyond their own doubt.

    Attributes:
        value: Mean, weighted by the doubt of each and by how much they differ.
        std: Its standard deviation.
        between: Standard deviation of the true values between diagnoses; 0 where nothing shows that they differ.
    """

    value: float
    std: float
    between: float


class Difference(NamedTuple):
    """How far the second is above the first, with a 90 % interval."""

    first: int
    second: int
    value: float
    low: float
    high: float


def cochran(values: np.ndarray, stds: np.ndarray) -> tuple[float, float]:
    """Cochran's Q of independent estimates of one value, and its p-value by chi squared with k - 1 degrees of freedom.

    Args:
        values: Estimates, shape (k,).
        stds: Their standard deviations, shape (k,).

    Source: Cochran, Biometrics 10(1), 1954.
    """
    weight = 1.0 / stds**2
    mean = np.sum(weight * values) / np.sum(weight)
    q = float(np.sum(weight * (values - mean) ** 2))
    return q, float(stats.chi2.sf(q, len(values) - 1))


def pooled(values: np.ndarray, stds: np.ndarray) -> Pooled:
    """The mean of values that may differ.

    Args:
        values: Estimates, shape (k,).
        stds: Their standard deviations, shape (k,).

    Source: DerSimonian and Laird, Controlled Clinical Trials 7(3), 1986.
    """
    weight = 1.0 / stds**2
    excess = cochran(values, stds)[0] - (len(values) - 1)
    spare = np.sum(weight) - np.sum(weight**2) / np.sum(weight)
    between = max(0.0, excess / spare)
    weight = 1.0 / (stds**2 + between)
    return Pooled(float(np.sum(weight * values) / np.sum(weight)), float(np.sum(weight) ** -0.5), float(between**0.5))


def differences(values: np.ndarray, stds: np.ndarray) -> list[Difference]:
    """Every pair's difference with its 90 % interval, the largest first."""
    half = float(stats.norm.ppf(1.0 - LEVEL))
    out = []
    for i in range(len(values)):
        for k in range(i + 1, len(values)):
            d, s = float(values[k] - values[i]), half * float(np.hypot(stds[i], stds[k]))
            out.append(Difference(i, k, d, d - s, d + s))
    return sorted(out, key=lambda one: -abs(one.value))


def all_within(pairs: Sequence[Difference], margin: float) -> bool:
    """Whether the interval of every difference lies within a margin: two one-sided tests at 5 % for each pair.

    All pairs have to pass, so that the error of calling all the same stays below that of one pair.

    Source: Schuirmann, Journal of Pharmacokinetics and Biopharmaceutics 15(6), 1987; Berger, Technometrics 24(4), 1982.
    """
    return all(-margin < one.low and one.high < margin for one in pairs)


def holm(p: Sequence[float]) -> list[float]:
    """p-values of a family of tests, adjusted so that the chance of any false difference is that of a single test.

    Source: Holm, Scandinavian Journal of Statistics 6(2), 1979.
    """
    order = np.argsort(p)
    out, largest = [0.0] * len(p), 0.0
    for rank, k in enumerate(order):
        largest = max(largest, min(1.0, (len(p) - rank) * p[k]))
        out[k] = largest
    return out
