"""Parameters of position servos fitted to the motion: the second stage for recordings of commands.

Torque of commands follows from positions that the friction itself has shaped, so a law that is not quite right draws
its parameters away from those that make a simulation move as the robot did.  Here the closed loop is simulated from
many moments of the recordings, and these are changed until it follows the positions:

    the amplitudes of what is named, where it acts on a joint and in the simulation; rotors that the torque leaves open;
    each servo's torque gain beside its stated Kp and Kd; its Kd; the time at which commands act

What the torque says is their prior, in either of the ways of `free`.  Gauss-Newton with finite differences of
MuJoCo's simulation.  Of all fits the one is kept whose simulations of motions that it did not see err least, and none
where those err as much as with the torque's own parameters.
"""

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg, optimize

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.corrected.native import beyond_file
from irb140_jax.mismatch.motion.free import ChangedModel, FreeParameters, as_estimated, as_predicted
from irb140_jax.mismatch.motion.inputs import Inputs, time_steps
from irb140_jax.mismatch.motion.laws import without_those
from irb140_jax.mismatch.motion.models import Simulated, followers, leading, led, positions_of, simulated_corrected
from irb140_jax.mismatch.motion.windows import Span, Window, windows
from irb140_jax.mismatch.regression.gaussian import log_odds_of_some
from irb140_jax.mismatch.regression.noise import correlation_time
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.recordings.drive import Drive

ROUNDS = 3  # of Gauss-Newton
CONVERGED = 1.0  # [nats] of the posterior: a round that gains less is the last
STEP = 0.5  # prior standard deviations over which slopes are taken: sticking makes a simulation jagged below
SETTLING = 0.25  # [s] in which a servo comes from any start to its goal: errors of the start count most there
FREEDOM = 4.0  # degrees of Student's distribution over windows: Lange, Little and Taylor, JASA 84 (1989)
ITERATIONS = 20  # to the size of Student's distribution
DIVERGED = 10.0  # [rad or m] off, a simulation has flown away
BATCH = 8  # changed models that are simulated side by side: memory
TINY = 1e-300


@dataclasses.dataclass(frozen=True)
class MotionFit:
    """What a fit to the motion has found.

    Attributes:
        model: The corrected model, without discrepancy, its drive as it was; rotors that are not named and torque
            gains of servos are among its effects.
        of_fold: The same without what each fold leaves out.
        amplitudes: Of candidates that are named, by their number.
        to_drive: Makes the drive of a recording's.
        later: By how much later commands act [s].
        torque_gains: Real over stated torque of servos, less one, and its standard deviation, by joint.
        rotors: Inertia of rotors that are not named, and its standard deviation, by joint [kg m^2 or kg].
        improvement: Share of the position error on motions that the fit did not see which is gone.
        unneeded: Effects that are not there with the odds of a name, by torque and motion together.
    """

    model: CorrectedModel
    of_fold: dict[int, CorrectedModel]
    amplitudes: dict[int, np.ndarray]
    to_drive: Callable[[Drive], Drive]
    later: float
    torque_gains: dict[int, tuple[float, float]]
    rotors: dict[int, tuple[float, float]]
    improvement: float
    unneeded: tuple[Site, ...]


def fit_to_motion(
    data: Comparison, ex: Explanation, of_fold: Callable[[int], CorrectedModel], blocks: Sequence[np.ndarray],
    unseen: Sequence[Span], model: CorrectedModel,
) -> MotionFit | None:  # fmt: skip
    """Fit to the positions of servos what the torque leaves open.

    Args:
        data: Model and recordings, with drives as they were found.
        ex: The explanation.
        of_fold: Corrected model of the torque that has not seen a fold.
        blocks: Of the data that each fold leaves out, shape (blocks,) each.
        unseen: What each fold leaves out, as stretches of time.
        model: Corrected model of the torque.

    Returns:
        The fit; None where nothing can be simulated, or simulations of unseen motions err as much with it.
    """
    cut = windows(list(unseen), [r.t for r in data.smooth])
    if not cut:
        return None
    step, finer = time_steps(data.smooth)
    motions = _Motions(data, Inputs(data.smooth, cut, finer, step), model)
    if motions.follow is None or motions.follow.all():
        return None
    before = motions.of_folds({w.fold: (of_fold(w.fold), lambda drive: drive, 0.0) for w in cut})
    best = None
    for rotors, prior_of in itertools.product(dict.fromkeys(((), ex.open_rotors)), (as_predicted, as_estimated)):
        free, left_out = FreeParameters.of(ex, model, data, rotors, prior_of), {}
        found = _fitted(free, motions)
        for fold in dict.fromkeys(w.fold for w in cut):
            own = free.centred(blocks[fold])
            left_out[fold] = own.model(found.without([w.fold == fold for w in cut], own))
        improvement = _improvement(motions.of_folds(left_out), before)
        if improvement > (best.improvement if best else 0.0):
            best = _as_found(free, found, left_out, improvement)
    return best


