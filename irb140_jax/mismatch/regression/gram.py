"""Gram matrices of every joint, and what is left of them once its nuisance parameters are integrated out.

With whitened rows y = Z z + E_j e + X w + noise, z are inertials and common nuisance parameters, w the amplitudes of
effects.  The own nuisance parameters e of joint j, its discrepancy among them, appear in the rows of that joint only.
For given sizes of the discrepancy they are integrated out joint by joint.  That leaves a small matrix over inertials,
effects and y; sums of those over joints are all that a search needs.
"""

import dataclasses
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from scipy import linalg

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.noise import ORDER, Noise, correlation_time
from irb140_jax.mismatch.regression.nuisances import SCALED, Nuisances
from irb140_jax.mismatch.regression.rows import Stretch, Window

ONE = 24  # index of the level at which the noise is as it was estimated
LEVELS = tuple(1.25 ** (k - ONE) for k in range(2 * ONE))  # noise over what was estimated
REMEMBERED = 192  # hyperparameters of a joint whose factors are kept

CandidateRows = Callable[[int], Iterable[tuple[Window, np.ndarray, np.ndarray]]]  # see `candidate_rows`
# Hyperparameters of a joint: indices into DISCREPANCY_SIZES for each block of SCALED, and into LEVELS.
JointHyper = tuple[int, ...]

START: JointHyper = (*([3] * len(SCALED)), ONE)


def log_prior(hyper: JointHyper) -> float:
    """Log prior of the sizes of a joint's discrepancy, half-Cauchy over the grid."""
    edges = np.sqrt(np.multiply(settings.DISCREPANCY_SIZES[1:-1], settings.DISCREPANCY_SIZES[2:]))
    edges = np.concatenate([[0.0, settings.DISCREPANCY_SIZES[1] / 2.0], edges, [np.inf]])
    mass = np.diff(np.arctan(edges / settings.USUAL_MISFIT)) * 2.0 / np.pi
    return float(np.log(mass[list(hyper[:-1])]).sum())


