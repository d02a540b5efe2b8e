"""A short time in which nothing explains most of the torque of most joints: a diagnosis leaves it out, and says so.

A servo in another mode, a hand on the arm, a cable that catches: some seconds of it spoil every estimate that is made
of all rows.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.validation.unexplained import Structure, When
from irb140_jax.recordings.recording import Recording, rows_of


def common_time(rest: Sequence[Structure], joints: int, recorded: float) -> When | None:
    """From when to when nothing explains most of the torque of most joints; None where there is no such short time.

    Fast motion has most of any error, however little of the torque that is, and alone shows what only fast motion can.

    Args:
        rest: What nothing explains.
        joints: How many were judged.
        recorded: How long they were recorded [s].
    """
    short = [s.when for s in mostly_unexplained(rest) if s.when]
    if not short or 2 * len(short) <= joints or len({w.recording for w in short}) > 1:
        return None
    if max(w.begin for w in short) > min(w.end for w in short):
        return None
    begin, end = min(w.begin for w in short), max(w.end for w in short)
    if end - begin > settings.BRIEF * recorded:
        return None
    share, of_torque = np.min([(w.share, w.of_torque) for w in short], axis=0)
    return When(short[0].recording, begin, end, float(share), float(of_torque))


def mostly_unexplained(rest: Sequence[Structure]) -> list[Structure]:
    """What nothing explains for a short time in which it is a large share of the joint's torque."""
    return [s for s in rest if s.when is not None and s.when.of_torque > settings.LARGE_ERROR]


def without(
    recordings: Sequence[Recording], times: Sequence[tuple[str, float, float]]
) -> list[Recording] | None:
    """The recordings without some times; None where nothing is left, or a name of a recording is not one's alone.

    What comes before, between and after is a recording of its own each, if there is anything of it, named for its time.

    Args:
        recordings: All of them.
        times: Name of a recording, begin and end in the time of its log [s].
    """
    names = [r.source for r in recordings]
    if any(names.count(name) != 1 for name, *_ in times):
        return None
    out = []
    for r in recordings:
        stays = np.ones(len(r.t), dtype=bool)
        for name, begin, end in times:
            inside = (r.t >= begin - settings.EVENT_MARGIN) & (r.t < end + settings.EVENT_MARGIN)
            stays &= (r.source != name) | ~inside
        if stays.all():
            out.append(r)
            continue
        for first, last in np.flatnonzero(np.diff(np.concatenate([[False], stays, [False]]))).reshape(-1, 2):
            part = rows_of(r, slice(first, last))
            if len(part.t) > 1 and part.t[-1] - part.t[0] > settings.FEWEST_SECONDS:
                name = f"{r.source} ({part.t[0]:.4g} to {part.t[-1]:.4g} s)"
                out.append(dataclasses.replace(part, source=name))
    return out or None
