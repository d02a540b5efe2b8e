"""The evidence of a set of effects, with the sizes of the discrepancy and the noise level fitted for that very set."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy import linalg

from irb140_jax.effects import At
from irb140_jax.mismatch.columns.beside import Beside
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.gaussian import posterior, root, with_prior
from irb140_jax.mismatch.regression.gram import LEVELS, JointGram, JointHyper
from irb140_jax.mismatch.selection.kinds import Kinds
from irb140_jax.mismatch.selection.unknown_width import WIDTHS, above_zero, evidences_by_width, truncated

Hyper = tuple[JointHyper, ...]  # hyperparameters, one a joint
DRY = "coulomb_friction"


@dataclasses.dataclass(frozen=True)
class Space:
    """All sets of candidates that a search may visit, and what their evidence is made of.

    Attributes:
        joints: Gram matrices of each joint.
        candidates: What may be in a set; columns count from `offset`.
        inertials: Shared columns of the inertial parameters, which come first.
        offset: Shared columns before the amplitudes: inertials and common nuisances, always in.
        size: Shared columns, without y.
        log_prior: Log prior odds of each candidate, but for those of its kind at all, shape (candidates,).
        kinds: What the prior says of kinds of effects.
        lowest, highest: Admissible amplitudes in prior units, padded with -inf and inf, shape (candidates, width).
        weights, least: Weights of the amplitudes in a sum that is bounded from below, and its bound, per candidate.
        silent: Rows in which each candidate says nothing of what is logged, and log of the range over the noise, shape
            (2, candidates): see `regression.silent`.
        centre: Prior means of the common nuisances in prior units, shape (offset - inertials,): not zero where rows
            were made with some of them.
        delays: How many of the common nuisances, the last ones, are delays of one joint each: as their prior's width is
            one for all of them and not known, late channels make others that are late more probable.
    """

    joints: tuple[JointGram, ...]
    candidates: tuple[Candidate, ...]
    inertials: int
    offset: int
    size: int
    log_prior: np.ndarray
    kinds: Kinds
    lowest: np.ndarray
    highest: np.ndarray
    weights: np.ndarray
    least: np.ndarray
    silent: np.ndarray
    centre: np.ndarray
    delays: int = 0

    @cached_property
    def beside(self) -> Beside:
        """Which candidates can't stand beside each other."""
        return Beside(self.candidates)

    @cached_property
    def columns(self) -> tuple[np.ndarray, ...]:
        """Shared columns of each candidate."""
        return tuple(c.columns + self.offset for c in self.candidates)

    def conflicts(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Candidates that can't stand beside a set, shape (candidates,).

        Beside what `Beside` says: one law a joint holds its level of dry friction, and one shifts its log in time.
        """
        out = self.beside.conflicts(chosen)
        for alike in (self._dry, self.late):
            taken = np.any(self.at_joint[:, list(chosen)] & alike[list(chosen)], axis=1)
            out = out | (alike & np.any(self.at_joint & taken.reshape(-1, 1), axis=0))
        return out

    def reach(self, candidate: int) -> Sequence[int]:
        """Joints whose torque a candidate may move; of a link's inertials its own, though they move those before it."""
        c = self.candidates[candidate]
        return range(len(self.joints)) if c.effect.place.everywhere else c.joints

    @cached_property
    def at_joint(self) -> np.ndarray:
        """Which candidates are at which joint, shape (n, candidates)."""
        out = np.zeros((len(self.joints), len(self.candidates)), dtype=bool)
        for i, c in enumerate(self.candidates):
            out[list(c.joints), i] = True
        return out

    @cached_property
    def _dry(self) -> np.ndarray:
        return np.array([DRY == c.slug or DRY in c.effect.law.contains for c in self.candidates], dtype=bool)

    @cached_property
    def late(self) -> np.ndarray:
        """Which candidates shift the log in time, shape (candidates,)."""
        return np.array([c.effect.place.at is At.LOG_TIMING for c in self.candidates])

    @cached_property
    def places(self) -> tuple[np.ndarray, ...]:
        """Where each shared column and y stand in a joint's matrix, -1 where they don't, per joint."""
        out = []
        for g in self.joints:
            place = np.full(self.size + 1, -1)
            place[g.index] = np.arange(len(g.index))
            out.append(place)
        return tuple(out)

    def without(self, blocks: np.ndarray) -> "Space":
        """The same without some blocks of the data, shape (B,); kept, for each finding asks for it."""
        key = blocks.tobytes()
        if key not in self._reduced:
            self._reduced[key] = dataclasses.replace(self, joints=tuple(g.without(blocks) for g in self.joints))
        return self._reduced[key]

    @cached_property
    def _reduced(self) -> dict[bytes, "Space"]:
        return {}

    def gram(
        self, hyper: Hyper, rows: np.ndarray, columns: np.ndarray, only: Sequence[int] | None = None,
        *, instrument: bool = True,
    ) -> np.ndarray:  # fmt: skip
        """Gram matrix of some shared columns with others, summed over joints; number `size` is y.

        Args:
            hyper: Sizes and levels.
            rows, columns: Which.
            only: Joints to sum over, all by default.
            instrument: See `JointGram.at`.
        """
        H = np.zeros((len(rows), len(columns)))
        for j in range(len(self.joints)) if only is None else only:
            of_joint, down = self.joints[j], self.places[j][columns]
            c = np.flatnonzero(down >= 0)
            if columns is rows:
                H[c[:, None], c] += of_joint.left(hyper[j], down[c], instrument)
                continue
            across = self.places[j][rows]
            r = np.flatnonzero(across >= 0)
            H[r[:, None], c] += of_joint.at(hyper[j], instrument).left(across[r], down[c])
        if self.centre.any():
            # A prior mean is a row of its own beside the data: y is the mean there.
            means, y = np.zeros(self.size + 1), np.arange(self.size + 1) == self.size
            means[self.inertials : self.offset] = self.centre
            H += np.outer(means[rows], y[columns]) + np.outer(y[rows], means[columns])
        return H

    def with_y(self, columns: np.ndarray) -> np.ndarray:
        """Columns and y."""
        return np.append(columns, self.size)

    def set_columns(self, chosen: Sequence[int]) -> np.ndarray:
        """Shared columns of a set: inertials and common nuisances, then the members' amplitudes."""
        return np.concatenate([np.arange(self.offset), *(self.columns[c] for c in chosen)])

    def constant(self, hyper: Hyper) -> float:
        """What sizes and levels add to the log evidence of any set."""
        of_mean = -0.5 * float(self.centre @ self.centre)
        return of_mean + sum(g.at(s).constant for g, s in zip(self.joints, hyper, strict=True))

    def log_evidence(self, chosen: Sequence[int], hyper: Hyper) -> float:
        """Log evidence and prior of a set; -inf where its amplitudes are inadmissible."""
        H, by_width = self._by_width(chosen, hyper)
        if self._impossible(chosen, H, self.prior(chosen, hyper)):
            return -np.inf
        known = self.constant(hyper) + self._prior(chosen) - float(self.lost(chosen, hyper).sum())
        return known + float(np.logaddexp.reduce(by_width, axis=None)) + self._of_truncated(chosen, H, hyper)

    def _of_truncated(self, chosen: Sequence[int], H: np.ndarray, hyper: Hyper) -> float:
        """What it adds to the log evidence that masses are not below zero."""
        if not (at := self._masses(chosen)).size:
            return 0.0
        prior = self.prior(chosen, hyper)
        chol = root(with_prior(H[:-1, :-1] * np.outer(prior, prior)))
        cov = linalg.cho_solve((chol, True), np.eye(len(prior))[:, at])
        return float(np.sum(above_zero(cov.T @ (prior * H[:-1, -1]), np.sqrt(np.diag(cov[at])))))

    def _by_width(self, chosen: Sequence[int], hyper: Hyper) -> tuple[np.ndarray, np.ndarray]:
        """Gram matrix of a set's columns and y, and log evidence and prior by `evidences_by_width`."""
        every = self.with_y(self.set_columns(chosen))
        H = self.gram(hyper, every, every)
        by_width = evidences_by_width(H, self._of_unknown_width(chosen))
        best = np.unravel_index(np.argmax(by_width), by_width.shape)
        of_delays = np.logaddexp.reduce(by_width, axis=(0, 2))
        of_delays = np.resize(of_delays - np.logaddexp.reduce(of_delays), len(WIDTHS))
        self._widths[tuple(sorted(chosen)), hyper] = WIDTHS[list(best)], of_delays
        return H, by_width

    def _of_unknown_width(self, chosen: Sequence[int]) -> np.ndarray:
        """Which of a set's columns have priors of one width each that is not known, shape (3, k)."""
        of_inertials, of_delays = np.zeros((2, self.offset + sum(len(self.columns[c]) for c in chosen)), dtype=bool)
        of_inertials[: self.inertials] = of_delays[self.offset - self.delays : self.offset] = True
        return np.stack([of_inertials, of_delays, self._tied(chosen)])

    def _tied(self, chosen: Sequence[int]) -> np.ndarray:
        """Which of a set's columns have one prior whose width is not known, shape (k,)."""
        of_members = [np.full(len(self.columns[c]), self.candidates[c].effect.prior.tied) for c in chosen]
        return np.concatenate([np.zeros(self.offset, dtype=bool), *of_members])

    def _masses(self, chosen: Sequence[int]) -> np.ndarray:
        """Which of a set's columns are masses that are not below zero: the first of their members'."""
        starts = self.offset + np.cumsum([0, *(len(self.columns[c]) for c in chosen)], dtype=int)[:-1]
        return np.array([s for s, c in zip(starts, chosen, strict=True) if self._is_mass(c)], dtype=int)

    def _is_mass(self, candidate: int) -> bool:
        return self.candidates[candidate].effect.prior.is_mass

    def width(self, chosen: Sequence[int], hyper: Hyper) -> float:
        """True over stated error of the inertials that is most probable beside a set."""
        return float(self._of_widths(chosen, hyper)[0][0])

    def _of_widths(self, chosen: Sequence[int], hyper: Hyper) -> tuple[np.ndarray, np.ndarray]:
        """The most probable widths of the priors of inertials, delays and tied columns over those stated, shape (3,).

        Beside them the log probability of each width of the delays' prior, shape (WIDTHS,).
        """
        key = tuple(sorted(chosen)), hyper
        if key not in self._widths:
            self._by_width(chosen, hyper)
        return self._widths[key]

    @cached_property
    def _widths(self) -> dict[tuple, tuple[np.ndarray, np.ndarray]]:
        return {}

    def prior(self, chosen: Sequence[int], hyper: Hyper) -> np.ndarray:
        """Prior standard deviations of a set's columns, in units of those that were stated."""
        unknown = self._of_unknown_width(chosen)
        return np.where(unknown.any(axis=0), self._of_widths(chosen, hyper)[0] @ unknown, 1.0)

    def priors_by_delays(self, chosen: Sequence[int], hyper: Hyper) -> list[tuple[np.ndarray, float]]:
        """Prior widths of a set's columns, shape (k,), at each width of the delays up to the most probable one.

        Without a late channel that an effect accounts for, the others' delays may well be smaller.

        Returns:
            The widths, and the log probability of that of the delays; nothing where there are no delays.
        """
        prior, mine = self.prior(chosen, hyper), self._of_unknown_width(chosen)[1]
        best, log_probability = self._of_widths(chosen, hyper)
        smaller = np.flatnonzero(WIDTHS <= best[1]) if mine.any() else []
        return [(np.where(mine, WIDTHS[k], prior), float(log_probability[k])) for k in smaller]

    def torque_scale_odds(self, chosen: Sequence[int], hyper: Hyper) -> float:
        """Log evidence for one scale of all torques, the first of the common nuisances, over that of none."""
        every = self.with_y(self.set_columns(chosen))
        H = self.gram(hyper, every, every)
        unknown = self._of_unknown_width(chosen)
        without = np.delete(np.delete(H, self.inertials, axis=0), self.inertials, axis=1)
        free = evidences_by_width(H, unknown)
        none = evidences_by_width(without, np.delete(unknown, self.inertials, axis=1))
        return float(np.logaddexp.reduce(free, axis=None) - np.logaddexp.reduce(none, axis=None))

    def lost(self, which: Sequence[int] | np.ndarray, hyper: Hyper) -> np.ndarray:
        """Log density of what is logged that candidates lose where they say nothing of it, shape (len(which),)."""
        rows, ranges = self.silent[:, np.asarray(which, dtype=int)]
        if not rows.any():
            return np.zeros(len(rows))
        levels = np.log([LEVELS[hyper[self.candidates[i].joints[0]][-1]] for i in which])
        return rows * np.maximum(ranges - levels, 0.0)

    def _prior(self, chosen: Sequence[int]) -> float:
        return float(sum(self.log_prior[c] for c in chosen)) + self.kinds.log_prior(chosen)

    def posterior(
        self, chosen: Sequence[int], hyper: Hyper, *, instrument: bool = True, scaled: bool = False,
        width: float | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Mean and covariance of inertials, common nuisances and amplitudes, in prior units.

        A strong effect's prior is as wide as it is large: see `evidence.posterior`.

        Args:
            chosen: The set.
            hyper: Sizes and levels.
            instrument: Whether the instrument may err within its stated widths; otherwise its part is zero ...
            scaled: ... but for one scale of all torques, the first of the common nuisances.
            width: True over stated error of the inertials, by default the one that is most probable beside the set.
        """
        every, prior = self.with_y(self.set_columns(chosen)), self.prior(chosen, hyper)
        if width is not None:
            prior[: self.inertials] = width
        free = np.ones(len(every) - 1, dtype=bool)
        free[self.inertials : self.offset] = instrument
        free[self.inertials] |= scaled
        H = self.gram(hyper, every, every, instrument=instrument)
        at = np.flatnonzero(free)
        mean, cov = np.zeros(len(free)), np.zeros((len(free), len(free)))
        ends = np.cumsum([len(self.columns[c]) for c in chosen], dtype=int) + np.count_nonzero(free[: self.offset])
        named = [slice(int(e) - len(self.columns[c]), int(e)) for c, e in zip(chosen, ends, strict=True)
                 if self.candidates[c].slug != "inertials"]  # fmt: skip
        found = posterior(np.pad(H[np.ix_(at, at)], (0, 1)) + np.pad(H[at, -1:], ((0, 1), (len(at), 0))),
                          np.arange(len(at)), named, prior[at])  # fmt: skip
        mean[at], cov[np.ix_(at, at)] = found.mean, found.cov
        for first in self._masses(chosen):
            mean, cov = truncated(mean, cov, int(first))
        return mean, cov

    def own(
        self, joint: int, of_joint: JointHyper, columns: np.ndarray, mean: np.ndarray, *, instrument: bool
    ) -> np.ndarray:
        """Mean of a joint's own nuisances beside a set, shape (D,).

        Args:
            joint: Which.
            of_joint: Its sizes and level.
            columns: Shared columns of the set.
            mean: Their mean.
            instrument: See `JointGram.at`.
        """
        own, at = self.joints[joint].at(of_joint, instrument).own(), self.places[joint][columns]
        return own[:, -1] - own[:, at[at >= 0]] @ mean[at >= 0]

    def functions(
        self, chosen: Sequence[int], hyper: Hyper, joint: int, shared: np.ndarray, own: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean (m,) and covariance (m, m) of linear functions of a set's columns and a joint's own nuisances.

        Args:
            chosen: The set.
            hyper: Sizes and levels.
            joint: Which.
            shared: Weights of the columns of `set_columns`, shape (m, k).
            own: Weights of the own nuisances, shape (m, D).
        """
        mean, cov = self.posterior(chosen, hyper)
        integrated, at = self.joints[joint].at(hyper[joint]), self.places[joint][self.set_columns(chosen)]
        per, there = integrated.own(), at >= 0
        along = shared.astype(float)
        along[:, there] -= own @ per[:, at[there]]
        return along @ mean + own @ per[:, -1], along @ cov @ along.T + integrated.cov(own)

    @cached_property
    def summed(self) -> dict[tuple, float]:
        """What sums over shapes gain, as far as they are known: see `hyperparameters.over_shapes`."""
        return {}

    @cached_property
    def alike(self) -> list[list[int]]:
        """Candidates that differ from each one in shape alone, itself included.

        Of one shape that follows from an amplitude a refined grid is all copies: it counts once, as in its prior.
        """
        groups: dict[tuple, dict[tuple, int]] = {}
        keys = [(c.slug, c.joints, c.variant) for c in self.candidates]
        shapes = [tuple(c.shape.tolist()) if c.effect.shapes.follows else (i,) for i, c in enumerate(self.candidates)]
        for i, (key, shape) in enumerate(zip(keys, shapes, strict=True)):
            groups.setdefault(key, {}).setdefault(shape, i)
        return [[*(groups[key] | {shape: i}).values()] for i, (key, shape) in enumerate(zip(keys, shapes, strict=True))]

    def inadmissible(self, chosen: Sequence[int], hyper: Hyper) -> list[int]:
        """Members of a set whose amplitudes are not such as can be."""
        every = self.with_y(self.set_columns(chosen))
        return self._impossible(chosen, self.gram(hyper, every, every), self.prior(chosen, hyper))

    def _impossible(self, chosen: Sequence[int], H: np.ndarray, prior: np.ndarray) -> list[int]:
        """The same, from the Gram matrix of a set's columns and y, and the columns' prior widths."""
        if not len(chosen):
            return []
        G = with_prior(H[:-1, :-1] * np.outer(prior, prior))
        mean = (prior * linalg.cho_solve((root(G), True), prior * H[:-1, -1]))[self.offset :]
        ends = np.cumsum([len(self.columns[c]) for c in chosen])
        parts = [mean[e - len(self.columns[c]) : e] for c, e in zip(chosen, ends, strict=True)]
        return [c for c, part in zip(chosen, parts, strict=True) if self.outside(np.array([c]), part[None])[0]]

    def outside(self, which: np.ndarray, mean: np.ndarray) -> np.ndarray:
        """Which candidates' amplitudes (candidates, k) are inadmissible."""
        k = mean.shape[1]
        # A mass may seem impossible by what is not known of its width: its bound is in the evidence.  What moves
        # nothing has an infinite one.
        mass = np.array([self._is_mass(i) for i in which], dtype=bool)
        lowest = self.lowest[which, :k]
        lowest = np.where(mass[:, None] & np.isfinite(lowest), -np.inf, lowest)
        bad = np.any((mean < lowest - 1e-9) | (mean > self.highest[which, :k] + 1e-9), axis=1)
        return bad | (np.sum(mean * self.weights[which, :k], axis=1) < self.least[which])
