"""Which physics, out of the library, explains the mismatch: a search over sets of candidates by their evidence."""

import dataclasses
import itertools
from collections import defaultdict

import numpy as np

from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.evidence import eliminated, gains, posterior

ACCEPT = np.log(100.0)  # posterior odds a finding needs; under the null, a bound of 1 % on a false one (Markov)
PREFER = np.log(20.0)  # odds at which a law replaces the simpler one that it contains
FORM_ERROR = 0.03  # no law is exact: 3 % of what a joint's effects explain is not evidence for another effect
RIGID_ERROR = 0.0003  # the same for the rigid-body torque: geometry, timing
MOST = 40  # effects at most in one set


@dataclasses.dataclass(frozen=True)
class Problem:
    """Everything the search needs; no data, only Gram matrices.

    Attributes:
        H: Gram matrix over [nuisances | amplitudes | y], nuisances eliminated, shape (K + 1, K + 1).
        per_joint: Gram matrices of each joint's rows before elimination, shape (n, K + 1, K + 1).
        rigid_energy: Squared whitened nominal torque of each joint, shape (n,).
        candidates: What may be in the set.
        offset: Column of the first amplitude.
        log_prior: Log prior odds of each candidate, shape (len(candidates),).
        lowest: Smallest admissible amplitudes in prior units, per candidate, padded with -inf.
    """

    H: np.ndarray
    per_joint: np.ndarray
    rigid_energy: np.ndarray
    candidates: tuple[Candidate, ...]
    offset: int
    log_prior: np.ndarray
    lowest: np.ndarray

    def columns(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Columns of H that a set uses."""
        parts = [self.candidates[c].columns + self.offset for c in chosen]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=int)

    def without(self, chosen: tuple[int, ...], *drop: int) -> np.ndarray:
        """Gram matrix with a set, less some of it, eliminated."""
        return eliminated(self.H, self.columns(tuple(c for c in chosen if c not in drop)))[0]

    def scores(self, H: np.ndarray) -> np.ndarray:
        """Log posterior odds of adding each candidate; -inf where its amplitudes would be inadmissible."""
        gain, mean = gains(H, list(self.candidates), self.offset)
        std = 1.0  # prior units: an amplitude is inadmissible only if it lies clearly on the wrong side
        bad = np.any(mean < self.lowest - 1e-9 * std, axis=1)
        return np.where(bad, -np.inf, gain + self.log_prior)

    def guard(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Log odds that imperfect laws could feign at each joint, shape (n,)."""
        index = self.columns(chosen)
        if len(index) == 0:
            return 0.5 * RIGID_ERROR**2 * self.rigid_energy
        v = posterior(self.H, index).mean
        explained = np.einsum("i,jik,k->j", v, self.per_joint[:, index[:, None], index[None, :]], v)
        return 0.5 * FORM_ERROR**2 * explained + 0.5 * RIGID_ERROR**2 * self.rigid_energy


def search(problem: Problem, start: tuple[int, ...] = ()) -> tuple[int, ...]:
    """The set of candidates with the best posterior odds that simpler sets do not match.

    Forward steps, each followed by exchanges (one or two members for one), simplifications and removals until nothing
    improves.
    """
    chosen = _settled(problem, start)
    while len(chosen) < MOST:
        scores = problem.scores(problem.without(chosen)) - _hurdle(problem, chosen) - ACCEPT
        scores[list(chosen)] = -np.inf
        scores = np.where(_conflicts(problem, chosen), -np.inf, scores)
        best = int(np.argmax(scores))
        if scores[best] <= 0:
            break
        chosen = _settled(problem, (*chosen, best))
    return chosen


def total_score(problem: Problem, chosen: tuple[int, ...]) -> float:
    """Log posterior odds of a set against the empty one."""
    H, total = problem.H, 0.0
    for c in chosen:
        gain, _ = gains(H, [problem.candidates[c]], problem.offset)
        total += float(gain[0]) + problem.log_prior[c]
        H, _ = eliminated(H, problem.candidates[c].columns + problem.offset)
    return total


def _hurdle(problem: Problem, chosen: tuple[int, ...]) -> np.ndarray:
    """Guard of each candidate: of the most suspect joint it touches."""
    guard = problem.guard(chosen)
    return np.array([guard[list(c.joints)].max() for c in problem.candidates])


def _conflicts(problem: Problem, chosen: tuple[int, ...]) -> np.ndarray:
    """Candidates that can't stand beside the set: the same effect at the site, or one that contains or is contained."""
    taken = [problem.candidates[c] for c in chosen]
    by_site = defaultdict(set)
    for c in taken:
        by_site[c.joints] |= {c.slug, *c.effect.contains}
    containers = defaultdict(set)
    for c in taken:
        containers[c.joints].add(c.slug)
    return np.array([
        c.slug in by_site[c.joints] or bool(set(c.effect.contains) & containers[c.joints])
        for c in problem.candidates
    ])  # fmt: skip


def _settled(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...]:
    """Exchange, simplify and remove until nothing improves."""
    for _ in range(30):
        changed = _exchange(problem, chosen) or _simplify(problem, chosen) or _remove(problem, chosen)
        if changed is None:
            return chosen
        chosen = changed
    return chosen


def _exchange(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...] | None:
    """The best replacement of one or two members by one candidate that shares a joint with them."""
    hurdle = _hurdle(problem, chosen)
    best, best_move = 1e-6, None
    drops = [(c,) for c in chosen]
    drops += [
        pair for pair in itertools.combinations(chosen, 2)
        if set(problem.candidates[pair[0]].joints) & set(problem.candidates[pair[1]].joints)
    ]  # fmt: skip
    for drop in drops:
        H = problem.without(chosen, *drop)
        scores = problem.scores(H)
        rest = tuple(c for c in chosen if c not in drop)
        removed = total_score(dataclasses.replace(problem, H=H), drop)
        old_columns = sum(len(problem.candidates[c].columns) for c in drop)
        joints = set().union(*(problem.candidates[c].joints for c in drop))
        blocked = _conflicts(problem, rest)
        for i, c in enumerate(problem.candidates):
            if blocked[i] or i in drop or not joints & set(c.joints):
                continue
            richer = any(problem.candidates[d].slug in c.effect.contains for d in drop)
            simpler = any(c.slug in problem.candidates[d].effect.contains for d in drop)
            need = PREFER + hurdle[i] if richer or len(c.columns) > old_columns else 0.0
            gain = scores[i] - removed - need
            if simpler and len(drop) == 1:
                continue  # `_simplify` decides that
            if gain > best:
                best, best_move = gain, (*rest, i)
    return best_move


def _simplify(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...] | None:
    """Put a law's special case in its place where the difference is not clear."""
    hurdle = _hurdle(problem, chosen)
    for d in chosen:
        member = problem.candidates[d]
        H = problem.without(chosen, d)
        scores = problem.scores(H)
        own = total_score(dataclasses.replace(problem, H=H), (d,))
        for i, c in enumerate(problem.candidates):
            special = c.slug in member.effect.contains or (
                c.slug == member.slug and len(c.columns) < len(member.columns) and np.array_equal(c.shape, member.shape)
            )
            if special and c.joints == member.joints and own - scores[i] < PREFER + hurdle[d]:
                return (*(x for x in chosen if x != d), i)
    return None


def _remove(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...] | None:
    """Drop the member that is least needed, if it is not needed."""
    odds = []
    for d in chosen:
        rest = tuple(x for x in chosen if x != d)
        own = total_score(dataclasses.replace(problem, H=problem.without(chosen, d)), (d,))
        odds.append(own - _hurdle(problem, rest)[d])
    if not odds or min(odds) >= ACCEPT:
        return None
    weakest = chosen[int(np.argmin(odds))]
    return tuple(x for x in chosen if x != weakest)


def group_odds(problem: Problem, H: np.ndarray) -> dict[tuple[str, tuple[int, ...]], float]:
    """Best log odds of each effect at each site, over its shapes and variants."""
    odds: dict[tuple[str, tuple[int, ...]], float] = {}
    for score, c in zip(problem.scores(H), problem.candidates, strict=True):
        key = (c.slug, c.joints)
        odds[key] = max(odds.get(key, -np.inf), float(score))
    return odds
