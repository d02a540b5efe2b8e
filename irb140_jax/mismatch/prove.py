"""Does it hold on data that the fit did not see?  Recordings, or blocks of a single one, are left out in turn."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch.assemble import BLOCKS
from irb140_jax.mismatch.evidence import Grams, Posterior, grams, posterior
from irb140_jax.mismatch.explanation import Explanation, explained_by, full_posterior, noise_left, parts
from irb140_jax.mismatch.name import ACCEPT, PREFER, possible_beside, simpler

MOST_OF_IT = 0.5  # of what is known of an amplitude, beyond which the block that holds it is no sample of its scatter
ALONE = 0.8  # share of a joint's usable rows, or of a finding's torque, beside which the others say nothing of it


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Residuals on rows that the fit behind them did not see, one array (R, n) per recording [N m or N].

    Attributes:
        nominal: Of the model as given.
        refit: Of the rigid body with refitted inertials.
        corrected: Of refit and findings together.
        use: Rows that count, (R, n).
        floor: Standard deviation of what the explanation leaves on data it did see, parameters paid for, shape (n,).
    """

    nominal: list[np.ndarray]
    refit: list[np.ndarray]
    corrected: list[np.ndarray]
    use: list[np.ndarray]
    floor: np.ndarray

    @property
    def judged(self) -> np.ndarray:
        """Joints of which there are rows to judge by, shape (n,)."""
        return np.any([u.any(axis=0) for u in self.use], axis=0)

    def rmse(self, residuals: list[np.ndarray]) -> np.ndarray:
        """RMS over the rows that count, shape (n,)."""
        squares = sum(np.sum(np.where(u, r, 0.0) ** 2, axis=0) for r, u in zip(residuals, self.use, strict=True))
        return np.sqrt(squares / np.maximum(sum(u.sum(axis=0) for u in self.use), 1))


def folds(ex: Explanation) -> list[np.ndarray]:
    """Blocks to leave out together: a motion each, with all that repeat it, or contiguous blocks of the only one.

    A motion that all but alone moves some joint, or all but alone holds what a finding does, is left out block by
    block, too: without it nothing is known there, and a wall that is touched once would drown all else.
    """
    g = ex.grams
    out, weight = [], np.vstack([g.rows.T, _energy(ex, ex.chosen)])
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    of_recording = np.array([s.motion if s.motion >= 0 else -1 - s.recording for s in ex.data.stretches])
    motion, number = of_recording[g.recording], _number_within(g.recording)
    for m in dict.fromkeys(motion.tolist()):
        mine = motion == m
        alone = np.max(weight[:, mine].sum(axis=1)) > ALONE
        out += [mine & (number == k) for k in np.unique(number[mine])] if alone else [mine]
    return out


def _number_within(recording: np.ndarray) -> np.ndarray:
    """Number of each block within its recording, shape (blocks,)."""
    return np.arange(len(recording)) - np.searchsorted(recording, recording)


def _energy(ex: Explanation, chosen: tuple[int, ...]) -> np.ndarray:
    """Squared whitened torque of each member of a set in each block, shape (members, blocks)."""
    mean = full_posterior(ex.data, ex.problem, ex.grams, chosen).mean
    out = np.zeros((len(chosen), len(ex.grams.recording)))
    for k, (c, part) in enumerate(zip(chosen, parts(ex.data, chosen), strict=True)):
        columns, w = ex.problem.columns((c,)), mean[part]
        out[k] = np.einsum("i,bij,j->b", w, ex.grams.blocks[:, columns[:, None], columns], w)
    return out


@dataclasses.dataclass(frozen=True)
class Refit:
    """The rigid body with refitted inertials and nothing else.

    Attributes:
        grams: Gram matrices of its columns alone, under the noise that it leaves.
        columns: Which of all columns those are.
    """

    grams: Grams
    columns: np.ndarray

    def posterior(self, without: np.ndarray | None = None) -> Posterior:
        """Inertials from all blocks, or from all but some."""
        post = posterior(self.grams.total(without), np.arange(len(self.columns)))
        return dataclasses.replace(post, columns=self.columns)


