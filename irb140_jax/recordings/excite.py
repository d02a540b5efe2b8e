"""Motions that excite an arm: Fourier series, point to point with dwells, and slow ones.

They start and end at rest and stay within the joint limits; where the model gives no limit, a cautious guess stands in.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from irb140_jax.robot import Robot

SPEED_GUESS = (2.0, 0.5)  # [rad/s], [m/s]: an industrial arm of middle size, used where the model gives no speed limit
RANGE_GUESS = (2.0, 0.3)  # [rad], [m] either way of zero: used where the model gives no joint range
RANGE_SHARE = 0.85  # of the joint range that a motion may use, so that tracking errors don't reach the stops
LEAST_ROOM = 0.1  # [rad], [m] either way of where a joint without limits was seen to stand
SPEED_UP_TIME = 0.25  # [s] to reach the speed limit: the acceleration limit is the speed limit divided by this


class Excitation(NamedTuple):
    """A motion to be played.

    Attributes:
        name: What kind of motion it is.
        t: Time [s], shape (T,), evenly spaced.
        q, qd, qdd: Joint positions, velocities and accelerations, shape (T, n).
    """

    name: str
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray


def motion_columns(motion: Excitation, joint_names: Sequence[str]) -> dict[str, np.ndarray]:
    """A motion as the columns of a table, by the names of a recording: t, q.<joint>, qd.<joint>, qdd.<joint>."""
    columns = {"t": motion.t}
    for name in ("q", "qd", "qdd"):
        columns |= {f"{name}.{joint}": getattr(motion, name)[:, i] for i, joint in enumerate(joint_names)}
    return columns


class Limits(NamedTuple):
    """Positions, speeds and accelerations within which motions stay; each of shape (n,)."""

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray


def fourier_motion(
    robot: Robot, duration: float = 20.0, rate: float = 1000.0, *, seed: int, speed: float = 0.6,
    harmonics: int = 8, base_frequency: float = 0.1,
) -> Excitation:
    """Random Fourier series on every joint at once, faded in and out.

    q_j(t) = centre_j + w(t) sum_k [a_jk sin(k w0 t) + b_jk cos(k w0 t)]

    Args:
        robot: Arm with n joints.
        duration: Length of the motion [s].
        rate: Samples per second [1/s].
        seed: Of the random coefficients.
        speed: Largest speed as a share of each joint's speed limit.
        harmonics: Number of harmonics.
        base_frequency: Frequency of the first harmonic [1/s].

    Returns:
        The motion, T = duration * rate samples.

    Source: Swevers, Ganseman, Tuekel, De Schutter, Van Brussel, IEEE Trans. Robotics and Automation 13(5), 1997.
    """
    rng = np.random.default_rng([seed, 1])
    limits, t = motion_limits(robot, speed), sample_times(duration, rate)
    omega = 2.0 * math.pi * base_frequency * np.arange(1, harmonics + 1)
    amplitude = rng.normal(size=(harmonics, robot.n)) / np.sqrt(np.arange(1, harmonics + 1))[:, None]
    phase = rng.uniform(0.0, 2.0 * math.pi, size=(harmonics, robot.n))
    angle = omega[None, :, None] * t[:, None, None] + phase[None]
    wave = np.sum(amplitude * np.sin(angle), axis=1)
    wave_d = np.sum(omega[:, None] * amplitude * np.cos(angle), axis=1)
    wave_dd = -np.sum(omega[:, None] ** 2 * amplitude * np.sin(angle), axis=1)
    w, wd, wdd = (x[:, None] for x in fade(t, min(2.0, 0.2 * duration)))
    shape, shape_d = w * wave, w * wave_d + wd * wave
    shape_dd = w * wave_dd + 2.0 * wd * wave_d + wdd * wave
    # The largest scale at which position, speed and acceleration all stay within their limits.
    low, high = np.minimum(shape.min(axis=0), 0.0), np.maximum(shape.max(axis=0), 0.0)
    scale = np.minimum(limits.speed / np.abs(shape_d).max(axis=0), limits.acceleration / np.abs(shape_dd).max(axis=0))
    scale = np.minimum(scale, (limits.upper - limits.lower) / (high - low))
    # Anywhere it fits: joints with a long range are not always moved around its middle.
    centre = rng.uniform(limits.lower - scale * low, limits.upper - scale * high + 1e-12)
    return Excitation("fourier", t, centre + scale * shape, scale * shape_d, scale * shape_dd)


def slow_motion(
    robot: Robot, duration: float = 20.0, rate: float = 1000.0, *, seed: int, speed: float = 0.08
) -> Excitation:
    """A Fourier motion at a few per cent of the speed limit: friction and gravity, hardly any inertia."""
    motion = fourier_motion(robot, duration, rate, seed=seed + 7919, speed=speed, harmonics=4, base_frequency=0.05)
    return motion._replace(name="slow")


def point_to_point_motion(
    robot: Robot, duration: float = 20.0, rate: float = 1000.0, *, seed: int, speed: float = 0.6
) -> Excitation:
    """Moves between random points, all joints together, with dwells of 0.3 to 0.8 s between them.

    Each move is a quintic, q = q0 + (q1 - q0) (10 s^3 - 15 s^4 + 6 s^5), at rest at both ends.

    Args:
        robot: Arm with n joints.
        duration: Length of the motion [s].
        rate: Samples per second [1/s].
        seed: Of the points and dwells.
        speed: Largest speed as a share of each joint's speed limit.

    Returns:
        The motion, T = duration * rate samples; it ends with a dwell.
    """
    rng = np.random.default_rng([seed, 2])
    limits, t = motion_limits(robot, speed), sample_times(duration, rate)
    span = limits.upper - limits.lower
    point = limits.lower + span * rng.uniform(0.25, 0.75, size=robot.n)
    q, qd, qdd = np.empty((t.size, robot.n)), np.zeros((t.size, robot.n)), np.zeros((t.size, robot.n))
    q[:] = point
    start = 0.3
    while True:
        time = rng.uniform(0.8, 2.2)
        if start + time > duration - 0.2:
            return Excitation("point_to_point", t, q, qd, qdd)
        # A quintic peaks at 1.875 of its mean speed and at 5.78 of its mean acceleration.
        reach = np.minimum(limits.speed * time / 1.875, limits.acceleration * time**2 / 5.78)
        step = rng.uniform(0.3, 1.0, size=robot.n) * np.minimum(reach, 0.9 * span)
        step = _inward(point, step * rng.choice([-1.0, 1.0], size=robot.n), limits)
        moving = (t >= start) & (t < start + time)
        s = ((t[moving] - start) / time)[:, None]
        q[moving] = point + step * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        qd[moving] = step / time * (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4)
        qdd[moving] = step / time**2 * (60.0 * s - 180.0 * s**2 + 120.0 * s**3)
        point = point + step
        q[t >= start + time] = point
        start += time + rng.uniform(0.3, 0.8)


def three_motions(robot: Robot, duration: float = 20.0, rate: float = 1000.0, *, seed: int) -> list[Excitation]:
    """The usual set: a Fourier motion, point to point with dwells, and a slow one."""
    kinds = (fourier_motion, point_to_point_motion, slow_motion)
    return [kind(robot, duration, rate, seed=seed) for kind in kinds]


def within(robot: Robot, low: np.ndarray, high: np.ndarray, speed: np.ndarray | None = None) -> Robot:
    """The robot with limits where the model gives none: where it was seen to be, and no faster than `speed`.

    Args:
        robot: Arm with n joints.
        low, high: Lowest and highest positions seen [rad or m], shape (n,).
        speed: Largest speeds allowed [rad/s or m/s], shape (n,); none by default.
    """
    room = np.maximum(LEAST_ROOM - 0.5 * (high - low), 0.0)
    fill = lambda given, seen: jnp.asarray(np.where(np.isfinite(given), given, seen))  # noqa: E731
    limits = (
        fill(robot.lower, low - room), fill(robot.upper, high + room),
        robot.velocity_limit if speed is None else fill(robot.velocity_limit, speed),
    )  # fmt: skip
    return eqx.tree_at(lambda r: (r.lower, r.upper, r.velocity_limit), robot, limits)


def motion_limits(robot: Robot, speed: float) -> Limits:
    """Limits in force, guesses filled in, margins taken off, speed scaled; each of shape (n,)."""
    guess = lambda pair: np.where(robot.is_slide, pair[1], pair[0])  # noqa: E731
    lower, upper = np.asarray(robot.lower), np.asarray(robot.upper)
    room = guess(RANGE_GUESS)
    lower_in = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper - 2.0 * room, -room))
    upper_in = np.where(np.isfinite(upper), upper, lower_in + 2.0 * room)
    middle, half = 0.5 * (lower_in + upper_in), 0.5 * RANGE_SHARE * (upper_in - lower_in)
    limit = np.asarray(robot.velocity_limit)
    limit = np.where(np.isfinite(limit), limit, guess(SPEED_GUESS))
    return Limits(middle - half, middle + half, speed * limit, speed * limit / SPEED_UP_TIME)


def sample_times(duration: float, rate: float) -> np.ndarray:
    """Evenly spaced times from zero, shape (duration * rate,)."""
    return np.arange(round(duration * rate)) / rate


def fade(t: np.ndarray, ramp: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A window from 0 to 1 and back to 0 with its two derivatives; speed and acceleration vanish at both ends."""
    rising = np.clip(t / ramp, 0.0, 1.0)
    falling = np.clip((t[-1] - t) / ramp, 0.0, 1.0)
    s, sign = np.minimum(rising, falling), np.where(rising <= falling, 1.0, -1.0)
    window = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
    slope = sign / ramp * (30.0 * s**2 - 60.0 * s**3 + 30.0 * s**4)
    return window, slope, (60.0 * s - 180.0 * s**2 + 120.0 * s**3) / ramp**2


def _inward(point: np.ndarray, step: np.ndarray, limits: Limits) -> np.ndarray:
    """The step, turned round or cut where it would leave the range."""
    inside = lambda s: (point + s >= limits.lower) & (point + s <= limits.upper)  # noqa: E731
    step = np.where(inside(step), step, -step)
    return np.where(inside(step), step, np.clip(point + step, limits.lower, limits.upper) - point)
