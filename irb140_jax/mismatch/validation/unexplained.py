"""Structure that no effect of the library explains: flexible competitors, scored on data that they did not see.

Each competitor knows few variables: of the joint's motion, load and past, of another joint, or time.
If one of them predicts what the findings leave, something is left out, and its variables say where.  No finding is
changed by it.
"""

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import signal

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.discrepancy import relaxed
from irb140_jax.mismatch.regression.noise import spread
from irb140_jax.mismatch.regression.rows import Stretch
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.held_out import HeldOut

MOST_ROWS = 20_000  # of a joint: of more, every second, third ... is taken; a log of an hour has ten times as many
FEATURES = 60  # random Fourier features a competitor
WAVES = 50  # along a joint's range, of the competitor that knows position and direction
SHIFTS = 99  # circular time shifts that make the null
SEED = 20260
SLOWEST, FASTEST = 0.3, 8.0  # Hz: oscillators that the competitor with a memory may hold
OSCILLATORS = 12
RINGING = 0.1  # their damping ratio
TRAVELS = (0.01, 0.03, 0.1, 0.3)  # of the range: along which the same competitor's hysteresis settles
SETTLING = (0.1, 0.3, 1.0, 3.0, 10.0)  # s: in which what the motion has strained gives way, for the same competitor
MOTION_BLOCK = 2.5  # s left out together
RIDGES = (0.003, 0.03, 0.3, 3.0, 30.0)  # of the features' variance; the best one counts, in the null as well
TIME_BAND = 1.0  # Hz up to which the competitor of time follows
MOST_COSINES = 600  # of a recording: along one of more than five minutes they follow no faster than these do
TIME_BLOCK = 0.5  # s: half a period of that; left out in turn


class Axis(NamedTuple):
    """Horizontal axis of a drawing of the residual.

    Attributes:
        quantity: "q", "qd", "qdd", "nominal" torque or logged "tau" of a joint, or "t".
        joint: Index.
    """

    quantity: str
    joint: int


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


@dataclasses.dataclass(frozen=True)
class Structure:
    """What is left at one joint.

    Attributes:
        joint: Index.
        share: Part of the remaining residual's variance that is predictable on unseen data.
        p_value: Share of time-shifted copies that are as predictable.
        variable: The variables that carry it, in words.
        rms: Size of the predictable part [N m or N].
        axis: One of them, to draw what is left over it.
        when: Where it is that short.
    """

    joint: int
    share: float
    p_value: float
    variable: str
    rms: float
    axis: Axis
    when: When | None = None


class Competitor(NamedTuple):
    """Features of some variables at a joint's rows.

    Attributes:
        variable: The variables in words.
        axis: One of them, to draw what is left over it.
        features: Shape (R, F), of the order of one.
        fold: Which rows are left out together, shape (R,).
        shifts: Whether shifting time breaks what it could rightly predict, so that shifted copies make its null.
    """

    variable: str
    axis: Axis
    features: np.ndarray
    fold: np.ndarray
    shifts: bool


class Rows(NamedTuple):
    """The rows of one joint over all recordings that count.

    Attributes:
        pick: Which rows of each stretch those are.
        residual: Held-out residual over the level of its recording's noise, shape (R,).
        level: That level, row by row [N m or N], shape (R,).
        recording: Shape (R,).
    """

    pick: list[np.ndarray]
    residual: np.ndarray
    level: np.ndarray
    recording: np.ndarray

    def of(self, arrays: list[np.ndarray]) -> np.ndarray:
        """The rows of arrays given stretch by stretch."""
        return np.concatenate([a[p] for a, p in zip(arrays, self.pick, strict=True)])


def unexplained(ex: Explanation, proof: HeldOut) -> list[Structure]:
    """Joints whose residual, findings taken off, can be predicted on unseen data."""
    out = []
    torque = np.sqrt(np.mean(np.concatenate([s.tau for s in ex.data.stretches]) ** 2, axis=0))
    rmse = proof.rmse(proof.left)
    for j in range(len(torque)):
        rows = _rows(ex, proof, j)
        least = max(settings.MATERIAL_SHARE, (settings.MATERIAL_TORQUE * torque[j] / max(rmse[j], 1e-100)) ** 2)
        # No share of so small a residual could matter.
        if len(rows.residual) < 200 or least > 1.0:
            continue
        rivals = competitors(ex.data.stretches, j, rows, ex.lib.robot.joint_names)
        shares = np.array([predicted(c, rows.residual[:, None], rows)[0] for c in rivals])
        if shares.max() < least:
            continue
        null = _null(rivals, rows)
        # Along a slow sweep position goes with time, and so do copies of the residual shifted in time: where motion is
        # not beyond chance, what goes with time still is.
        for best in dict.fromkeys((_carrier(rivals, shares), int(np.argmax(shares)))):
            share = float(shares[best])
            p = float((1 + np.sum(null >= share)) / (1 + SHIFTS))
            if share >= least and p <= settings.SIGNIFICANT:
                size = float(np.sqrt(share) * rmse[j])
                both = zip(ex.data.stretches, proof.left, strict=True)
                when = shortest(ex.data.stretches, [np.where(s.use, r, 0.0)[:, j] for s, r in both], j)
                out.append(Structure(j, share, p, rivals[best].variable, size, rivals[best].axis, when))
                break
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
        so_far = np.append(0.0, np.cumsum(r**2))
        end = np.searchsorted(so_far, so_far[:-1] + settings.MOST_OF_ERROR * total)
        first = np.flatnonzero(end < len(so_far))
        lasts = s.t[end[first] - 1] - s.t[first]
        if len(first) and np.min(lasts) < least:
            i = int(first[np.argmin(lasts)])
            error, counts = so_far[end[i]] - so_far[i], r[i : end[i]] != 0.0
            of_torque = float(np.sqrt(error / max(float(np.sum(s.tau[i : end[i], j][counts] ** 2)), 1e-300)))
            best = When(s.recording, float(s.t[i]), float(s.t[end[i] - 1]), float(error / total), of_torque)
            least = float(np.min(lasts))
    return best


