"""Pieces of motion, each from rest to rest, also such that show what lively motion hides; and joining them."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.recordings.excite import (
    SPEED_UP_TIME,
    Excitation,
    Limits,
    fourier_motion,
    motion_limits,
    point_to_point_motion,
    sample_times,
)
from irb140_jax.robot import Robot

SLOWEST = 0.01  # of the speed limit: the lowest rung of a ladder
RUNGS = 4  # speeds of a ladder
DWELL = 0.3  # [s] of rest between moves
KINDS = ("fourier", "point_to_point", "slow", "ladder", "micro")


@dataclasses.dataclass(frozen=True)
class Segment:
    """What a piece of motion is made from.

    Attributes:
        kind: One of `KINDS`.
        joint: The joint that moves while the others rest; None: all move.
        speed: Largest speed as a share of the speed limits.
        frequency: Of the first harmonic of a Fourier motion, or of micro-motion [1/s].
        seed: Of everything random.
    """

    kind: str
    joint: int | None
    speed: float
    frequency: float
    seed: int

    def said(self, names: Sequence[str]) -> str:
        """A few words for a person."""
        words = {
            "fourier": "Fourier motion", "point_to_point": "moves from point to point with pauses",
            "slow": "slow motion", "ladder": "constant speeds from very slow to fast in both directions",
            "micro": "small reversals in several postures",
        }  # fmt: skip
        who = "all joints" if self.joint is None else names[self.joint]
        return f"{words[self.kind]} of {who}"


def segment_motion(robot: Robot, segment: Segment, duration: float, rate: float) -> Excitation:
    """The motion of a piece.

    Args:
        robot: Arm with limits.
        segment: What it is made from.
        duration: Length [s]; a ladder may take less.
        rate: Samples per second [1/s].
    """
    given = {"seed": segment.seed, "speed": segment.speed}
    if segment.kind == "ladder":
        return _ladder(robot, segment, duration, rate)
    if segment.kind == "micro":
        return _micro(robot, segment, duration, rate)
    if segment.kind == "point_to_point":
        motion = point_to_point_motion(robot, duration, rate, **given)
    else:
        motion = fourier_motion(robot, duration, rate, base_frequency=segment.frequency, harmonics=5, **given)
    return motion if segment.joint is None else _alone(robot, motion, segment)


def _alone(robot: Robot, motion: Excitation, segment: Segment) -> Excitation:
    """The motion of one joint, the others at rest in a posture."""
    q = np.tile(_posture(robot, segment.seed), (len(motion.t), 1))
    qd, qdd, j = np.zeros_like(q), np.zeros_like(q), segment.joint
    q[:, j], qd[:, j], qdd[:, j] = motion.q[:, j], motion.qd[:, j], motion.qdd[:, j]
    return Excitation(segment.kind, motion.t, q, qd, qdd)


def _posture(robot: Robot, seed: int) -> np.ndarray:
    limits = motion_limits(robot, 1.0)
    return np.random.default_rng([seed, 3]).uniform(limits.lower, limits.upper)


def _ladder(robot: Robot, segment: Segment, duration: float, rate: float) -> Excitation:
    """There and back at constant speed, faster rung by rung, as far as time and the joint's range allow."""
    limits, rng = motion_limits(robot, segment.speed), np.random.default_rng([segment.seed, 4])
    moving = range(robot.n) if segment.joint is None else [segment.joint]
    start = _posture(robot, segment.seed)
    time = 0.5 * (duration - DWELL) / RUNGS - DWELL
    side = rng.choice([-1.0, 1.0], size=robot.n)
    points, ramps = [start], []
    for share in np.geomspace(SLOWEST / segment.speed, 1.0, RUNGS):
        # A smooth step of speed peaks at 1.875 of its mean acceleration.
        ramp = float(np.clip(1.875 * SPEED_UP_TIME * share, 0.1 * time, 0.45 * time))
        speed = np.minimum(share * limits.speed, limits.acceleration * ramp / 1.875)
        away = start.copy()
        for j in moving:
            room = (limits.upper[j] - start[j]) if side[j] > 0 else (start[j] - limits.lower[j])
            if room < 0.3 * (limits.upper[j] - limits.lower[j]):
                side[j], room = -side[j], limits.upper[j] - limits.lower[j] - room
            away[j] += side[j] * min(speed[j] * (time - ramp), room)
        points += [away, start]
        ramps += [ramp, ramp]
    return _strokes("ladder", points, time, ramps, rate)


