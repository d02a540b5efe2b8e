"""The same log given twice, and the same programme played again: neither is another motion."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.recording import Recording, content_hash

SAMPLES = 500  # at which two motions are compared
SAME = 0.02  # of a joint's travel by which two runs of one programme may differ, root mean square
LATEST = 0.05  # of the duration by which one of them may begin later
DURATION = 0.03  # relative, by which they may differ in length
PROBED = 200  # samples of a log that are looked for in another
AS_WRITTEN = 1e-4  # of a channel's scatter by which a number may differ when it is written again: of five digits
FOUND = 0.9  # share of those samples which must be in the other log, all as much earlier or later


def without_copies(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Recordings without those that hold the same numbers as another, or a part of it, and a note for each of these."""
    kept: dict[str, Recording] = {}
    notes = []
    for r in recordings:
        first = kept.setdefault(content_hash(r), r)
        if first is not r:
            notes.append(f"{r.source} holds the same log as {first.source} and was left out.")
    out = sorted(kept.values(), key=lambda r: -len(r.t))
    for whole in list(out):
        if any(r is whole for r in out) and len(out) > 1:
            holds = _part_of(whole)
            for r in [r for r in out if r is not whole and len(r.t) <= len(whole.t) and holds(r)]:
                out = [x for x in out if x is not r]
                notes.append(f"{r.source} holds a part of the log in {whole.source} and was left out.")
    return [r for r in kept.values() if any(r is x for x in out)], notes


def _part_of(whole: Recording) -> Callable[[Recording], bool]:
    """Whether the rows of another recording are rows of this, cut out, thinned or rounded: sensors never repeat theirs.
    """
    there = _numbers(whole)
    close, step = AS_WRITTEN * there.std(axis=0), float(np.median(np.diff(whole.t)))
    # Of candidates there are fewest by the channel that has most values.
    key = max(range(there.shape[1]), key=lambda k: len(np.unique(there[:: max(len(there) // 1000, 1), k])))
    order = np.argsort(there[:, key])
    rising = there[order, key]

    def later(row: np.ndarray) -> float:
        """Time of the row that is the same; NaN where there is none, or several as of a robot at rest."""
        at = order[slice(*np.searchsorted(rising, row[key] + close[key] * np.array([-1.0, 1.0])))]
        same = at[np.all(np.abs(there[at] - row) <= close, axis=1)]
        return float(whole.t[same[0]]) if len(same) == 1 else np.nan

    def holds(part: Recording) -> bool:
        here, late = _numbers(part), []
        probes = np.unique(np.linspace(0, len(here) - 1, PROBED).astype(int))
        for i in probes:
            late.append(later(here[i]) - float(part.t[i]))
            if np.sum(np.isnan(late)) > (1.0 - FOUND) * len(probes):
                return False
        return bool(np.mean(np.abs(late - np.nanmedian(late)) < step) >= FOUND)

    return holds


def _numbers(r: Recording) -> np.ndarray:
    """Positions and torque or commands, shape (T, 2 n)."""
    return np.concatenate([r.q, r.tau if r.qdes is None else r.qdes], axis=1)


def with_motions_numbered(
    smooth: Sequence[Conditioned], recordings: Sequence[Recording]
) -> tuple[list[Conditioned], list[str]]:
    """Conditioned recordings that know which of them repeat a motion, and a note where some do."""
    motion: list[int] = []
    for i, r in enumerate(recordings):
        motion.append(next((motion[k] for k in range(i) if same_motion(recordings[k], r)), i))
    repeats = [motion.count(m) for m in motion]
    notes = []
    for m in dict.fromkeys(motion):
        names = [r.source for r, own in zip(recordings, motion, strict=True) if own == m]
        if len(names) > 1:
            notes.append(f"{', '.join(names)} repeat one motion: they count as one recording whose noise is averaged.")
    numbered = zip(smooth, motion, repeats, strict=True)
    return [dataclasses.replace(r, motion=m, repeats=k) for r, m, k in numbered], notes


def same_motion(a: Recording, b: Recording) -> bool:
    """Whether two recordings are of one programme: their positions are the same but for a late start."""
    lengths = [r.t[-1] - r.t[0] for r in (a, b)]
    if abs(lengths[0] - lengths[1]) > DURATION * max(lengths):
        return False
    share = np.linspace(LATEST, 1.0 - LATEST, SAMPLES)
    at = lambda r, late: np.stack([np.interp((share + late) * lengths[0], r.t - r.t[0], x) for x in r.q.T])  # noqa: E731
    one = at(a, 0.0)
    travel = np.maximum(np.ptp(one, axis=1), 1e-3)
    off = [np.max(np.sqrt(np.mean((at(b, late) - one) ** 2, axis=1)) / travel)
           for late in np.linspace(-LATEST, LATEST, 101)]  # fmt: skip
    return bool(min(off) < SAME)
