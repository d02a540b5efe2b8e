"""Repairs that can't do harm: each states what it did in a note."""

import dataclasses
import pathlib

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.recording import Recording

MAX_MISSING_SHARE = 0.01  # of a column's values; beyond it, interpolation would write a part of the measurement
MAX_GAP_ROWS = 10  # rows; at usual rates 10 to 50 ms, well below the periods at which arms move
LARGEST = 1e9  # no joint turns so far and no motor pulls so much: a broken number, as good as none
LEAST_REPEATED = 0.2  # of the time stamps that repeat the one before; fewer are rows out of order, not a coarse clock
LONGEST_TICK = 0.1  # s; within a longer one, motion can't be told from its spreading
MAX_ENDS_SHARE = 0.05  # of the rows that may be cut off at either end because a channel started late
SPIKE_NEIGHBOURS = 20.0  # a glitch stands out by this many times what the joint does from sample to sample
SPIKE_ACCELERATION = 2e4  # rad/s^2 or m/s^2; no arm reaches it, so such a jump and return is the encoder's

Table = dict[str, np.ndarray]


def without_repeated_rows(table: Table, rows: np.ndarray, notes: list[str]) -> tuple[Table, np.ndarray]:
    """Drop rows that repeat the row before in every column, the time included."""
    repeated = np.isfinite(table["t"])
    repeated[:1] = False
    for x in table.values():
        repeated[1:] &= (x[1:] == x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1]))
    if repeated.any():
        notes.append(f"{_count(repeated.sum(), 'row')} repeating the row before in every column, the first at row "
                     f"{rows[repeated][0]}, left out")
        table, rows = {name: values[~repeated] for name, values in table.items()}, rows[~repeated]
    return table, rows


def without_absurd_values(table: Table, used: list[str]) -> Table:
    """Values of the used channels beyond `LARGEST` as missing ones."""
    absurd = {name: np.abs(table[name]) > LARGEST for name in used if name != "t"}
    return table | {name: np.where(x, np.nan, table[name]) for name, x in absurd.items() if x.any()}


def without_missing_ends(
    table: Table, used: list[str], rows: np.ndarray, notes: list[str]
) -> tuple[Table, np.ndarray]:
    """Cut off rows at both ends in which a used channel has no value yet or any more."""
    complete = np.flatnonzero(np.logical_and.reduce([np.isfinite(table[name]) for name in used]))
    if not len(complete):
        return table, rows
    first, last = int(complete[0]), int(complete[-1])
    limit = max(2, int(MAX_ENDS_SHARE * len(rows)))
    first, last = first if first <= limit else 0, last if len(rows) - 1 - last <= limit else len(rows) - 1
    lost = len(rows) - 1 - last + first
    if lost:
        notes.append(f"{_count(lost, 'row')} at the ends, in which a channel holds no value, left out")
    return {name: values[first : last + 1] for name, values in table.items()}, rows[first : last + 1]


def with_coarse_times_spread(table: Table, notes: list[str]) -> Table:
    """Spread rows evenly where the clock's tick is longer than the time between rows, so that stamps repeat.

    Rows between two ticks are spread between them, and the rate is taken as steady over half a second as long as no
    row moves by more than a tick.
    """
    t = table["t"]
    dt = np.diff(t)
    if len(t) < 3 or not np.isfinite(t).all() or np.any(dt < 0) or np.mean(dt == 0) < LEAST_REPEATED:
        return table
    starts = np.concatenate([[0], np.flatnonzero(dt > 0) + 1])
    tick = float(np.median(np.diff(t[starts]))) if len(starts) > 2 else np.inf
    if tick > LONGEST_TICK:
        return table
    # The last tick holds as many rows a second as all before it.
    rate = starts[-1] / (t[-1] - t[0])
    end = t[-1] + (len(t) - starts[-1]) / rate
    spread = np.interp(np.arange(len(t)), np.append(starts, len(t)), np.append(t[starts], end))
    half = max(int(0.25 * rate), 1)
    padded = np.pad(spread, half, mode="reflect", reflect_type="odd")
    steady = np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")
    near = np.abs(steady - spread) <= tick
    even = steady if near.all() and np.all(np.diff(steady) > 0) else spread
    notes.append(f"Time stamps repeat: the clock ticks every {1000 * tick:.3g} ms, the rows come every "
                 f"{1000 / rate:.3g} ms; the rows were spread evenly over the ticks")
    return table | {"t": even}


