"""Does it hold on data that the fit did not see?  Recordings, or blocks of a single one, are left out in turn."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.assemble import problem
from irb140_jax.mismatch.evidence import Grams, posterior
from irb140_jax.mismatch.explain import Explanation, full_posterior
from irb140_jax.mismatch.noise import noise_from_residuals


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Residuals on rows that the fit behind them did not see, one array (R, n) per recording [N m or N].

    Attributes:
        nominal: Of the model as given.
        refit: Of the rigid body with refitted inertials.
        corrected: Of refit and findings together.
        use: Rows that count, (R, n).
        floor: Standard deviation of the noise in the band, shape (n,).
    """

    nominal: list[np.ndarray]
    refit: list[np.ndarray]
    corrected: list[np.ndarray]
    use: list[np.ndarray]
    floor: np.ndarray

    def rmse(self, residuals: list[np.ndarray]) -> np.ndarray:
        """RMS over the rows that count, shape (n,)."""
        squares = sum(np.sum(np.where(u, r, 0.0) ** 2, axis=0) for r, u in zip(residuals, self.use, strict=True))
        return np.sqrt(squares / np.maximum(sum(u.sum(axis=0) for u in self.use), 1))


def folds(g: Grams) -> list[np.ndarray]:
    """Blocks to leave out together: a recording each, or contiguous blocks of the only one."""
    if len(set(g.recording)) > 1:
        return [g.recording == r for r in sorted(set(g.recording))]
    return [np.arange(len(g.recording)) == b for b in range(len(g.recording))]


def refit_problem(ex: Explanation) -> tuple[Grams, np.ndarray]:
    """Gram matrices under the noise of the rigid body alone, and the columns that a refit of inertials uses."""
    loose = tuple(c for c in ex.chosen if ex.data.candidates[c].slug == "inertials")
    columns = ex.columns(loose)
    noise, g = ex.noise, ex.grams
    for _ in range(2):
        w = posterior(g.total(), columns)
        coefficients = w.mean * ex.data.scale[columns]
        residuals = [s.y - s.X[..., columns] @ coefficients for s in ex.data.stretches]
        noise = noise_from_residuals(residuals, [s.use for s in ex.data.stretches], np.zeros(residuals[0].shape[1]))
        g = problem(ex.data, noise)[1]
    return g, columns


def held_out(ex: Explanation, refit_grams: Grams, refit_columns: np.ndarray) -> HeldOut:
    """Residuals of the rival models, each row predicted from the other recordings (or blocks)."""
    data = ex.data
    out = {name: [s.y.copy() for s in data.stretches] for name in ("refit", "corrected")}
    for fold in folds(ex.grams):
        fits = {
            "refit": (refit_columns, posterior(refit_grams.total(fold), refit_columns).mean),
            "corrected": (ex.columns(), full_posterior(data, ex.problem, ex.grams, ex.chosen, fold).mean),
        }
        for r, s in enumerate(data.stretches):
            mine = fold[ex.grams.recording == s.recording]
            edges = np.linspace(0, len(s.t), len(mine) + 1).astype(int)
            for b in np.flatnonzero(mine):
                rows = slice(edges[b], edges[b + 1])
                for name, (columns, mean) in fits.items():
                    out[name][r][rows] -= s.X[rows][..., columns] @ (mean * data.scale[columns])
    nominal = [s.y for s in data.stretches]
    level = np.minimum(np.sqrt(np.mean(ex.floor.total**2, axis=0)), np.sqrt(np.mean(ex.noise.total**2, axis=0)))
    return HeldOut(nominal, out["refit"], out["corrected"], [s.use for s in data.stretches], level)


def held_out_gain(ex: Explanation, without: int) -> tuple[float, float]:
    """What a finding is worth on unseen data.

    Returns:
        Share of the whitened squared error, beyond the noise, that the finding removes; and the log-likelihood gain.
    """
    H = ex.grams.blocks
    errors = {"with": 0.0, "without": 0.0}
    rows = 0.0
    for fold in folds(ex.grams):
        unseen = H[fold].sum(axis=0)
        rows += ex.grams.rows[fold].sum()
        for name, chosen in (("with", ex.chosen), ("without", tuple(c for c in ex.chosen if c != without))):
            columns = ex.columns(chosen)
            w = np.concatenate([posterior(ex.grams.total(fold), columns).mean, [-1.0]])
            index = np.concatenate([columns, [H.shape[1] - 1]])
            errors[name] += float(w @ unseen[np.ix_(index, index)] @ w)
    drop = errors["without"] - errors["with"]
    return drop / max(errors["without"], 1e-300), 0.5 * drop


def jackknife_factor(ex: Explanation) -> np.ndarray:
    """How much wider than the posterior the estimates scatter over the data, per amplitude, never below 1.

    Blocks are left out in turn; scatter over recordings is the primary error bar, since it sees what white noise
    does not: laws that fit here and not there.
    """
    whole = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)
    blocks = len(ex.grams.recording)
    means = []
    for b in range(blocks):
        left_out = np.arange(blocks) == b
        means.append(full_posterior(ex.data, ex.problem, ex.grams, ex.chosen, left_out).mean)
    means = np.array(means)
    variance = (blocks - 1) / blocks * np.sum((means - means.mean(axis=0)) ** 2, axis=0)
    return np.sqrt(np.maximum(variance / np.maximum(np.diag(whole.cov), 1e-300), 1.0))
