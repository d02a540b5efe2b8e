"""Does it hold on data that the fit did not see?  Motions, or blocks of a single one, are left out in turn."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gaussian import Posterior, grams, posterior
from irb140_jax.mismatch.regression.noise import Noise, noise_from_residuals
from irb140_jax.mismatch.regression.nuisances import DRIVE, Nuisances
from irb140_jax.mismatch.regression.rows import Stretch
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.explanation import Explanation, parts, usual_in_its_place

SETTLED = 2  # rounds in which the noise and what leaves it agree


@dataclasses.dataclass(frozen=True)
class Fold:
    """What is left out together, and what the other blocks say.

    Attributes:
        blocks: Which blocks are left out, shape (blocks,).
        refit: Inertials without effects.
        corrected: Inertials and amplitudes of the findings.
        scale: Torque scale less one.
    """

    blocks: np.ndarray
    refit: Posterior
    corrected: Posterior
    scale: float


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Residuals on rows that the fit behind them did not see, one array (R, n) per recording [N m or N].

    Attributes:
        nominal: Of the model as given.
        refit: Of the rigid body with refitted inertials.
        named: Of refit and findings together.
        left: The same, with errors of the instrument at joints where they explain some of it: what smoothing takes off
            accelerations is no physics.
        corrected: The same, with the discrepancy where it is carried.
        recorded, use: Rows in which nothing is lost, and those of them in which the joint moves, (R, n) each.
        carried: Joints at which the discrepancy makes the error on unseen data smaller, shape (n,).
        folds: The fits behind them.
    """

    nominal: list[np.ndarray]
    refit: list[np.ndarray]
    named: list[np.ndarray]
    left: list[np.ndarray]
    corrected: list[np.ndarray]
    recorded: list[np.ndarray]
    use: list[np.ndarray]
    carried: np.ndarray
    folds: tuple[Fold, ...] = ()

    @property
    def judged(self) -> np.ndarray:
        """Joints of which there are rows to judge by, shape (n,)."""
        return np.any([u.any(axis=0) for u in self.use], axis=0)

    def as_predicted(self, beyond: list[np.ndarray]) -> "HeldOut":
        """The same of a model whose torque is this much, (R, n) each, beyond what the columns of its laws add up to.

        That is known of the fit to all data; the fits that leave some out are taken to have as much.
        """
        named, corrected = ([x - b for x, b in zip(of, beyond, strict=True)] for of in (self.named, self.corrected))
        return dataclasses.replace(self, named=named, corrected=corrected)

    def without_discrepancy(self, joints: np.ndarray) -> "HeldOut":
        """The same where some joints, shape (n,), carry no discrepancy."""
        corrected = [np.where(joints, n, c) for n, c in zip(self.named, self.corrected, strict=True)]
        return dataclasses.replace(self, corrected=corrected, carried=self.carried & ~joints)

    def rmse(self, residuals: list[np.ndarray], *, at_rest: bool = False) -> np.ndarray:
        """RMS over the rows in which each joint moves, or over all, shape (n,)."""
        rows = self.recorded if at_rest else self.use
        squares = sum(np.sum(np.where(u, r, 0.0) ** 2, axis=0) for r, u in zip(residuals, rows, strict=True))
        return np.sqrt(squares / np.maximum(sum(u.sum(axis=0) for u in rows), 1))


def folds(ex: Explanation) -> list[np.ndarray]:
    """Blocks to leave out together: a motion each, with all that repeat it, or contiguous blocks of the only one.

    A motion that all but alone moves some joint, or all but alone holds what a finding does, is left out block by
    block, too: without it nothing is known there, and a wall that is touched once would drown all else.
    """
    out, weight = [], np.vstack([np.stack([g.rows for g in ex.by_block.joints]), _energy(ex, ex.chosen)])
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
    number = np.tile(np.arange(settings.BLOCKS), len(ex.data.stretches))
    for mine in _motions(ex):
        alone = np.max(weight[:, mine].sum(axis=1)) > settings.ALONE
        out += [mine & (number == k) for k in np.unique(number[mine])] if alone else [mine]
    return out


def _motions(ex: Explanation) -> list[np.ndarray]:
    """Blocks of each motion, with all that repeat it, shape (blocks,) each."""
    motion = ex.data.motions[recordings_of_blocks(ex)]
    return [motion == m for m in dict.fromkeys(motion.tolist())]


