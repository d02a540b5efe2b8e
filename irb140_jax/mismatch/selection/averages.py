"""Averages over the sets that a search visited: how probable each effect at each site is."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate

Site = tuple[str, tuple[int, ...]]
Sets = Mapping[frozenset[int], float]  # log posterior of sets of candidates


def near_best(sets: Sets) -> Sets:
    """Those within `WITHIN` of the best."""
    top = max(sets.values())
    return {s: v for s, v in sets.items() if top - v <= settings.WITHIN} if np.isfinite(top) else {}


def weights(sets: Sets) -> dict[frozenset[int], float]:
    """Probability of each set within `WITHIN` of the best."""
    top = max(sets.values())
    near = {s: float(np.exp(v - top)) for s, v in near_best(sets).items()}
    total = sum(near.values())
    return {s: w / total for s, w in near.items()}


def probabilities(candidates: Sequence[Candidate], sets: Sets) -> dict[Site, float]:
    """Posterior probability of each effect at each site."""
    out: dict[Site, float] = defaultdict(float)
    for chosen, weight in weights(sets).items():
        for site in {site_of(candidates[m]) for m in chosen}:
            out[site] += weight
    return dict(out)


def in_its_place(
    candidates: Sequence[Candidate], sets: Sets, best: Sequence[int], index: int
) -> tuple[dict[Site, float], float]:
    """Probability of each effect in the place of a member of the best set, and of the member or any of those.

    In its place, in a set without the member, is an effect that shares a joint with it and that the best set lacks.
    """
    mine, usual = site_of(candidates[index]), {site_of(candidates[i]) for i in best}
    filled, out = 0.0, defaultdict(float)
    for chosen, weight in weights(sets).items():
        there = {site_of(candidates[i]) for i in chosen}
        others = {s for s in there - usual if set(s[1]) & set(mine[1])} if mine not in there else set()
        filled += weight if mine in there or others else 0.0
        for s in others:
            out[s] += weight
    return dict(out), filled


def site_of(c: Candidate) -> Site:
    """An effect and its joints."""
    return c.slug, c.joints