@dataclasses.dataclass(frozen=True)
class Integrated:
    """A joint's rows at some sizes of the discrepancy and a noise level, its own nuisances integrated out.

    Attributes:
        gram: Gram matrix over [own | shared | y], of which the own columns are not yet integrated out, at level 1.
        level: Noise level.
        used: Own columns that may differ from zero.
        scale: Their prior standard deviations.
        chol: Cholesky factor of their precision, in units of those.
        half: What integrating them out takes off the Gram matrix of shared columns and y, half.T @ half.
        constant: What the joint adds to the log evidence besides: log determinants, noise level and prior of the sizes.
    """

    gram: np.ndarray
    level: float
    used: np.ndarray
    scale: np.ndarray
    chol: np.ndarray
    half: np.ndarray
    constant: float

    def left(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some shared columns with others, as numbered in `JointGram.index`."""
        first = len(self.gram) - self.half.shape[1]
        square = self.gram[np.ix_(rows + first, columns + first)] / self.level**2
        return square - self.half[:, rows].T @ self.half[:, columns]

    def blocks(self, groups: np.ndarray) -> np.ndarray:
        """Such Gram matrices of small groups of columns (m, k), shape (m, k, k); -1 stands for a column of zeros."""
        at, there = groups + len(self.gram) - self.half.shape[1], groups >= 0
        G = self.gram[at[:, :, None], at[:, None, :]] / self.level**2
        part = np.moveaxis(self.half[:, groups], 0, 1)
        G = G - np.swapaxes(part, 1, 2) @ part
        return np.where(there[:, :, None] & there[:, None, :], G, 0.0)

    def own(self) -> np.ndarray:
        """Mean of the own columns per unit of each shared column and of y, shape (D, k + 1)."""
        out = np.zeros((len(self.gram) - self.half.shape[1], self.half.shape[1]))
        out[self.used] = self.scale[:, None] * linalg.solve_triangular(self.chol, self.half, lower=True, trans=1)
        return out

    def spread(self) -> np.ndarray:
        """Standard deviation of the own columns' coefficients beside shared ones that are known, shape (D,)."""
        out = np.zeros(len(self.gram) - self.half.shape[1])
        inverse = linalg.solve_triangular(self.chol, np.eye(len(self.used)), lower=True)
        out[self.used] = self.scale * np.sqrt(np.sum(inverse**2, axis=0))
        return out

    def dof(self) -> float:
        """How many of the own columns the rows determine."""
        return float(len(self.used) - np.sum((self.spread()[self.used] / self.scale) ** 2))


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
        self._kept: dict[tuple[JointHyper, bool], Integrated] = {}

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
        total, rows = 0.0, 0.0
        for k, gram, count in self._totals:
            square = level**2
            sensors = 1.0 - self.misfit
            worth = square / (sensors / k + square - sensors) / k
            total, rows = total + worth * gram, rows + worth * count
        return np.asarray(total), rows

    def at(self, hyper: JointHyper, instrument: bool = True) -> Integrated:
        """Own nuisances integrated out; kept, for a search asks for the same ones thousands of times.

        Args:
            hyper: Sizes and level.
            instrument: Whether the instrument may err within its stated widths; otherwise it is taken to be right.
        """
        key = hyper, instrument
        if key not in self._kept:
            if len(self._kept) >= REMEMBERED:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = self._integrated(hyper, instrument)
        else:
            self._kept[key] = self._kept.pop(key)  # most recently used last
        return self._kept[key]

    def forget(self) -> None:
        """Drop what is kept: hundreds of megabytes, once a search is over."""
        self._kept.clear()

    def _integrated(self, hyper: JointHyper, instrument: bool) -> Integrated:
        level, size, D = LEVELS[hyper[-1]], own_scale(self.groups, hyper), len(self.groups)
        used = np.flatnonzero((size > 0.0) & (instrument | (self.groups >= 0)))
        total, rows = self.weighted(level)
        s = size[used]
        M = s[:, None] * total[np.ix_(used, used)] * s / level**2 + np.eye(len(used))
        chol = linalg.cholesky(M, lower=True, check_finite=False)
        half = linalg.solve_triangular(chol, s[:, None] * total[used, D:] / level**2, lower=True, check_finite=False)
        left = total[-1, -1] / level**2 - half[:, -1] @ half[:, -1]
        constant = -float(np.log(np.diag(chol)).sum()) - rows * np.log(level) - 0.5 * left
        return Integrated(total, level, used, s, chol, half, constant + log_prior(hyper))


def _sum(blocks: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted sum of blocks, without a copy of a single one."""
    return blocks[0] if len(blocks) == 1 and weights[0] == 1.0 else np.tensordot(weights, blocks, 1)


def own_scale(groups: np.ndarray, hyper: JointHyper) -> np.ndarray:
    """Prior standard deviation of each own column."""
    sizes = np.array([1.0, *(settings.DISCREPANCY_SIZES[i] for i in hyper[:-1])])
    return sizes[groups + 1]


@dataclasses.dataclass
class Sums:
    """Sums over all rows of products of all columns, of which no more than a window is held at a time.

    Attributes:
        grams: Of each joint, by how often the motion was repeated: whitened Gram matrix over
            [own | inertials | common | amplitudes | y], the last three in their own units.
        rows: Of each joint, by the same: how many rows count.
        power: Sum of the squares of each column that isn't zero throughout, all rows alike, shape (entries,).
        lawless: Amplitudes that are of no law along these recordings.
    """

    grams: list[dict[int, np.ndarray]]
    rows: list[dict[int, float]]
    power: np.ndarray
    lawless: np.ndarray

    @property
    def finite(self) -> bool:
        """Whether all sums are numbers."""
        return all(np.isfinite(G).all() for by in self.grams for G in by.values())


def summed(
    lib: Library, stretches: Sequence[Stretch], rows: Sequence[CandidateRows], extra: Sequence[Nuisances], noise: Noise
) -> Sums:
    """Whiten the rows and sum the products of all columns.

    Args:
        lib: The library.
        stretches: The rows of each recording, with no column of a candidate.
        rows: What yields the columns of all candidates along each, given the rows that a window is to overlap by.
        extra: Nuisance columns of each.
        noise: Of the rows.
    """
    n, joints = lib.robot.n, lib.entries[0]
    own = [np.flatnonzero(joints == j) for j in range(n)]
    out = Sums([{} for _ in range(n)], [{} for _ in range(n)], np.zeros(len(joints)), np.zeros(0, dtype=int))
    # Joints side by side: nearly all of the time is in products, and those hold no lock.
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for s, e, windows in zip(stretches, extra, rows, strict=True):
            usable = [noise.usable(s.use[:, j], j) for j in range(n)]
            for window, columns, lawless in windows(ORDER):
                fresh = window.new - window.rows.start
                out.power += np.einsum("te,te->e", columns[fresh:], columns[fresh:])
                out.lawless = np.union1d(out.lawless, lawless)

                def add(j: int, s=s, e=e, window=window, columns=columns, fresh=fresh, usable=usable) -> None:
                    at = window.rows
                    A = np.concatenate([
                        e.own[j][at], s.inertials[at, j], e.common[at, j], columns[:, own[j]], s.y[at, [j]],
                    ], axis=1)  # fmt: skip
                    counts = usable[j][at].copy()
                    counts[:fresh] = False
                    A = noise.whitened(A, j, s.recording, s.unsure[at, j])[counts]
                    _added(out.grams[j], s.repeats, A.T @ A)
                    _added(out.rows[j], s.repeats, float(len(A)))

                list(threads.map(add, range(n)))
    out.power[np.isin(lib.entries[1], out.lawless)] = 0.0  # never named
    return out


def _added(sums: dict[int, Any], key: int, more: Any) -> None:
    sums[key] = sums[key] + more if key in sums else more


def joint_grams(
    sums: Sums, lib: Library, data: Data, extra: Sequence[Nuisances], noise: Noise, sensors: np.ndarray | None = None
) -> tuple[JointGram, ...]:
    """Gram matrices of every joint over all candidates.

    Shared columns are [inertials | common nuisances | amplitudes | loose inertials], in prior units.

    Args:
        sums: Over all rows.
        lib: The library.
        data: Low-passed rows, with the prior scale of every column.
        extra: Nuisance columns, one per recording.
        noise: Of the rows.
        sensors: What of the noise the sensors make, shape (n,) [N m or N]; all of it by default.
    """
    misfit, common = misfits(noise, sensors), extra[0].common.shape[-1]
    out = []
    for j, (by_repeats, rows) in enumerate(zip(sums.grams, sums.rows, strict=True)):
        power = np.sum([np.diagonal(G) for G in by_repeats.values()], axis=0)
        index, take, scale = _in_prior_units(lib, data.scale, len(extra[0].groups[j]), common, power, j)
        alike = rows_alike(data, noise, misfit, j)
        blocks = np.stack([G[np.ix_(take, take)] * (scale[:, None] * scale) / alike for G in by_repeats.values()])
        count, repeats = np.array([*rows.values()]) / alike, np.array([*rows])
        out.append(JointGram(index, blocks, extra[0].groups[j], count, repeats, float(misfit[j])))
    return tuple(out)


def _in_prior_units(
    lib: Library, prior: np.ndarray, own: int, common: int, power: np.ndarray, j: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the shared columns that move a joint, y last; where all its columns stand in the sums; their scales.

    Args:
        lib: The library.
        prior: Prior standard deviation of every column, shape (K,).
        own: Number of the joint's own columns.
        common: Number of nuisance parameters that all joints share.
        power: Diagonal of the joint's sums.
        j: The joint.
    """
    joints, amplitudes = lib.entries
    k, mine = 10 * lib.robot.n, amplitudes[joints == j]
    # Loose inertials have the columns of the inertials: in the sums they stand once.
    links = own + np.arange(k)
    stands = np.concatenate([links, own + k + common + np.arange(len(mine)), links])
    number = np.concatenate([np.arange(k), k + mine, k + lib.size + np.arange(k)])
    active = (power[stands] > 0.0) & (prior[number] > 0.0)
    stands, number = stands[active], number[active]
    first, rest = (number < k), (number >= k)
    take = np.concatenate([
        np.arange(own), stands[first], own + k + np.arange(common), stands[rest], [len(power) - 1]
    ])  # fmt: skip
    scale = np.concatenate([np.ones(own), prior[number[first]], np.ones(common), prior[number[rest]], [1.0]])
    index = np.concatenate([number[first], k + np.arange(common), number[rest] + common, [len(prior) + common]])
    return index, take, scale


def misfits(noise: Noise, sensors: np.ndarray | None) -> np.ndarray:
    """Share of the variance of each joint's noise that the sensors don't make, shape (n,); none by default."""
    total = np.sqrt(np.mean(noise.total**2, axis=0))
    return np.zeros(len(total)) if sensors is None else 1.0 - np.minimum(sensors / total, 1.0) ** 2


def grams_by_block(
    data: Data, extra: Sequence[Nuisances], noise: Noise, sensors: np.ndarray, columns: np.ndarray, blocks: int
) -> tuple[JointGram, ...]:
    """Gram matrices of every joint over few columns, by block of the data: to leave some out.

    Args:
        data: Low-passed rows that hold the columns.
        extra: Nuisance columns, one per recording.
        noise: Of the rows.
        sensors: What of the noise the sensors make, shape (n,) [N m or N].
        columns: Which columns, inertials first.
        blocks: Contiguous blocks per recording.
    """
    return tuple(
        _gram_by_block(data, extra, noise, misfits(noise, sensors), columns, blocks, j)
        for j in range(data.stretches[0].y.shape[1])
    )


def _gram_by_block(
    data: Data, extra: Sequence[Nuisances], noise: Noise, misfit: np.ndarray, columns: np.ndarray, blocks: int, j: int
) -> JointGram:
    k, common = data.nuisances, extra[0].common.shape[-1]
    moves = np.any([np.any(s.of(columns, j) != 0.0, axis=0) for s in data.stretches], axis=0)
    active = columns[moves & (data.scale[columns] > 0.0)]
    links, others = active[active < k], active[active >= k]
    index = np.concatenate([links, k + np.arange(common), others + common, [len(data.scale) + common]])
    out, count, repeats = [], [], []
    for s, e in zip(data.stretches, extra, strict=True):
        A = np.concatenate([
            e.own[j], s.of(links, j) * data.scale[links], e.common[:, j], s.of(others, j) * data.scale[others],
            s.y[:, [j]],
        ], axis=1)  # fmt: skip
        A, usable = noise.whitened(A, j, s.recording, s.unsure[:, j]), noise.usable(s.use[:, j], j)
        edges = np.linspace(0, len(A), blocks + 1).astype(int)
        for block in map(slice, edges[:-1], edges[1:]):
            part = A[block][usable[block]]
            out.append(part.T @ part)
            count.append(len(part))
            repeats.append(s.repeats)
    alike = rows_alike(data, noise, misfit, j)
    grams, rows = np.stack(out) / alike, np.array(count) / alike
    return JointGram(index, grams, extra[0].groups[j], rows, np.array(repeats), float(misfit[j]))


def rows_alike(data: Data, noise: Noise, misfit: np.ndarray, j: int) -> float:
    """How many rows of a joint count as one observation.

    Sensor noise is independent from row to row.  What a law errs by is a function of the joint's state and stays the
    same for as long as its speed does; and the residual shows for how many rows it stays the same at least.

    Args:
        data: Low-passed rows.
        noise: Of the rows.
        misfit: Share of the noise's variance that the sensors don't make, shape (n,).
        j: The joint.
    """
    speed = [s.qd[:, j] - np.mean(s.qd[:, j]) for s in data.stretches]
    return max(float(noise.alike[j]), 1.0 + float(misfit[j]) * (correlation_time(speed) - 1.0))

