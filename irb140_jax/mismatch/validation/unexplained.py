"""Structure that no effect of the library explains: flexible competitors, scored on data that they did not see.

If one of them predicts what the findings leave, something is left out, and its variables say where.  No finding is
changed by it.
"""

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.noise import spread
from irb140_jax.mismatch.regression.rows import Stretch
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.competitors import Axis, Competitor, Rows, competitors
from irb140_jax.mismatch.validation.held_out import HeldOut

MOST_ROWS = 20_000  # of a joint: of more, every second, third ... is taken; a log of an hour has ten times as many
SHIFTS = 99  # circular time shifts that make the null
SEED = 20261
RIDGES = (0.003, 0.03, 0.3, 3.0, 30.0)  # of the features' variance; the best one counts, in the null as well


class When(NamedTuple):
    """A short time that holds most of what is left.

    Attributes:
        recording: Index.
        begin, end: In the time of its log [s].
        share: Of the squared residual of all recordings.
        of_torque: Residual over logged torque in that time, root mean squares.
    """

    recording: int
    begin: float
    end: float
    share: float
    of_torque: float


class Where(NamedTuple):
    """A short part of what was visited of a position, a speed or a load that holds most of what is left.

    Attributes:
        begin, end: Of the variable.
        share: Of the squared residual of all recordings.
    """

    begin: float
    end: float
    share: float


@dataclasses.dataclass(frozen=True)
class Structure:
    """What is left at one joint.

    Attributes:
        joint: Index.
        share: Part of the remaining residual's variance that is predictable on unseen data.
        p_value: Share of time-shifted copies that are as predictable.
        variable: The variables that carry it, in words.
        rms: Size of the predictable part [N m or N].
        of_torque: The same over the joint's torque, root mean squares.
        axis: One of them, to draw what is left over it.
        when: Where it is that short.
        where: Along the axis, where that is not time and it is that short.
    """

    joint: int
    share: float
    p_value: float
    variable: str
    rms: float
    of_torque: float
    axis: Axis
    when: When | None = None
    where: Where | None = None


def unexplained(ex: Explanation, proof: HeldOut, scatter: np.ndarray) -> tuple[list[Structure], list[Structure]]:
    """Joints whose residual, findings taken off, can be predicted on unseen data.

    Args:
        ex: The explanation.
        proof: Errors on unseen data.
        scatter: Of the sensors, shape (n,) [N m or N].

    Returns:
        Those where it is a share of the joint's torque that is worth a person's time, and those where it is less but
        stands out of the noise of the sensors.
    """
    material, slight = list[Structure](), list[Structure]()
    torque = np.sqrt(np.mean(np.concatenate([s.tau for s in ex.data.stretches]) ** 2, axis=0))
    matters = settings.MATERIAL_TORQUE * torque
    shows = np.minimum(matters, settings.ABOVE_NOISE * scatter)
    for j, rmse in enumerate(proof.rmse(proof.left)):
        least = [max(settings.MATERIAL_SHARE, float(x[j] / max(rmse, 1e-100)) ** 2) for x in (matters, shows)]
        sure = _beyond_chance(ex, proof, j, float(rmse), float(torque[j]), least[1])
        for found, enough in zip((material, slight), least, strict=True):
            if large := [s for s in sure if s.share >= enough]:
                found.append(large[0])
                break
    return material, slight


def _beyond_chance(
    ex: Explanation, proof: HeldOut, j: int, rmse: float, torque: float, least: float
) -> list[Structure]:
    """What is left at a joint as the preferred regression predicts it, and as the best does, where that is no chance.

    Args:
        ex, proof: See `unexplained`.
        j: The joint.
        rmse, torque: What is left of it, and its torque, root mean squares [N m or N].
        least: Share that must be predicted.
    """
    rows = _rows(ex, proof, j)
    # No share of so small a residual could matter.
    if len(rows.residual) < 200 or least > 1.0:
        return []
    rivals = competitors(ex.data.stretches, j, rows, ex.lib.robot.joint_names)
    shares = np.array([predicted(c, rows.residual[:, None], rows)[0] for c in rivals])
    if shares.max() < least:
        return []
    null, both = _null(rivals, rows), zip(ex.data.stretches, proof.left, strict=True)
    left = [np.where(s.use, r, 0.0)[:, j] for s, r in both]
    when = shortest(ex.data.stretches, left, j)
    out = []
    # Along a slow sweep position goes with time, and so do copies of the residual shifted in time: where motion is not
    # beyond chance, what goes with time still is.
    for best in dict.fromkeys((carrier(rivals, shares), int(np.argmax(shares)))):
        share, size = float(shares[best]), float(np.sqrt(max(shares[best], 0.0))) * rmse
        p = float((1 + np.sum(null >= share)) / (1 + SHIFTS))
        if p <= settings.SIGNIFICANT:
            part = size / max(torque, 1e-300)
            axis = rivals[best].axis
            where = narrowest(ex.data.stretches, left, axis)
            out.append(Structure(j, share, p, rivals[best].variable, size, part, axis, when, where))
    return out


