"""What a candidate would add to a set, with sizes and levels as they are."""

from collections.abc import Collection, Sequence

import numpy as np
from scipy import linalg

from irb140_jax.mismatch.regression.gaussian import root, with_prior
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.unknown_width import added_by_tied


def near(space: Space, chosen: Sequence[int], hyper: Hyper, columns: np.ndarray) -> np.ndarray:
    """Gram matrix of some shared columns and y, inertials, nuisances and a set integrated out."""
    base, extra, prior = space.set_columns(chosen), space.with_y(columns), space.prior(chosen, hyper)
    chol = root(with_prior(space.gram(hyper, base, base) * np.outer(prior, prior)))
    across = prior[:, None] * space.gram(hyper, base, extra)
    half = linalg.solve_triangular(chol, across, lower=True, check_finite=False)
    return space.gram(hyper, extra, extra) - half.T @ half


def gains(space: Space, chosen: Sequence[int], hyper: Hyper, which: np.ndarray) -> np.ndarray:
    """Log posterior odds of adding each of some candidates to a set; -inf if inadmissible."""
    priors = space.priors_by_delays(chosen, hyper)
    late = space.late[which] & bool(priors)
    out = np.full(len(which), -np.inf)
    out[~late] = _gains(space, chosen, hyper, which[~late], space.prior(chosen, hyper))
    if late.any():
        each = [_gains(space, chosen, hyper, which[late], prior) + p for prior, p in priors]
        out[late] = np.logaddexp.reduce(each)
    return out


def _gains(space: Space, chosen: Sequence[int], hyper: Hyper, which: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """The same with these prior widths of the set's columns."""
    out = np.full(len(which), -np.inf)
    if not len(which):
        return out
    extra = np.unique(np.concatenate([space.columns[i] for i in which]))
    number = np.full(space.size, -1)
    number[extra] = np.arange(len(extra))
    base = space.set_columns(chosen)
    more = space.kinds.one_more(chosen)
    chol = root(with_prior(space.gram(hyper, base, base) * np.outer(prior, prior)))
    across = prior[:, None] * space.gram(hyper, base, space.with_y(extra))
    half = linalg.solve_triangular(chol, across, lower=True, check_finite=False)
    with_y = space.gram(hyper, extra, np.array([space.size]))[:, 0] - half[:, :-1].T @ half[:, -1]
    by_size: dict[tuple[int, bool], list[int]] = {}
    for m, i in enumerate(which):
        by_size.setdefault((len(space.columns[i]), space.candidates[i].effect.prior.tied), []).append(m)
    for (k, tied), members in by_size.items():
        columns = np.array([space.columns[which[m]] for m in members])
        at = number[columns]
        part = half[:, at]
        each = np.moveaxis(part, 0, 1)
        M = np.eye(k) - np.swapaxes(each, 1, 2) @ each
        for g, of_joint, place in zip(space.joints, hyper, space.places, strict=True):
            mine = place[columns]
            moved = np.flatnonzero((mine >= 0).any(axis=1))
            if len(moved):
                M[moved] += g.at(of_joint).blocks(mine[moved])
        rhs = with_y[at]
        ids = which[members]
        if tied:
            mass = [space.candidates[i].effect.prior.is_mass for i in ids]
            each = [added_by_tied(m, r, x) for m, r, x in zip(M, rhs, mass, strict=True)]
            gain, mean = np.array([g for g, _ in each]), np.array([w for _, w in each])
        else:
            mean = np.linalg.solve(M, rhs[..., None])[..., 0]
            gain = 0.5 * np.einsum("ik,ik->i", rhs, mean) - 0.5 * np.linalg.slogdet(M)[1]
        known = space.log_prior[ids] + more[ids] - space.lost(ids, hyper)
        out[members] = np.where(space.outside(ids, mean), -np.inf, gain + known)
    return out


def reshaped(
    space: Space, chosen: Sequence[int], hyper: Hyper, tried: Collection[int] = ()
) -> tuple[int, ...]:
    """The set with the best other shape for each member whose amplitudes can't be at its own, if there is one.

    Args:
        space: What may be in a set.
        chosen: The set.
        hyper: Sizes and levels beside it.
        tried: Shapes at which amplitudes were found that can't be: those of a whole set, beside which widths are
            settled, differ a little from those that a screening sees.
    """
    now = list(chosen)
    for c in space.inadmissible(chosen, hyper):
        rest = tuple(i for i in now if i != c)
        others = [i for i in space.alike[c] if i != c and i not in tried]
        gained = gains(space, rest, hyper, np.array(others, dtype=int))
        if np.isfinite(gained).any():
            now = [*rest, others[int(np.argmax(gained))]]
    return tuple(sorted(now))
