"""The same log given twice, and the same programme played again: neither is another motion."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.recording import Recording, content_hash

SAMPLES = 500  # at which two motions are compared
SAME = 0.02  # of a joint's travel by which two runs of one programme may differ, root mean square
LATEST = 0.05  # of the duration by which one of them may begin later
DURATION = 0.03  # relative, by which they may differ in length


def without_copies(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Recordings without those that hold the same numbers as one before, and a note for each of these."""
    kept: dict[str, Recording] = {}
    notes = []
    for r in recordings:
        first = kept.setdefault(content_hash(r), r)
        if first is not r:
            notes.append(f"{r.source} holds the same log as {first.source} and was left out.")
    return list(kept.values()), notes


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