def recordings_of_blocks(ex: Explanation) -> np.ndarray:
    """Recording of each block, shape (blocks,)."""
    return np.repeat([s.recording for s in ex.data.stretches], settings.BLOCKS)


def _energy(ex: Explanation, chosen: tuple[int, ...]) -> np.ndarray:
    """Squared whitened torque of each member of a set in each block, shape (members, blocks)."""
    mean, space = ex.posterior(chosen, instrument=False).mean, ex.by_block
    out = np.zeros((len(chosen), len(space.joints[0].blocks)))
    for k, (c, part) in enumerate(zip(chosen, parts(ex.data, chosen), strict=True)):
        for g, place in zip(space.joints, space.places, strict=True):
            at = place[space.columns[c]]
            w, at = mean[part][at >= 0], at[at >= 0] + len(g.groups)
            out[k] += np.einsum("i,bij,j->b", w, g.blocks[:, at[:, None], at], w)
    return out


@dataclasses.dataclass(frozen=True)
class Refit:
    """The rigid body with refitted inertials and nothing else.

    Attributes:
        ex: The explanation that it stands beside.
        loose: Its candidates that stand for inertials wrong beyond their stated uncertainty: free here too.
        grams: Gram matrices of their columns and the inertials' alone, by block, under the noise that they leave, shape
            (blocks, K + 1, K + 1).
        prior: Standard deviations of the columns' prior, in units of those that were stated: of the explanation.
    """

    ex: Explanation
    loose: tuple[int, ...]
    grams: np.ndarray
    prior: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """Which of all columns those are."""
        return self.ex.columns(self.loose)

    def posterior(self, without: np.ndarray | None = None) -> Posterior:
        """Inertials of possible bodies from all blocks, or from all but some."""
        blocks = self.grams if without is None else self.grams[~without]
        post = posterior(blocks.sum(axis=0), np.arange(len(self.columns)), prior=self.prior)
        mean = self.ex.of_bodies(post.mean, post.cov, self.loose, self.ex.data.nuisances)
        return Posterior(self.columns, mean, post.cov)


def refitted(ex: Explanation) -> Refit:
    """Refit the inertials beside an explanation."""
    loose = tuple(c for c in ex.chosen if ex.data.candidates[c].is_inertials)
    columns = ex.columns(loose)
    stretches = [s.of_rigid_body() for s in ex.data.stretches]
    scale, prior = ex.data.scale[columns], np.ones(len(columns))
    prior[: ex.data.nuisances] = ex.space.width(ex.chosen, ex.hyper)
    noise = _noise_left(stretches, columns, scale, prior, ex.noise)
    return Refit(ex, loose, grams(stretches, columns, noise, scale, settings.BLOCKS), prior)


def _noise_left(
    stretches: list[Stretch], columns: np.ndarray, scale: np.ndarray, prior: np.ndarray, noise: Noise
) -> Noise:
    """Noise that columns leave, fitted under noise that was guessed before, and again under what they leave."""
    every, n = np.arange(len(scale)), stretches[0].y.shape[1]
    for _ in range(SETTLED):
        post = posterior(grams(stretches, columns, noise, scale, 1).sum(axis=0), every, prior=prior)
        residuals = [s.y - s.torque(columns, post.mean * scale) for s in stretches]
        # Effective parameters: shrunk ones count for less; shared ones are split over the joints.
        dof = np.full(n, (len(scale) - float(np.sum(np.diag(post.cov) / prior**2))) / n)
        noise = noise_from_residuals(residuals, [s.use for s in stretches], dof, [s.unsure for s in stretches])
    return noise