def _as_found(
    free: FreeParameters, found: "_Found", left_out: dict[int, ChangedModel], improvement: float
) -> MotionFit:
    """What is told of a fit."""
    own, spread = free.values(found.x), free.unit * np.sqrt(np.diag(linalg.inv(found.precision)))
    joint = lambda w: w.at if w.kind == "torque_gain" else free.base.named[w.at].joints[0]  # noqa: E731
    told = [*zip(free.parameters, own.tolist(), spread.tolist(), strict=True)]
    of_kind = lambda kind: {joint(w): (x, std) for w, x, std in told if w.kind == kind}  # noqa: E731
    model, to_drive, later = free.model(found.x)
    return MotionFit(
        model, {k: made for k, (made, _, _) in left_out.items()}, free.amplitudes(own), to_drive, later,
        of_kind("torque_gain"), of_kind("rotor"), improvement, _unneeded(free, found),
    )  # fmt: skip


def _unneeded(free: FreeParameters, found: "_Found") -> tuple[Site, ...]:
    """Effects whose own amplitudes may be zero, at the odds at which they would not be named."""
    ex, cov, out = free.ex, linalg.inv(found.precision), []
    for index, rows, width in free.own_amplitudes():
        mean, kinds = found.x[rows], ex.space.kinds
        prior = np.maximum(width, np.abs(mean))  # a strong effect's is as wide as it is large
        log_odds = log_odds_of_some(mean, cov[np.ix_(rows, rows)], prior)
        log_odds += kinds.log_prior(ex.chosen) - kinds.log_prior(ex.others(index))
        if log_odds < np.log(settings.NAMED / (1.0 - settings.NAMED)):
            out.append(site_of(ex.data.candidates[index]))
    return tuple(out)


class _Found(NamedTuple):
    """Where a fit has ended, and the least-squares problem of its last round, by window.

    Attributes:
        x: The parameters, shape (P,).
        precision: Of the parameters, shape (P, P).
        about: Where slopes were taken, shape (P,).
        share: Of the last step that was gone.
        grams: Slopes times slopes, shape (B, P, P).
        slopes: Slopes times errors, shape (B, P).
        free: Prior and bounds.
    """

    x: np.ndarray
    precision: np.ndarray
    about: np.ndarray
    share: float
    grams: np.ndarray
    slopes: np.ndarray
    free: FreeParameters

    def without(self, windows_: Sequence[bool], free: FreeParameters) -> np.ndarray:
        """Where it ends without some windows, in that last round, with the prior of `free`."""
        keep = ~np.array(windows_)
        end = _least(self.grams[keep].sum(axis=0), self.slopes[keep].sum(axis=0), self.about, free)
        return self.about + self.share * (end - self.about)


class _Ready(NamedTuple):
    """A model as it is simulated, what makes its drive of a recording's, and by how much later that acts [s]."""

    simulated: Simulated
    to_drive: Callable[[Drive], Drive]
    later: float