def shortest(stretches: list[Stretch], residuals: list[np.ndarray], j: int) -> When | None:
    """The shortest time that holds `MOST_OF_ERROR` of the square of joint j's residuals; None where it is not `BRIEF`.

    Args:
        stretches: Rows of all recordings.
        residuals: Of each [N m or N], shape (R,), zero in rows that don't count.
        j: The joint.
    """
    total = sum(float(np.sum(r**2)) for r in residuals)
    recorded = sum(float(s.t[-1] - s.t[0]) for s in stretches)
    best, least = None, settings.BRIEF * recorded
    for s, r in zip(stretches, residuals, strict=True):
        held = _holds_most(s.t, r, total)
        if held is None or (lasts := s.t[held.stop - 1] - s.t[held.start]) >= least:
            continue
        error, counts = float(np.sum(r[held] ** 2)), r[held] != 0.0
        of_torque = float(np.sqrt(error / max(float(np.sum(s.tau[held, j][counts] ** 2)), 1e-300)))
        best = When(s.recording, float(s.t[held.start]), float(s.t[held.stop - 1]), error / total, of_torque)
        least = float(lasts)
    return best


def narrowest(stretches: list[Stretch], residuals: list[np.ndarray], axis: Axis) -> Where | None:
    """The narrowest part of a variable that holds `MOST_OF_ERROR` of the square of residuals.

    None where it is not `BRIEF`, as a share of what was visited, and along time.

    Args:
        stretches: Rows of all recordings.
        residuals: Of each [N m or N], shape (R,), zero in rows that don't count.
        axis: The variable.
    """
    if axis.quantity == "t":
        return None
    r = np.concatenate(residuals)
    x = np.concatenate([getattr(s, axis.quantity)[:, axis.joint] for s in stretches])[r != 0.0]
    order = np.argsort(x)
    x, r = x[order], r[r != 0.0][order]
    total = float(np.sum(r**2))
    held = _holds_most(x, r, total)
    if held is None or x[held.stop - 1] - x[held.start] >= settings.BRIEF * np.ptp(x):
        return None
    return Where(float(x[held.start]), float(x[held.stop - 1]), float(np.sum(r[held] ** 2)) / total)


def _holds_most(x: np.ndarray, r: np.ndarray, total: float) -> slice | None:
    """Rows of the narrowest part of a rising variable that hold `MOST_OF_ERROR` of a total of squares; None if none do.
    """
    so_far = np.append(0.0, np.cumsum(r**2))
    end = np.searchsorted(so_far, so_far[:-1] + settings.MOST_OF_ERROR * total)
    first = np.flatnonzero(end < len(so_far))
    if not len(first):
        return None
    i = int(first[np.argmin(x[end[first] - 1] - x[first])])
    return slice(i, int(end[i]))


def carrier(rivals: list[Competitor], shares: np.ndarray) -> int:
    """The simplest of the competitors that predict about as much as the best; time only where motion does not nearly.

    Whatever is slow goes with time, and all but noise comes back in the repeats of a motion.  Along one path every
    joint goes with every other, so that those who know more joints predict a little more by chance.
    """
    motion = np.where([c.shifts for c in rivals], shares, -np.inf)
    if motion.max() <= settings.NEARLY * shares.max():
        return int(np.argmax(shares))
    enough = np.flatnonzero(motion >= settings.MOST_OF_ERROR * motion.max())
    return int(min(enough, key=lambda k: (rivals[k].knows, -shares[k])))