def _carrier(rivals: list[Competitor], shares: np.ndarray) -> int:
    """The best competitor; time only where motion does not do nearly as well.

    Whatever is slow goes with time, and all but noise comes back in the repeats of a motion.
    """
    motion = np.where([c.shifts for c in rivals], shares, -np.inf)
    return int(np.argmax(motion if motion.max() > settings.NEARLY * shares.max() else shares))


def competitors(stretches: list[Stretch], j: int, rows: Rows, names: tuple[str, ...]) -> list[Competitor]:
    """All competitors for what is left at joint `j`, weighted like the residual.

    Not those of time: each recording has amplitudes of its own, which weights would make as small as the ridge.
    """
    weight = (np.median(rows.level) / rows.level)[:, None]
    rivals = _unweighted(stretches, j, rows, names)
    return [c._replace(features=weight * c.features) if c.shifts else c for c in rivals]


def _unweighted(stretches: list[Stretch], j: int, rows: Rows, names: tuple[str, ...]) -> list[Competitor]:
    q, qd, qdd, load, tau = (
        np.stack([_standard(rows.of([getattr(s, name)[:, i] for s in stretches])) for i in range(len(names))], axis=1)
        for name in ("q", "qd", "qdd", "nominal", "tau")
    )
    direction = np.sign(rows.of([s.qd[:, [j]] for s in stretches]))
    mine = lambda x: x[:, [j]]  # noqa: E731
    along = _waves(mine(q))
    groups = {
        "position": ("q", np.hstack([_features(mine(q)), along])),
        "speed": ("qd", _features(mine(qd))),
        "acceleration": ("qdd", _features(mine(qdd))),
        "load": ("nominal", _features(mine(load))),
        "position and speed": ("q", _features(np.hstack([mine(q), mine(qd)]))),
        "position and its direction of motion": ("q", np.hstack([along, direction * along, direction])),
        "load and speed": ("nominal", _features(np.hstack([mine(load), mine(qd)]))),
        "own past": ("q", _memory(stretches, j, rows)),
    }
    fold, others = _motion_folds(stretches, rows), [i for i in range(len(names)) if i != j]
    out = [Competitor(f"the joint's {name}", Axis(by, j), x, fold, True) for name, (by, x) in groups.items()]
    # Not the joint's own logged torque: what is left is a part of it.
    out += [Competitor(f"the torque of {names[i]}", Axis("tau", i), tau[:, [i]], fold, True) for i in others]
    for i in others:
        by_direction = np.hstack([direction * _features(q[:, [i]]), direction])
        said = f"the position of {names[i]} and the joint's own direction of motion"
        out.append(Competitor(said, Axis("q", i), by_direction, fold, True))
    own = np.hstack([np.ones_like(direction), direction, *(mine(x) for x in (q, qd, load))])
    for i in others:
        theirs = np.stack([q[:, i], qd[:, i], np.abs(qd[:, i]), np.sign(qd[:, i]), qdd[:, i]], axis=1)
        products = (own[:, :, None] * theirs[:, None]).reshape(len(own), -1)
        waves = np.hstack([_features(np.hstack([mine(x), x[:, [i]]])) for x in (q, qd)])
        together = f"the motion of {names[i]} together with the joint's own"
        out += [Competitor(together, Axis("qd", i), x, fold, True) for x in (products, waves)]
    return [*out, *_repeated(stretches, rows), _time(stretches, rows)]


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


def _motion_folds(stretches: list[Stretch], rows: Rows) -> np.ndarray:
    """Contiguous stretches of `MOTION_BLOCK`, five folds: far longer than any noise remembers.

    Repeats of a motion are left out together: in each of them the same motion comes at the same time, so that one
    would predict the other whatever goes with time.
    """
    t = rows.of([s.t - s.begin for s in stretches])
    return ((t / MOTION_BLOCK).astype(int) + rows.of([np.full(len(s.t), s.motion) for s in stretches])) % 5


