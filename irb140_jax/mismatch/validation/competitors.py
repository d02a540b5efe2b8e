"""Features of the regressions that may predict what the findings leave of a joint's torque.

Each regression, called a competitor, knows few variables: of the joint's motion, load and past, of another joint, or
time.
"""

from typing import NamedTuple

import numpy as np
from scipy import signal

from irb140_jax.mismatch.regression.discrepancy import relaxed
from irb140_jax.mismatch.regression.rows import Stretch

FEATURES = 60  # random Fourier features a competitor
WAVES = 50  # along a joint's range, of the competitor that knows position and direction
SEED = 20260
SLOWEST, FASTEST = 0.3, 8.0  # Hz: oscillators that the competitor with a memory may hold
OSCILLATORS = 12
RINGING = 0.1  # their damping ratio
TRAVELS = (0.01, 0.03, 0.1, 0.3)  # of the range: along which the same competitor's hysteresis settles
SETTLING = (0.1, 0.3, 1.0, 3.0, 10.0)  # s: in which what the motion has strained gives way, for the same competitor
MOTION_BLOCK = 2.5  # s left out together
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


class Competitor(NamedTuple):
    """Features of some variables at a joint's rows.

    Attributes:
        variable: The variables in words.
        axis: One of them, to draw what is left over it.
        features: Shape (R, F), of the order of one.
        fold: Which rows are left out together, shape (R,).
        shifts: Whether shifting time breaks what it could rightly predict, so that shifted copies make its null.
        knows: How many variables it knows; time, with which goes whatever is slow, counts as all of them.
    """

    variable: str
    axis: Axis
    features: np.ndarray
    fold: np.ndarray
    shifts: bool
    knows: int


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
        "position": ("q", 1, np.hstack([_features(mine(q)), along])),
        "speed": ("qd", 1, _features(mine(qd))),
        "acceleration": ("qdd", 1, _features(mine(qdd))),
        "load": ("nominal", 1, _features(mine(load))),
        "position and speed": ("q", 2, _features(np.hstack([mine(q), mine(qd)]))),
        "position and its direction of motion": ("q", 2, np.hstack([along, direction * along, direction])),
        "load and speed": ("nominal", 2, _features(np.hstack([mine(load), mine(qd)]))),
        "own past": ("q", 2, _memory(stretches, j, rows)),
    }
    fold, others = _motion_folds(stretches, rows), [i for i in range(len(names)) if i != j]
    out = [Competitor(f"the joint's {name}", Axis(by, j), x, fold, True, k) for name, (by, k, x) in groups.items()]
    # Not the joint's own logged torque: what is left is a part of it.
    out += [Competitor(f"the torque of {names[i]}", Axis("tau", i), tau[:, [i]], fold, True, 1) for i in others]
    for i in others:
        by_direction = np.hstack([direction * _features(q[:, [i]]), direction])
        said = f"the position of {names[i]} and the joint's own direction of motion"
        out.append(Competitor(said, Axis("q", i), by_direction, fold, True, 2))
    own = np.hstack([np.ones_like(direction), direction, *(mine(x) for x in (q, qd, load))])
    for i in others:
        theirs = np.stack([q[:, i], qd[:, i], np.abs(qd[:, i]), np.sign(qd[:, i]), qdd[:, i]], axis=1)
        products = (own[:, :, None] * theirs[:, None]).reshape(len(own), -1)
        waves = np.hstack([_features(np.hstack([mine(x), x[:, [i]]])) for x in (q, qd)])
        together = f"the motion of {names[i]} together with the joint's own"
        out += [Competitor(together, Axis("qd", i), x, fold, True, 3) for x in (products, waves)]
    return [*out, *_repeated(stretches, rows), _time(stretches, rows)]


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
    return [Competitor(said, Axis("t", 0), known, rows.recording, False, 4)] if features.any() else []


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
    said = "time or on the motion of more than two joints"
    return Competitor(said, Axis("t", 0), phi, np.concatenate(folds), False, 4)
