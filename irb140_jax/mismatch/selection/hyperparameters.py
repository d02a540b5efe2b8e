"""Sizes of the discrepancy and noise levels that are best for a set, and the sum over its members' shapes."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from scipy import linalg, special

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import root, with_prior
from irb140_jax.mismatch.regression.gram import LEVELS, JointHyper
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.screening import gains, reshaped

LEAST = 1e-3  # nats that a step of a size or a level must gain


def settled(
    space: Space, chosen: Sequence[int], hyper: Hyper, joints: Sequence[int] | None = None
) -> tuple[float, Hyper]:
    """Sizes and levels that are best for a set, by ascent on their grids, at some joints or all.

    Returns:
        Log posterior of the set, summed over shapes, -inf where it is inadmissible; and the hyperparameters.
    """
    joints = list(range(len(space.joints)) if joints is None else joints)
    prior, at_best = space.prior(chosen, hyper), 0
    for j in itertools.cycle(joints):
        better = _climbed(space, chosen, hyper, j, prior)
        at_best += 1
        if better != hyper:
            hyper, prior, at_best = better, space.prior(chosen, better), 1
        if at_best == len(joints):
            break
    return space.log_evidence(chosen, hyper) + over_shapes(space, chosen, hyper), hyper


def possible(
    space: Space, chosen: tuple[int, ...], judge: Callable[[tuple[int, ...]], tuple[float, Hyper]], *,
    fewer: bool = False,
) -> tuple[int, ...]:  # fmt: skip
    """A set, with other shapes of members whose amplitudes can't be at theirs; itself where that is of no use.

    Args:
        space: What may be in a set.
        chosen: The set.
        judge: Log posterior of a set, sizes and levels: see `settled`.
        fewer: Whether members without any possible shape are left out.
    """
    seen, tried = set[tuple[int, ...]](), set[int]()
    while not np.isfinite((judged := judge(chosen))[0]):
        seen.add(chosen)
        tried.update(bad := space.inadmissible(chosen, judged[1]))
        other = reshaped(space, chosen, judged[1], tried)
        if other in seen and fewer:
            other = tuple(i for i in chosen if i not in bad)
        if other in seen:
            break
        chosen = other
    return chosen


def over_shapes(space: Space, chosen: Sequence[int], hyper: Hyper) -> float:
    """What a set's log posterior gains where the shapes of its members are summed over instead of the best ones.

    One member at a time, the others' shapes as they are.
    """
    out = 0.0
    for c in chosen:
        if len(alike := space.alike[c]) > 1:
            rest = tuple(i for i in chosen if i != c)
            near = frozenset(i for i in rest if space.at_joint[list(space.candidates[c].joints), i].any())
            key = c, near, tuple(hyper[j] for j in space.candidates[c].joints)
            if key not in space.summed:
                gained = gains(space, rest, hyper, np.array(alike))
                own = gained[alike.index(c)]
                space.summed[key] = float(special.logsumexp(gained) - own) if np.isfinite(own) else 0.0
            out += space.summed[key]
    return out


def _climbed(space: Space, chosen: Sequence[int], hyper: Hyper, j: int, prior: np.ndarray) -> Hyper:
    """Hyperparameters, those of one joint at their best beside a set whose columns have these prior widths."""
    index, here = space.with_y(space.set_columns(chosen)), [i for i in chosen if space.at_joint[j, i]]
    gram, at = space.joints[j], space.places[j][index]
    mine, others = np.flatnonzero(at >= 0), np.flatnonzero(at < 0)
    scale, elsewhere = np.append(prior, 1.0), [i for i in range(len(space.joints)) if i != j]
    M = with_prior(scale[:, None] * space.gram(hyper, index, index, elsewhere) * scale)
    # Columns that don't move this joint are eliminated once.
    half = linalg.solve_triangular(root(M[others[:, None], others]), M[others[:, None], mine], lower=True)
    rest, take, scale = M[mine[:, None], mine] - half.T @ half, at[mine], scale[mine]
    known: dict[JointHyper, float] = {}

    def values(tries: list[JointHyper]) -> None:
        if new := [s for s in tries if s not in known]:
            own = scale[:, None] * np.stack([gram.left(s, take) for s in new]) * scale
            diagonal = np.diagonal(root(rest + own), axis1=1, axis2=2)
            value = 0.5 * (own[:, -1, -1] - diagonal[:, -1] ** 2) - np.log(diagonal[:, :-1]).sum(axis=1)
            lost = [space.lost(here, (*hyper[:j], s, *hyper[j + 1 :])).sum() for s in new]
            known.update(zip(new, value + [gram.at(s).constant for s in new] - lost, strict=True))

    now = hyper[j]
    while True:
        near = _near(now, gram.lowest)
        values([now, *near])
        best = max(near, key=lambda s: known[s])
        if known[best] <= known[now] + LEAST:
            return (*hyper[:j], now, *hyper[j + 1 :])
        now = best


def _near(hyper: JointHyper, lowest: int) -> list[JointHyper]:
    """Neighbours on the grid, with no level below the lowest."""
    bounds = [*([(0, len(settings.DISCREPANCY_SIZES))] * (len(hyper) - 1)), (lowest, len(LEVELS))]
    out = []
    for axis, (bottom, top) in enumerate(bounds):
        for step in (-1, 1):
            if bottom <= hyper[axis] + step < top:
                out.append((*hyper[:axis], hyper[axis] + step, *hyper[axis + 1 :]))
    return out
