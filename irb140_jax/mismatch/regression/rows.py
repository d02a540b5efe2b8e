"""Rows of a recording to fit: columns and the torque they should add up to, both through the low-pass.

Columns of all candidates are made window by window and never held together: what a search needs of them are sums over
the rows.  Held are those of the inertials, and of the few candidates that an explanation consists of.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from irb140_jax.mismatch.columns.along import (
    NEW,
    RUN_IN,
    Loads,
    Prepared,
    columns_by_effect,
    tool_along,
    unbounded,
    without,
)
from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.columns.torques import library_of
from irb140_jax.mismatch.regression.tangent import Point, counted_twice, leaning, logged, regressor
from irb140_jax.recordings.low_pass import Band

FEWEST = 64  # rows of a window, however long the low-pass
MARGIN = 0.25  # [s] on either side of a window, in which laws of the log look for what they pass on


@dataclasses.dataclass(frozen=True)
class Stretch:
    """A stretch of one recording, low-passed: for each joint its rows of columns and of the torque residual.

    Columns are numbered [inertials | amplitudes of the library | loose inertials]; the last are the first again.

    Attributes:
        recording: Index of the recording it belongs to.
        t: Time of the rows [s], shape (R,).
        begin: Time at which the recording begins [s].
        size: Number of amplitudes of the library.
        inertials: Columns of the inertials in units of their prior at relative standard deviation 1, (R, n, 10 n).
        held: Numbers of the amplitudes whose columns are held, in order, shape (k,).
        amplitudes: Those columns, (R, n, k).
        y: What the columns should add up to, (R, n): logged minus nominal torque, and what the last explanation says of
            products of its unknowns; see `tangent`.
        rigid: Columns of the inertials under the model's own gravity and before the log, (R, n, 10 n).
        tau: Logged torque, low-passed, (R, n).
        nominal: Nominal torque, low-passed, (R, n).
        unsure: Standard deviation that the samples of the log leave open of tau, (R, n); see `Conditioned`.
        recorded: Rows in which nothing is lost, (R, n).
        use: Those of them in which the joint moves, (R, n).
        q, qd, qdd: Motion at the rows, (R, n), for maps and the flexible competitor.
        motion, repeats: Which motion it is of, and of how many recordings that is; see `Conditioned`.
        tool, tool_jacobian: Where the tool is and how joints move it, (R, 3) and (R, n, 6); see `RigidBody`.
    """

    recording: int
    t: np.ndarray
    begin: float
    size: int
    inertials: np.ndarray
    held: np.ndarray
    amplitudes: np.ndarray
    y: np.ndarray
    rigid: np.ndarray
    tau: np.ndarray
    nominal: np.ndarray
    unsure: np.ndarray
    recorded: np.ndarray
    use: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tool: np.ndarray
    tool_jacobian: np.ndarray
    motion: int = -1
    repeats: int = 1

    def of(self, columns: np.ndarray, joint: int | None = None) -> np.ndarray:
        """Some columns, (R, n, columns), or those of one joint, (R, columns)."""
        inertials, amplitudes = (x if joint is None else x[:, joint] for x in (self.inertials, self.amplitudes))
        links, at, where = self._places(columns)
        out = np.empty((*inertials.shape[:-1], len(columns)))
        out[..., links], out[..., ~links] = inertials[..., at], amplitudes[..., where]
        return out

    def torque(self, columns: np.ndarray, w: np.ndarray) -> np.ndarray:
        """What some columns add up to with amplitudes w, shape (R, n)."""
        links, at, where = self._places(columns)
        inertials, amplitudes = np.zeros(self.inertials.shape[-1]), np.zeros(len(self.held))
        np.add.at(inertials, at, w[links])
        np.add.at(amplitudes, where, w[~links])
        return self.inertials @ inertials + self.amplitudes @ amplitudes

    def _places(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which columns are inertials, where those stand among the inertials, and the others among what is held."""
        k = self.inertials.shape[-1]
        columns = np.where(columns < k + self.size, columns, columns - k - self.size)
        links = columns < k
        return links, columns[links], np.searchsorted(self.held, columns[~links] - k)

    def of_rigid_body(self) -> "Stretch":
        """With inertials as they are without any explanation, and what they alone should add up to."""
        return dataclasses.replace(self, inertials=self.rigid, y=self.tau - self.nominal)

    def holding(self, held: np.ndarray, amplitudes: np.ndarray) -> "Stretch":
        """With the columns (R, n, k) of amplitudes of these numbers (k,)."""
        return dataclasses.replace(self, held=held, amplitudes=amplitudes)


