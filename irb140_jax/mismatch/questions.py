"""How much a motion would say about what a diagnosis left open, before it is played."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.along import prepared
from irb140_jax.mismatch.assemble import LOOSE_STD
from irb140_jax.mismatch.candidates import Library
from irb140_jax.mismatch.evidence import eliminated, gain_of, grams, posterior
from irb140_jax.mismatch.noise import Noise
from irb140_jax.mismatch.prior import inertial_prior_factor
from irb140_jax.mismatch.rows import stretch
from irb140_jax.mismatch.testable import played, stands_out
from irb140_jax.mismatch.undecided import Pair, Sets, Undecided
from irb140_jax.recordings.excite import Excitation
from irb140_jax.robot import Robot


class Questions:
    """The open questions of a diagnosis, ready to be put to motions.

    Gram matrices are over [inertials | loose links | amplitudes] in prior units, as in `Undecided`; those of pieces of
    motion add up.
    """

    def __init__(self, robot: Robot, open_: Undecided):
        self.open = open_
        self._robot, self._factor = robot, inertial_prior_factor(robot, 1.0)
        self._lib, self._order = _library(robot, open_)
        widths = [len(c.variant) for c in open_.columns]
        first = 10 * robot.n + 10 * len(open_.loose) + np.concatenate([[0], np.cumsum(widths)]).astype(int)
        self._columns = [np.arange(a, a + w) for a, w in zip(first, widths, strict=False)]
        self._always = np.arange(first[0])

    def gram(self, motion: Excitation, effort_share: float = np.inf) -> np.ndarray | None:
        """What recording a motion would add, shape (K, K); None where it needs too much torque.

        Args:
            motion: Sampled at the rate of `Undecided.band`.
            effort_share: Of the torque limits, that the nominal model may need.
        """
        o = self.open
        along = prepared(self._robot, played(motion, o.scales.rest_speed))
        if np.any(np.abs(along.nominal) > effort_share * np.asarray(self._robot.effort_limit)):
            return None
        rows = stretch(self._lib, along, 0, o.band, self._factor)
        theta = rows.X[..., : len(self._factor)]
        loose = [theta[..., 10 * k : 10 * k + 10] for k in o.loose]
        X = np.concatenate([theta, *loose, rows.X[..., len(self._factor) + self._order]], axis=-1)
        scale = np.concatenate(
            [np.full(len(self._factor), o.uncertainty), np.full(10 * len(o.loose), LOOSE_STD), o.scale]
        )
        noise = Noise(o.ar, o.level[None], o.level[None])
        return grams([dataclasses.replace(rows, X=X)], noise, scale, len(self._always), 1).total()[:-1, :-1]

    def margin(self, added: np.ndarray, pair: Pair) -> float:
        """Log odds expected in favour of the true one of two explanations, whichever is true, the worse of the two.

        The log that either predicts is added to the recordings there are; the other does with it what it can, with
        inertials, amplitudes and shapes free: half the divergence that T-optimal designs maximise.  What an imperfect
        law could feign (`feigned`) is taken off as if all were one recording, so that the motion convinces without the
        others' help; below zero, they stay even.

        Source: Atkinson and Fedorov, Biometrika 62(1), 1975; Lopez-Fidalgo, Tommasi, Trandafir, JRSS B 69(2), 2007.
        """
        named, rival = (pair.named, pair.named_sets), (pair.rival, pair.rival_sets)
        return min(self._odds_if_true(added, pair, *order) for order in ((named, rival), (rival, named)))

    def _odds_if_true(self, added: np.ndarray, pair: Pair, one: tuple[str, Sets], two: tuple[str, Sets]) -> float:
        (slug, true), (rival, other) = one, two
        rest = np.concatenate([self._always, *(self._columns[c] for c in pair.rest)])
        own = lambda s: np.concatenate([self._columns[c] for c in s])  # noqa: E731
        old, _ = eliminated(self.open.gram, rest)
        best = max(true, key=lambda s: gain_of(old, own(s)))
        columns = np.concatenate([rest, own(best)])
        w = posterior(self.open.gram, columns).mean
        H = self.open.gram.copy()
        H[:-1, :-1] += added
        told = added[:, columns] @ w
        H[:-1, -1] += told
        H[-1, :-1] += told
        left, _ = eliminated(H, rest)
        mean = posterior(left, own(best)).mean
        explained = 0.5 * float(mean @ H[np.ix_(own(best), own(best))] @ mean)
        feigned = max(CATALOGUE[s].feigned for s in (slug, rival)) ** 2 * explained
        # A special case stands until the law that contains it has beaten that.
        handicap = -feigned if slug in CATALOGUE[rival].contains else feigned
        return max(gain_of(left, own(s)) for s in true) - max(gain_of(left, own(s)) for s in other) - handicap

    def visible(self, added: np.ndarray, columns: Sequence[int]) -> np.ndarray:
        """Standard deviations by which effects, at the strength of `testable`, would stand out; one for each column."""
        H = self.open.gram[:-1, :-1] + added
        chosen = [self._columns[c] for c in self.open.chosen]
        left, _ = eliminated(H, np.concatenate([self._always, *chosen]))
        strength = self.open.reference
        members = [self.open.columns[c] for c in self.open.chosen]
        at = lambda c: (self._columns[c], strength[self._columns[c] - self._always.size])  # noqa: E731
        return np.array([stands_out(left, self.open.columns[c], *at(c), members) for c in columns])


def _library(robot: Robot, open_: Undecided) -> tuple[Library, np.ndarray]:
    """The effects in question as a library, and where its amplitudes stand in the order of `Undecided`."""
    blocks, start, place = [], {}, {}
    first = 0
    for slug in dict.fromkeys(c.slug for c in open_.columns):
        mine = [k for k, c in enumerate(open_.columns) if c.slug == slug]
        effect = CATALOGUE[slug]
        sites = np.array([open_.columns[k].joints for k in mine])
        shapes = np.array([[open_.columns[k].shape] for k in mine], dtype=float)
        blocks.append((effect, sites, shapes, first))
        width = max(max(v) for v in effect.variants) + 1
        place |= {k: first + i * width for i, k in enumerate(mine)}
        start[slug] = first
        first += len(mine) * width
    parts = [place[k] + np.array(c.variant) for k, c in enumerate(open_.columns)]
    order = np.concatenate(parts) if parts else np.zeros(0, dtype=int)
    return Library(robot, (), tuple(blocks), first), order
