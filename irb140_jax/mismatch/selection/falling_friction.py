"""Friction that certainly falls as the speed rises, whatever the form of its law.

Evidence can't tell a law of about the right form, with a discrepancy beside it, from the discrepancy alone: both hold
the same curve.  What is certain is the curve.  Where it falls, that is the finding, and the law with that name takes
the place of ordinary dry friction.
"""

import dataclasses
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from irb140_jax.effects import Effect, Scales
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.discrepancy import by_speed
from irb140_jax.mismatch.regression.gaussian import log_odds_of_any
from irb140_jax.mismatch.regression.gram import own_scale
from irb140_jax.mismatch.regression.nuisances import SCALED, Nuisances
from irb140_jax.mismatch.selection.evidence import DRY, Hyper, Space
from irb140_jax.mismatch.selection.hyperparameters import settled
from irb140_jax.mismatch.selection.screening import gains

VISCOUS = "viscous_friction"
SPEEDS = 16  # of the curve, from the slowest to the fastest motion
SHARE = 0.05  # of the rows that are slower than the slowest of these, and faster than the fastest


@dataclasses.dataclass(frozen=True)
class Fall:
    """Why a law is named in place of ordinary dry friction.

    Attributes:
        log_odds: That friction falls.
        usual: The candidate in whose place the law stands.
        at_rest: Root mean square of what the discrepancy holds beside the law as the speed nears zero [N m or N].
    """

    log_odds: float
    usual: int
    at_rest: float


@dataclasses.dataclass(frozen=True)
class Curve:
    """Friction of one joint over speed, in one direction.

    Attributes:
        speed: Speeds, shape (S,) [rad/s or m/s].
        mean, cov: Friction there, (S,) and (S, S) [N m or N].
        prior: Covariance before anything was recorded, shape (S, S).
    """

    speed: np.ndarray
    mean: np.ndarray
    cov: np.ndarray
    prior: np.ndarray

    def log_odds_of_fall(self) -> float:
        """Log odds that friction falls, and less so at higher speeds, against the odds of any rare effect."""
        pairs = [(a, b, 2.0 * self.speed[b] - self.speed[a]) for a, b in combinations(range(len(self.speed)), 2)]
        pairs = [p for p in pairs if p[2] <= self.speed[-1]]
        if not pairs:
            return -np.inf
        a, b, fast = max(pairs, key=lambda p: self.mean[p[0]] - self.mean[p[1]])
        at = np.eye(len(self.speed))
        beyond = np.array([np.interp(fast, self.speed, row) for row in at])
        # Beyond the fall it must not fall on as before: friction that helps at any speed is a drive's feed-forward.
        return min(self._log_odds(at[a] - at[b]), self._log_odds(at[a] - 2.0 * at[b] + beyond)) + np.log(settings.RARE)

    def _log_odds(self, weights: np.ndarray) -> float:
        """Log odds that a combination of frictions is positive and not zero."""
        mean, *widths = (float(weights @ self.mean), *(float(weights @ c @ weights) for c in (self.cov, self.prior)))
        std, prior = np.sqrt(np.maximum(widths, 0.0))
        return log_odds_of_any(mean, std, prior) if mean > 0.0 and std > 0.0 and prior > 0.0 else -np.inf


def with_falling_friction(
    space: Space, data: Data, extra: Nuisances, scales: Scales, best: tuple[int, ...], hyper: Hyper
) -> tuple[tuple[int, ...], Hyper, Mapping[int, Fall]]:
    """A set with the law of falling friction in place of ordinary dry friction wherever friction certainly falls.

    Args:
        space: What may be in a set.
        data: Low-passed rows and candidates.
        extra: Nuisance columns of any recording.
        scales: Sizes of the recordings.
        best: The set.
        hyper: Sizes and levels beside it.

    Returns:
        The set, sizes and levels beside it, and its members that are there for that.
    """
    falls: dict[int, Fall] = {}
    for j in range(len(space.joints)):
        dry = [i for i in best if space.candidates[i].slug == DRY and space.candidates[i].joints == (j,)]
        laws = [i for i, c in enumerate(space.candidates) if c.effect.law.falls and c.joints == (j,)]
        moves = any(s.use[:, j].any() for s in data.stretches)
        here = [space.candidates[i].effect for i in best if space.candidates[i].joints == (j,)]
        if not (dry and laws and moves) or any(map(has_own_viscous_friction, here)):
            continue
        odds = _curve(space, data, extra, scales, best, hyper, j).log_odds_of_fall()
        if odds < np.log(settings.NAMED / (1.0 - settings.NAMED)):
            continue
        rest = tuple(i for i in best if i not in dry)
        # With a discrepancy all shapes are equally good.
        exact = tuple((*(0 for _ in s[:-1]), s[-1]) if k == j else s for k, s in enumerate(hyper))
        gained = np.where(space.conflicts(rest)[laws], -np.inf, gains(space, rest, exact, np.array(laws)))
        if np.isfinite(gained).any():
            law = laws[int(np.argmax(gained))]
            best = tuple(sorted((*rest, law)))
            hyper = max((settled(space, best, h, [j]) for h in (hyper, exact)), key=lambda found: found[0])[1]
            own = _of_speeds(np.zeros(1), extra, scales, j)
            mean, cov = space.functions(best, hyper, j, np.zeros((1, len(space.set_columns(best)))), own)
            falls[law] = Fall(odds, dry[0], float(np.sqrt(mean[0] ** 2 + cov[0, 0])))
    return best, hyper, falls


def has_own_viscous_friction(effect: Effect) -> bool:
    """Whether a law holds viscous friction in a form of its own: `_curve` lacks it, and is not all of the friction."""
    return VISCOUS in effect.law.contains


def _curve(
    space: Space, data: Data, extra: Nuisances, scales: Scales, chosen: tuple[int, ...], hyper: Hyper, j: int
) -> Curve:
    """Friction of one joint over speed: dry and viscous friction, and the discrepancy's."""
    qd = np.abs(np.concatenate([s.qd[s.use[:, j], j] for s in data.stretches]))
    slowest, fastest = np.quantile(qd, [SHARE, 1.0 - SHARE])
    speed = np.geomspace(float(slowest), float(fastest), SPEEDS)
    own, along = _of_speeds(speed, extra, scales, j), {DRY: np.ones(SPEEDS), VISCOUS: speed}
    shared, at = np.zeros((SPEEDS, len(space.set_columns(chosen)))), space.offset
    for c in (space.candidates[i] for i in chosen):
        if c.slug in along and c.joints == (j,):
            shared[:, at] = along[c.slug] * data.scale[data.nuisances + c.columns[0]]
        at += len(c.columns)
    mean, cov = space.functions(chosen, hyper, j, shared, own)
    sizes = own_scale(extra.groups[j], hyper[j])
    return Curve(speed, mean, cov, shared @ shared.T + (own * sizes**2) @ own.T)


def _of_speeds(speed: np.ndarray, extra: Nuisances, scales: Scales, j: int) -> np.ndarray:
    """Weights of a joint's own columns in its friction at some speeds (S,) in one direction, shape (S, D)."""
    own, block = np.zeros((len(speed), len(extra.groups[j]))), extra.groups[j] == SCALED.index("speed")
    features = np.concatenate(by_speed(speed, np.ones(len(speed)), float(scales.speed[j])), axis=1)
    own[:, block] = features * extra.units[j][block]
    return own
