"""Which physics, out of the library, explains the mismatch: a search over sets of candidates by their evidence."""

import dataclasses
import itertools
from collections import defaultdict
from collections.abc import Collection, Iterable
from functools import cached_property

import numpy as np

from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.evidence import Layout, gain_of, gains, layouts, posterior, with_prior

ACCEPT = np.log(100.0)  # posterior odds a finding needs; under the null, a bound of 1 % on a false one (Markov)
PREFER = np.log(20.0)  # odds at which a law replaces the simpler one that it contains
LEAST_SHARE = 0.005  # an effect below this share of its joint's torque is within what smoothing and geometry feign
MOST = 40  # effects at most in one set


@dataclasses.dataclass(frozen=True)
class Neighbourhood:
    """Candidates near some joints: which, their columns in the Gram matrix, and groups numbered within those."""

    which: np.ndarray
    columns: np.ndarray
    groups: tuple[Layout, ...]


@dataclasses.dataclass(frozen=True)
class Problem:
    """Everything the search needs; no data, only Gram matrices.

    Attributes:
        H: Gram matrix over [nuisances | amplitudes | y], nuisances eliminated, shape (K + 1, K + 1).
        per_joint: Gram matrices of each joint's rows before elimination, shape (n, K + 1, K + 1).
        torque_energy: Squared whitened logged torque of each joint, shape (n,).
        candidates: What may be in the set.
        offset: Column of the first amplitude.
        log_prior: Log prior odds of each candidate beside its rivals, shape (len(candidates),).
        entry: Log odds that a candidate lacks to enter where nothing was: ordinary effects are likely rivals of others,
            but no likelier to be found by chance.
        lowest, highest: Admissible amplitudes in prior units, per candidate, padded with -inf and inf.
        summed, least: Weights of the amplitudes in a sum that is bounded from below, and its bound, per candidate.
    """

    H: np.ndarray
    per_joint: np.ndarray
    torque_energy: np.ndarray
    candidates: tuple[Candidate, ...]
    offset: int
    log_prior: np.ndarray
    entry: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    summed: np.ndarray
    least: np.ndarray

    def columns(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Columns of H that a set uses."""
        parts = [self.candidates[c].columns + self.offset for c in chosen]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=int)

    @cached_property
    def groups(self) -> tuple[Layout, ...]:
        """All candidates, in groups of equal size."""
        return layouts(self.candidates, self.offset)

    @cached_property
    def at_joint(self) -> np.ndarray:
        """Which candidates touch which joint, shape (n, candidates)."""
        touches = np.zeros((len(self.per_joint), len(self.candidates)), dtype=bool)
        for i, c in enumerate(self.candidates):
            touches[list(c.joints), i] = True
        return touches

    def scores(self, chosen: tuple[int, ...], joints: Collection[int] | None = None) -> np.ndarray:
        """Log posterior odds of adding each candidate to a set; -inf where its amplitudes would be inadmissible.

        Args:
            chosen: The set.
            joints: Only candidates that touch these joints, -inf for the rest; all by default.
        """
        near = self.neighbourhood(frozenset(joints) if joints is not None else None)
        H = self.eliminated_near(chosen, near.columns)
        gain, mean = gains(H, near.groups, len(self.candidates), self.lowest.shape[1])
        with np.errstate(invalid="ignore"):
            bad = np.any((mean < self.lowest - 1e-9) | (mean > self.highest + 1e-9), axis=1)
        bad |= np.nansum(mean * self.summed, axis=1) < self.least
        return np.where(bad | (self._share(mean) < LEAST_SHARE), -np.inf, gain + self.log_prior)

    def eliminated_near(self, chosen: tuple[int, ...], columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some columns and y, with a set eliminated."""
        index = np.append(columns, self.H.shape[0] - 1)
        H = self.H[np.ix_(index, index)]
        c = self.columns(chosen)
        if len(c) == 0:
            return H
        half = np.linalg.solve(np.linalg.cholesky(with_prior(self.H[np.ix_(c, c)])), self.H[np.ix_(c, index)])
        return H - half.T @ half

    def neighbourhood(self, joints: frozenset[int] | None) -> "Neighbourhood":
        """Candidates that touch some joints, with their columns numbered among themselves."""
        if joints not in self._neighbourhoods:
            which = np.arange(len(self.candidates))
            if joints is not None:
                which = np.flatnonzero(self.at_joint[sorted(joints)].reshape(len(joints), -1).any(axis=0))
            columns = np.unique(np.concatenate([self.candidates[i].columns for i in which])) + self.offset
            number = {int(c): k for k, c in enumerate(columns)}
            groups: dict[int, list[int]] = defaultdict(list)
            for i in which:
                groups[len(self.candidates[i].columns)].append(int(i))
            local = lambda i: [number[int(c + self.offset)] for c in self.candidates[i].columns]  # noqa: E731
            layout = tuple(Layout(np.array(m), np.array([local(i) for i in m])) for m in groups.values())
            self._neighbourhoods[joints] = Neighbourhood(which, columns, layout)
        return self._neighbourhoods[joints]

    @cached_property
    def _neighbourhoods(self) -> dict[frozenset[int] | None, "Neighbourhood"]:
        return {}

    def _share(self, mean: np.ndarray) -> np.ndarray:
        """Torque of each candidate with these amplitudes, as a share of the torque of the joint it matters most to."""
        share = np.zeros(len(self.candidates))
        for g, G in zip(self.groups, self._own_grams, strict=True):
            k = g.columns.shape[1]
            v = np.nan_to_num(mean[g.which, :k])
            energy = np.einsum("ik,jikl,il->ji", v, G, v)
            share[g.which] = np.sqrt(np.max(energy / self.torque_energy[:, None], axis=0))
        return share

    @cached_property
    def _own_grams(self) -> list[np.ndarray]:
        """Gram matrix of each candidate's own columns at each joint, per group, shape (n, members, k, k)."""
        return [self.per_joint[:, g.columns[:, :, None], g.columns[:, None, :]] for g in self.groups]

    def odds(self, rest: tuple[int, ...], chosen: Iterable[int]) -> float:
        """Log posterior odds of adding some candidates to a set."""
        chosen = tuple(chosen)
        if not chosen:
            return 0.0
        columns = self.columns(chosen)
        H = self.eliminated_near(rest, columns)
        return gain_of(H, np.arange(len(columns))) + float(sum(self.log_prior[c] for c in chosen))

    def explained(self, chosen: tuple[int, ...], *, friction: bool = False) -> np.ndarray:
        """Half the whitened squared torque that a set, or the friction in it, explains at each joint, shape (n,)."""
        index = self.columns(chosen)
        if len(index) == 0:
            return np.zeros(len(self.per_joint))
        members = [self.candidates[c] for c in chosen]
        counts = np.concatenate([np.full(len(m.columns), m.effect.friction or not friction) for m in members])
        v = np.where(counts, posterior(self.H, index).mean, 0.0)
        explained = np.einsum("i,jik,k->j", v, self.per_joint[:, index[:, None], index[None, :]], v)
        return 0.5 * explained


def search(problem: Problem, start: tuple[int, ...] = ()) -> tuple[int, ...]:
    """The set of candidates with the best posterior odds that simpler sets do not match.

    Forward steps, each followed by exchanges (one or two members for one), simplifications and removals among the
    joints it touched, and at the end among all, until nothing improves.
    """
    chosen = _settled(problem, start)
    for _ in range(3):
        settled = _joined(problem, _split(problem, _settled(problem, _grown(problem, chosen))))
        if set(settled) == set(chosen):
            break
        chosen = settled
    return chosen


def _split(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...]:
    """Put several effects in the place of one that acts on several joints at once, where they explain more."""
    for d in chosen:
        joints = problem.candidates[d].joints
        if len(joints) < 2:
            continue
        banned = frozenset(
            i for i, c in enumerate(problem.candidates) if len(c.joints) > 1 and set(c.joints) & set(joints)
        )
        rest = tuple(c for c in chosen if c != d)
        other = _settled(problem, _grown(problem, rest, banned), set(joints), banned)
        both = tuple(set(rest) & set(other))
        new, old = (tuple(c for c in s if c not in both) for s in (other, chosen))
        if problem.odds(both, new) - len(new) * ACCEPT > problem.odds(both, old) - len(old) * ACCEPT:
            return other
    return chosen


def _joined(problem: Problem, chosen: tuple[int, ...]) -> tuple[int, ...]:
    """Put one effect that acts on several joints in the place of one kind on each of them, where it explains more."""
    everywhere = np.array([len(c.joints) > 1 for c in problem.candidates])
    kinds = defaultdict(list)
    for c in chosen:
        if not everywhere[c] and not problem.candidates[c].effect.ordinary:
            kinds[problem.candidates[c].slug].append(c)
    for alike in kinds.values():
        if len(alike) < 2:
            continue
        rest = tuple(c for c in chosen if c not in alike)
        scores = np.where(everywhere & ~conflicts(problem, rest), problem.scores(rest), -np.inf)
        best = int(np.argmax(scores))
        if scores[best] - ACCEPT > problem.odds(rest, alike) - len(alike) * ACCEPT:
            return _settled(problem, (*rest, best))
    return chosen


def _grown(problem: Problem, chosen: tuple[int, ...], banned: frozenset[int] = frozenset()) -> tuple[int, ...]:
    """Add the best candidate, settle around it, and again, until none is worth adding."""
    seen: set[frozenset[int]] = set()
    while len(chosen) < MOST:
        scores = problem.scores(chosen) + problem.entry - _hurdle(problem, chosen) - ACCEPT
        scores[[*chosen, *banned]] = -np.inf
        scores = np.where(conflicts(problem, chosen), -np.inf, scores)
        best = int(np.argmax(scores))
        if scores[best] <= 0:
            break
        chosen = _settled(problem, (*chosen, best), set(problem.candidates[best].joints), banned)
        if frozenset(chosen) in seen:
            break  # adding and settling undo each other
        seen.add(frozenset(chosen))
    return chosen


def _hurdle(problem: Problem, chosen: tuple[int, ...]) -> np.ndarray:
    """Log odds that imperfect laws of the set could feign for each candidate, at the joint where they are largest.

    Friction is feigned by friction: what tilts, weighs or springs does not turn with the direction of motion.
    """
    rubs = np.array([c.effect.friction for c in problem.candidates])
    by_friction, by_all = problem.explained(chosen, friction=True), problem.explained(chosen)
    explained = np.where(rubs, by_friction[:, None], by_all[:, None])
    explained = np.max(np.where(problem.at_joint, explained, 0.0), axis=0)
    return np.array([c.effect.feigned**2 for c in problem.candidates]) * explained


def conflicts(problem: Problem, chosen: tuple[int, ...]) -> np.ndarray:
    """Candidates that can't stand beside the set: the same effect at the site, or one that absorbs the other."""
    taken: dict[tuple[int, ...], set[str]] = defaultdict(set)
    absorbed: dict[tuple[int, ...], set[str]] = defaultdict(set)
    for c in (problem.candidates[i] for i in chosen):
        taken[c.joints].add(c.slug)
        absorbed[c.joints] |= _absorbed(c)
    return np.array([
        c.slug in taken[c.joints] | absorbed[c.joints] or bool(_absorbed(c) & taken[c.joints])
        for c in problem.candidates
    ])  # fmt: skip


def possible_beside(problem: Problem, chosen: tuple[int, ...], options: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Those of some sets that can stand beside another."""
    if not options:
        return []
    bad = conflicts(problem, chosen)
    return [o for o in options if not bad[list(o)].any()]


def _absorbed(c: Candidate) -> set[str]:
    return set(c.effect.contains) if c.effect.absorbs else set()


def _settled(
    problem: Problem, chosen: tuple[int, ...], joints: set[int] | None = None, banned: frozenset[int] = frozenset()
) -> tuple[int, ...]:
    """Exchange, simplify and remove until nothing improves, among the members at some joints or all."""
    for _ in range(30):
        near = tuple(c for c in chosen if joints is None or joints & set(problem.candidates[c].joints))
        changed = (
            _exchange(problem, chosen, near, banned)
            or _simplify(problem, chosen, near)
            or _remove(problem, chosen, near)
        )
        if changed is None:
            return chosen
        chosen = changed
    return chosen


def _exchange(
    problem: Problem, chosen: tuple[int, ...], near: tuple[int, ...], banned: frozenset[int]
) -> tuple[int, ...] | None:
    """The best replacement of one or two members by one candidate that shares a joint with them."""
    hurdle = _hurdle(problem, chosen)
    best, best_move = 1e-6, None
    pairs = [p for p in itertools.combinations(near, 2)
             if problem.candidates[p[0]].joints == problem.candidates[p[1]].joints]  # fmt: skip
    for drop in [*((c,) for c in near), *pairs]:
        rest = tuple(c for c in chosen if c not in drop)
        old = [problem.candidates[c] for c in drop]
        scores = problem.scores(rest, {j for c in old for j in c.joints}) - problem.odds(rest, drop)
        scores[conflicts(problem, rest)] = -np.inf
        scores[[*drop, *banned]] = -np.inf
        for i in np.flatnonzero(scores > best):
            c = problem.candidates[i]
            if len(drop) == 1 and c.slug in old[0].effect.contains:
                continue  # `_simplify` decides that
            more = _size(c) > sum(_size(o) for o in old)
            rarer = all(o.effect.ordinary for o in old) and not c.effect.ordinary
            # More parameters, or a rarer law in the place of ordinary friction, must be clearly better.
            gain = scores[i] - (PREFER + hurdle[i] if more or rarer else 0.0)
            if gain > best:
                best, best_move = gain, (*rest, int(i))
    return best_move


def _simplify(problem: Problem, chosen: tuple[int, ...], near: tuple[int, ...]) -> tuple[int, ...] | None:
    """Put special cases or ordinary friction in the place of a law where the difference is not clear."""
    hurdle = _hurdle(problem, chosen)
    for d in near:
        rest = tuple(x for x in chosen if x != d)
        options = possible_beside(problem, rest, simpler(problem, d))
        if not options:
            continue
        possible = np.isfinite(problem.scores(rest, problem.candidates[d].joints))
        odds = {o: problem.odds(rest, o) for o in options if possible[list(o)].all()}
        if not odds:
            continue
        best = max(odds, key=lambda o: odds[o])
        if problem.odds(rest, (d,)) - odds[best] < PREFER + hurdle[d]:
            return (*rest, *best)
    return None


def simpler(problem: Problem, d: int) -> list[tuple[int, ...]]:
    """What could stand for a law: its special cases, itself with fewer columns, or ordinary friction with as many."""
    member = problem.candidates[d]
    if member.effect.ordinary:
        return []
    at_site = [(i, c) for i, c in enumerate(problem.candidates) if c.joints == member.joints]
    fewer: list[tuple[int, ...]] = [
        (i,)
        for i, c in at_site
        if c.slug in member.effect.contains
        or (c.slug == member.slug and len(c.columns) < len(member.columns) and np.array_equal(c.shape, member.shape))
    ]
    ordinary = tuple(i for i, c in at_site if c.effect.ordinary)
    if member.effect.friction and 1 < len(ordinary) <= _size(member):
        fewer.append(ordinary)
    return fewer


def _size(c: Candidate) -> int:
    """Parameters of a candidate: amplitudes and shape."""
    return len(c.columns) + len(c.shape)


def _remove(problem: Problem, chosen: tuple[int, ...], near: tuple[int, ...]) -> tuple[int, ...] | None:
    """Drop the member that is least needed, if it is not needed."""
    odds = {}
    for d in near:
        rest = tuple(x for x in chosen if x != d)
        # The score knows what is admissible: what was so when it entered need not be so beside later members.
        fits = np.isfinite(problem.scores(rest, problem.candidates[d].joints)[d])
        odds[d] = problem.odds(rest, (d,)) + problem.entry[d] - _hurdle(problem, rest)[d] if fits else -np.inf
    if not odds or min(odds.values()) >= ACCEPT:
        return None
    weakest = min(odds, key=lambda d: odds[d])
    return tuple(x for x in chosen if x != weakest)


def group_odds(problem: Problem, chosen: tuple[int, ...]) -> dict[tuple[str, tuple[int, ...]], float]:
    """Best log odds of adding each effect at each site to a set, over its shapes and variants."""
    odds: dict[tuple[str, tuple[int, ...]], float] = {}
    for score, c in zip(problem.scores(chosen), problem.candidates, strict=True):
        key = (c.slug, c.joints)
        odds[key] = max(odds.get(key, -np.inf), float(score))
    return odds