class _Motions:
    """Simulations of windows of recordings.

    Attributes:
        given: The windows.
        true: Recorded positions, NaN where they don't count, shape (B, T, n).
        follow: Joints that follow the recording, shape (n,); None where nothing can be simulated.
    """

    def __init__(self, data: Comparison, given: Inputs, model: CorrectedModel):
        self.given, self.step = given, given.step / given.parts
        self.start, self.speed, self.began, self.drives = given.start, given.speed, given.began, given.drives
        self.true = given.positions()
        self.true[:, : round(SETTLING / given.step)] = np.nan
        self.follow, self.missing = None, []
        bare, made = dataclasses.replace(without_those(model), discrepancy=None), simulated_corrected(model, self.step)
        # What happens once or needs a memory acts as a torque, as in the proof.
        missing = beyond_file(bare, data.smooth, [torques_along(bare, r).corrected for r in data.smooth])
        if missing is not None and made.compiled["corrected"].nv == model.robot.n:
            self.missing, self.follow = missing, followers([made], data.smooth)

    def ready(self, model: ChangedModel) -> _Ready:
        """A model compiled."""
        assert self.follow is not None
        made = simulated_corrected(model[0], self.step)
        if self.follow.any():
            made = dataclasses.replace(made, compiled=led(made.compiled, self.follow))
        return _Ready(made, *model[1:])

    def errors(self, sets: Sequence[Sequence[_Ready]]) -> np.ndarray:
        """Simulated less recorded positions, NaN where they don't count, (sets, B, T, n); in each set a model a window.
        """
        out = []
        for group in (sets[i : i + BATCH] for i in range(0, len(sets), BATCH)):
            models = [m for one in group for m in one]
            drives = [d and m.to_drive(d) for m, d in zip(models, self.drives * len(group), strict=True)]
            count = len(self.drives)
            own = [slice(i, i + count) for i in range(0, len(models), count)]
            control = [self.given.control(drives[k], [m.later for m in models[k]]) for k in own]
            torque = [self._torque([m.simulated for m in models[k]]) for k in own]
            start, speed, began = (np.concatenate([x] * len(group)) for x in (self.start, self.speed, self.began))
            went = positions_of(
                [m.simulated for m in models], "corrected", drives, start, speed, np.concatenate(torque),
                np.concatenate(control), began,
            )[:, :: self.given.parts]  # fmt: skip
            off = went.reshape(len(group), *self.true.shape) - self.true
            off[..., self.follow] = np.nan
            out.append(np.clip(off, -DIVERGED, DIVERGED))
        return np.concatenate(out)

    def of_folds(self, models: dict[int, ChangedModel]) -> np.ndarray:
        """The same with the models of the fold of each window, (B, T, n)."""
        ready = {fold: self.ready(model) for fold, model in models.items()}
        return self.errors([[ready[w.fold] for w in self.given.cut]])[0]

    def _torque(self, models: Sequence[Simulated]) -> np.ndarray:
        """Torque on the joints beside that of the servos, shape (B, S, n)."""
        of, follow = dict(zip(self.given.cut, models, strict=True)), self.follow
        assert follow is not None

        def applied(w: Window) -> np.ndarray:
            r = self.given.recordings[w.recording]
            return leading(of[w].torque("corrected", 0.0 * r.tau, self.missing[w.recording]), r, follow)

        return self.given.between(applied)


def _fitted(free: FreeParameters, motions: _Motions) -> _Found:
    """Most probable parameters, from where the torque has them."""
    size, x = len(free.unit), free.mean
    count = len(motions.given.cut)
    errors_at = lambda xs: motions.errors([[motions.ready(free.model(y))] * count for y in xs])  # noqa: E731
    errors = errors_at([x])[0]
    for _ in range(ROUNDS):
        weight = _weights(errors)
        step = np.where(x + STEP <= free.high, STEP, -STEP)
        slopes = (errors_at(x + np.diag(step)) - errors) / step[:, None, None, None]
        weighted = np.nan_to_num(weight[:, None] * slopes.swapaxes(0, 1)).reshape(count, size, -1)
        flat = np.nan_to_num(slopes.swapaxes(0, 1)).reshape(count, size, -1)
        grams = weighted @ flat.swapaxes(1, 2)
        along = (weighted @ np.nan_to_num(errors).reshape(count, -1, 1))[..., 0]
        less = _information(grams, along, [w.fold for w in motions.given.cut], x, free)
        weight, grams, along = less * weight, less * grams, less * along
        end, about = _least(grams.sum(axis=0), along.sum(axis=0), x, free), x
        shares = (1.0, 0.5)
        tried = errors_at([about + share * (end - about) for share in shares])
        lost = [_cost(free, y, weight, e) for y, e in zip(
            [about, *(about + share * (end - about) for share in shares)], [errors, *tried], strict=True)]  # fmt: skip
        best = int(np.argmin(lost))
        share = (0.0, *shares)[best]
        x, errors = about + share * (end - about), [errors, *tried][best]
        if lost[0] - lost[best] < CONVERGED:
            break
    return _Found(x, grams.sum(axis=0) + free.precision, about, share, grams, along, free)


