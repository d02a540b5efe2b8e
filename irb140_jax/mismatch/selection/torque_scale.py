"""One scale of all logged torques: a nuisance parameter of every fit, and what may be left out as any effect may.

A set whose inertials and effects explain the torque only if all of it is scaled says that the scale is off, which is a
finding with the prior odds of a rare effect.  So each set counts twice: with that finding, and without any scale.
"""

from collections.abc import Collection, Mapping

import numpy as np

from irb140_jax.effects.torque_gain import EFFECT as GAIN
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.selection.averages import Sets, near_best
from irb140_jax.mismatch.selection.evidence import Hyper, Space


def scale_of(space: Space) -> Candidate:
    """One scale of all torques, which has no amplitudes of its own: it comes after all candidates of a space."""
    nothing = np.zeros(0)
    return Candidate(GAIN, tuple(range(len(space.joints))), nothing, nothing.astype(int), (), nothing, nothing)


def scale_log_odds(space: Space, chosen: Collection[int], hyper: Hyper) -> float:
    """Log odds that all torques are logged too large or too small by one factor, if a set is true."""
    return space.torque_scale_odds(tuple(sorted(chosen)), hyper) + float(np.log(settings.RARE))


def beside_scale(space: Space, visited: Mapping[frozenset[int], tuple[float, Hyper]]) -> Sets:
    """Log posterior of the visited sets that are near the best, each without any scale and with that of `scale_of`.

    Args:
        space: What may be in a set.
        visited: Log posterior of sets of candidates, some scale in every one, and sizes and levels beside them.
    """
    out: dict[frozenset[int], float] = {}
    for chosen, value in near_best({s: v for s, (v, _) in visited.items()}).items():
        scaled = value + float(np.log(settings.RARE))
        out[chosen | {len(space.candidates)}] = scaled
        out[chosen] = scaled - scale_log_odds(space, chosen, visited[chosen][1])
    return out
