"""Which physics, out of the library, explains the mismatch: a search over sets of candidates by their evidence."""

import itertools
from collections import defaultdict

import numpy as np

from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.problem import Problem

ACCEPT = np.log(100.0)  # posterior odds a finding needs; under the null, a bound of 1 % on a false one (Markov)
PREFER = np.log(20.0)  # odds at which a law replaces the simpler one that it contains
MOST = 40  # effects at most in one set


def search(problem: Problem, start: tuple[int, ...] = ()) -> tuple[int, ...]:
    """The set of candidates with the best posterior odds that simpler sets do not match.

    Forward steps, each followed by exchanges (one or two members for one), simplifications and removals among the
    joints it touched, and at the end among all, until nothing improves.
    """
    chosen = _settled(problem, start)
    for _ in range(3):
        settled = _joined(problem, _split(problem, guessed(problem, chosen)))
        if set(settled) == set(chosen):
            break
        chosen = settled
    return chosen


def guessed(problem: Problem, start: tuple[int, ...] = ()) -> tuple[int, ...]:
    """A set found by forward steps and what settles them: enough to see what noise there may be."""
    return _settled(problem, _grown(problem, start))


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
    """Put one effect that acts on several joints in the place of one kind on each of them, where it explains more.

    It may take the place of another such effect as well: a delay that is wrong is made up for by lags.  And it may take
    from each only what goes beyond a special case: a lean of the base makes friction seem asymmetric everywhere.
    """
    everywhere = np.array([len(c.joints) > 1 for c in problem.candidates])
    kinds = defaultdict(list)
    for c in chosen:
        if not everywhere[c] and not problem.candidates[c].effect.ordinary:
            kinds[problem.candidates[c].slug].append(c)
    for alike in kinds.values():
        if len(alike) < 2:
            continue
        for more in [(), *((c,) for c in chosen if everywhere[c])]:
            old = (*alike, *more)
            rest = tuple(c for c in chosen if c not in old)
            already = problem.odds(rest, old) - len(old) * ACCEPT
            for kept in {(), _special(problem, rest, alike)}:
                others = (*rest, *kept)
                scores = np.where(everywhere & ~problem.beside.conflicts(others), problem.scores(others), -np.inf)
                best = int(np.argmax(scores))
                if problem.odds(rest, kept) + scores[best] - (len(kept) + 1) * ACCEPT > already:
                    return _settled(problem, (*others, best))
    return chosen


def _special(problem: Problem, rest: tuple[int, ...], alike: list[int]) -> tuple[int, ...]:
    """The best special case of each of some members, beside others."""
    best = []
    for d in alike:
        options = [o for o in possible_beside(problem, rest, simpler(problem, d, ordinary=False)) if o[0] not in rest]
        best += [max(options, key=lambda o: problem.odds(rest, o))] if options else []
    return tuple(i for option in best for i in option)


def _grown(problem: Problem, chosen: tuple[int, ...], banned: frozenset[int] = frozenset()) -> tuple[int, ...]:
    """Add the best candidate, settle around it, and again, until none is worth adding."""
    seen = {frozenset(chosen)}
    while len(chosen) < MOST:
        scores = problem.scores(chosen) + problem.entry
        scores = scores - problem.feigned(chosen, scores) - ACCEPT
        scores[[*chosen, *banned]] = -np.inf
        scores = np.where(problem.beside.conflicts(chosen), -np.inf, scores)
        best = int(np.argmax(scores))
        if scores[best] <= 0:
            break
        c = problem.candidates[best]
        grown = _settled(problem, (*chosen, best), set(c.joints), banned)
        if frozenset(grown) in seen:
            # Adding and settling undo each other: no shape of it gets any further.
            banned |= frozenset(i for i, o in enumerate(problem.candidates) if (o.slug, o.joints) == (c.slug, c.joints))
            continue
        chosen = grown
        seen.add(frozenset(chosen))
    return chosen


