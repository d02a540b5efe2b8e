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


def without(recordings: Sequence[Recording], name: str, when: When) -> list[Recording] | None:
    """The recordings without that time of the one of this name; None where the name is not one's alone.

    What comes before and what comes after are recordings of their own, if there is anything of them.
    """
    if [r.source for r in recordings].count(name) != 1:
        return None
    out = []
    for r in recordings:
        if r.source != name:
            out.append(r)
            continue
        before = int(np.searchsorted(r.t, when.begin - settings.EVENT_MARGIN))
        after = int(np.searchsorted(r.t, when.end + settings.EVENT_MARGIN))
        for rows in (slice(0, before), slice(after, len(r.t))):
            part = rows_of(r, rows)
            if len(part.t) > 1 and part.t[-1] - part.t[0] > settings.FEWEST_SECONDS:
                out.append(dataclasses.replace(part, sha256=r.sha256, path=r.path))
    return out or None
