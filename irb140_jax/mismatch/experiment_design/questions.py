"""How much a motion would say about what a diagnosis left open, before it is played."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import prepared
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.experiment_design.undecided import Pair, Sets, Undecided
from irb140_jax.mismatch.inertials.prior import inertial_prior_factor
from irb140_jax.mismatch.regression.gaussian import eliminated, gain_of, grams, posterior
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.regression.rows import stretch
from irb140_jax.mismatch.validation.testable import played, stands_out
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
        self._known: dict[Pair, tuple[_Order, _Order]] = {}

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
        rows, inertials = stretch(self._lib, along, 0, o.band, self._factor), np.arange(len(self._factor))
        loose = [inertials[10 * k : 10 * k + 10] for k in o.loose]
        columns = np.concatenate([inertials, *loose, len(inertials) + self._order])
        scale = np.concatenate(
            [np.full(len(self._factor), o.uncertainty), np.full(10 * len(o.loose), settings.LOOSE_INERTIALS), o.scale]
        )
        noise = Noise(o.ar, o.level[None], o.level[None], np.ones(len(o.ar)))
        return grams([rows], columns, noise, scale, 1)[0, :-1, :-1]

    def margin(self, added: np.ndarray, pair: Pair, *, exact: bool = False) -> float:
        """Log odds expected in favour of the true one of two explanations, whichever is true, the worse of the two.

        The log that either predicts is added to the recordings there are; the other does with it what it can, with
        inertials, amplitudes and shapes free: half the divergence that T-optimal designs maximise.  What laws
        are usually wrong by (`USUAL_MISFIT`) is taken off, so that the motion convinces all the same; below zero, they
        stay even.

        Args:
            added: What the motion adds, from `gram`.
            pair: The explanations.
            exact: Whether to take the laws as exact and take nothing off.

        Source: Atkinson and Fedorov, Biometrika 62(1), 1975; Lopez-Fidalgo, Tommasi, Trandafir, JRSS B 69(2), 2007.
        """
        return min(self._odds_if_true(added, order, exact) for order in self._orders(pair))

    def _orders(self, pair: Pair) -> tuple["_Order", "_Order"]:
        """Either explanation as the true one; what doesn't depend on the motion is worked out once."""
        if pair not in self._known:
            named, rival = pair.named_sets, pair.rival_sets
            self._known[pair] = self._order_of(pair, named, rival), self._order_of(pair, rival, named)
        return self._known[pair]

    def _order_of(self, pair: Pair, true: Sets, other: Sets) -> "_Order":
        rest = np.concatenate([self._always, *(self._columns[c] for c in pair.rest)])
        own = lambda sets: [np.concatenate([self._columns[c] for c in s]) for s in sets]  # noqa: E731
        truths, others = own(true), own(other)
        old, _ = eliminated(self.open.gram, rest)
        best = max(truths, key=lambda columns: gain_of(old, columns))
        columns = np.concatenate([rest, best])
        # Of the whole matrix only what either explanation uses is needed.
        kept = np.unique(np.concatenate([rest, *truths, *others]))
        at = lambda columns: np.searchsorted(kept, columns)  # noqa: E731
        weights = posterior(self.open.gram, columns).mean
        known = self.open.gram[np.ix_(np.append(kept, -1), np.append(kept, -1))]
        own_at = at(rest), at(best), [*map(at, truths)], [*map(at, others)]
        return _Order(kept, known, columns, weights, *own_at)

    def _odds_if_true(self, added: np.ndarray, o: "_Order", exact: bool) -> float:
        H = o.known.copy()
        H[:-1, :-1] += added[np.ix_(o.kept, o.kept)]
        told = added[np.ix_(o.kept, o.columns)] @ o.weights
        H[:-1, -1] += told
        H[-1, :-1] += told
        left, _ = eliminated(H, o.rest)
        mean = posterior(left, o.best).mean
        explained = 0.0 if exact else 0.5 * float(mean @ H[np.ix_(o.best, o.best)] @ mean)
        gain = lambda sets: max(gain_of(left, s) for s in sets)  # noqa: E731
        return gain(o.truths) - gain(o.others) - settings.USUAL_MISFIT**2 * explained

    def visible(self, added: np.ndarray, columns: Sequence[int]) -> np.ndarray:
        """Standard deviations by which effects, at the strength of `testable`, would stand out; one for each column."""
        H = self.open.gram[:-1, :-1] + added
        chosen = [self._columns[c] for c in self.open.chosen]
        left, _ = eliminated(H, np.concatenate([self._always, *chosen]))
        strength = self.open.reference
        members = [self.open.columns[c] for c in self.open.chosen]
        at = lambda c: (self._columns[c], strength[self._columns[c] - self._always.size])  # noqa: E731
        return np.array([stands_out(left, self.open.columns[c], *at(c), members) for c in columns])


class _Order(NamedTuple):
    """One of two explanations as the true one; indices are among the columns kept, unless it says otherwise.

    Attributes:
        kept: Columns of the whole matrix that matter.
        known: What the recordings say of those and y.
        columns: Of the true explanation at its best shape, in the whole matrix.
        weights: Their amplitudes.
        rest: Columns of both explanations.
        best: Columns of the true one alone at its best shape.
        truths, others: Columns of the true and of the other one alone, for every shape.
    """

    kept: np.ndarray
    known: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    rest: np.ndarray
    best: np.ndarray
    truths: list[np.ndarray]
    others: list[np.ndarray]


def _library(robot: Robot, open_: Undecided) -> tuple[Library, np.ndarray]:
    """The effects in question as a library, and where its amplitudes stand in the order of `Undecided`."""
    blocks, start, place = [], {}, {}
    first = 0
    for slug, effect in open_.effects.items():
        mine = [k for k, c in enumerate(open_.columns) if c.slug == slug]
        sites = np.array([open_.columns[k].joints for k in mine])
        shapes = np.array([[open_.columns[k].shape] for k in mine], dtype=float)
        blocks.append((effect, sites, shapes, first))
        width = effect.law.width
        place |= {k: first + i * width for i, k in enumerate(mine)}
        start[slug] = first
        first += len(mine) * width
    parts = [place[k] + np.array(c.variant) for k, c in enumerate(open_.columns)]
    order = np.concatenate(parts) if parts else np.zeros(0, dtype=int)
    return Library(robot, (), tuple(blocks), first), order
