"""Model discrepancy: what a joint's torque may differ by from any law of the library, as a function of its own state.

Four zero-mean blocks of features a joint, each with a size of its own: what depends on position alone, friction that
depends on speed alone, what depends on several of position, speed, direction and load, and what friction may do
differently around a change of direction, by bristles or lateness.  None holds a term that a named effect consists of
(a constant, the direction itself, position, speed, acceleration, load, how fast the load changes): the discrepancy
stands for what no law explains, not for the laws.  Functions of several of those may resemble dry friction where a
joint moves little, so they hold none of it over the recordings.

Source: Kennedy and O'Hagan, Bayesian calibration of computer models, JRSS B 63(3), 2001; orthogonal to laws as in
Plumlee, Bayesian calibration of inexact computer models, JASA 112(519), 2017; the low rank as in Rasmussen and
Williams, Gaussian Processes for Machine Learning, 2006, ch. 8.
"""

import dataclasses
from typing import Any

import numpy as np

from irb140_jax.effects import Scales
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import pieces
from irb140_jax.recordings.condition import Conditioned

ORDERS = 6  # of the polynomials in position
SPEEDS = 4  # of the polynomials in the logarithm of speed
FEATURES = 84  # of all blocks, and dry friction


@dataclasses.dataclass(frozen=True)
class Discrepancy:
    """What a corrected model adds, on some joints, to what its laws say: torque without a name.

    Attributes:
        scales: Sizes of the recordings that it was found in.
        coefficients: Of each joint's features, block by block, and of its direction [N m or N], zero where nothing is
            carried, shape (n, FEATURES).
    """

    scales: Scales
    coefficients: np.ndarray

    def along(self, r: Conditioned, load: np.ndarray) -> np.ndarray:
        """Its torque along a motion, shape (T, n) [N m or N].

        Args:
            r: T samples of n joints.
            load: Torque that the transmissions carry [N m or N], shape (T, n).
        """
        out = np.zeros_like(load)
        for j in np.flatnonzero(self.coefficients.any(axis=1)):
            own = features(r, load, self.scales, int(j))
            for at in pieces(len(r.t)):
                X = np.concatenate([*own.blocks(at), r.direction[at, [j]]], axis=1)
                out[at, j] = X @ self.coefficients[j]
        return out

    def on(self, joints: np.ndarray) -> "Discrepancy | None":
        """The same on some joints alone, shape (n,); None where it is nothing there."""
        kept = np.where(joints[:, None], self.coefficients, 0.0)
        return dataclasses.replace(self, coefficients=kept) if kept.any() else None

    def to_json(self) -> dict[str, Any]:
        """Everything of it as JSON."""
        sizes = {k: np.asarray(v).tolist() for k, v in self.scales._asdict().items()}
        return {"scales": sizes, "coefficients": self.coefficients.tolist()}

    @staticmethod
    def from_json(data: dict[str, Any]) -> "Discrepancy":
        """The inverse of `to_json`."""
        sizes: dict[str, Any] = {k: np.array(v, dtype=float) if isinstance(v, list) else float(v)
                                 for k, v in data["scales"].items()}  # fmt: skip
        return Discrepancy(Scales(**sizes), np.array(data["coefficients"], dtype=float))


@dataclasses.dataclass(frozen=True)
class Features:
    """What the features of one joint are made of along a recording.

    The features themselves are made for some samples at a time: of a long recording all of them fill the memory.

    Attributes:
        x: Position in its range, from -1 to 1, shape (T,).
        qd: Velocity [rad/s or m/s], shape (T,).
        direction: Of the motion, shape (T,).
        carried: Torque that the transmission carries over the joint's usual one, shape (T,).
        bend: Slope of the line through zero that is nearest to the square of `carried` over its size.
        turning: Features of what happens around reversals, whatever the load, shape (T, 10).
        pushed: Size of the acceleration over its RMS, shape (T,).
        top: The joint's top speed [rad/s or m/s].
    """

    x: np.ndarray
    qd: np.ndarray
    direction: np.ndarray
    carried: np.ndarray
    bend: float
    turning: np.ndarray
    pushed: np.ndarray
    top: float

    def blocks(self, at: slice = slice(None)) -> list[np.ndarray]:
        """The four blocks of features at some samples, each (t, features): position, speed, smooth, reversal."""
        direction = self.direction[at, None]
        position = np.polynomial.chebyshev.chebvander(self.x[at], ORDERS)[:, 1:]
        fast = 1.0 + 2.0 * np.log(np.abs(self.qd[at]) / self.top + 1e-3) / np.log(1e3)
        speed = np.polynomial.chebyshev.chebvander(np.clip(fast, -1.0, 1.0), SPEEDS)[:, 1:]
        rounded, tails = by_speed(self.qd[at], self.direction[at], self.top)
        carried, pushed = self.carried[at, None], self.pushed[at, None]
        smooth = _smooth(direction, carried, self.bend, position, speed)
        turning = np.concatenate([self.turning[at], rounded], axis=1)
        reversal = [self.turning[at], turning * np.abs(carried), turning * pushed]
        return [position[:, 1:], np.concatenate([rounded, tails], axis=1), smooth, np.concatenate(reversal, axis=1)]


