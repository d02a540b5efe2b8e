"""Gram matrices of every joint: of all candidates from sums over the rows, or of a few columns by block of the data."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.gram import JointGram
from irb140_jax.mismatch.regression.noise import Noise, correlation_time
from irb140_jax.mismatch.regression.nuisances import Nuisances
from irb140_jax.mismatch.regression.sums import Sums


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
    misfit = misfits(noise, sensors)
    return tuple(_gram_by_block(data, extra, noise, misfit, columns, blocks, j) for j in range(len(misfit)))


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