def _micro(robot: Robot, segment: Segment, duration: float, rate: float) -> Excitation:
    """Sines of a few hundredths of a rad (or m) around a posture, growing, each with a dwell before it."""
    limits, rng = motion_limits(robot, segment.speed), np.random.default_rng([segment.seed, 5])
    t = sample_times(duration, rate)
    span = limits.upper - limits.lower
    omega = 2.0 * np.pi * segment.frequency
    most = np.minimum(np.minimum(limits.speed / omega, limits.acceleration / omega**2), 0.03 * span)
    moving = np.ones(robot.n) if segment.joint is None else np.eye(robot.n)[segment.joint]
    size = 0.8 * moving * most
    # A posture at a limit is moved off it: a wave cut off there would stop at once.
    middle = np.clip(_posture(robot, segment.seed), limits.lower + size, limits.upper - size)
    growth = 0.05 + 0.95 * (t / t[-1])
    ends = np.minimum(np.minimum(t, t[-1] - t) / max(1.0 / segment.frequency, 0.5), 1.0)
    envelope = growth * ends**3 * (10.0 - 15.0 * ends + 6.0 * ends**2)
    phase = rng.uniform(0.0, 2.0 * np.pi, robot.n)
    q = middle + size * envelope[:, None] * np.sin(omega * t[:, None] + phase)
    return _with_rates("micro", t, q, rate)


def _strokes(name: str, points: Sequence[np.ndarray], time: float, ramps: Sequence[float], rate: float) -> Excitation:
    """Moves from point to point, each at constant speed but for its ends, with dwells between."""
    dwell, t, pieces = round(DWELL * rate), sample_times(time, rate), []
    for a, b, ramp in zip(points[:-1], points[1:], ramps, strict=True):
        # Speed rises and falls over the ramps as a smooth step; its integral is the share of the way.
        s = np.clip(np.minimum(t, time - t) / ramp, 0.0, 1.0)
        speed = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
        pieces += [np.repeat(a[None], dwell, axis=0), a + (b - a) * (way / way[-1])[:, None]]
    q = np.concatenate([*pieces, np.repeat(points[-1][None], dwell, axis=0)])
    return _with_rates(name, np.arange(len(q)) / rate, q, rate)


def _with_rates(name: str, t: np.ndarray, q: np.ndarray, rate: float) -> Excitation:
    qd = np.gradient(q, 1.0 / rate, axis=0)
    return Excitation(name, t, q, qd, np.gradient(qd, 1.0 / rate, axis=0))


def joined(robot: Robot, motions: Sequence[Excitation], rate: float) -> Excitation:
    """One motion after the other, with a quintic move from where one ends to where the next begins.

    Args:
        robot: Arm with limits.
        motions: At least one; each starts and ends at rest.
        rate: Samples per second, that of the motions [1/s].
    """
    limits = motion_limits(robot, 0.5)
    parts = [motions[0]]
    for before, after in zip(motions, motions[1:], strict=False):
        parts += [_move(before.q[-1], after.q[0], limits, rate), after]
    q, qd, qdd = (np.concatenate([getattr(p, k) for p in parts]) for k in ("q", "qd", "qdd"))
    return Excitation("proposed", np.arange(len(q)) / rate, q, qd, qdd)


def _move(a: np.ndarray, b: np.ndarray, limits: Limits, rate: float) -> Excitation:
    """q = a + (b - a)(10 s^3 - 15 s^4 + 6 s^5), after a dwell; peaks at 1.875 of its mean speed."""
    step = b - a
    time = max(0.5, float(np.max(1.875 * np.abs(step) / limits.speed)))
    time = max(time, float(np.max(np.sqrt(5.78 * np.abs(step) / limits.acceleration))))
    s = np.clip((sample_times(time + DWELL, rate) - DWELL) / time, 0.0, 1.0)[:, None]
    q = a + step * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    qd = step / time * s**2 * (30.0 - 60.0 * s + 30.0 * s**2)
    qdd = step / time**2 * s * (60.0 - 180.0 * s + 120.0 * s**2)
    return Excitation("move", np.arange(len(s)) / rate, q, qd, qdd)