def _weights(errors: np.ndarray) -> np.ndarray:
    """Inverse variance of each error over how many rows say the same, (B, 1, n), by Student's distribution of windows.

    Args:
        errors: Shape (B, T, n), NaN where they don't count.
    """
    square = _mean_square(errors)
    usual, size = _student(square)
    known = [[x[~np.isnan(x)] for x in errors[..., j] if not np.isnan(x).all()] for j in range(errors.shape[-1])]
    alike = [correlation_time(of_joint) if of_joint else 1.0 for of_joint in known]
    return (usual / size / alike)[:, None, :]


def _mean_square(errors: np.ndarray) -> np.ndarray:
    """Over the time of each window, (B, n); NaN where nothing counts."""
    counts = np.isfinite(errors).sum(axis=1)
    return np.where(counts > 0, np.nansum(errors**2, axis=1) / np.maximum(counts, 1), np.nan)


def _information(
    grams: np.ndarray, along: np.ndarray, folds: Sequence[int], about: np.ndarray, free: FreeParameters
) -> float:
    """Share of what the windows seem to say that they do say, as motions differ in what they ask for; at most 1.

    What a law errs by comes back all through a motion, so that its windows are wrong alike, and each would be believed.

    Args:
        grams, along: As `_Found` has them.
        folds: Motion that each window is of.
        about: Where slopes are taken.
        free: Prior and bounds.

    Source: Chandler and Bate, Inference for clustered data using the independence loglikelihood, Biometrika 94 (2007);
    by one factor, as in Pauli, Racugno and Ventura, Bayesian composite marginal likelihoods, Stat. Sinica 21 (2011).
    """
    gram = grams.sum(axis=0)
    end = _least(gram, along.sum(axis=0), about, free)
    score = along + grams @ (end - about)
    of_motion = np.stack([score[np.array(folds) == fold].sum(axis=0) for fold in dict.fromkeys(folds)])
    count = len(of_motion)
    varies = np.cov(of_motion.T).reshape(gram.shape) * count if count > 1 else gram
    known = linalg.inv(gram + free.precision)
    return float(min(1.0, np.sum(known * gram) / max(np.sum(known * varies), TINY)))


def _cost(free: FreeParameters, x: np.ndarray, weight: np.ndarray, errors: np.ndarray) -> float:
    """Negative log posterior but for a constant."""
    apart = x - free.mean
    return 0.5 * float(np.nansum(weight * errors**2) + apart @ free.precision @ apart)


def _least(gram: np.ndarray, along: np.ndarray, about: np.ndarray, free: FreeParameters) -> np.ndarray:
    """Least-squares parameters within their bounds where slopes are those at `about`, shape (P,)."""
    precision = gram + free.precision
    downhill = precision @ about - along - free.precision @ (about - free.mean)
    root = linalg.cholesky(precision, lower=True)
    low, high = np.minimum(free.low, about), np.maximum(free.high, about)
    target = linalg.solve_triangular(root, downhill, lower=True)
    return optimize.lsq_linear(root.T, target, bounds=(low - 1e-9, high + 1e-9), method="bvls").x


def _improvement(now: np.ndarray, before: np.ndarray) -> float:
    """Share of the position error that is gone, the geometric mean over joints."""
    both = [_student(_mean_square(errors))[1] for errors in (now, before)]
    return 1.0 - float(np.exp(0.5 * np.nanmean(np.log(both[0] / both[1]))))


def _student(square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weight of each window by Student's distribution, (B, n), and the mean square that is usual at a joint, (n,).

    Args:
        square: Mean square error in each window, shape (B, n); NaN at joints that don't count.
    """
    counts = np.isfinite(square).any(axis=0)
    weight, size, own = np.full(square.shape, np.nan), np.full(square.shape[1], np.nan), square[:, counts]
    usual = np.maximum(np.nanmedian(own, axis=0), TINY)
    for _ in range(ITERATIONS):
        heavy = (FREEDOM + 1.0) / (FREEDOM + own / usual)
        usual = np.maximum(np.nanmean(heavy * own, axis=0), TINY)
    weight[:, counts], size[counts] = heavy, usual
    return weight, size
