"""Sums over all rows of products of all columns, made window by window."""

import dataclasses
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.regression.noise import ORDER, Noise
from irb140_jax.mismatch.regression.nuisances import Nuisances
from irb140_jax.mismatch.regression.rows import Stretch, Window

CandidateRows = Callable[[int], Iterable[tuple[Window, np.ndarray, np.ndarray]]]  # see `candidate_rows`


@dataclasses.dataclass
class Sums:
    """Sums over all rows of products of all columns, of which no more than a window is held at a time.

    Attributes:
        grams: Of each joint, by how often the motion was repeated: whitened Gram matrix over
            [own | inertials | common | amplitudes | y], the last three in their own units.
        rows: Of each joint, by the same: how many rows count.
        power: Sum of the squares of each column that isn't zero throughout, all rows alike, shape (entries,).
        endless: Amplitudes whose columns have no bound along these recordings.
    """

    grams: list[dict[int, np.ndarray]]
    rows: list[dict[int, float]]
    power: np.ndarray
    endless: np.ndarray

    @property
    def finite(self) -> bool:
        """Whether all sums are numbers."""
        return all(np.isfinite(G).all() for by in self.grams for G in by.values())


def summed(
    lib: Library, stretches: Sequence[Stretch], rows: Sequence[CandidateRows], extra: Sequence[Nuisances], noise: Noise
) -> Sums:
    """Whiten the rows and sum the products of all columns.

    Args:
        lib: The library.
        stretches: The rows of each recording, with no column of a candidate.
        rows: What yields the columns of all candidates along each, given the rows that a window is to overlap by.
        extra: Nuisance columns of each.
        noise: Of the rows.
    """
    n, joints = lib.robot.n, lib.entries[0]
    own = [np.flatnonzero(joints == j) for j in range(n)]
    out = Sums([{} for _ in range(n)], [{} for _ in range(n)], np.zeros(len(joints)), np.zeros(0, dtype=int))
    # Joints side by side: nearly all of the time is in products, and those hold no lock.
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for s, e, windows in zip(stretches, extra, rows, strict=True):
            usable = [noise.usable(s.use[:, j], j) for j in range(n)]
            for window, columns, endless in windows(ORDER):
                fresh = columns[window.new - window.rows.start :]
                out.power += np.einsum("te,te->e", fresh, fresh)
                out.endless = np.union1d(out.endless, endless)
                list(threads.map(partial(_add, out, s, e, noise, window, columns, own, usable), range(n)))
    out.power[np.isin(lib.entries[1], out.endless)] = 0.0  # never named
    return out


def _add(
    out: Sums, s: Stretch, e: Nuisances, noise: Noise, window: Window, columns: np.ndarray, own: list[np.ndarray],
    usable: list[np.ndarray], j: int,
) -> None:  # fmt: skip
    """Add a window of one joint's rows; `own` are its entries among the columns, `usable` its rows that count."""
    at = window.rows
    A = [e.own[j][at], s.inertials[at, j], e.common[at, j], columns[:, own[j]], s.y[at, [j]]]
    counts = usable[j][at] & (np.arange(at.start, at.stop) >= window.new)
    A = noise.whitened(np.concatenate(A, axis=1), j, s.recording, s.unsure[at, j])[counts]
    _added(out.grams[j], s.repeats, A.T @ A)
    _added(out.rows[j], s.repeats, float(len(A)))


def _added(sums: dict[int, Any], key: int, more: Any) -> None:
    sums[key] = sums[key] + more if key in sums else more
