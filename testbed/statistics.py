"""Shares with their intervals, and how far stated probabilities are from what happens."""

import numpy as np
from scipy import stats

EDGES = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 0.999, 1.0)  # of the bins of stated probabilities, most of which are high


def wilson(hits: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's interval for a share of `hits` in n; (0, 1) where there is nothing to count.

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22, 1927.
    """
    if n == 0:
        return 0.0, 1.0
    z = float(stats.norm.ppf(0.5 + level / 2.0))
    p, w = hits / n, z * z / n
    middle, half = (p + w / 2) / (1 + w), z / (1 + w) * np.sqrt(p * (1 - p) / n + w / (4 * n))
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def reliability(stated: list[float], right: list[bool]) -> list[tuple[float, int, int]]:
    """Per bin of EDGES that holds any: mean stated probability, how many were right, how many there are."""
    p, hit = np.asarray(stated), np.asarray(right)
    bins = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, len(EDGES) - 2)
    return [(float(p[bins == b].mean()), int(hit[bins == b].sum()), int(np.sum(bins == b))) for b in np.unique(bins)]


def calibration_error(stated: list[float], right: list[bool]) -> float:
    """Expected calibration error: mean distance of stated probability and share right over the bins, by their numbers.

    Source: Naeini, Cooper, Hauskrecht, AAAI 2015.
    """
    table = reliability(stated, right) if stated else []
    return sum(n * abs(p - hits / n) for p, hits, n in table) / max(len(stated), 1)


def covered(value: float, std: float, true: float, level: float) -> bool:
    """Whether a normal interval of this level about a stated value holds the truth."""
    return abs(value - true) <= float(stats.norm.ppf(0.5 + level / 2.0)) * std
