"""Which set of candidates explains the rows, with model discrepancy and errors of the instrument beside it."""

from collections.abc import Mapping, Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.gram import START, own_scale
from irb140_jax.mismatch.regression.noise import Noise, noise_from_residuals, ridge
from irb140_jax.mismatch.regression.nuisances import Nuisances
from irb140_jax.mismatch.selection.averages import Sets, Site, in_its_place
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.search import Search

Visited = Mapping[frozenset[int], tuple[float, Hyper]]

FREE = (*([len(settings.DISCREPANCY_SIZES) - 1] * (len(START) - 1)), START[-1])  # a discrepancy of any size


def selected(
    space: Space, chosen: Sequence[int] = (), *, every_move: bool = True, held: frozenset[Site] = frozenset()
) -> tuple[tuple[int, ...], Hyper, Visited]:
    """Search for the best set.

    Args:
        space: What may be in a set.
        chosen: Where the search starts.
        every_move: See `Search.run`.
        held: Effects that are in every set.

    Returns:
        The best set, sizes and levels beside it, and log posterior, sizes and levels of every set visited.
    """
    search = Search(space, (START,) * len(space.joints), held)
    best = search.run(chosen, every_move=every_move)
    return best, search.visited[frozenset(best)][1], {s: of for s, of in search.visited.items() if search.holds(s)}


def named(candidates: Sequence[Candidate], sets: Sets) -> tuple[int, ...]:
    """What is stated: the members of a set that are probable together with what may stand in their place.

    Of sets that can't be told from the best one it is one with the fewest members beside ordinary friction: a rare
    effect needs the odds for it, ordinary friction needs none.  Of those it is that with the fewest in all, where
    evidence for more is not substantial.

    Args:
        candidates: What may be in a set.
        sets: Log posterior of every set visited.
    """
    top, odds = max(sets, key=lambda s: sets[s]), np.log(settings.NAMED / (1.0 - settings.NAMED))
    # Whether one of its own members may be missing is for that member's probability to say.
    even = [s for s, value in sets.items() if value > sets[top] - odds and not s < top]
    beside = lambda s: sum(not candidates[i].effect.prior.ordinary for i in s)  # noqa: E731
    fewest = min(map(beside, even))
    rare = [s for s in even if beside(s) == fewest]
    least = max(sets[s] for s in rare) - settings.SUBSTANTIAL
    few = tuple(sorted(min((s for s in rare if sets[s] > least), key=lambda s: (len(s), -sets[s]))))
    return tuple(i for i in few if in_its_place(candidates, sets, few, i)[1] >= settings.NAMED)


def flexible_noise(data: Data, extra: Sequence[Nuisances]) -> Noise:
    """Noise that inertials, ordinary friction and a discrepancy of any size leave: where the fit of levels starts.

    Args:
        data: Low-passed rows and candidates.
        extra: Nuisance columns, one per recording.
    """
    n = data.stretches[0].y.shape[1]
    usual = [data.nuisances + c.columns for c in data.candidates if c.effect.prior.ordinary]
    shared = np.concatenate([np.arange(data.nuisances), *usual])
    residuals, dof = [np.zeros_like(s.y) for s in data.stretches], np.zeros(n)
    for j in range(n):
        keep = shared[np.any([np.any(s.of(shared, j) != 0.0, axis=0) for s in data.stretches], axis=0)]
        size = np.concatenate([data.scale[keep], own_scale(extra[0].groups[j], FREE)])
        columns = [
            np.concatenate([s.of(keep, j), e.own[j]], axis=1) * size
            for s, e in zip(data.stretches, extra, strict=True)
        ]
        A = np.concatenate([x[s.use[:, j]] for x, s in zip(columns, data.stretches, strict=True)])
        y = np.concatenate([s.y[s.use[:, j], j] for s in data.stretches])
        if len(y) < 10:
            continue
        v, dof[j] = ridge(A, y)
        for s, r, x in zip(data.stretches, residuals, columns, strict=True):
            r[:, j] = s.y[:, j] - x @ v
    return noise_from_residuals(residuals, [s.use for s in data.stretches], dof, [s.unsure for s in data.stretches])


def noise_left(
    data: Data, extra: Sequence[Nuisances], space: Space, chosen: Sequence[int], hyper: Hyper
) -> Noise:
    """Noise that a set leaves, with errors of the instrument and the discrepancy beside it.

    Args:
        data: Low-passed rows and candidates.
        extra: Nuisance columns, one per recording.
        space: Gram matrices.
        chosen: The set.
        hyper: Sizes and levels beside it.
    """
    mean, cov = space.posterior(chosen, hyper)
    columns, n = space.set_columns(chosen), len(space.joints)
    amplitudes = columns[space.offset :] - space.offset + data.nuisances
    at = np.r_[0 : data.nuisances, amplitudes]
    w = np.r_[mean[: data.nuisances], mean[space.offset :]] * data.scale[at]
    common = mean[data.nuisances : space.offset]
    own = [space.own(j, s, columns, mean, instrument=True) for j, s in enumerate(hyper)]
    residuals = []
    for s, e in zip(data.stretches, extra, strict=True):
        r = s.y - s.torque(at, w) - e.common @ common
        residuals.append(r - np.stack([x @ v for x, v in zip(e.own, own, strict=True)], axis=1))
    known = np.diag(cov) / space.prior(chosen, hyper) ** 2
    shared = (len(mean) - float(known.sum())) / n  # shrunk ones count for less; they are split over the joints
    dof = np.array([g.at(s).dof() for g, s in zip(space.joints, hyper, strict=True)]) + shared
    return noise_from_residuals(residuals, [s.use for s in data.stretches], dof, [s.unsure for s in data.stretches])