class Window(NamedTuple):
    """Some rows of a recording.

    Attributes:
        rows: Which they are, those of the window before included that a filter needs.
        new: The first that no window before had.
        samples: What they are made of, with a margin.
        first: The first sample that the low-pass needs.
    """

    rows: slice
    new: int
    samples: slice
    first: int

    def low_passed(self, x: np.ndarray, band: Band) -> np.ndarray:
        """The rows, from what `samples` hold."""
        begin = self.first - self.samples.start
        count = (self.rows.stop - self.rows.start - 1) * band.step + len(band.low_pass())
        return band.apply(x[begin : begin + count])


def row_windows(band: Band, samples: int, margin: int = 0, overlap: int = 0) -> Iterator[Window]:
    """All rows of a recording of so many samples, some at a time; each but the first with some of those before.

    As many as one compiled call makes the columns of: more take more memory and no less time.
    """
    taps, count = len(band.low_pass()), len(band.kept(samples))
    many = lambda at_once: max((at_once - taps - 2 * margin) // band.step - overlap, FEWEST)  # noqa: E731
    # Nothing has to be run in before the first.
    edges = [0, *range(many(NEW + RUN_IN), count, many(NEW)), count]
    for new, end in itertools.pairwise(edges):
        rows = slice(max(new - overlap, 0), end)
        first, last = rows.start * band.step, (rows.stop - 1) * band.step + taps
        yield Window(rows, new, slice(max(first - margin, 0), min(last + margin, samples)), first)


def margin(at: Point | None, dt: float) -> int:
    """Samples [dt s apart] on either side of a window that the laws of the log at a point look at."""
    return int(np.ceil(MARGIN / dt)) if at and at.log else 0


def candidate_rows(
    lib: Library, along: Prepared, index: int, band: Band, loads: Loads | None = None, at: Point | None = None,
    overlap: int = 0,
) -> Iterator[tuple[Window, np.ndarray, np.ndarray]]:  # fmt: skip
    """Columns of all candidates through the low-pass, window by window.

    Args:
        lib: The library.
        along: The recording.
        index: Its number.
        band: Of the comparison.
        loads: See `columns_along`.
        at: Of the last explanation, if there is one.
        overlap: Rows of the window before that come again.

    Returns:
        The window, the columns that aren't zero throughout, (rows, entries), and amplitudes whose columns have no bound
        in it.
    """
    recording, dt = along.recording, float(np.mean(np.diff(along.recording.t)))
    late = at if at and loads and at.log else None
    joints, amplitudes = np.where(lib.in_log, -1, lib.entries[0]), lib.entries[1]
    for window in row_windows(band, len(recording.t), margin(late, dt), overlap):
        out = np.empty((window.rows.stop - window.rows.start, len(joints)))
        endless: list[np.ndarray] = []
        # One effect after the other: the samples of all columns would be many times the rows that are kept.
        for own, columns in columns_by_effect(lib, along, loads, index, window.samples):
            endless.append(unbounded(amplitudes[own], columns))
            columns = without(amplitudes[own], columns, endless[-1])
            if late:
                columns = logged(late, columns, joints[own], dt)
            out[:, own] = window.low_passed(columns, band)
        yield window, out, np.concatenate([np.zeros(0, dtype=int), *endless])


def stretch(
    lib: Library, along: Prepared, index: int, band: Band, factor: np.ndarray, loads: Loads | None = None,
    at: Point | None = None,
) -> Stretch:  # fmt: skip
    """Rows of a recording with the columns of a whole library, which should be a small one.

    Args:
        lib: The library.
        along: The recording.
        index: Its number.
        band: Of the comparison.
        factor: Square root of the inertial prior, shape (10 n, 10 n).
        loads: See `columns_along`.
        at: Of the last explanation, if there is one.
    """
    return with_library(bare_stretch(lib, along, index, band, factor, loads, at), lib, along, band, loads, at)


def with_library(
    bare: Stretch, lib: Library, along: Prepared, band: Band, loads: Loads | None = None, at: Point | None = None
) -> Stretch:
    """Rows with the columns of all amplitudes of a library in the place of what they held."""
    bare = dataclasses.replace(bare, size=lib.size)
    return bare.holding(np.arange(lib.size), _dense(lib, along, bare.recording, band, loads, at))


def with_candidates(
    bare: Stretch, chosen: Sequence[Candidate], along: Prepared, band: Band, loads: Loads | None, at: Point | None
) -> Stretch:
    """Rows with the columns of a few candidates."""
    few = [c for c in chosen if not c.is_inertials]
    lib = library_of(along.robot, few)
    dense = _dense(lib, along, bare.recording, band, loads, at)
    numbers = np.concatenate([*(c.columns for c in few), np.zeros(0, dtype=int)])
    places = np.concatenate([*(c.columns for c in lib.candidates), np.zeros(0, dtype=int)])
    held, first = np.unique(numbers, return_index=True)
    return bare.holding(held, dense[..., places[first]])


def _dense(
    lib: Library, along: Prepared, index: int, band: Band, loads: Loads | None, at: Point | None
) -> np.ndarray:
    """Columns of all amplitudes of a library, shape (R, n, size)."""
    out = np.zeros((len(band.kept(len(along.recording.t))), lib.robot.n, lib.size))
    endless: list[np.ndarray] = [np.zeros(0, dtype=int)]
    for window, columns, bad in candidate_rows(lib, along, index, band, loads, at):
        lib.spread(columns, out[window.rows])
        endless.append(bad)
    out[..., np.concatenate(endless)] = 0.0
    return out


def bare_stretch(
    lib: Library, along: Prepared, index: int, band: Band, factor: np.ndarray, loads: Loads | None = None,
    at: Point | None = None,
) -> Stretch:  # fmt: skip
    """Rows of a recording without the columns of candidates; see `stretch`."""
    recording, n = along.recording, lib.robot.n
    kept, dt = band.kept(len(recording.t)), float(np.mean(np.diff(recording.t)))
    base, twice = along.nominal, np.zeros_like(along.nominal)
    explained = at if at and loads and not at.plain else None
    if explained and loads:
        base = logged(explained, along.nominal - leaning(explained, along), np.arange(n), dt)
        twice = counted_twice(explained, loads, dt)
    rigid, inertials = _inertials(along, band, factor, explained, dt)
    nominal, tau = band.apply(along.nominal), band.apply(recording.tau)
    held, none = np.zeros(0, dtype=int), np.zeros((len(kept), n, 0))
    return Stretch(
        index, recording.t[kept], recording.began, lib.size, inertials, held, none,
        tau - band.apply(base) + band.apply(twice), rigid, tau, nominal, recording.unsure[kept],
        recording.recorded[kept], recording.usable[kept], recording.q[kept], recording.qd[kept], recording.qdd[kept],
        *tool_along(along.robot, recording.q[kept]), recording.motion, recording.repeats,
    )  # fmt: skip


def _inertials(
    along: Prepared, band: Band, factor: np.ndarray, at: Point | None, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the inertials as the model has them, and at a point, (R, n, 10 n) each."""
    samples, n, k = len(along.recording.t), along.nominal.shape[1], len(factor)
    rigid = np.empty((len(band.kept(samples)), n, k))
    found = np.empty_like(rigid) if at else rigid
    for window in row_windows(band, samples, margin(at, dt)):
        rigid[window.rows] = window.low_passed(along.regressor_at(window.samples), band) @ factor
        if at:
            Y = regressor(at, along, window.samples)
            Y = logged(at, Y.reshape(len(Y), -1), np.repeat(np.arange(n), k), dt).reshape(Y.shape)
            found[window.rows] = window.low_passed(Y, band) @ factor
    return rigid, found
