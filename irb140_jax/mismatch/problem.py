"""What a search needs of the data: the odds of any set of candidates, from Gram matrices alone."""

import dataclasses
from collections import defaultdict
from collections.abc import Collection, Iterable
from functools import cached_property

import numpy as np

from irb140_jax.mismatch.beside import Beside
from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.evidence import Layout, gain_of, gains, half_of, posterior

UNSURE = 1e-3  # of a joint's torque: what smoothing and control in steps make late, however exact the log
REMEMBERED = 512  # scores: what puts in, exchanges, simplifies and removes asks for the same ones in turn
LEAST_SHARE = 0.005  # of its joint's torque: what has no name must matter, or it would choose among those that have one


@dataclasses.dataclass(frozen=True)
class Neighbourhood:
    """Some candidates: which, their columns in the Gram matrix, and groups numbered within those.

    Attributes:
        which: Candidates.
        columns: Their columns.
        groups: Candidates with equally many columns, numbered among these.
        gram: Gram matrix of these columns and y.
        own: Gram matrices of each candidate's own columns at each joint, per group, shape (n, members, k, k).
    """

    which: np.ndarray
    columns: np.ndarray
    groups: tuple[Layout, ...]
    gram: np.ndarray
    own: list[np.ndarray]


@dataclasses.dataclass(frozen=True)
class Problem:
    """Everything the search needs; no data, only Gram matrices.

    Attributes:
        H: Gram matrix over [nuisances | amplitudes | y], nuisances eliminated, shape (K + 1, K + 1).
        per_joint: Gram matrices of each joint's rows before elimination, shape (n, K + 1, K + 1).
        torque_energy: Squared whitened logged torque of each recording (one stretch) and joint, shape (recordings, n).
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
    def beside(self) -> Beside:
        """Which candidates can't stand beside each other."""
        return Beside(self.candidates)

    @cached_property
    def motions(self) -> np.ndarray:
        """How many recordings, by their torque, each joint's evidence comes from, shape (n,)."""
        total = self.torque_energy.sum(axis=0)
        return 1.0 / np.sum((self.torque_energy / total) ** 2, axis=0)

    def parts(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Part of the squared whitened torque at each joint, of candidates on several joints as they fit beside a set.

        Shape (n, candidates); one for those on a joint alone.
        """
        near, parts = self._on_several, self.at_joint.astype(float)
        if len(near.which):
            energy = self._energy(near, self._gains(near, chosen)[1])[:, near.which]
            parts[:, near.which] = energy / np.maximum(energy.sum(axis=0), 1e-300)
        return parts

    @cached_property
    def _on_several(self) -> "Neighbourhood":
        return self._numbered(np.flatnonzero(self.at_joint.sum(axis=0) > 1))

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
        key = chosen, frozenset(joints) if joints is not None else None
        if key not in self._scores:
            if len(self._scores) >= REMEMBERED:
                self._scores.pop(next(iter(self._scores)))
            self._scores[key] = self._scored(chosen, self.neighbourhood(key[1]))
            self._scores[key].setflags(write=False)
        return self._scores[key]

    @cached_property
    def _scores(self) -> dict[tuple[tuple[int, ...], frozenset[int] | None], np.ndarray]:
        return {}

    def _scored(self, chosen: tuple[int, ...], near: "Neighbourhood") -> np.ndarray:
        gain, mean = self._gains(near, chosen)
        with np.errstate(invalid="ignore"):
            bad = np.any((mean < self.lowest - 1e-9) | (mean > self.highest + 1e-9), axis=1)
        bad |= np.nansum(mean * self.summed, axis=1) < self.least
        # Silent ones: the most that their torque is of a joint's.
        share = np.max(self._energy(self._silent, mean) / self.torque_energy.sum(axis=0)[:, None], axis=0)
        bad[self._silent.which] |= share[self._silent.which] < LEAST_SHARE**2
        return np.where(bad, -np.inf, gain + self.log_prior)

    def _gains(self, near: "Neighbourhood", chosen: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Log evidence and amplitudes of some candidates beside a set, as by `evidence.gains`."""
        index, c = np.append(near.columns, self.H.shape[0] - 1), self.columns(chosen)
        half = half_of(self.H, c, index) if len(c) else None
        return gains(near.gram, near.groups, len(self.candidates), self.lowest.shape[1], half)

    def eliminated_near(self, chosen: tuple[int, ...], columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some columns and y, with a set eliminated."""
        index = np.append(columns, self.H.shape[0] - 1)
        H = self.H[np.ix_(index, index)]
        c = self.columns(chosen)
        if len(c) == 0:
            return H
        half = half_of(self.H, c, index)
        return H - half.T @ half

    def neighbourhood(self, joints: frozenset[int] | None) -> "Neighbourhood":
        """Candidates that touch some joints, with their columns numbered among themselves."""
        if joints not in self._neighbourhoods:
            which = np.arange(len(self.candidates))
            if joints is not None:
                which = np.flatnonzero(self.at_joint[sorted(joints)].reshape(len(joints), -1).any(axis=0))
            self._neighbourhoods[joints] = self._numbered(which)
        return self._neighbourhoods[joints]

    def _numbered(self, which: np.ndarray) -> "Neighbourhood":
        """Some candidates with their columns numbered among themselves."""
        columns = np.unique(np.concatenate([np.zeros(0, int), *(self.candidates[i].columns for i in which)]))
        number = {int(c): k for k, c in enumerate(columns)}
        groups: dict[int, list[int]] = defaultdict(list)
        for i in which:
            groups[len(self.candidates[i].columns)].append(int(i))
        local = lambda i: [number[int(c)] for c in self.candidates[i].columns]  # noqa: E731
        layout = tuple(Layout(np.array(m), np.array([local(i) for i in m])) for m in groups.values())
        columns = columns + self.offset
        index = np.append(columns, self.H.shape[0] - 1)
        at = [columns[g.columns] for g in layout]
        own = [self.per_joint[:, i[:, :, None], i[:, None, :]] for i in at]
        return Neighbourhood(which, columns, layout, self.H[np.ix_(index, index)], own)

    @cached_property
    def _neighbourhoods(self) -> dict[frozenset[int] | None, "Neighbourhood"]:
        return {}

    @cached_property
    def _silent(self) -> "Neighbourhood":
        return self._numbered(np.flatnonzero([c.effect.silent for c in self.candidates]))

    def _energy(self, near: "Neighbourhood", mean: np.ndarray) -> np.ndarray:
        """Squared whitened torque of candidates with these amplitudes at each joint, shape (n, candidates)."""
        energy = np.zeros((len(self.per_joint), len(self.candidates)))
        for g, G in zip(near.groups, near.own, strict=True):
            v = np.nan_to_num(mean[g.which, : g.columns.shape[1]])
            energy[:, g.which] = np.einsum("ik,jikl,il->ji", v, G, v)
        return energy

    def odds(self, rest: tuple[int, ...], chosen: Iterable[int]) -> float:
        """Log posterior odds of adding some candidates to a set."""
        chosen = tuple(chosen)
        if not chosen:
            return 0.0
        columns = self.columns(chosen)
        H = self.eliminated_near(rest, columns)
        return gain_of(H, np.arange(len(columns))) + float(sum(self.log_prior[c] for c in chosen))

    def feigned(self, chosen: tuple[int, ...], odds: np.ndarray | float) -> np.ndarray:
        """Part of each candidate's log odds that imperfect laws of a set could feign, shape (len(candidates),).

        Friction is feigned by friction: what tilts, weighs or springs does not turn with the direction of motion.  What
        acts on several joints may be feigned at each, for reversals that encoders do not see are late at all of them;
        but no more at a joint than comes from there.  What is `UNSURE` of the torque may feign lateness or a push.

        Args:
            chosen: The set.
            odds: Log odds of each candidate, or of all.
        """
        if chosen not in self._last:
            shares = np.array([c.effect.feigned**2 for c in self.candidates])
            by_friction, by_all = (self.explained(chosen, friction=f)[:, None] for f in (True, False))
            most = np.where(self.at_joint, shares * np.where(self.friction, by_friction, by_all), 0.0) + self._unsure
            self._last.clear()  # a search asks for the same set many times, and then for another
            self._last[chosen] = most, self.parts(chosen)
        most, parts = self._last[chosen]
        alone = self.at_joint.sum(axis=0) == 1
        return np.where(alone, most, np.minimum(most, np.maximum(odds, 0.0) * parts)).sum(axis=0)

    @cached_property
    def _unsure(self) -> np.ndarray:
        """Half the whitened square of `UNSURE` of the torque at each joint of what is late or happens once.

        Of the torque of the recording in which it happens: others may have far less noise.  Shape (n, candidates).
        """
        felt = np.where(self._late, self.torque_energy.sum(axis=0)[:, None], 0.0)
        for i, c in enumerate(self.candidates):
            if c.effect.once:
                felt[:, i] = self.torque_energy[c.effect.during(c.shape)[0]]
        return 0.5 * UNSURE**2 * felt * self.at_joint

    @cached_property
    def friction(self) -> np.ndarray:
        """Which candidates are laws of friction, shape (len(candidates),)."""
        return np.array([c.effect.friction for c in self.candidates], dtype=bool)

    @cached_property
    def _late(self) -> np.ndarray:
        """Which candidates put the log out of time, shape (len(candidates),)."""
        return np.array([c.effect.logged > 1 for c in self.candidates])

    @cached_property
    def imitated(self) -> np.ndarray:
        """How far up to `UNSURE` of the torque moves the amplitude of what is late, shape (len(candidates),).

        In standard deviations of white noise; anything up to it is equally likely.  Of what isn't late 0.
        """
        square = np.diagonal(self.per_joint, axis1=1, axis2=2)
        felt = np.stack([square[:, c.columns + self.offset].sum(axis=1) for c in self.candidates], axis=1)
        felt = felt / np.maximum(felt.sum(axis=0), 1e-300)
        return UNSURE * np.sqrt(self.torque_energy.sum(axis=0) @ felt / 3.0) * self._late

    @cached_property
    def _last(self) -> dict[tuple[int, ...], tuple[np.ndarray, np.ndarray]]:
        return {}

    def explained(self, chosen: tuple[int, ...], *, friction: bool = False) -> np.ndarray:
        """Half the whitened squared torque that a set, or the friction in it, explains at each joint, shape (n,).

        Friction counts for one recording, on average: what its form errs by goes with warmth, load and motion, and
        resembles another law of friction in one recording by chance, not in all.  Whatever goes with position is the
        same in all.  A member counts as `AbstractEffect.coarse` as it is.
        """
        index = self.columns(chosen)
        if len(index) == 0:
            return np.zeros(len(self.per_joint))
        members = [self.candidates[c] for c in chosen]
        counted = [m.effect.coarse if m.effect.friction or not friction else 0.0 for m in members]
        counts = np.concatenate([np.full(len(m.columns), c) for m, c in zip(members, counted, strict=True)])
        v = counts * posterior(self.H, index).mean
        explained = np.einsum("i,jik,k->j", v, self.per_joint[:, index[:, None], index[None, :]], v)
        return 0.5 * explained / (self.motions if friction else 1.0)


def best_of_groups(problem: Problem, chosen: tuple[int, ...]) -> dict[tuple[str, tuple[int, ...]], tuple[float, int]]:
    """Best log odds of adding each effect at each site to a set, over shapes and variants, and which one has them."""
    best: dict[tuple[str, tuple[int, ...]], tuple[float, int]] = {}
    for i, (score, c) in enumerate(zip(problem.scores(chosen).tolist(), problem.candidates, strict=True)):
        key = (c.slug, c.joints)
        if key not in best or score > best[key][0]:
            best[key] = score, i
    return best
