"""Averages over the sets that a search visited: how probable each effect at each site is."""

from collections import defaultdict

import numpy as np

from irb140_jax.mismatch.selection.search import Search

WITHIN = 15.0  # nats of the best set: others weigh less than one in a million

Site = tuple[str, tuple[int, ...]]


def probabilities(search: Search, temperature: float = 1.0) -> dict[Site, float]:
    """Posterior probability of each effect at each site, over all sets visited.

    Args:
        search: The search.
        temperature: By which log odds are divided.
    """
    best = max(v for v, _ in search.visited.values())
    out: dict[Site, float] = defaultdict(float)
    total = 0.0
    for chosen, (value, _) in search.visited.items():
        if best - value > WITHIN * temperature:
            continue
        weight = float(np.exp((value - best) / temperature))
        total += weight
        for site in {(search.space.candidates[m].slug, search.space.candidates[m].joints) for m in chosen}:
            out[site] += weight
    return {site: w / total for site, w in out.items()}