def features(r: Conditioned, load: np.ndarray, scales: Scales, j: int) -> Features:
    """What the features of one joint are made of.

    Args:
        r: T samples of n joints.
        load: Torque that the transmissions carry [N m or N], shape (T, n).
        scales: Sizes over all recordings.
        j: The joint.
    """
    middle, half = 0.5 * (scales.high[j] + scales.low[j]), 0.5 * max(scales.high[j] - scales.low[j], 1e-9)
    carried, qdd = load[:, j] / max(float(scales.torque[j]), 1e-12), r.qdd[:, j]
    even = np.abs(carried)
    # Of friction that grows with load only how it bends: in proportion is a law of its own.
    bend = float(np.sum(even**3)) / max(float(np.sum(even**2)), 1e-300)
    pushed = np.abs(qdd) / max(float(np.sqrt(np.mean(qdd**2))), 1e-12)
    x = np.clip((r.q[:, j] - middle) / half, -1.0, 1.0)
    return Features(x, r.qd[:, j], r.direction[:, j], carried, bend, _turning(r, scales, j), pushed,
                    float(scales.speed[j]))  # fmt: skip


def by_speed(qd: np.ndarray, direction: np.ndarray, top: float) -> tuple[np.ndarray, np.ndarray]:
    """Friction that goes over into its level as the speed rises: quickly and slowly, at several speeds, (T, 4) each.

    Args:
        qd: Velocity, shape (T,) [rad/s or m/s].
        direction: Of the motion, shape (T,).
        top: The joint's top speed [rad/s or m/s].
    """
    slow, v, level = np.array(settings.ROUNDED_SPEEDS) * top, qd[:, None], direction[:, None]
    return level - v / np.hypot(v, slow), level - v / (np.abs(v) + slow)


def _smooth(
    direction: np.ndarray, carried: np.ndarray, bend: float, position: np.ndarray, speed: np.ndarray
) -> np.ndarray:
    """Smooth functions of several of one joint's position, speed, direction and load, shape (t, 28)."""
    even = np.abs(carried)
    parts = [
        direction * position, direction * speed, speed,
        (direction * speed)[:, :, None] * position[:, None, :2],
        direction * (even**2 - even * bend), carried**2, carried * position[:, :2],
        direction * even * position[:, :2], direction * even * speed,
    ]  # fmt: skip
    return np.concatenate([p.reshape(len(position), -1) for p in parts], axis=1)


def _turning(r: Conditioned, scales: Scales, j: int) -> np.ndarray:
    """What happens around one joint's reversals, whatever the load, shape (T, 10)."""
    q, direction = r.q[:, j], r.direction[:, j]
    travel = max(float(scales.high[j] - scales.low[j]), 1e-9)
    out = [relaxed(q, share * travel) - direction for share in settings.BRISTLE_TRAVELS]
    out += [np.interp(r.t - late, r.t, direction) - direction for late in settings.TURNING_DELAYS]
    out.append(through_rest(r.qd[:, j], r.qdd[:, j], r.t) - direction)
    return np.stack(out, axis=1)


def through_rest(qd: np.ndarray, qdd: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The sign of the smoothed speed however slow, as a mean over the time that a sample stands for, shape (T,).

    Args:
        qd, qdd: Speed and acceleration of one joint, shape (T,) [rad/s or m/s; rad/s^2 or m/s^2].
        t: Time [s], shape (T,).
    """
    reach = 0.5 * np.abs(qdd) * np.gradient(t)  # of the speed within that time, either way
    return np.divide(qd, reach, out=np.sign(qd), where=np.abs(qd) < reach)


def relaxed(q: np.ndarray, travel: float) -> np.ndarray:
    """Direction that follows motion over some travel: Dahl's bristles of unit strength, shape (T,)."""
    dq = np.diff(q, prepend=q[0])
    keep, sign = np.exp(-np.abs(dq) / travel), np.sign(dq)
    z, out = 0.0, np.empty_like(q)
    for i, (k, s) in enumerate(zip(keep.tolist(), sign.tolist(), strict=True)):
        z = k * z + (1.0 - k) * s
        out[i] = z
    return out