def refitted(ex: Explanation) -> Refit:
    """Refit the inertials; links that the explanation found wrong beyond their stated uncertainty are free here too.

    Where nothing is named this is the explanation, under its noise.
    """
    columns = ex.columns(tuple(c for c in ex.chosen if ex.data.candidates[c].slug == "inertials"))
    stretches = [s.of_rigid_body(columns) for s in ex.data.stretches]
    scale, alone = ex.data.scale[columns], len(columns) == len(ex.columns())
    noise = ex.noise if alone else noise_left(stretches, scale, [], ex.noise)
    return Refit(grams(stretches, noise, scale, len(columns), BLOCKS), columns)


def held_out(ex: Explanation, refit: Refit) -> HeldOut:
    """Residuals of the rival models, each row predicted from the other recordings (or blocks)."""
    data, energy = ex.data, _energy(ex, ex.chosen)
    seen = full_posterior(data, ex.problem, ex.grams, ex.chosen).mean
    bare = [s.of_rigid_body(refit.columns) for s in data.stretches]
    out = {"refit": [s.y.copy() for s in bare], "corrected": [s.y.copy() for s in data.stretches]}
    for fold in folds(ex):
        unseen = full_posterior(data, ex.problem, ex.grams, ex.chosen, fold).mean
        corrected = np.where(_only_here(ex, ex.chosen, energy, fold), seen, unseen)
        means = {"refit": refit.posterior(fold).mean * data.scale[refit.columns]}
        means["corrected"] = corrected * data.scale[ex.columns()]
        for r, s in enumerate(data.stretches):
            mine = fold[ex.grams.recording == s.recording]
            edges = np.linspace(0, len(s.t), len(mine) + 1).astype(int)
            for b in np.flatnonzero(mine):
                rows = slice(edges[b], edges[b + 1])
                out["refit"][r][rows] -= bare[r].X[rows] @ means["refit"]
                out["corrected"][r][rows] -= s.X[rows][..., ex.columns()] @ means["corrected"]
    nominal = [s.tau - s.nominal for s in data.stretches]
    level = np.sqrt(np.mean(ex.noise.total**2, axis=0))
    return HeldOut(nominal, out["refit"], out["corrected"], [s.use for s in data.stretches], level)


def unseen_error(ex: Explanation, chosen: tuple[int, ...]) -> float:
    """Whitened squared error of a set on data that its fit did not see."""
    columns, error = ex.columns(chosen), 0.0
    own = ex.grams.of(columns)
    every, energy = np.arange(len(columns)), _energy(ex, chosen)
    seen = posterior(own.total(), every).mean
    for fold in folds(ex):
        only = _only_here(ex, chosen, energy, fold)
        w = np.append(np.where(only, seen, posterior(own.total(fold), every).mean), -1.0)
        error += float(w @ own.blocks[fold].sum(axis=0) @ w)
    return error


