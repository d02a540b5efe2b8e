"""The evidence of a set of effects, with the sizes of the discrepancy and the noise level fitted for that very set."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy import linalg

from irb140_jax.mismatch.beside import Beside
from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.regression.gram import LEVELS, SIZES, JointGram, Setting

Settings = tuple[Setting, ...]  # one a joint
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
        log_prior: Log prior odds of each candidate, shape (candidates,).
        lowest, highest: Admissible amplitudes in prior units, padded with -inf and inf, shape (candidates, width).
    """

    joints: tuple[JointGram, ...]
    candidates: tuple[Candidate, ...]
    inertials: int
    offset: int
    size: int
    log_prior: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

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

        Beside what `Beside` says: one law a joint holds its level of dry friction, and one puts its log out of time.
        """
        out = self.beside.conflicts(chosen)
        for alike in (self._dry, self._late):
            taken = np.any(self._acts[:, list(chosen)] & alike[list(chosen)], axis=1)
            out = out | (alike & np.any(self._acts & taken.reshape(-1, 1), axis=0))
        return out

    @cached_property
    def _acts(self) -> np.ndarray:
        """Which joints each candidate's columns move, shape (n, candidates)."""
        out = np.zeros((len(self.joints), len(self.candidates)), dtype=bool)
        for j, which in enumerate(self.touching):
            out[j, which] = True
        return out

    @cached_property
    def _dry(self) -> np.ndarray:
        return np.array([DRY == c.slug or DRY in c.effect.contains for c in self.candidates], dtype=bool)

    @cached_property
    def _late(self) -> np.ndarray:
        return np.array([c.effect.logged > 1 for c in self.candidates])

    @cached_property
    def touching(self) -> tuple[np.ndarray, ...]:
        """Candidates whose columns move each joint."""
        moves = [np.isin(np.arange(self.size), g.index) for g in self.joints]
        return tuple(np.flatnonzero([m[c].any() for c in self.columns]) for m in moves)

    @cached_property
    def _place(self) -> tuple[np.ndarray, ...]:
        """Where each shared column and y stand in a joint's matrix, -1 where they don't, per joint."""
        out = []
        for g in self.joints:
            place = np.full(self.size + 1, -1)
            place[g.index] = np.arange(len(g.index))
            out.append(place)
        return tuple(out)

    def summed(
        self, settings: Settings, rows: np.ndarray, columns: np.ndarray, only: Sequence[int] | None = None
    ) -> np.ndarray:
        """Gram matrix of some shared columns with others, summed over joints; number `size` is y."""
        H = np.zeros((len(rows), len(columns)))
        for j in range(len(self.joints)) if only is None else only:
            across, down = self._place[j][rows], self._place[j][columns]
            r, c = np.flatnonzero(across >= 0), np.flatnonzero(down >= 0)
            H[np.ix_(r, c)] += self.joints[j].left(settings[j], across[r], down[c])
        return H

    def _with_y(self, columns: np.ndarray) -> np.ndarray:
        return np.append(columns, self.size)

    def set_columns(self, chosen: Sequence[int]) -> np.ndarray:
        """Shared columns of a set: inertials and common nuisances, then the members' amplitudes."""
        return np.concatenate([np.arange(self.offset), *(self.columns[c] for c in chosen)])

    def log_evidence(self, chosen: Sequence[int], settings: Settings) -> float:
        """Log evidence and prior of a set; -inf where its amplitudes are inadmissible."""
        every = self._with_y(self.set_columns(chosen))
        H = self.summed(settings, every, every)
        constant = sum(g.factor(s).constant for g, s in zip(self.joints, settings, strict=True))
        return constant + float(sum(self.log_prior[c] for c in chosen)) + _solved(H, self._bounds(chosen))[0]

    def posterior(self, chosen: Sequence[int], settings: Settings) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of inertials, common nuisances and amplitudes, in prior units."""
        every = self._with_y(self.set_columns(chosen))
        H = self.summed(settings, every, every)
        cov = np.linalg.inv(H[:-1, :-1] + np.eye(len(H) - 1))
        return cov @ H[:-1, -1], cov

    def settled(
        self, chosen: Sequence[int], settings: Settings, joints: Sequence[int] | None = None
    ) -> tuple[float, Settings]:
        """Sizes and levels that are best for a set, by coordinate ascent on their grids, at some joints or all.

        Returns:
            Log evidence and prior of the set, and the settings.
        """
        joints = range(len(self.joints)) if joints is None else joints
        index = self._with_y(self.set_columns(chosen))
        prior, best, moved = float(sum(self.log_prior[c] for c in chosen)), -np.inf, True
        bounds = self._bounds(chosen)
        while moved:
            moved = False
            for j in joints:
                rest = self.summed(settings, index, index, [i for i in range(len(self.joints)) if i != j])
                constant = prior + sum(
                    g.factor(s).constant for i, (g, s) in enumerate(zip(self.joints, settings, strict=True)) if i != j
                )
                at = self._place[j][index]
                mine = np.flatnonzero(at >= 0)
                into, take = np.ix_(mine, mine), at[mine]

                def value(setting: Setting, j=j, rest=rest, constant=constant, into=into, take=take) -> float:
                    H = rest.copy()
                    H[into] += self.joints[j].left(setting, take, take)
                    return constant + self.joints[j].factor(setting).constant + _solved(H, bounds)[0]

                now = value(settings[j])
                best = max(best, now) if np.isfinite(now) else best
                climbing = True
                while climbing:
                    climbing = False
                    for other in _near(settings[j]):
                        v = value(other)
                        if v > now + 1e-3:
                            now, climbing, moved = v, True, len(joints) > 1
                            settings = (*settings[:j], other, *settings[j + 1 :])
                best = now
        return best, settings

    def _bounds(self, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Admissible amplitudes of inertials and nuisances (any) and of a set."""
        free = np.full(self.offset, np.inf)
        low = [self.lowest[c, : len(self.columns[c])] for c in chosen]
        high = [self.highest[c, : len(self.columns[c])] for c in chosen]
        return np.concatenate([-free, *low]), np.concatenate([free, *high])

    def gains(self, chosen: Sequence[int], settings: Settings, which: np.ndarray) -> np.ndarray:
        """Log posterior odds of adding each of some candidates to a set at these settings; -inf if inadmissible."""
        out = np.full(len(which), -np.inf)
        if not len(which):
            return out
        base = self.set_columns(chosen)
        extra = np.unique(np.concatenate([self.columns[i] for i in which]))
        number = np.full(self.size, -1)
        number[extra] = np.arange(len(extra))
        prior = np.eye(len(base))
        chol = linalg.cholesky(self.summed(settings, base, base) + prior, lower=True, check_finite=False)
        beside = self.summed(settings, base, self._with_y(extra))
        half = linalg.solve_triangular(chol, beside, lower=True, check_finite=False)
        with_y = self.summed(settings, extra, np.array([self.size]))[:, 0] - half[:, :-1].T @ half[:, -1]
        by_size: dict[int, list[int]] = {}
        for m, i in enumerate(which):
            by_size.setdefault(len(self.columns[i]), []).append(m)
        for k, members in by_size.items():
            columns = np.array([self.columns[which[m]] for m in members])
            at = number[columns]
            part = half[:, at]
            M = np.eye(k) - np.einsum("amk,aml->mkl", part, part, optimize=True)
            for g, setting, place in zip(self.joints, settings, self._place, strict=True):
                mine = place[columns]
                moved = np.flatnonzero((mine >= 0).any(axis=1))
                if len(moved):
                    M[moved] += g.own(setting, mine[moved])
            rhs = with_y[at]
            mean = np.linalg.solve(M, rhs[..., None])[..., 0]
            gain = 0.5 * np.einsum("ik,ik->i", rhs, mean) - 0.5 * np.linalg.slogdet(M)[1]
            ids = which[members]
            bad = np.any((mean < self.lowest[ids, :k] - 1e-9) | (mean > self.highest[ids, :k] + 1e-9), axis=1)
            out[members] = np.where(bad, -np.inf, gain + self.log_prior[ids])
        return out


def _near(setting: Setting) -> list[Setting]:
    """Neighbours of a setting on the grid."""
    most = [*([len(SIZES)] * (len(setting) - 1)), len(LEVELS)]
    out = []
    for axis, top in enumerate(most):
        for step in (-1, 1):
            if 0 <= setting[axis] + step < top:
                out.append((*setting[:axis], setting[axis] + step, *setting[axis + 1 :]))
    return out


def _solved(H: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> tuple[float, np.ndarray]:
    """Log evidence of amplitudes with unit priors from a Gram matrix whose last column is y, and their mean."""
    chol = linalg.cholesky(H[:-1, :-1] + np.eye(len(H) - 1), lower=True, check_finite=False)
    half = linalg.solve_triangular(chol, H[:-1, -1], lower=True, check_finite=False)
    mean = linalg.solve_triangular(chol, half, lower=True, trans=1, check_finite=False)
    if np.any(mean < bounds[0] - 1e-9) or np.any(mean > bounds[1] + 1e-9):
        return -np.inf, mean
    return 0.5 * float(half @ half) - float(np.log(np.diag(chol)).sum()), mean
