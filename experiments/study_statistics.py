"""Tests between two sets of runs: Mann-Whitney's, Holm's correction within a named family, effect sizes with intervals.

Every test names the runs it compares by file, column and rows, so that anyone can compute it again from what is stored:
recompute_study.py does, with pandas alone.
"""

import dataclasses
import math
import pathlib
from functools import lru_cache

import numpy as np
import pandas as pd
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 4000
ALPHA = 0.05  # chance that even one of a family's tests is taken for a difference by luck
# Values that agree to this share are level: round-off, or one sample of a rise or settling time.
LEVEL = 1e-8
DIGITS = 9  # that are stored of a measure; what lies beyond is round-off
FAMILIES = {
    "identification": "Tables 3 and 5: what the swarms of the nearest pair end with",
    "control": "Tables 4 and 5: every statement of the text in every reading of the control",
    "network": "what each penalty changes near singular poses",
    "future": "the swarms that the study leaves to the future, with torque noise",
    "tracking": "QPSO against PSO when the closed loop is the objective",
    "tracking_circle": "the same along the study's circle",
}


@dataclasses.dataclass(frozen=True)
class Test:
    """Is `column` of the first runs lower than of the second?

    Attributes:
        family: One of `FAMILIES`.
        name: Of the test, within its family.
        table: File with one row a run.
        column: What is compared.
        first: Which rows: values of other columns.
        second: Which rows, likewise.
    """

    __test__ = False  # nothing for pytest to collect

    family: str
    name: str
    table: str
    column: str
    first: tuple[tuple[str, str | float | int], ...]
    second: tuple[tuple[str, str | float | int], ...]

    def values(self, folder: pathlib.Path) -> tuple[np.ndarray, np.ndarray]:
        """Both sets of runs."""
        frame = runs(folder / self.table)
        return tuple(frame.loc[chosen(frame, rows), self.column].to_numpy(float) for rows in (self.first, self.second))


def chosen(frame: pd.DataFrame, rows: tuple[tuple[str, str | float | int], ...]) -> pd.Series:
    """Which rows of a frame have these values."""
    keep = pd.Series(True, index=frame.index)
    for column, value in rows:
        keep &= frame[column] == value
    return keep


def runs(path: pathlib.Path) -> pd.DataFrame:
    """What is stored, one row a run."""
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _read(path: pathlib.Path, _: int) -> pd.DataFrame:
    return pd.read_parquet(path)


def tested(tests: list[Test], folder: pathlib.Path) -> list[dict]:
    """What all tests of a family say, Holm's correction made."""
    rows = [dataclasses.asdict(test) | compared(*test.values(folder)) for test in tests]
    for row, p in zip(rows, holm([row["p"] for row in rows]), strict=True):
        row["p_holm"] = p
        settled = p < ALPHA
        row["lower"] = "neither" if not settled else "first" if row["effect"] > 0.0 else "second"
    return rows


def holm(p: list[float]) -> list[float]:
    """Holm's (1979) step-down correction: p that keeps its meaning for the smallest of so many."""
    order = np.argsort(p, kind="stable")
    scaled = np.asarray(p, float)[order] * (len(p) - np.arange(len(p)))
    corrected = np.empty(len(p))
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(scaled))
    return corrected.tolist()


def compared(x: np.ndarray, y: np.ndarray) -> dict:
    """Mann-Whitney's two-sided p; the effect P(x < y) - P(x > y) and the difference of means y - x, with intervals.

    Infinite values, of what never gets there, come last and leave the means out.
    """
    finite = np.concatenate([x, y])
    finite = finite[np.isfinite(finite)]
    known = finite.size == x.size + y.size
    level = known and float(np.ptp(finite)) <= LEVEL * float(np.abs(finite).max())
    p = 1.0 if level or not finite.size else float(stats.mannwhitneyu(x, y, method="asymptotic").pvalue)
    below = (x[:, None] < y[None]).astype(float) - (x[:, None] > y[None])
    if level:
        below = np.zeros_like(below)
    rng = np.random.default_rng(0)
    w, v = (rng.multinomial(n, np.full(n, 1.0 / n), RESAMPLES) / n for n in (x.size, y.size))
    told = {
        "n": [x.size, y.size], "medians": [float(np.median(x)), float(np.median(y))], "p": p,
        "effect": float(below.mean()), "effect_interval": _interval(np.einsum("ri,ij,rj->r", w, below, v)),
        "difference": None, "difference_interval": None,
    }  # fmt: skip
    if known and not level:
        told |= {"difference": float(y.mean() - x.mean()), "difference_interval": _interval(v @ y - w @ x)}
    return told


def _interval(values: np.ndarray) -> list[float]:
    tail = 0.5 * (1.0 - CONFIDENCE)
    return np.quantile(values, [tail, 1.0 - tail]).tolist()


def said(row: dict, unit: str = "") -> str:
    """A test in words."""
    low, high = row["effect_interval"]
    # More digits where one could hide on which side of the limit it is.
    digits = 3 if 0.5 < row["p_holm"] / ALPHA < 2.0 else 1
    text = f"p = {row['p_holm']:.{digits}g} (Holm), effect {row['effect']:.2f} [{low:.2f}, {high:.2f}]"
    # The interval is of this test alone, p of the whole family.
    alone = "; alone it would count, among so many tests it does not" * bool(row["p"] < ALPHA <= row["p_holm"])
    if row["difference"] is None:
        return text + alone
    ends = row["difference_interval"]
    text += f", means differ by {row['difference']:.2g}{unit} [{ends[0]:.2g}, {ends[1]:.2g}]"
    sure = ends[0] * ends[1] > 0.0
    if sure and math.copysign(1.0, row["difference"]) * row["effect"] < 0.0:
        text += "; the means point the other way than most runs, because of a few runs with large values"
    return text + alone


def rounded(values: np.ndarray, digits: int = DIGITS) -> np.ndarray:
    """To so many significant digits; infinite ones and zero as they are."""
    x = np.asarray(values, float)
    usual = np.isfinite(x) & (x != 0.0)
    scale = 10.0 ** (digits - 1 - np.floor(np.log10(np.abs(np.where(usual, x, 1.0)))))
    return np.where(usual, np.round(np.where(usual, x, 1.0) * scale) / scale, x)
