"""Torque channels that are certainly early or late beside the positions, whether or not a set has an effect for it.

Delays of single channels are errors of the instrument, of a size that is not known beforehand.  A log whose channels
are all a little out of step needs no effect, and one channel that is far off may be just one of those; evidence can't
always tell.  What is certain is that the channel is late.  Where it is, that is the finding.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from scipy import special

from irb140_jax.effects import At
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import log_odds_of_any
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.hyperparameters import settled
from irb140_jax.mismatch.selection.screening import gains


@dataclasses.dataclass(frozen=True)
class Late:
    """Why an effect that shifts one channel in time is named.

    Attributes:
        log_odds: That the channel is early or late.
        rivals: Probability of other such effects in its place.
    """

    log_odds: float
    rivals: Mapping[Site, float]


@dataclasses.dataclass(frozen=True)
class Delays:
    """By how much each joint's torque is logged early [s], shape (n,) each; late where it is below zero.

    Attributes:
        early, unsure: Mean and standard deviation.
        log_odds: That it is not zero, against the odds of any rare effect.
    """

    early: np.ndarray
    unsure: np.ndarray
    log_odds: np.ndarray

    @property
    def notable(self) -> np.ndarray:
        """Which are worth saying, if they are there."""
        return np.abs(self.early) > settings.NOTABLE_DELAY


def delays_beside(space: Space, chosen: Sequence[int], hyper: Hyper) -> Delays:
    """What a set leaves to the instrument's own delays: that of all channels and that of each joint's."""
    mean, cov = space.posterior(chosen, hyper)
    at = np.arange(space.offset - space.delays, space.offset)
    weights = np.zeros((len(at), len(mean)))
    weights[:, space.inertials + 1] = settings.DELAY_COMMON
    weights[np.arange(len(at)), at] = settings.DELAY_JOINT
    early, unsure = weights @ mean, np.sqrt(np.diag(weights @ cov @ weights.T))
    widths = np.hypot(settings.DELAY_COMMON, settings.DELAY_JOINT * space.prior(chosen, hyper)[at])
    odds = [log_odds_of_any(*one) for one in zip(early.tolist(), unsure.tolist(), widths.tolist(), strict=True)]
    return Delays(early, unsure, np.array(odds) + np.log(settings.RARE))


def with_late_channels(
    space: Space, best: tuple[int, ...], hyper: Hyper, held: frozenset[Site] = frozenset()
) -> tuple[tuple[int, ...], Hyper, Mapping[Site, Late]]:
    """A set with an effect for every channel that is certainly early or late: the kind that suits all of them best.

    Args:
        space: What may be in a set; what is impossible beforehand is not taken.
        best: The set.
        hyper: Sizes and levels beside it.
        held: Effects that stay what they are.

    Returns:
        The set, sizes and levels beside it, and what is certain of its members.
    """
    candidates = space.candidates
    timed = [i for i in best if candidates[i].effect.place.at is At.LOG_TIMING]
    if not space.delays or any(candidates[i].effect.place.everywhere for i in timed):
        return best, hyper, {}
    base = tuple(i for i in best if i not in timed)
    beside = settled(space, base, hyper)[1] if timed else hyper
    found = delays_beside(space, base, beside)
    certain = found.notable & (found.log_odds >= np.log(settings.NAMED / (1.0 - settings.NAMED)))
    options = [_shifting(space, base, beside, int(j), held) for j in np.flatnonzero(certain)]
    kinds = sorted({slug for of_joint in options for slug in of_joint})
    total = {k: sum(o[k][0] if k in o else max(v for v, _ in o.values()) for o in options if o) for k in kinds}
    worth = special.softmax([total[k] for k in kinds]) if kinds else []
    kind = max(kinds, key=lambda k: total[k], default="")
    chosen, late = list(base), {}
    for j, of_joint in zip(np.flatnonzero(certain), options, strict=True):
        if of_joint:
            _, member = of_joint[kind] if kind in of_joint else max(of_joint.values())
            chosen.append(member)
            others = {(k, (int(j),)): float(w) for k, w in zip(kinds, worth, strict=True)
                      if k in of_joint and k != candidates[member].slug}  # fmt: skip
            late[site_of(candidates[member])] = Late(float(found.log_odds[j]), others)
    taken = {j for i in chosen if i not in base for j in candidates[i].joints}
    chosen += [i for i in timed if not taken & set(candidates[i].joints)]
    stated = tuple(sorted(chosen))
    return stated, (hyper if stated == best else settled(space, stated, beside)[1]), late


def _shifting(
    space: Space, base: tuple[int, ...], hyper: Hyper, j: int, held: frozenset[Site]
) -> dict[str, tuple[float, int]]:
    """Effects that shift one channel in time, by name: log posterior odds over all shapes, and the best candidate."""
    which = [i for i, c in enumerate(space.candidates) if space.late[i] and c.joints == (j,)]
    kept = [i for i in which if site_of(space.candidates[i]) in held]
    first = {space.candidates[i].slug: i for i in reversed(kept or which)}
    out: dict[str, tuple[float, int]] = {}
    for slug, i in first.items():
        shapes = np.array(space.alike[i])
        gained = gains(space, base, hyper, shapes)
        if np.isfinite(gained).any():
            out[slug] = float(np.logaddexp.reduce(gained)), int(shapes[np.argmax(gained)])
    return out
