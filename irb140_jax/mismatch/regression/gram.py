"""Gram matrices of every joint, and what is left of them once its nuisance parameters are integrated out.

With whitened rows y = Z z + E_j e + X w + noise, z are inertials and common nuisance parameters, w the amplitudes of
effects.  The own nuisance parameters e of joint j, its discrepancy among them, appear in the rows of that joint only.
For given sizes of the discrepancy they are integrated out joint by joint.  That leaves a small matrix over inertials,
effects and y; sums of those over joints are all that a search needs.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy import linalg
from scipy.linalg import lapack

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.nuisances import INSTRUMENT, SCALED

ONE = 24  # index of the level at which the noise is as it was estimated
LEVELS = tuple(1.25 ** (k - ONE) for k in range(2 * ONE))  # noise over what was estimated
REMEMBERED = 192  # hyperparameters of a joint whose factors are kept, and matrices of sets at those

T = TypeVar("T")

# Hyperparameters of a joint: indices into DISCREPANCY_SIZES for each block of SCALED, and into LEVELS.
JointHyper = tuple[int, ...]

START: JointHyper = (*([3] * len(SCALED)), ONE)


def log_prior_of_sizes() -> np.ndarray:
    """Log prior of each size of a block of the discrepancy, half-Cauchy over the grid."""
    edges = np.sqrt(np.multiply(settings.DISCREPANCY_SIZES[1:-1], settings.DISCREPANCY_SIZES[2:]))
    edges = np.concatenate([[0.0, settings.DISCREPANCY_SIZES[1] / 2.0], edges, [np.inf]])
    return np.log(np.diff(np.arctan(edges / settings.USUAL_MISFIT)) * 2.0 / np.pi)


@dataclasses.dataclass(frozen=True)
class Integrated:
    """A joint's rows at some sizes of the discrepancy and a noise level, its own nuisances integrated out.

    Attributes:
        gram: Gram matrix over [own | shared | y], of which the own columns are not yet integrated out, at level 1.
        level: Noise level.
        used: Own columns that may differ from zero.
        scale: Their prior standard deviations.
        chol: Cholesky factor of their precision, in units of those.
        halves: Of each shared column and y what integrating them out takes off products with it: H with H[a] . H[b],
            shape (k + 1, used).  Made where it is asked for: a search asks for a tenth of them.
        made: Which of these are, shape (k + 1,).
        constant: What the joint adds to the log evidence besides: log determinants, noise level and prior of the sizes.
    """

    gram: np.ndarray
    level: float
    used: np.ndarray
    scale: np.ndarray
    chol: np.ndarray
    halves: np.ndarray
    made: np.ndarray
    constant: float = 0.0

    @functools.cached_property
    def first(self) -> int:
        """Where the shared columns begin in the Gram matrix."""
        return len(self.gram) - len(self.made)

    def half(self, columns: np.ndarray) -> np.ndarray:
        """What integrating out takes off products with some shared columns, by rows."""
        if len(self.used) and not self.made[columns].all():
            new = columns[~self.made[columns]]
            products = self.scale[:, None] * self.gram[self.used[:, None], new + self.first] / self.level**2
            solved, _ = lapack.dtrtrs(self.chol, products, lower=1)  # pyright: ignore[reportAttributeAccessIssue]
            self.halves[new] = solved.T
            self.made[new] = True
        return self.halves[columns]

    def left(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some shared columns with others, as numbered in `JointGram.index`."""
        square = self.gram[rows[:, None] + self.first, columns + self.first] / self.level**2
        half = self.half(rows)
        return square - half @ (half if rows is columns else self.half(columns)).T

    def blocks(self, groups: np.ndarray) -> np.ndarray:
        """Such Gram matrices of small groups of columns (m, k), shape (m, k, k); -1 stands for a column of zeros."""
        there, groups = groups >= 0, np.maximum(groups, 0)
        self.half(np.unique(groups))
        at, part = groups + self.first, self.halves[groups]
        G = self.gram[at[:, :, None], at[:, None, :]] / self.level**2
        G = G - part @ np.swapaxes(part, 1, 2)
        return np.where(there[:, :, None] & there[:, None, :], G, 0.0)

    def own(self) -> np.ndarray:
        """Mean of the own columns per unit of each shared column and of y, shape (D, k + 1)."""
        out = np.zeros((self.first, len(self.made)))
        half = self.half(np.arange(len(self.made)))
        out[self.used] = self.scale[:, None] * linalg.solve_triangular(self.chol, half.T, lower=True, trans=1)
        return out

    def cov(self, own: np.ndarray) -> np.ndarray:
        """Covariance of linear functions (m, D) of the own columns' coefficients, shared ones known, shape (m, m)."""
        half = linalg.solve_triangular(self.chol, (own[:, self.used] * self.scale).T, lower=True)
        return half.T @ half

    def dof(self) -> float:
        """How many of the own columns the rows determine."""
        inverse = linalg.solve_triangular(self.chol, np.eye(len(self.used)), lower=True)
        return float(len(self.used) - np.sum(inverse**2))