def possible_beside(problem: Problem, chosen: tuple[int, ...], options: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Those of some sets that can stand beside another."""
    if not options:
        return []
    bad = problem.beside.conflicts(chosen)
    return [o for o in options if not bad[list(o)].any()]


def _settled(
    problem: Problem, chosen: tuple[int, ...], joints: set[int] | None = None, banned: frozenset[int] = frozenset()
) -> tuple[int, ...]:
    """Exchange, simplify and remove until nothing improves, among the members at some joints or all."""
    seen = {frozenset(chosen)}
    while True:
        near = tuple(c for c in chosen if joints is None or joints & set(problem.candidates[c].joints))
        changed = (
            _exchange(problem, chosen, near, banned)
            or _simplify(problem, chosen, near)
            or _remove(problem, chosen, near)
        )
        if changed is None:
            return chosen
        chosen = changed
        if frozenset(chosen) in seen:
            return chosen  # what one rule puts in, another takes out
        seen.add(frozenset(chosen))


def _exchange(
    problem: Problem, chosen: tuple[int, ...], near: tuple[int, ...], banned: frozenset[int]
) -> tuple[int, ...] | None:
    """The best replacement of one or two members by one candidate that shares a joint with them."""
    best, best_move = 1e-6, None
    pairs = [p for p in itertools.combinations(near, 2)
             if problem.candidates[p[0]].joints == problem.candidates[p[1]].joints]  # fmt: skip
    for drop in [*((c,) for c in near), *pairs]:
        rest = tuple(c for c in chosen if c not in drop)
        old = [problem.candidates[c] for c in drop]
        own, already = problem.scores(rest, {j for c in old for j in c.joints}), problem.odds(rest, drop)
        scores = own - already
        scores[problem.beside.conflicts(rest)] = -np.inf
        scores[[*drop, *banned]] = -np.inf
        if not (scores > best).any():
            continue
        hurdle = problem.feigned(chosen, scores)
        if len(drop) == 1 and not old[0].effect.friction:
            # What goes feigns nothing any more, and had to take such a hurdle itself.
            lower = np.maximum(problem.feigned(rest, own) - problem.feigned(rest, already)[drop[0]], 0.0)
            hurdle = np.where(problem.friction, hurdle, lower)
        for i in np.flatnonzero(scores > best):
            c = problem.candidates[i]
            if len(drop) == 1 and c.slug in old[0].effect.contains:
                continue  # `_simplify` decides that
            same = len(drop) == 1 and (c.slug, c.joints) == (old[0].slug, old[0].joints)
            more = _size(c) > sum(_size(o) for o in old) and not (same or all(o.effect.silent for o in old))
            rarer = all(o.effect.ordinary for o in old) and not c.effect.ordinary
            # More parameters, or a rarer law in the place of ordinary friction, must be clearly better; not the same
            # law with more columns: its name is not in question, and what it lacks makes its other parameters wrong.
            gain = scores[i] - (PREFER + hurdle[i] if more or rarer else 0.0)
            if gain > best:
                best, best_move = gain, (*rest, int(i))
    return best_move


def _simplify(problem: Problem, chosen: tuple[int, ...], near: tuple[int, ...]) -> tuple[int, ...] | None:
    """Put special cases or ordinary friction in the place of a law where the difference is not clear."""
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
        more = problem.odds(rest, (d,)) - odds[best]
        if more < PREFER + problem.feigned(chosen, more)[d]:
            return (*rest, *best)
    return None


def simpler(problem: Problem, d: int, *, ordinary: bool = True) -> list[tuple[int, ...]]:
    """What could stand for a law: its special cases, or (unless not asked for) ordinary friction, no more of it."""
    member = problem.candidates[d]
    if member.effect.ordinary:
        return []
    at_site = [(i, c) for i, c in enumerate(problem.candidates) if c.joints == member.joints]
    special: list[tuple[int, ...]] = [(i,) for i, c in at_site if c.slug in member.effect.contains]
    if not (member.effect.friction and ordinary):
        return special
    usual = tuple(i for i, c in at_site if c.effect.ordinary)
    one = [(i,) for i in usual if (i,) not in special]
    return [*special, *one, *([usual] if 1 < len(usual) <= _size(member) else [])]


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
        own = problem.odds(rest, (d,)) + problem.entry[d]
        odds[d] = own - problem.feigned(rest, own)[d] if fits else -np.inf
    if not odds or min(odds.values()) >= ACCEPT:
        return None
    weakest = min(odds, key=lambda d: odds[d])
    return tuple(x for x in chosen if x != weakest)