def held_out(ex: Explanation, refit: Refit) -> HeldOut:
    """Residuals of the rival models, each row predicted from the other motions (or blocks)."""
    data, energy, recording = ex.data, _energy(ex, ex.chosen), recordings_of_blocks(ex)
    seen = ex.posterior(instrument=False).mean
    bare = [s.of_rigid_body() for s in data.stretches]
    out = {"refit": [s.y.copy() for s in bare], "named": [s.y.copy() for s in data.stretches]}
    out["flexible"], out["left"] = ([s.y.copy() for s in data.stretches] for _ in range(2))
    gains, fits = {"flexible": np.zeros(len(ex.hyper)), "left": np.zeros(len(ex.hyper))}, []
    for fold in folds(ex):
        post, scale, own = ex.prediction(fold)
        post = dataclasses.replace(post, mean=np.where(_only_here(ex, ex.chosen, energy, fold), seen, post.mean))
        fits.append(Fold(fold, refit.posterior(fold), post, scale))
        corrected = post.mean * data.scale[post.columns]
        inertial = fits[-1].refit.mean * data.scale[refit.columns]
        erring, common, errors = ex.beside_instrument(fold)
        erring = np.where(_only_here(ex, ex.chosen, energy, fold), seen, erring) * data.scale[post.columns]
        for r, s in enumerate(data.stretches):
            mine = fold[recording == s.recording]
            if not mine.any():
                continue
            edges = np.linspace(0, len(s.t), len(mine) + 1).astype(int)
            rows, extra, rigid = np.repeat(mine, np.diff(edges)), ex.extra[r], bare[r]
            laws = s.y - s.torque(post.columns, corrected) - scale / settings.GAIN_COMMON * extra.common[..., 0]
            drives = [np.where(g == DRIVE, v, 0.0) for v, g in zip(own, extra.groups, strict=True)]
            unseen = {
                "refit": rigid.y - rigid.torque(refit.columns, inertial),
                "named": laws - _of_own(extra, drives),
                "flexible": laws - _of_own(extra, own),
                "left": s.y - s.torque(post.columns, erring) - extra.common @ common - _of_own(extra, errors),
            }
            for which, x in unseen.items():
                out[which][r][rows] = x[rows]
            for which, gain in gains.items():
                old, new = (np.where(s.use, unseen[k], 0.0)[rows] for k in ("named", which))
                gain += np.sum(old**2 - new**2, axis=0)
    nominal = [s.tau - s.nominal for s in data.stretches]
    recorded, use = [s.recorded for s in data.stretches], [s.use for s in data.stretches]
    carried, left = (
        [np.where(gains[k] > 0.0, better, named) for better, named in zip(out[k], out["named"], strict=True)]
        for k in ("flexible", "left")
    )
    return HeldOut(
        nominal, out["refit"], out["named"], left, carried, recorded, use, gains["flexible"] > 0.0, tuple(fits)
    )


def _of_own(extra: Nuisances, w: list[np.ndarray]) -> np.ndarray:
    """Torque of each joint's own columns, shape (R, n)."""
    return np.stack([x @ v for x, v in zip(extra.own, w, strict=True)], axis=1)


def held_out_gains(ex: Explanation) -> dict[int, float]:
    """Share of the whitened squared error on unseen data, noise included, that each finding removes.

    Of all joints together, over the error of the set without it.  Its noise is that of the whole set, so that inertials
    then go as far from what is stated as they have to: much further than those of `Refit`.
    """
    errors, out = _Errors(ex, folds(ex)), {}
    for i in ex.chosen:
        whole, without = (x.sum() for x in errors.with_and_without(i))
        out[i] = float((without - whole) / max(without, 1e-300))
    return out


def unproved(ex: Explanation) -> list[Site]:
    """Rare effects against which motions speak substantially, each of them also once the worse ones are left out.

    Evidence trusts that some law is true.  Where none of them knows what the model errs by, one may fit all the same,
    and motions that the fit did not see tell: by how many nats they are less probable with it, each joint's error as
    large as it is there, and with what it says nothing of.  Of a single motion, and of a finding that one motion alone
    tells of, the same is asked of what the fit saw: a law that is only wanted for what it undoes of the discrepancy
    makes the error larger there, too.
    """
    against = _against(ex, [i for i in ex.chosen if _is_rare(ex, i)])
    out: list[int] = []
    for i in sorted(against, key=lambda i: -against[i]):
        left = dataclasses.replace(ex, chosen=tuple(k for k in ex.chosen if k not in out))
        if not out or _against(left, [i]):
            out.append(i)
    return [site_of(ex.data.candidates[i]) for i in out]


def _against(ex: Explanation, findings: Sequence[int]) -> dict[int, float]:
    """By how many nats motions speak against each of some findings, where that is substantial."""
    errors = _Errors(ex, _motions(ex))
    nats = {i: errors.against(i) for i in findings}
    return {i: x for i, x in nats.items() if x > settings.SUBSTANTIAL}


def _is_rare(ex: Explanation, index: int) -> bool:
    """Whether a finding is an effect that few robots have, named for its law."""
    c = ex.data.candidates[index]
    return not (c.effect.prior.ordinary or c.is_inertials or index in ex.falls)