class JointGram:
    """Gram matrices of one joint's rows, by block of the data.

    Args:
        index: Global numbers of the shared columns that move this joint, y last.
        blocks: Gram matrices over [own | shared | y] in prior units, shape (B, D + k + 1, D + k + 1).
        groups: Block of each own column, see `Nuisances`.
        rows: Rows of each block, shape (B,).
        repeats: How many recordings there are of each block's motion, shape (B,).
        misfit: Share of the noise's variance, at level 1, that the sensors don't make.
        keep: Which blocks count, shape (B,); all by default.
    """

    def __init__(
        self, index: np.ndarray, blocks: np.ndarray, groups: np.ndarray, rows: np.ndarray,
        repeats: np.ndarray | None = None, misfit: float = 0.0, keep: np.ndarray | None = None,
    ):  # fmt: skip
        self.index, self.blocks, self.groups, self.rows, self.misfit = index, blocks, groups, rows, misfit
        self.repeats = np.ones(len(blocks), dtype=int) if repeats is None else repeats
        least = np.sqrt(1.0 - misfit)  # no residual is quieter than the sensors
        self.lowest = int(np.searchsorted(LEVELS, least * (1.0 - 1e-9)))
        self.keep = np.ones(len(blocks), dtype=bool) if keep is None else keep
        alike = {int(k): (self.keep & (self.repeats == k)).astype(float) for k in np.unique(self.repeats[self.keep])}
        self._totals = [(k, _sum(blocks, w), float(w @ rows)) for k, w in alike.items()]
        self._once = self._totals[0][1:] if self._totals else (np.zeros(blocks.shape[1:]), 0.0)
        self._log_prior = log_prior_of_sizes()
        self._by_level: dict[float, tuple[np.ndarray, float]] = {}
        self._factors: dict[tuple, Integrated] = {}
        self._of_sets: dict[tuple, np.ndarray] = {}

    def without(self, blocks: np.ndarray) -> "JointGram":
        """The same without some blocks, shape (B,)."""
        keep = self.keep & ~blocks
        return JointGram(self.index, self.blocks, self.groups, self.rows, self.repeats, self.misfit, keep)

    def weighted(self, level: float) -> tuple[np.ndarray, float]:
        """Sum of the blocks and their number of rows, each motion that was repeated by what its repeats are worth.

        Sensor noise averages out over k repeats of a motion, what a model errs by comes back with it: their mean has
        the variance s^2 / k + m^2 where one has s^2 + m^2.

        Args:
            level: Noise over that at which `misfit` is stated.
        """
        if all(k == 1 for k, *_ in self._totals):
            return self._once
        if level not in self._by_level:
            square, sensors = level**2, 1.0 - self.misfit
            worth = [square / (sensors / k + square - sensors) / k for k, *_ in self._totals]
            gram = sum(w * G for w, (_, G, _) in zip(worth, self._totals, strict=True))
            rows = sum(w * count for w, (*_, count) in zip(worth, self._totals, strict=True))
            self._by_level[level] = np.asarray(gram), rows
        return self._by_level[level]

    def at(self, hyper: JointHyper, instrument: bool = True) -> Integrated:
        """Own nuisances integrated out; kept, for a search asks for the same ones thousands of times.

        Args:
            hyper: Sizes and level.
            instrument: Whether the instrument may err within its stated widths; otherwise it is taken to be right, but
                for a servo's drive, which is part of the machine.
        """
        return _kept(self._factors, (hyper, instrument), lambda: self._integrated(hyper, instrument))

    def left(self, hyper: JointHyper, columns: np.ndarray, instrument: bool = True) -> np.ndarray:
        """Gram matrix of some shared columns, see `Integrated.left`; kept: sets that differ elsewhere have it, too.

        Args:
            hyper: Sizes and level.
            columns: Shared columns, shape (k,).
            instrument: See `at`.
        """
        return _kept(self._of_sets, (hyper, instrument, columns.tobytes()),
                     lambda: self.at(hyper, instrument).left(columns, columns))  # fmt: skip

    def forget(self) -> None:
        """Drop what is kept: hundreds of megabytes, once a search is over."""
        self._factors.clear()
        self._of_sets.clear()
        self._by_level.clear()

    def _integrated(self, hyper: JointHyper, instrument: bool) -> Integrated:
        level, size, D = LEVELS[hyper[-1]], own_scale(self.groups, hyper), len(self.groups)
        used = np.flatnonzero((size > 0.0) & (instrument | (self.groups != INSTRUMENT)))
        total, rows = self.weighted(level)
        s = size[used]
        M = s[:, None] * total[np.ix_(used, used)] * s / level**2 + np.eye(len(used))
        chol, k = linalg.cholesky(M, lower=True, check_finite=False), len(total) - D
        out = Integrated(total, level, used, s, chol, np.empty((k, len(used))), np.zeros(k, dtype=bool))
        left = float(out.left(np.array([k - 1]), np.array([k - 1]))[0, 0])
        constant = -float(np.log(np.diag(chol)).sum()) - rows * np.log(level) - 0.5 * left
        return dataclasses.replace(out, constant=constant + float(self._log_prior[list(hyper[:-1])].sum()))


def _kept(known: dict[tuple, T], key: tuple, made: Callable[[], T]) -> T:
    """What is known under a key, or made; the least recently used of too many is dropped."""
    value = known.pop(key) if key in known else made()
    known[key] = value
    if len(known) > REMEMBERED:
        del known[next(iter(known))]
    return value


def _sum(blocks: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted sum of blocks, without a copy of a single one."""
    return blocks[0] if len(blocks) == 1 and weights[0] == 1.0 else np.tensordot(weights, blocks, 1)


def own_scale(groups: np.ndarray, hyper: JointHyper) -> np.ndarray:
    """Prior standard deviation of each own column."""
    sizes = np.array([1.0, *(settings.DISCREPANCY_SIZES[i] for i in hyper[:-1])])
    return sizes[np.maximum(groups, INSTRUMENT) + 1]
