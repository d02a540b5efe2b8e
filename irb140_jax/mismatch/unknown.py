"""Structure that no effect of the library explains: a flexible competitor, scored on data that it did not see."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.explain import Explanation
from irb140_jax.mismatch.noise import Noise
from irb140_jax.mismatch.prove import HeldOut, folds

FEATURES = 120  # random Fourier features a variable set; more adds nothing at this length of data
SHIFTS = 99  # circular time shifts that make the null
MATERIAL_SHARE = 0.05  # of the remaining residual's variance; less is not worth a person's time
MATERIAL_TORQUE = 0.02  # of the joint's torque RMS; below, noise-free input would report rounding
SIGNIFICANT = 0.01
SEED = 20260
VARIABLES = ("position", "speed", "acceleration", "load", "time")


@dataclasses.dataclass(frozen=True)
class Unexplained:
    """What is left at one joint.

    Attributes:
        joint: Index.
        share: Part of the remaining residual's variance that is predictable on unseen data.
        p_value: Share of time-shifted copies that are as predictable.
        variable: The variable that carries most of it.
        rms: Size of the predictable part [N m or N].
    """

    joint: int
    share: float
    p_value: float
    variable: str
    rms: float


def unexplained(ex: Explanation, proof: HeldOut) -> list[Unexplained]:
    """Joints whose residual, findings taken off, can be predicted on unseen data from the motion."""
    out = []
    n = len(proof.floor)
    torque = np.sqrt(np.mean(np.concatenate([s.tau for s in ex.data.stretches]) ** 2, axis=0))
    rmse = proof.rmse(proof.corrected)
    for j in range(n):
        inputs, y, fold = _whitened_residual(ex, proof, j)
        if len(y) < 200:
            continue
        share = _predictable(inputs, y, fold)
        size = np.sqrt(max(share, 0.0)) * rmse[j]
        if share < MATERIAL_SHARE or size < MATERIAL_TORQUE * torque[j]:
            continue
        null = _null(inputs, y, fold)
        p = (1 + np.sum(null >= share)) / (1 + len(null))
        if p > SIGNIFICANT:
            continue
        alone = {v: _predictable(inputs[:, [k]], y, fold) for k, v in enumerate(VARIABLES)}
        out.append(Unexplained(j, float(share), float(p), max(alone, key=lambda v: alone[v]), float(size)))
    return out


def _whitened_residual(ex: Explanation, proof: HeldOut, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs (R, 5) standardised, the held-out residual, and the fold of each row.

    Only the level is divided out, not the colour: a slow structure is exactly what is looked for.
    """
    inputs, target, fold = [], [], []
    split = folds(ex.grams)
    for r, s in enumerate(ex.data.stretches):
        blocks = np.flatnonzero(ex.grams.recording == s.recording)
        edges = np.linspace(0, len(s.t), len(blocks) + 1).astype(int)
        of_row = np.zeros(len(s.t), dtype=int)
        for b, block in enumerate(blocks):
            of_row[edges[b] : edges[b + 1]] = next(i for i, f in enumerate(split) if f[block])
        use = Noise.usable(s.use[:, j])
        t = (s.t - s.t[0]) / max(s.t[-1] - s.t[0], 1e-9)
        x = np.stack([s.q[:, j], s.qd[:, j], s.qdd[:, j], s.nominal[:, j], t], axis=1)
        inputs.append(x[use])
        target.append(proof.corrected[r][use, j] / ex.noise.total[r, j])
        fold.append(of_row[use])
    x, y, f = np.concatenate(inputs), np.concatenate(target), np.concatenate(fold)
    if len(y):
        x = (x - x.mean(axis=0)) / np.maximum(x.std(axis=0), 1e-12)
        limit = 6.0 * np.median(np.abs(y)) + 1e-12
        y = np.clip(y - np.mean(y), -limit, limit)
    return x, y, f


def _features(x: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(SEED)
    omega = rng.normal(size=(x.shape[1], FEATURES)) * rng.choice([0.5, 1.0, 2.0], size=FEATURES)
    phase = rng.uniform(0, 2 * np.pi, FEATURES)
    return np.concatenate([np.cos(x @ omega + phase), x, np.sign(x)], axis=1)


def _predictable(x: np.ndarray, y: np.ndarray, fold: np.ndarray) -> float:
    """Share of variance that ridge regression on the features predicts on left-out folds."""
    return float(_scores(_features(x), y[:, None], fold)[0])


def _scores(phi: np.ndarray, Y: np.ndarray, fold: np.ndarray) -> np.ndarray:
    missed, whole = np.zeros(Y.shape[1]), np.sum(Y**2, axis=0)
    for f in np.unique(fold):
        train, test = fold != f, fold == f
        if not train.any():
            return np.zeros(Y.shape[1])
        A = phi[train]
        w = np.linalg.solve(A.T @ A + 1e-2 * len(A) * np.eye(A.shape[1]), A.T @ Y[train])
        missed += np.sum((Y[test] - phi[test] @ w) ** 2, axis=0)
    return 1.0 - missed / np.maximum(whole, 1e-300)


def _null(x: np.ndarray, y: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Scores of copies of the residual shifted in time against the motion, within each fold."""
    rng = np.random.default_rng(SEED + 1)
    copies = np.empty((len(y), SHIFTS))
    for f in np.unique(fold):
        rows = np.flatnonzero(fold == f)
        for k in range(SHIFTS):
            copies[rows, k] = np.roll(y[rows], rng.integers(len(rows) // 10, max(len(rows) - len(rows) // 10, 2)))
    return _scores(_features(x), copies, fold)
