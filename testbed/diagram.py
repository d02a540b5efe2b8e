"""The figure of a draw: reliability of probabilities and coverage of intervals."""

import pathlib
from typing import Any

import matplotlib
import numpy as np

from testbed import scoring
from testbed.statistics import covered, reliability, wilson

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

LEVELS = (0.2, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99)


def draw(lines: list[dict[str, Any]], path: pathlib.Path) -> None:
    """Write both diagrams, with 95 % intervals, as SVG that is the same for the same results."""
    plt.rcParams |= {"svg.hashsalt": "calibration", "font.size": 9}
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.6), layout="constrained")
    kinds = (("all findings", lambda e: True), ("ordinary friction aside", lambda e: e not in scoring.ORDINARY))
    for (label, wanted), mark in zip(kinds, "os", strict=True):
        stated = [x for line in lines for x in scoring.probabilities(line) if wanted(x[0])]
        table = reliability([p for _, p, _ in stated], [hit for *_, hit in stated]) if stated else []
        _marks(left, [p for p, _, _ in table], [(h, n) for _, h, n in table], mark, f"{label}, {len(stated)}")
    found = [x for line in lines for x in scoring.intervals(line)]
    hits = [(sum(covered(v, s, true, level) for *_, v, s, true in found), len(found)) for level in LEVELS]
    _marks(right, LEVELS, hits, "o", f"{len(found)} parameters")
    for axes, x, y in ((left, "stated probability", "share that is right"),
                       (right, "level of the interval", "share that holds the truth")):  # fmt: skip
        axes.plot([0, 1], [0, 1], color="0.6", lw=0.8)
        axes.set(xlabel=x, ylabel=y, xlim=(0, 1.03), ylim=(0, 1.03))
        axes.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0))  # error bars may be anywhere inside
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _marks(axes, at, hits: list[tuple[int, int]], mark: str, label: str) -> None:
    shown = [(x, h / n, *wilson(h, n)) for x, (h, n) in zip(at, hits, strict=True) if n]
    if shown:
        x, y, low, high = np.array(shown).T
        axes.errorbar(x, y, np.maximum([y - low, high - y], 0.0), fmt=mark, ms=4, capsize=2, lw=1, label=label)
