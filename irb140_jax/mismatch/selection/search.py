"""The search over sets of effects: reversible moves, each judged with sizes of the discrepancy fitted for that set."""

import itertools
from collections.abc import Callable, Iterable

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.hyperparameters import possible, settled
from irb140_jax.mismatch.selection.screening import gains

BEST = 3  # candidates of different kinds that a screening passes on to be judged in full
LEAST = 1e-2  # nats that a move must gain


class Search:
    """Sets visited so far with their log posterior, and the best of them.

    Args:
        space: What may be in a set.
        hyper: Where sizes and levels start.
        held: Effects that are in every set that the search goes to.
    """

    def __init__(self, space: Space, hyper: Hyper, held: frozenset[Site] = frozenset()):
        self.space, self.start, self.held = space, hyper, held
        whole = lambda joints: 1 < len(joints) == len(space.joints)  # noqa: E731
        self._sites = [[i for i, c in enumerate(space.candidates) if j in c.joints and not whole(c.joints)]
                       for j in range(len(space.joints))]  # fmt: skip
        # A zero is one joint's, and moves the torque of all: it is at its joint, and of the whole arm.
        self._sites.append([i for i in range(len(space.candidates)) if whole(space.reach(i))])
        # What sizes of the discrepancy fitted anew may gain: the range of its features' prior volume.
        features = max(int(np.sum(g.groups >= 0)) for g in space.joints)
        self._refitting = features * np.log(settings.DISCREPANCY_SIZES[-1] / settings.DISCREPANCY_SIZES[1])
        self.visited: dict[frozenset[int], tuple[float, Hyper]] = {}
        self._screened: dict[tuple[int, frozenset[int]], list[tuple[float, int]]] = {}
        self._in_vain: dict[tuple[tuple[int, ...], frozenset[int]], frozenset[int]] = {}

    def judged(self, chosen: Iterable[int], hyper: Hyper, joints: Iterable[int] | None = None) -> float:
        """Log posterior of a set, its hyperparameters fitted from some near ones."""
        key = frozenset(chosen)
        if key not in self.visited:
            at = sorted(set(joints)) if joints is not None else None
            self.visited[key] = settled(self.space, tuple(sorted(key)), hyper, at)
        return self.visited[key][0]

    def run(self, chosen: Iterable[int] = (), *, every_move: bool = True) -> tuple[int, ...]:
        """The best set that no move improves, from a set or from ordinary friction at all joints.

        Args:
            chosen: Where it starts.
            every_move: Whether to try more than to add and to remove.
        """
        now = frozenset(chosen or (i for i, c in enumerate(self.space.candidates) if c.effect.prior.ordinary))
        self.judged(now, self.start)
        moves: tuple[Callable[[frozenset[int]], frozenset[int]], ...] = (
            self._added, self._removed, self._exchanged, self._on_all_joints, self._ordinary,
        )[: None if every_move else 2]  # fmt: skip
        while True:
            before, moving = now, True
            while moving:
                moving = False
                for move in moves:
                    while (better := move(now)) != now:
                        now, moving = better, True
                        self.visited[now] = settled(self.space, tuple(sorted(now)), self.visited[now][1])
            # What was tried in vain beside other sets at other joints counts in the averages beside this one.
            self._in_vain = {drop: beside for drop, beside in self._in_vain.items() if beside == now}
            self._screened.clear()
            if now == before:
                return tuple(sorted(now))

    def holds(self, chosen: frozenset[int]) -> bool:
        """Whether a set has what has to be in every one."""
        return not self.held or self.held <= {site_of(self._of(i)) for i in chosen}

    def _value(self, chosen: frozenset[int]) -> float:
        return self.visited[chosen][0]

    def _best(
        self, now: frozenset[int], others: Iterable[tuple[frozenset[int], Iterable[int] | None]]
    ) -> frozenset[int]:
        """The best of some sets if it improves on a set, else that set."""
        hyper, best = self.visited[now][1], now
        for other, joints in others:
            other = self._possible(other, hyper, joints)
            if self.holds(other) and self._value(other) > self._value(best) + (LEAST if best == now else 0.0):
                best = other
        return best

    def _possible(
        self, chosen: frozenset[int], hyper: Hyper, joints: Iterable[int] | None
    ) -> frozenset[int]:
        """A set, judged, with other shapes of members whose amplitudes can't be at theirs, or without those members."""

        def judge(members: tuple[int, ...]) -> tuple[float, Hyper]:
            self.judged(members, hyper, joints)
            return self.visited[frozenset(members)]

        return frozenset(possible(self.space, tuple(sorted(chosen)), judge, fewer=True))

    def screened(
        self, chosen: frozenset[int], joint: int, most: int | None = BEST, least: float = -np.inf
    ) -> list[int]:
        """The most promising candidates at a joint beside a set, the best of each kind and site.

        Args:
            chosen: The set.
            joint: Its number; the one after the last joint's stands for effects of the whole arm.
            most: How many; all where None.
            least: Log posterior that they must be able to reach with sizes fitted anew.
        """
        bad, within = self.space.conflicts(tuple(chosen)), least - self._refitting
        return [i for v, i in self._scored(chosen, joint) if v > within and not bad[i] and i not in chosen][:most]

    def _scored(self, chosen: frozenset[int], joint: int) -> list[tuple[float, int]]:
        """Log posterior of a set with each kind of candidate at a joint, best first, and the candidate.

        By the set's own hyperparameters or by those with less discrepancy and noise, whichever makes more of them.
        """
        near = frozenset(m for m in chosen if joint in self.space.reach(m))
        if (joint, near) not in self._screened or joint == len(self.space.joints):
            self._screened[joint, near] = self._scored_anew(chosen, joint)
        return self._screened[joint, near]

    def _scored_anew(self, chosen: frozenset[int], joint: int) -> list[tuple[float, int]]:
        space, hyper = self.space, self.visited[chosen][1]
        bad = space.conflicts(tuple(chosen))
        which = np.array([i for i in self._sites[joint] if not bad[i] and i not in chosen], dtype=int)
        if not len(which):
            return []
        best = np.full(len(which), -np.inf)
        joints = [joint] if joint < len(space.joints) else range(len(space.joints))
        lower = tuple(
            ((*(max(k - 2, 0) for k in own[:-1]), max(own[-1] - 2, space.joints[j].lowest)) if j in joints else own)
            for j, own in enumerate(hyper)
        )
        lowest = tuple(
            ((*(min(k, 1) for k in own[:-1]), max(own[-1] - 6, space.joints[j].lowest)) if j in joints else own)
            for j, own in enumerate(hyper)
        )
        for trial in dict.fromkeys((hyper, lower, lowest)):
            base = space.log_evidence(tuple(chosen), trial)
            if np.isfinite(base):
                best = np.maximum(best, base + gains(space, tuple(chosen), trial, which))
        kinds: dict[tuple[str, tuple[int, ...]], tuple[float, int]] = {}
        for k in np.argsort(-best):
            c = space.candidates[which[k]]
            if np.isfinite(best[k]):
                kinds.setdefault((c.slug, c.joints), (float(best[k]), int(which[k])))
        return list(kinds.values())

    def _joints(self, *members: int) -> set[int]:
        return {j for m in members for j in self.space.reach(m)}

    def _added(self, now: frozenset[int]) -> frozenset[int]:
        """One more; where none is worth it, the best effect of the whole arm with another that shows beside it."""
        # What acts on the whole arm may lower the noise of some joints only, which no trial of all of them shows.
        least, whole = self._value(now), self.screened(now, len(self.space.joints), None, self._value(now))
        tries = {i for j in range(len(self.space.joints)) for i in self.screened(now, j, 2, least)}
        better = self._best(now, ((now | {i}, self._joints(i)) for i in sorted({*tries, *whole})))
        if better != now or not whole:
            return better
        # Beside a push that is not named all else drowns, and with it the reason to name the push.
        best = max(whole, key=lambda i: self._value(now | {i}))
        one = now | {best}
        if not np.isfinite(self._value(one)):
            return now
        more = {i for j in range(len(self.space.joints)) for i in self.screened(one, j, 1, least)}
        return self._best(now, ((one | {i}, self._joints(best, i)) for i in more))

    def _removed(self, now: frozenset[int]) -> frozenset[int]:
        fewer, hyper = [(now - {c}, self._joints(c)) for c in now], self.visited[now][1]
        for rest, joints in fewer:
            # Judged from other sizes it may have stopped at worse ones: a member that moves nothing would look better.
            members = tuple(sorted(rest))
            if rest in self.visited and self.space.log_evidence(members, hyper) > self._value(rest):
                self.visited[rest] = settled(self.space, members, hyper, sorted(joints))
        return self._best(now, fewer)

    def _exchanged(self, now: frozenset[int]) -> frozenset[int]:
        """One or two members at a joint for one or two others there."""
        space = self.space
        for drop in [*((c,) for c in now), *self._pairs(now)]:
            rest, joints = now - set(drop), self._joints(*drop)
            shared = set[int].intersection(*(self._joints(m) for m in drop))
            beside = drop, frozenset(m for m in now if self._joints(m) & joints)
            if beside in self._in_vain:
                continue
            self.judged(rest, self.visited[now][1], joints)
            others: list[tuple[frozenset[int], set[int]]] = []
            bad = space.conflicts(tuple(rest))
            special = [i for i in self._special(drop) if not bad[i]]
            others += [(rest | {i}, joints | self._joints(i)) for i in special]
            others += [(rest | set(p), joints) for p in itertools.combinations(special, 2) if self._together(*p)]
            # What acts on the whole arm takes the place of its like here; of a law on each joint in `_on_all_joints`.
            whole = [len(space.joints)] if len(joints) == len(space.joints) else []
            for j in (*sorted(shared), *whole):
                for i in self.screened(rest, j, least=self._value(now)):
                    one = rest | {i}
                    others.append((one, joints | self._joints(i)))
                    self.judged(one, self.visited[rest][1], joints | self._joints(i))
                    more = self.screened(one, j, 1, self._value(now))
                    others += [(one | {k}, joints | self._joints(i, k)) for k in more]
            # Alone it may also be what a single member is.
            if len(drop) == 1 and not whole:
                arm = self.screened(rest, len(space.joints), 1, self._value(now))
                others += [(rest | {i}, joints | self._joints(i)) for i in arm]
            if (better := self._best(now, others)) != now:
                return better
            self._in_vain[beside] = now
        return now

    def _special(self, members: tuple[int, ...]) -> list[int]:
        """Special cases of laws, the same laws with other terms, and ordinary friction in the place of any friction.

        A payload and the inertials of its link stand in each other's place, too.
        """
        out = set[int]()
        for law in map(self._of, members):
            for i, c in enumerate(self.space.candidates):
                if self.space.beside.one_body(law, c):
                    out.add(i)
                if c.joints == law.joints and i not in members:
                    usual = law.effect.place.is_friction and c.effect.prior.ordinary
                    terms = c.slug == law.slug and c.variant != law.variant and np.array_equal(c.shape, law.shape)
                    out |= {i} if usual or terms or c.slug in law.effect.law.contains else set()
        return sorted(out)

    def _together(self, one: int, other: int) -> bool:
        """Whether two candidates can stand side by side."""
        return not self.space.conflicts((one,))[other]

    def _pairs(self, now: frozenset[int]) -> list[tuple[int, int]]:
        """Members at a common joint, and wrong zeros of any two; not a zero with the friction of another joint."""
        own = {m: set(self._of(m).joints) for m in now}
        zeros = {m for m in now if own[m] < self._joints(m)}
        return [p for p in itertools.combinations(sorted(now), 2) if own[p[0]] & own[p[1]] or {*p} <= zeros]

    def _on_all_joints(self, now: frozenset[int]) -> frozenset[int]:
        """A kind on every joint at once; another, or one effect of all joints, in the place of all of a kind."""
        space = self.space
        tries: list[tuple[frozenset[int], None]] = []
        kinds = [c.slug for c in map(self._of, now) if len(c.joints) == 1 and not c.effect.prior.ordinary]
        for slug in dict.fromkeys(kinds):
            scored = [self._scored_anew(now, j) for j in range(len(space.joints))]
            each = [next((i for _, i in at if self._of(i).slug == slug), None) for at in scored]
            tries.append((now | {i for i in each if i is not None}, None))
        for slug in dict.fromkeys(k for k in kinds if kinds.count(k) > 1):
            rest = frozenset(m for m in now if self._of(m).slug != slug)
            without = self.judged(rest, self.visited[now][1])
            gained: dict[str, dict[int, tuple[float, int]]] = {}
            for j in range(len(self._sites)):
                for value, i in self._scored_anew(rest, j):
                    place = j if len(self._of(i).joints) == 1 else -1
                    best = gained.setdefault(self._of(i).slug, {})
                    best[place] = max(best.get(place, (0.0, i)), (value - without, i))
            promise = {k: sum(max(g, 0.0) for g, _ in sites.values()) for k, sites in gained.items() if k != slug}
            for kind in sorted(promise, key=lambda k: -promise[k])[:BEST]:
                tries.append((rest | {i for g, i in gained[kind].values() if g > 0.0}, None))
        return self._best(now, tries)

    def _ordinary(self, now: frozenset[int]) -> frozenset[int]:
        """Ordinary friction for all friction of a joint."""
        tries = []
        for j in range(len(self.space.joints)):
            rubs = {m for m in now if self._of(m).effect.place.is_friction and self._of(m).joints == (j,)}
            usual = {i for i in self._sites[j] if self._of(i).effect.prior.ordinary and self._of(i).joints == (j,)}
            tries += [(now - rubs | usual, [j]), *((now - rubs | {i}, [j]) for i in usual)]
        return self._best(now, tries)

    def _of(self, member: int) -> Candidate:
        return self.space.candidates[member]
