"""From which moments of recordings motions are simulated: of those rows that the models' fit did not see."""

from typing import NamedTuple

import numpy as np

HORIZON = 2.0  # [s]
WINDOWS = 24  # over all recordings, evenly spread
LONGEST = 20.0  # [s] of a whole run
FINEST, FINEST_SERVO = 0.003, 0.001  # [s] largest time step under torque, and of a stiff servo
MARGIN = 0.1  # [s] at the ends of a recording, where smoothed speeds are worse


class Window(NamedTuple):
    """A piece of a recording on its own grid.

    Attributes:
        recording: Index of the recording.
        fold: Index of the fold whose models have not seen it.
        first: Index of its first sample.
        last: Index of its last sample.
    """

    recording: int
    fold: int
    first: int
    last: int


class Span(NamedTuple):
    """A stretch of time of a recording that a fold's models have not seen [s]."""

    recording: int
    fold: int
    begin: float
    end: float


def spans(folds: list[np.ndarray], recording: np.ndarray, times: list[np.ndarray]) -> list[Span]:
    """Stretches of time that the folds leave out, blocks that follow each other joined.

    Args:
        folds: Which blocks each leaves out, each shape (blocks,).
        recording: Recording of each block, shape (blocks,).
        times: Time of the rows of each recording [s].
    """
    out = []
    for f, fold in enumerate(folds):
        for r, t in enumerate(times):
            mine = fold[recording == r]
            edges = np.linspace(0, len(t) - 1, len(mine) + 1).astype(int)
            run: list[float] | None = None
            for b, left_out in enumerate([*mine, False]):
                if left_out:
                    run = [run[0] if run else float(t[edges[b]]), float(t[edges[b + 1]])]
                elif run:
                    out.append(Span(r, f, run[0], run[1]))
                    run = None
    return out


def windows(unseen: list[Span], grids: list[np.ndarray], length: float = HORIZON, count: int = WINDOWS) -> list[Window]:
    """Windows spread evenly over unseen spans, in proportion to their length; in short spans the later are shorter.

    Args:
        unseen: The spans.
        grids: Time of the samples of each recording [s], even.
        length: Of a window [s].
        count: About how many.
    """
    whole = sum(span.end - span.begin for span in unseen)
    out = []
    for span in unseen:
        t = grids[span.recording]
        begin, end = max(span.begin, t[0] + MARGIN), min(span.end, t[-1] - MARGIN)
        if end - begin < 0.1 * length:
            continue
        many = max(1, round(count * (span.end - span.begin) / whole))
        for start in np.linspace(begin, max(end - length, 0.5 * (begin + end)), many) if many > 1 else [begin]:
            first = int(np.searchsorted(t, start))
            last = int(np.searchsorted(t, min(start + length, end) + 1e-9)) - 1
            if last > first:
                out.append(Window(span.recording, span.fold, first, last))
    return out
