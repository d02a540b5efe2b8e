"""From low-passed rows to the space that a search visits: priors and bounds of every candidate, Gram matrices."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch.assemble import Data
from irb140_jax.mismatch.noise import Noise
from irb140_jax.mismatch.regression.gram import joint_grams
from irb140_jax.mismatch.regression.nuisances import Nuisances
from irb140_jax.mismatch.selection.evidence import Space

RARE = 0.05  # expected number of sites of a robot at which an effect that few machines have is left out
COMMON = 0.5  # probability of ordinary friction at a joint


def space_of(data: Data, extra: Sequence[Nuisances], noise: Noise) -> Space:
    """Gram matrices of the rows, with the prior probability of every candidate.

    Args:
        data: Low-passed rows and candidates.
        extra: Nuisance columns of each recording.
        noise: Sensors' noise.
    """
    common = extra[0].common.shape[-1]
    kinds: dict[tuple[str, tuple[int, ...]], int] = {}
    places: dict[str, set[tuple[int, ...]]] = {}
    for c in data.candidates:
        kinds[c.slug, c.joints] = kinds.get((c.slug, c.joints), 0) + 1
        places.setdefault(c.slug, set()).add(c.joints)
    rare = np.array([
        np.log(RARE / len(places[c.slug]) / (kinds[c.slug, c.joints] * c.effect.scanned)) for c in data.candidates
    ])  # fmt: skip
    # The last link's inertials and a payload's are one thing under two priors, whose widths mean little: a factor of
    # three in each of ten parameters.
    held = any(c.effect.tied and data.scale[data.nuisances + c.columns[0]] > 0.0 for c in data.candidates)
    last = data.stretches[0].y.shape[1] - 1
    doubly = [held and c.slug == "inertials" and c.joints == (last,) for c in data.candidates]
    rare -= 10.0 * np.log(3.0) * np.array(doubly)
    usual = np.log(COMMON / (1.0 - COMMON))
    log_prior = np.where([c.effect.ordinary for c in data.candidates], usual, rare)
    width = max(len(c.columns) for c in data.candidates)
    lowest = np.full((len(data.candidates), width), -np.inf)
    highest = np.full((len(data.candidates), width), np.inf)
    for i, c in enumerate(data.candidates):
        s = data.scale[data.nuisances + c.columns]
        k, moves = len(c.columns), s > 0.0
        lowest[i, :k] = np.where(moves, c.lowest / np.where(moves, s, 1.0), np.where(c.lowest == 0.0, np.inf, -np.inf))
        highest[i, :k] = c.highest / np.where(moves, s, 1.0)
        if moves.all():
            least, most = c.effect.at_shape(c.shape)
            own = list(c.variant)
            lowest[i, :k] = np.maximum(lowest[i, :k], least[own] / s)
            highest[i, :k] = np.minimum(highest[i, :k], most[own] / s)
    return Space(
        joint_grams(data, extra, noise), data.candidates, data.nuisances, data.nuisances + common,
        len(data.scale) + common, log_prior, lowest, highest,
    )  # fmt: skip