def _standard(x: np.ndarray) -> np.ndarray:
    return (x - x.mean(axis=0)) / np.maximum(x.std(axis=0), 1e-12)


def _features(x: np.ndarray) -> np.ndarray:
    """Random Fourier features at three scales, the variables and their signs, shape (R, F)."""
    rng = np.random.default_rng(SEED)
    omega = rng.normal(size=(x.shape[1], FEATURES)) * rng.choice([0.7, 1.5, 4.0], size=FEATURES)
    phase = rng.uniform(0, 2 * np.pi, FEATURES)
    return np.concatenate([np.cos(x @ omega + phase), x, np.sign(x)], axis=1)


def _waves(q: np.ndarray) -> np.ndarray:
    """Waves along a range, from the whole of it down to teeth of a gear, shape (R, F); q of shape (R, 1)."""
    x = (q - q.min()) / max(float(np.ptp(q)), 1e-12)
    angle = 2.0 * np.pi * x * np.arange(1, WAVES + 1)
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def _memory(stretches: list[Stretch], j: int, rows: Rows) -> np.ndarray:
    """What the motion so far has left behind, shape (R, F).

    Oscillators of many frequencies shaken by the joint's acceleration, positions and speeds; hysteresis that settles
    along a travel; and what was strained and gives way in time.
    """
    parts, span = [], max(float(np.ptp(np.concatenate([s.q[:, j] for s in stretches]))), 1e-12)
    for s in stretches:
        dt = float(np.median(np.diff(s.t)))
        part = []
        for f in np.geomspace(SLOWEST, min(FASTEST, 0.3 / dt), OSCILLATORS):
            omega = 2.0 * np.pi * f
            system = signal.cont2discrete(
                (np.array([[0, 1], [-(omega**2), -2 * RINGING * omega]]), np.array([[0], [1]]),
                 np.diag([omega**2, omega]), np.zeros((2, 1))), dt, method="bilinear",
            )  # fmt: skip
            part.append(signal.dlsim(system, s.qdd[:, j])[1])
        part.append(np.stack([relaxed(s.q[:, j], share * span) for share in TRAVELS], axis=1))
        moved, keeps = np.diff(s.q[:, j], prepend=s.q[:1, j]), np.exp(-dt / np.array(SETTLING))
        part.append(np.stack([signal.lfilter([1.0], [1.0, -keep], moved) for keep in keeps], axis=1))
        parts.append(np.hstack(part))
    now = [np.stack([s.qd[:, j], s.qdd[:, j], np.sign(s.qd[:, j])], axis=1) for s in stretches]
    return np.hstack([_standard(rows.of(parts)), _standard(rows.of(now))])


def _repeated(stretches: list[Stretch], rows: Rows) -> list[Competitor]:
    """What was left in the other repeats of a motion at the same time after their begin; none without repeats."""
    at = rows.of([s.t - s.begin for s in stretches])
    left, motion = rows.residual * rows.level, np.array([s.motion for s in stretches])
    features = np.zeros_like(left)
    for r in np.unique(rows.recording):
        mine, others = rows.recording == r, [k for k in np.flatnonzero(motion == motion[r]) if k != r]
        for k in others:
            theirs = rows.recording == k
            if theirs.any():
                features[mine] += np.interp(at[mine], at[theirs], left[theirs]) / len(others)
    said = "time or on the motion, which repeats of it can't tell apart"
    known = (features / rows.level)[:, None]
    return [Competitor(said, Axis("t", 0), known, rows.recording, False)] if features.any() else []


def _time(stretches: list[Stretch], rows: Rows) -> Competitor:
    """Cosines of each recording's own time, up to `TIME_BAND`; short blocks are left out in turn."""
    features, folds = [], []
    for r, (s, pick) in enumerate(zip(stretches, rows.pick, strict=True)):
        length = s.t[-1] - s.t[0]
        count = min(max(int(2.0 * TIME_BAND * length), 2), MOST_COSINES)
        own = np.cos(np.pi * np.outer((s.t[pick] - s.t[0]) / length, np.arange(count)))
        features.append((r, own))
        folds.append(((s.t[pick] - s.t[0]) / TIME_BLOCK).astype(int) % 5)
    width = sum(own.shape[1] for _, own in features)
    phi, row, column = np.zeros((len(rows.residual), width)), 0, 0
    for _, own in features:
        phi[row : row + len(own), column : column + own.shape[1]] = own
        row, column = row + len(own), column + own.shape[1]
    return Competitor("time more than on the motion", Axis("t", 0), phi, np.concatenate(folds), False)


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
    rng = np.random.default_rng(SEED + 1)
    copies = np.empty((len(rows.residual), SHIFTS))
    for r in np.unique(rows.recording):
        at = np.flatnonzero(rows.recording == r)
        for k in range(SHIFTS):
            copies[at, k] = np.roll(rows.residual[at], rng.integers(len(at) // 10, max(len(at) - len(at) // 10, 2)))
    return np.max([predicted(c, copies, rows) for c in rivals if c.shifts], axis=0)