@dataclasses.dataclass(frozen=True)
class _Errors:
    """Errors on data that the fit did not see, with what is found and without some of it.

    Attributes:
        ex: The explanation.
        left_out: Blocks that are left out together.
        whole: Errors with all that is found, by whether `ex` itself judges and the inertials' width: filled as asked.
    """

    ex: Explanation
    left_out: list[np.ndarray]
    whole: dict[tuple[bool, float], np.ndarray] = dataclasses.field(default_factory=dict)

    def with_and_without(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Whitened squared error by joint with a finding and without it, shape (n,) each.

        Inertials may be as far off in both as they have to be without it: else what differs is how well they stand in
        for anything, and not what the finding says.
        """
        judge, fewer = self._judge_and_rest(index)
        width = judge.space.width(fewer, judge.hyper)
        return self._of_all(judge, width), _unseen_errors(judge, fewer, self.left_out, width)

    def against(self, index: int) -> float:
        """By how many nats data are less probable with a finding than without it, or with usual friction in its place.

        With it, inertials may be as far off as they have to be without it or as they have to be with it, whichever
        errs less: beside an offset, a weight that may be anything only blurs what either of them is.
        """
        rows, nats = np.array([float(g.rows.sum()) for g in self.ex.by_block.joints]), []
        judge, rest = self._judge_and_rest(index)
        for usual in {(), usual_in_its_place(self.ex.data.candidates, self.ex.chosen, index)}:
            widths = [judge.space.width(members, judge.hyper) for members in (rest + usual, judge.chosen)]
            without = _unseen_errors(judge, rest + usual, self.left_out, widths[0])
            ratios = [(self._of_all(judge, width) + 1e-300) / (without + 1e-300) for width in widths]
            nats.append(min(0.5 * float(np.sum(rows * np.log(ratio))) for ratio in ratios))
        return max(nats) + float(self.ex.space.lost([index], self.ex.hyper)[0])

    def _judge_and_rest(self, index: int) -> tuple[Explanation, tuple[int, ...]]:
        """The explanation that judges a finding, and its set without the finding."""
        judge, site = self.ex.judged_by(index), site_of(self.ex.data.candidates[index])
        return judge, judge.others(next(k for k in judge.chosen if site_of(judge.data.candidates[k]) == site))

    def _of_all(self, judge: Explanation, width: float) -> np.ndarray:
        """Errors with all that is found, shape (n,), by an explanation and the inertials' width."""
        key = judge is self.ex, width
        if key not in self.whole:
            self.whole[key] = _unseen_errors(judge, judge.chosen, self.left_out, width)
        return self.whole[key]


def _unseen_errors(ex: Explanation, chosen: tuple[int, ...], left_out: list[np.ndarray], width: float) -> np.ndarray:
    """Whitened squared error of a set on data that its fit did not see, by joint, shape (n,); see `posterior`.

    What is left out with nothing beside it is seen.
    """
    space, energy = ex.by_block, _energy(ex, chosen)
    error, columns = np.zeros(len(space.joints)), space.with_y(space.set_columns(chosen))
    seen = ex.posterior(chosen, instrument=False, width=width).mean
    for fold in left_out:
        unseen = None if fold.all() else fold
        only = _only_here(ex, chosen, energy, fold)
        mean = np.where(only, seen, ex.posterior(chosen, unseen, instrument=False, width=width).mean)
        w = np.zeros(len(columns))
        w[: space.inertials], w[space.offset : -1], w[-1] = mean[: space.inertials], mean[space.inertials :], -1.0
        seen_by = space if unseen is None else space.without(unseen)
        for j, (g, place) in enumerate(zip(space.joints, space.places, strict=True)):
            at, drive = place[columns], np.flatnonzero(g.groups == DRIVE)
            own = seen_by.own(j, ex.hyper[j], columns[:-1], w[:-1], instrument=False)[drive]
            v, at = np.concatenate([own, w[at >= 0]]), np.concatenate([drive, at[at >= 0] + len(g.groups)])
            error[j] += float(v @ g.blocks[fold].sum(axis=0)[np.ix_(at, at)] @ v)
    return error


def _only_here(ex: Explanation, chosen: tuple[int, ...], energy: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Columns of members that only this fold can tell of: they happen once, or nearly all of their torque is in it."""
    members = [ex.data.candidates[i] for i in chosen]
    alone = energy[:, fold].sum(axis=1) > settings.ALONE * energy.sum(axis=1)
    each = [np.full(len(c.columns), c.effect.shapes.once or a) for c, a in zip(members, alone, strict=True)]
    return np.concatenate([np.zeros(ex.data.nuisances, dtype=bool), *each])