def _only_here(ex: Explanation, chosen: tuple[int, ...], energy: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Which columns of a set belong to what happens once, or but for a trace in this fold: no other tells of them."""
    members = [ex.data.candidates[i] for i in chosen]
    alone = energy[:, fold].sum(axis=1) > ALONE * energy.sum(axis=1)
    each = [np.full(len(c.columns), c.effect.once or a) for c, a in zip(members, alone, strict=True)]
    return np.concatenate([np.zeros(ex.data.nuisances, dtype=bool), *each])


def held_out_gain(ex: Explanation, without: int) -> tuple[float, float]:
    """What a finding is worth on unseen data.

    Returns:
        Share of the whitened squared error, noise included, that the finding removes; and the log-likelihood gain.
    """
    rest = unseen_error(ex, tuple(c for c in ex.chosen if c != without))
    drop = rest - unseen_error(ex, ex.chosen)
    return drop / max(rest, 1e-300), 0.5 * drop


def transferring(ex: Explanation) -> Explanation:
    """The explanation without findings, or refinements of a simpler law, that do not help on unseen data.

    A name must transfer: a refinement by as much as the search asks of it on seen data, a finding at all.  Beside the
    error on unseen data counts how far the inertials must be from where the model has them, in stated standard
    deviations: a rotor or a payload that inertials of twenty deviations could stand for predicts no better than they.
    """
    while True:
        error = unseen_error(ex, ex.chosen) + _strain(ex, ex.chosen)
        worst, better = 0.0, ex.chosen
        for c in ex.chosen:
            if ex.data.candidates[c].effect.silent:
                continue
            rest = tuple(x for x in ex.chosen if x != c)
            fits = np.isfinite(ex.problem.scores(rest, ex.data.candidates[c].joints))
            options = [o for o in possible_beside(ex.problem, rest, simpler(ex.problem, c)) if fits[list(o)].all()]
            for option, least in ((), 0.0), *((o, PREFER) for o in options):
                other = (*rest, *option)
                loss = 0.5 * (unseen_error(ex, other) + _strain(ex, other) - error) - least
                if loss < worst:
                    worst, better = loss, (*rest, *option)
        if better == ex.chosen:
            return ex
        ex = explained_by(ex, better)


def lasting(ex: Explanation) -> Explanation:
    """The explanation without findings that are not beyond what their amplitudes scatter by over the recordings.

    White noise would be sure of a trace that each recording puts elsewhere: of a law that is another's shadow.  What
    the scatter says of an amplitude takes the place of what white noise would in the evidence for it.  Of what is late,
    smoothing and control in steps may make any part up to a bound: what is beyond it counts.
    """
    while True:
        post = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)
        # What happens in one block only is not contradicted by the others.
        wide = scatter(ex, [True] * len(ex.chosen))
        odds = {}
        for i, part in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
            if ex.data.candidates[i].effect.silent:
                continue
            mean, known = post.mean[part], np.linalg.inv(post.cov[part, part])
            bound = np.sqrt(3.0 * np.diag(post.cov[part, part])) * ex.problem.imitated[i]
            sure = np.sign(mean) * np.maximum(np.abs(mean) - bound, 0.0) / wide[part]
            alone = ex.problem.odds(tuple(x for x in ex.chosen if x != i), (i,))
            odds[i] = alone - 0.5 * (mean @ known @ mean - sure @ known @ sure) + float(np.log(wide[part]).sum())
        least = min(odds, key=lambda i: odds[i], default=None)
        if least is None or odds[least] >= ACCEPT:
            return ex
        ex = explained_by(ex, tuple(i for i in ex.chosen if i != least))


def _strain(ex: Explanation, chosen: tuple[int, ...]) -> float:
    """Squared shift of the inertials that a set needs, in stated standard deviations."""
    mean = full_posterior(ex.data, ex.problem, ex.grams, chosen).mean
    return float(mean[: ex.data.nuisances] @ mean[: ex.data.nuisances])


def jackknife_factor(ex: Explanation) -> np.ndarray:
    """How much wider than the posterior the estimates are, per amplitude, never below 1.

    As much as they scatter; and what is out of time is known no better than the smoothing and the steps of the control,
    which are as late in all blocks.
    """
    imitated = ex.problem.imitated[list(ex.chosen)]
    late = [np.full(len(m.columns), i) for m, i in zip(ex.members, imitated, strict=True)]
    return np.hypot(
        scatter(ex, [m.effect.once for m in ex.members]), np.concatenate([np.zeros(ex.data.nuisances), *late])
    )


def scatter(ex: Explanation, lopsided: Sequence[bool]) -> np.ndarray:
    """How much wider than the posterior the estimates scatter over the recordings, per amplitude, never below 1.

    Blocks are left out in turn; scatter over recordings is the primary error bar, since it sees what white noise
    does not: laws that fit here and not there.

    Args:
        ex: The explanation.
        lopsided: Of which of its members a block that holds most of what is known, of a push or of a wall that is
            touched once, is no sample of scatter: when it goes, its weight is that of its share (Busing, Meijer and
            van der Leeden, Statistics and Computing 9, 1999).
    """
    whole = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)
    blocks = len(ex.grams.recording)
    left_out = [np.arange(blocks) == b for b in range(blocks)]
    posts = [full_posterior(ex.data, ex.problem, ex.grams, ex.chosen, b) for b in left_out]
    known, means = np.maximum(np.diag(whole.cov), 1e-300), np.array([p.mean for p in posts])
    each = [np.full(len(m.columns), one) for m, one in zip(ex.members, lopsided, strict=True)]
    spared = np.concatenate([np.full(ex.data.nuisances, False), *each])
    share = np.maximum(1.0 - known / [np.diag(p.cov) for p in posts], MOST_OF_IT)
    weight = np.where(spared & (share > MOST_OF_IT), (1.0 - share) / share, blocks - 1.0)
    centre = np.where(spared, whole.mean, means.mean(axis=0))
    variance = np.sum(weight * (means - centre) ** 2, axis=0) / blocks
    return np.sqrt(np.maximum(variance / known, 1.0))