def few_missing(values: np.ndarray) -> bool:
    """Whether what is missing in a column may be interpolated."""
    bad = ~np.isfinite(values)
    return bad.mean() <= MAX_MISSING_SHARE and longest_run(bad)[0] <= MAX_GAP_ROWS


def with_gaps_filled(
    table: Table, used: list[str], rows: np.ndarray, path: pathlib.Path | str, notes: list[str]
) -> Table:
    """Interpolate the few values that are NaN or infinite in the used columns.

    Raises:
        RecordingError: There are too many of them, or a time is among them.
    """
    filled = dict(table)
    for name in used:
        bad = ~np.isfinite(table[name])
        if not bad.any():
            continue
        first, (gap, _) = rows[np.flatnonzero(bad)[0]], longest_run(bad)
        if name == "t":
            raise RecordingError(f"{path}: column t, row {first}: the time is missing; every row needs a time, delete "
                                 "the row")
        if bad.all():
            raise RecordingError(f"{path}: column {name} holds no finite value below {LARGEST:g}; log this channel, or "
                                 "check the column's name")
        if not few_missing(table[name]):
            raise RecordingError(
                f"{path}: column {name}: {bad.sum()} of {len(bad)} values are NaN, infinite, beyond {LARGEST:g} or "
                f"empty, the first at row {first}, up to {gap} rows in a row; allowed is {MAX_MISSING_SHARE:.0%} and "
                f"{MAX_GAP_ROWS} rows in a row: cut the recording there, or drop the rows")
        index = np.arange(len(bad))
        at = table["t"] if np.isfinite(table["t"]).all() else index
        filled[name] = np.where(bad, np.interp(at, at[~bad], table[name][~bad]), table[name])
        notes.append(f"{name}: {_count(bad.sum(), 'missing value')} filled by interpolation, the first at row {first}")
    return filled


def unwrapped(recording: Recording, is_slide: tuple[bool, ...]) -> Recording:
    """Undo jumps of a full turn between neighbouring samples of a hinge, where an absolute encoder wraps."""
    q, notes = recording.q.copy(), list(recording.notes)
    for j, name in enumerate(recording.joint_names):
        turns = np.diff(q[:, j]) / (2 * np.pi)
        # A full turn within a sample, up to what the joint moves in that sample.
        jump = (np.abs(np.abs(turns) - 1.0) < 0.1) & (np.abs(turns) > 20 * np.median(np.abs(turns)))
        if jump.any() and not is_slide[j]:
            q[1:, j] -= 2 * np.pi * np.cumsum(np.where(jump, np.round(turns), 0.0))
            notes.append(f"q.{name} jumps by a full turn {_count(jump.sum(), 'time')}, the first at sample "
                         f"{np.flatnonzero(jump)[0] + 2}; unwrapped")
    return dataclasses.replace(recording, q=q, notes=tuple(notes))


def without_glitches(recording: Recording) -> Recording:
    """Replace single positions that no arm could have reached and left again within two samples."""
    q, dt = recording.q.copy(), np.diff(recording.t)
    notes = list(recording.notes)
    for j, name in enumerate(recording.joint_names):
        middle = 0.5 * (q[2:, j] + q[:-2, j])
        off = np.abs(q[1:-1, j] - middle)
        typical = np.median(off) + np.quantile(np.abs(np.diff(q[:, j])), 0.95)
        glitch = (off > SPIKE_NEIGHBOURS * typical) & (off > SPIKE_ACCELERATION * dt[1:] * dt[:-1])
        # The neighbours of a glitch stand out half as far; the glitch itself is the local peak.
        peak = np.pad(off, 1)
        glitch &= (off >= peak[:-2]) & (off >= peak[2:])
        if glitch.any() and glitch.mean() < MAX_MISSING_SHARE:
            q[1:-1, j] = np.where(glitch, middle, q[1:-1, j])
            notes.append(f"q.{name}: {_count(glitch.sum(), 'single position')} out of line, the first at sample "
                         f"{np.flatnonzero(glitch)[0] + 2}, replaced by the mean of the neighbours")
    return dataclasses.replace(recording, q=q, notes=tuple(notes))


def longest_run(flags: np.ndarray) -> tuple[int, int]:
    """Length and start of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    k = int(np.argmax(ends - starts))
    return int(ends[k] - starts[k]), int(starts[k])


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
