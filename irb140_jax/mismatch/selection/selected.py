"""What a search with model discrepancy found: the set, how probable its members are, and their amplitudes."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch.assemble import Data
from irb140_jax.mismatch.evidence import Posterior
from irb140_jax.mismatch.noise import Noise, noise_from_residuals, ridge
from irb140_jax.mismatch.regression.gram import START, own_scale
from irb140_jax.mismatch.regression.nuisances import GAIN_COMMON, Nuisances
from irb140_jax.mismatch.selection.averages import Site, probabilities
from irb140_jax.mismatch.selection.evidence import Settings, Space
from irb140_jax.mismatch.selection.search import Search
from irb140_jax.mismatch.selection.space import space_of

# Posterior probability, with that of what may stand in its place, from which an effect is named: odds of ten, "strong"
# evidence in Jeffreys, Theory of Probability, 1961, app. B.
NAMED = 0.9


@dataclasses.dataclass(frozen=True)
class Selected:
    """A set of candidates with the sizes of the discrepancy and the noise levels fitted to it.

    Attributes:
        chosen: The candidates named.
        space: Gram matrices and priors.
        settings: Sizes and levels of each joint.
        sets: Log posterior of every set that the search visited.
        probability: Of each effect at each site, over those sets.
        noise: Noise that the whitening used.
    """

    chosen: tuple[int, ...]
    space: Space
    settings: Settings
    sets: dict[frozenset[int], float]
    probability: dict[Site, float]
    noise: Noise

    def posterior(self) -> Posterior:
        """Inertials and amplitudes, in prior units, with discrepancy and nuisance parameters integrated out."""
        mean, cov = self.space.posterior(self.chosen, self.settings)
        common = self.space.offset - self.space.inertials
        columns = self.space.set_columns(self.chosen)
        keep = np.flatnonzero((columns < self.space.inertials) | (columns >= self.space.offset))
        columns = np.where(columns < self.space.inertials, columns, columns - common)[keep]
        return Posterior(columns, mean[keep], cov[np.ix_(keep, keep)])

    def torque_scale(self) -> tuple[float, float]:
        """Logged over real torque of all joints alike, less one: mean and standard deviation."""
        mean, cov = self.space.posterior(self.chosen, self.settings)
        at = self.space.inertials
        return GAIN_COMMON * float(mean[at]), GAIN_COMMON * float(np.sqrt(cov[at, at]))

    def rivals(self, index: int) -> dict[Site, float]:
        """Share of the sets in which another effect stands in a finding's place, by that effect."""
        return _rivals(self.space, self.sets, self.chosen, index)[0]


def _rivals(
    space: Space, sets: dict[frozenset[int], float], best: Sequence[int], index: int
) -> tuple[dict[Site, float], float]:
    """Share of the sets with each effect in the place of a member of the best one, and of those with it or any such.

    In its place stands what is not in the best set and shares a joint with the member, which itself is not there.
    """
    site = lambda i: (space.candidates[i].slug, space.candidates[i].joints)  # noqa: E731
    mine, usual, top = site(index), {site(i) for i in best}, max(sets.values())
    total, filled, out = 0.0, 0.0, {}
    for chosen, value in sets.items():
        weight, there = float(np.exp(max(value - top, -50.0))), {site(i) for i in chosen}
        others = {s for s in there - usual if set(s[1]) & set(mine[1])} if mine not in there else set()
        total += weight
        filled += weight if mine in there or others else 0.0
        for s in others:
            out[s] = out.get(s, 0.0) + weight
    return {s: w / total for s, w in out.items()}, filled / total


def selected(data: Data, extra: Sequence[Nuisances], chosen: Sequence[int] = ()) -> Selected:
    """Search for the best set, average over those on the way, and name what is probable.

    Args:
        data: Low-passed rows and candidates.
        extra: Nuisance columns, one per recording.
        chosen: Where the search starts.
    """
    noise = flexible_noise(data, extra)
    space = space_of(data, extra, noise)
    search = Search(space, (START,) * len(space.joints))
    best = search.run(chosen)
    probability = probabilities(search)
    sets = {s: v for s, (v, _) in search.visited.items()}
    named = tuple(i for i in best if _rivals(space, sets, best, i)[1] >= NAMED)
    settings = search.visited[frozenset(best)][1]
    if len(named) < len(best):
        settings = space.settled(named, settings)[1]
    return Selected(named, space, settings, sets, probability, noise)


def flexible_noise(data: Data, extra: Sequence[Nuisances]) -> Noise:
    """Noise that is left where every column of the library and of the discrepancy may help.

    Args:
        data: Low-passed rows and candidates.
        extra: Nuisance columns, one per recording.
    """
    n = data.stretches[0].y.shape[1]
    use = [s.use for s in data.stretches]
    residuals, dof = [np.zeros_like(s.y) for s in data.stretches], np.zeros(n)
    for j in range(n):
        keep = np.any([np.any(s.X[:, j] != 0.0, axis=0) for s in data.stretches], axis=0) & (data.scale > 0)
        size = np.concatenate([data.scale[keep], own_scale(extra[0].groups[j], START)])
        columns = [
            np.concatenate([s.X[:, j][:, keep], e.own[j]], axis=1) * size
            for s, e in zip(data.stretches, extra, strict=True)
        ]
        A = np.concatenate([x[u[:, j]] for x, u in zip(columns, use, strict=True)])
        y = np.concatenate([s.y[u[:, j], j] for s, u in zip(data.stretches, use, strict=True)])
        if len(y) < 10:
            continue
        v, dof[j] = ridge(A, y)
        for s, r, x in zip(data.stretches, residuals, columns, strict=True):
            r[:, j] = s.y[:, j] - x @ v
    return noise_from_residuals(residuals, use, dof, [s.unsure for s in data.stretches])
