"""What a channel's numbers tell before anything is known of its unit: its health, and its size beside the model's.

Nothing here refuses: `channels` has the hypotheses by which a recording is refused.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from irb140_jax.recordings.check_model import own_motion
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.repair import longest_run
from irb140_jax.recordings.torques import Torques

FROZEN_SHARE, FROZEN_RUNS = 0.1, 10.0  # a run of equal values this long, and this many times the usual ones
FLAT_SHARE, FLAT_RUN = 0.01, 5  # of the samples at the very end of the range, and in a row: a limited drive
COARSE_STEP = 0.003  # of the range: steps that a smoother sees
TOLD = 0.05  # of a torque's variance that the model has to tell for its scale to be worth saying


class Scale(NamedTuple):
    """How many of the file's units make one N m (or N) at the joint, by regression on the nominal model.

    Attributes:
        value: File units per N m; negative where the sign is reversed.
        std: Standard deviation of it, of the regression alone: a wrong model is not in it.
        told: Share of the torque's variance that the model tells beyond friction, rotor and offset of the joint.
    """

    value: float
    std: float
    told: float


def torque_scales(seen: Glance, model: Torques) -> list[Scale]:
    """tau_file = scale (M qdd + C qd + g) + a qd + b sign(qd) + c qdd + d, by least squares, joint by joint."""
    result = []
    for j in range(seen.q.shape[1]):
        others = np.stack([np.ones(len(seen.q)), *own_motion(seen, j)], axis=1)
        Q = np.linalg.qr(others / np.maximum(np.linalg.norm(others, axis=0), 1e-300))[0]
        x, y = (v - Q @ (Q.T @ v) for v in (model.total[:, j], seen.tau[:, j]))
        power = float(x @ x)
        whole = float(np.sum((seen.tau[:, j] - seen.tau[:, j].mean()) ** 2))
        if power <= 1e-12 * max(float(np.sum(model.total[:, j] ** 2)), 1e-300) or whole <= 0:
            result.append(Scale(np.nan, np.inf, 0.0))
            continue
        value = float(x @ y) / power
        left = y - value * x
        # Neighbouring samples are alike: as many independent ones as the residual has sign changes.
        independent = max(10, int(np.sum(np.diff(np.sign(left)) != 0)))
        std = float(np.sqrt(left @ left / len(left) / (power / len(x)) / independent))
        result.append(Scale(value, std, float((y @ y - left @ left) / whole)))
    return result


class Health(NamedTuple):
    """What is doubtful about the raw values of a channel.

    Attributes:
        dead: All values are equal.
        frozen: Start and length [samples] of a stretch of equal values that is none of the channel's habits, or None.
        saturated: Share of the samples at the highest or lowest value, where they look cut off, else 0.
        step: The distance of neighbouring values where it is coarse, else 0.
        missing: Share of the values that are no numbers.
    """

    dead: bool
    frozen: tuple[int, int] | None
    saturated: float
    step: float
    missing: float


def health(values: Float[np.ndarray, " T"]) -> Health:
    """Look at the raw values of one channel."""
    finite = np.isfinite(values)
    missing = float(1.0 - finite.mean())
    x = values[finite]
    if len(x) < 2 or np.ptp(x) == 0:
        return Health(len(x) > 0, None, 0.0, 0.0, missing)
    return Health(False, _frozen(x), _saturated(x), _coarse_step(x), missing)


def _frozen(x: np.ndarray) -> tuple[int, int] | None:
    ends = np.flatnonzero(np.concatenate([np.diff(x) != 0, [True]]))
    runs = np.diff(np.concatenate([[-1], ends]))
    k = int(np.argmax(runs))
    usual = float(np.quantile(np.delete(runs, k), 0.95)) if len(runs) > 1 else 1.0
    if runs[k] < FROZEN_SHARE * len(x) or runs[k] < FROZEN_RUNS * usual:
        return None
    return int(ends[k] - runs[k] + 1), int(runs[k])


def _saturated(x: np.ndarray) -> float:
    for end in (x.max(), x.min()):
        flat = np.abs(x - end) <= 1e-9 * abs(end)
        if end != 0 and flat.mean() > FLAT_SHARE and longest_run(flat)[0] >= FLAT_RUN:
            return float(flat.mean())
    return 0.0


def _coarse_step(x: np.ndarray) -> float:
    levels = np.unique(x)
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * np.ptp(x)]
    step = float(np.median(gaps)) if len(gaps) else 0.0
    # Levels on one grid, and few of them: measured to no more digits.
    regular = bool(len(gaps)) and float(np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.05)) > 0.9
    return step if regular and step > COARSE_STEP * np.ptp(x) and len(levels) < 0.2 * len(x) else 0.0


def swapped(rows: Float[np.ndarray, "T n"], columns: Float[np.ndarray, "T n"]) -> list[tuple[int, int]]:
    """Pairs (j, k) where column k follows row j, and neither its own; both sides of an exchange are listed."""
    from scipy.optimize import linear_sum_assignment

    unit = lambda x: (x - x.mean(0)) / np.maximum(np.linalg.norm(x - x.mean(0), axis=0), 1e-300)  # noqa: E731
    correlation = np.abs(unit(rows).T @ unit(columns))
    _, best = linear_sum_assignment(-correlation)
    return [(j, int(k)) for j, k in enumerate(best)
            if j != k and correlation[j, k] > 0.9 and correlation[j, j] < 0.5]  # fmt: skip
