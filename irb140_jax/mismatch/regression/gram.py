"""Gram matrices of every joint, and what is left of them once its nuisance parameters are integrated out.

With whitened rows y = Z z + E_j e + X w + noise of unit variance times the level, own nuisances e of joint j touch its
rows only.  For given sizes of the discrepancy they are integrated out joint by joint, which leaves a small matrix over
inertials, effects and y; sums of those over joints are all that a search needs.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import linalg

from irb140_jax.mismatch.assemble import Data
from irb140_jax.mismatch.noise import Noise
from irb140_jax.mismatch.regression.nuisances import SCALED, Nuisances

SIZES = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)  # of a block, as a share of the joint's torque
USUAL = 0.03  # share of the torque that laws are usually wrong by: scale of the half-Cauchy prior
LEVELS = tuple(1.25**k for k in range(0, 24))  # noise over the sensors' level
REMEMBERED = 128  # factors of a joint

Setting = tuple[int, ...]  # indices into SIZES for each block of SCALED, and into LEVELS


def log_prior(setting: Setting) -> float:
    """Log prior of the sizes of a joint's discrepancy, half-Cauchy over the grid."""
    edges = np.sqrt(np.multiply(SIZES[1:-1], SIZES[2:]))
    edges = np.concatenate([[0.0, SIZES[1] / 2.0], edges, [np.inf]])
    mass = np.diff(np.arctan(edges / USUAL)) * 2.0 / np.pi
    return float(np.log(mass[list(setting[:-1])]).sum())


@dataclasses.dataclass(frozen=True)
class Factor:
    """What integrating out a joint's own nuisances takes, at some sizes and a noise level.

    Attributes:
        half: What integrating them out takes off the Gram matrix of shared columns and y, half.T @ half, (D, k + 1).
        level: Noise over the sensors' level.
        constant: What this adds to the log evidence: log determinants, noise level and prior of the sizes.
    """

    half: np.ndarray
    level: float
    constant: float


class JointGram:
    """Gram matrices of one joint's rows, by block of the data.

    Args:
        index: Global numbers of the shared columns that move this joint, y last.
        blocks: Gram matrices over [own | shared | y] in prior units, shape (B, D + k + 1, D + k + 1).
        groups: Block of each own column, see `Nuisances`.
        rows: Rows of each block, shape (B,).
    """

    def __init__(self, index: np.ndarray, blocks: np.ndarray, groups: np.ndarray, rows: np.ndarray):
        self.index, self.blocks, self.groups, self.rows = index, blocks, groups, rows
        self.total = blocks.sum(axis=0)
        self._factors: dict[Setting, Factor] = {}

    def factor(self, setting: Setting) -> Factor:
        """See `Factor`; kept, for a search asks for the same ones thousands of times."""
        if setting not in self._factors:
            if len(self._factors) >= REMEMBERED:
                self._factors.pop(next(iter(self._factors)))
            self._factors[setting] = self._factor(setting)
        return self._factors[setting]

    def _factor(self, setting: Setting) -> Factor:
        level, size = LEVELS[setting[-1]], own_scale(self.groups, setting)
        used = np.flatnonzero(size > 0.0)
        s = size[used]
        M = s[:, None] * self.total[np.ix_(used, used)] * s / level**2 + np.eye(len(used))
        chol = linalg.cholesky(M, lower=True)
        D = len(self.groups)
        half = linalg.solve_triangular(chol, s[:, None] * self.total[used, D:] / level**2, lower=True)
        left = self.total[-1, -1] / level**2 - half[:, -1] @ half[:, -1]
        constant = -float(np.log(np.diag(chol)).sum()) - float(self.rows.sum()) * np.log(level) - 0.5 * left
        return Factor(half, level, constant + log_prior(setting))

    def left(self, setting: Setting, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some shared columns with others, own nuisances integrated out; numbered as in `index`."""
        f, D = self.factor(setting), len(self.groups)
        return self.total[np.ix_(rows + D, columns + D)] / f.level**2 - f.half[:, rows].T @ f.half[:, columns]

    def own(self, setting: Setting, groups: np.ndarray) -> np.ndarray:
        """Such Gram matrices of many small groups of columns; -1 stands for one that does not move this joint.

        Args:
            setting: Sizes and level.
            groups: Shape (m, k).

        Returns:
            Shape (m, k, k).
        """
        f, at, there = self.factor(setting), groups + len(self.groups), groups >= 0
        G = self.total[at[:, :, None], at[:, None, :]] / f.level**2
        part = f.half[:, groups]
        G = G - np.einsum("amk,aml->mkl", part, part, optimize=True)
        return np.where(there[:, :, None] & there[:, None, :], G, 0.0)


def own_scale(groups: np.ndarray, setting: Setting) -> np.ndarray:
    """Prior standard deviation of each own column."""
    sizes = np.array([1.0, *(SIZES[i] for i in setting[:-1])])
    return sizes[groups + 1]


def joint_grams(data: Data, extra: Sequence[Nuisances], noise: Noise, blocks: int = 1) -> tuple[JointGram, ...]:
    """Whiten the rows and form the Gram matrices of every joint.

    Shared columns are [inertials | common nuisances | amplitudes | loose inertials], in prior units.

    Args:
        data: Low-passed rows.
        extra: Nuisance columns, one per recording.
        noise: Sensors' noise.
        blocks: Contiguous blocks per recording.
    """
    return tuple(_joint_gram(data, extra, noise, blocks, j) for j in range(data.stretches[0].y.shape[1]))


def _joint_gram(data: Data, extra: Sequence[Nuisances], noise: Noise, blocks: int, j: int) -> JointGram:
    k, common = data.nuisances, extra[0].common.shape[-1]
    moves = np.any([np.any(s.X[:, j] != 0.0, axis=0) for s in data.stretches], axis=0)
    active = np.flatnonzero(moves & (data.scale > 0.0))
    inertial, amplitude = active[active < k], active[active >= k]
    index = np.concatenate([inertial, k + np.arange(common), amplitude + common, [len(data.scale) + common]])
    out, count = [], []
    for s, e in zip(data.stretches, extra, strict=True):
        X = s.X[:, j]
        A = np.concatenate([
            e.own[j], X[:, inertial] * data.scale[inertial], e.common[:, j], X[:, amplitude] * data.scale[amplitude],
            s.y[:, [j]],
        ], axis=1)  # fmt: skip
        A, usable = noise.whitened(A, j, s.recording, s.unsure[:, j]), noise.usable(s.use[:, j], j)
        edges = np.linspace(0, len(A), blocks + 1).astype(int)
        for block in map(slice, edges[:-1], edges[1:]):
            part = A[block][usable[block]]
            out.append(part.T @ part)
            count.append(len(part))
    return JointGram(index, np.stack(out), extra[0].groups[j], np.array(count))


START: Setting = (*([3] * (len(SCALED) - 1)), 3, 0)