def _rows(ex: Explanation, proof: HeldOut, j: int) -> Rows:
    """Only the level is divided out, not the colour: a slow structure is exactly what is looked for."""
    pick = [ex.noise.usable(s.use[:, j], j) for s in ex.data.stretches]
    thin = 1 + sum(int(p.sum()) for p in pick) // MOST_ROWS
    pick = [p & (np.arange(len(p)) % thin == 0) for p in pick]
    level = np.concatenate([
        ex.noise.total[r, j] * spread(s.unsure[p, j], ex.noise.total[r, j])
        for r, (s, p) in enumerate(zip(ex.data.stretches, pick, strict=True))
    ])  # fmt: skip
    recording = np.repeat(np.arange(len(pick)), [p.sum() for p in pick])
    y = np.concatenate([c[p, j] for c, p in zip(proof.left, pick, strict=True)]) / level
    if len(y):
        y = y - (y @ (1.0 / level)) / np.sum(level**-2.0) / level  # a constant in N m: recordings aren't equally loud
        middle = np.median(np.abs(y))
        for r in np.unique(recording):
            # All of a quiet recording may be off by many times its noise, and that is no outlier.
            limit = 6.0 * max(middle, np.median(np.abs(y[recording == r]))) + 1e-12
            y[recording == r] = np.clip(y[recording == r], -limit, limit)
    return Rows(pick, y, level, recording)


def predicted(c: Competitor, Y: np.ndarray, rows: Rows) -> np.ndarray:
    """Share of each column's variance that ridge regression on the features predicts on left-out folds.

    What motion predicts is fitted to differences within recordings.  That it predicts those between recordings as well
    speaks for it; that they are there does not, for copies that are shifted in time have them, too.
    """
    total, missed = np.maximum(np.sum(Y**2, axis=0), 1e-300), np.zeros((len(RIDGES), Y.shape[1]))
    if not c.shifts:
        for k, test, w in _fits(c.features, Y, c.fold):
            missed[k] += np.sum((Y[test] - c.features[test] @ w) ** 2, axis=0)
        return 1.0 - missed.min(axis=0) / total
    X, within, across = _centred(c.features, rows.recording), _centred(Y, rows.recording), np.zeros_like(missed)
    weight = 1.0 / rows.level  # what a constant of all recordings [N m or N] is in a row
    sums = lambda at: (weight[at] @ Y[at], weight[at] @ c.features[at], weight[at] @ weight[at])  # noqa: E731
    whole = sums(slice(None))
    for k, test, w in _fits(X, within, c.fold):
        missed[k] += np.sum((within[test] - X[test] @ w) ** 2, axis=0)
        of_y, of_features, of_weight = (a - b for a, b in zip(whole, sums(test), strict=True))
        constant = (of_y - of_features @ w) / of_weight
        across[k] += np.sum((Y[test] - c.features[test] @ w - np.outer(weight[test], constant)) ** 2, axis=0)
    return np.maximum(np.sum(within**2, axis=0) - missed.min(axis=0), total - across.min(axis=0)) / total


def _centred(X: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Columns (R, K) less their mean over each recording."""
    _, which, count = np.unique(recording, return_inverse=True, return_counts=True)
    means = np.zeros((len(count), X.shape[1]))
    np.add.at(means, which, X)
    return X - (means / count[:, None])[which]


def _fits(X: np.ndarray, Y: np.ndarray, fold: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Number of a ridge, the rows that are left out, and the coefficients (F, K) that the others give with it."""
    whole, cross = X.T @ X, X.T @ Y
    for f in np.unique(fold):
        test = fold == f
        A = X[test]
        values, vectors = np.linalg.eigh(whole - A.T @ A)
        projected = vectors.T @ (cross - A.T @ Y[test])
        for k, ridge in enumerate(RIDGES):
            yield k, test, vectors @ (projected / (np.maximum(values, 0.0) + ridge * max((~test).sum(), 1))[:, None])


def _null(rivals: list[Competitor], rows: Rows) -> np.ndarray:
    """Best share that some competitor predicts of copies of the residual, shifted in time against the motion."""
    rng = np.random.default_rng(SEED)
    copies = np.empty((len(rows.residual), SHIFTS))
    for r in np.unique(rows.recording):
        at = np.flatnonzero(rows.recording == r)
        for k in range(SHIFTS):
            copies[at, k] = np.roll(rows.residual[at], rng.integers(len(at) // 10, max(len(at) - len(at) // 10, 2)))
    return np.max([predicted(c, copies, rows) for c in rivals if c.shifts], axis=0)
