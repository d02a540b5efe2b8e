"""Torque channels that are certainly early or late beside the positions, whether or not a set has an effect for it.

Delays of single channels are errors of the instrument, of a size that is not known beforehand.  A log whose channels
are all a little out of step needs no effect, and one channel that is far off may be just one of those; evidence can't
always tell.  What is certain is that the channel is late.  Where it is, that is the finding.
"""

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np
from scipy import special

from irb140_jax.effects import At
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import log_odds_of_any
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.hyperparameters import possible, settled
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
    """What a set leaves to the instrument's own delays: the sum of that of all channels and that of each joint's.

    Args:
        space: What may be in a set.
        chosen: The set.
        hyper: Sizes and levels beside it.
    """
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
    """A set with an effect for every channel that is certainly early or late.

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
    value, beside = settled(space, base, hyper)
    found = delays_beside(space, base, beside)
    certain = found.notable & (found.log_odds >= np.log(settings.NAMED / (1.0 - settings.NAMED)))
    if not certain.any():
        return best, hyper, {}
    options = [_shifting(space, base, beside, (int(j),), held) for j in np.flatnonzero(certain)]
    options = [of_joint for of_joint in options if of_joint]
    every = tuple(range(len(certain)))
    if len(options) == len(every) > 1 and (of_all := _shifting(space, base, beside, every, held)):
        # One delay of all channels, or delays of their own that happen to be long: with the latter nothing is named.
        slug, i = next(iter(of_all.items()))
        stated = tuple(sorted((*base, i)))
        of_set, with_it = settled(space, stated, beside)
        if of_set > value:
            rival = next(iter(options[0])), every
            whole = Late(float(found.log_odds.min()), {rival: float(special.expit(value - of_set))})
            return stated, with_it, {(slug, every): whole}
    chosen, worth = _most_probable(space, base, beside, options)
    late: dict[Site, Late] = {}
    for c in (candidates[i] for i in chosen if space.late[i]):
        rivals = {(slug, c.joints): p for slug, p in worth[c.joints[0]].items() if slug != c.slug}
        late[site_of(c)] = Late(float(found.log_odds[c.joints[0]]), rivals)
    kept = [i for i in timed if candidates[i].joints[0] not in worth]
    stated = tuple(sorted((*chosen, *kept)))
    return stated, hyper if stated == best else settled(space, stated, beside)[1], late


def _most_probable(
    space: Space, base: tuple[int, ...], hyper: Hyper, options: list[dict[str, int]]
) -> tuple[tuple[int, ...], dict[int, dict[str, float]]]:
    """A set with the most probable effect of each channel, and how probable each effect is, the others given.

    From one kind for all channels, where one suits them all, one channel after another.

    Args:
        space: What may be in a set.
        base: The rest of the set.
        hyper: Sizes and levels beside it.
        options: Of each channel the candidate of each effect, by the effect's name, the best first.

    Returns:
        The set, `base` where none is possible; and by joint and effect the probability.
    """

    @functools.cache
    def judge(whole: tuple[int, ...]) -> tuple[float, Hyper]:
        return settled(space, whole, hyper)

    def judged(members: tuple[int, ...]) -> tuple[float, tuple[int, ...]]:
        whole = possible(space, tuple(sorted((*base, *members))), judge)
        return judge(whole)[0], whole

    each = [[*of_joint.values()] for of_joint in options]
    exchanged = lambda members, at: [(*members[:at], i, *members[at + 1 :]) for i in each[at]]  # noqa: E731
    kinds = set[str].intersection(*map(set, options)) if options else ()
    alike = [tuple(of_joint[kind] for of_joint in options) for kind in sorted(kinds)]
    members = max(alike or [tuple(of_joint[0] for of_joint in each)], key=judged)
    for at in range(len(members)):
        members = max(exchanged(members, at), key=judged)
    value, chosen = judged(members)
    if not np.isfinite(value):
        return base, {}
    worth: dict[int, dict[str, float]] = {}
    for at, of_joint in enumerate(options):
        shares = special.softmax([judged(other)[0] for other in exchanged(members, at)])
        worth[space.candidates[members[at]].joints[0]] = dict(zip(of_joint, shares.tolist(), strict=True))
    return chosen, worth


def _shifting(
    space: Space, base: tuple[int, ...], hyper: Hyper, joints: tuple[int, ...], held: frozenset[Site]
) -> dict[str, int]:
    """Effects that shift some channels in time, by name: the candidate with the best shape, the best effect first."""
    which = [i for i, c in enumerate(space.candidates) if space.late[i] and c.joints == joints]
    kept = [i for i in which if site_of(space.candidates[i]) in held]
    out: dict[str, tuple[float, int]] = {}
    for slug, i in {space.candidates[i].slug: i for i in reversed(kept or which)}.items():
        shapes = np.array(space.alike[i])
        gained = gains(space, base, hyper, shapes)
        if np.isfinite(gained).any():
            out[slug] = float(np.max(gained)), int(shapes[np.argmax(gained)])
    return {slug: i for slug, (_, i) in sorted(out.items(), key=lambda item: -item[1][0])}
