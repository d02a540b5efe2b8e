"""Motions of an arm: known in position, speed and acceleration at every fine step."""

import dataclasses

import numpy as np
from scipy import ndimage
from scipy.integrate import cumulative_trapezoid

from testbed.arms import Arm

STEP = 0.0005  # s between fine samples; logs take every second one at most


@dataclasses.dataclass(frozen=True)
class Motion:
    """A motion, sampled every STEP.

    Attributes:
        t: [s], shape (T,).
        q, qd, qdd: Shape (T, n) [rad or m, s].
        number: Of the recording it is for.
    """

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    number: int = 0


def fourier(arm: Arm, rng: np.random.Generator, seconds: float) -> Motion:
    """Sums of five sines on every joint, from rest to rest."""
    t = np.arange(0.0, seconds, STEP)
    rate = 2.0 * np.pi * rng.uniform(0.05, 0.6, (5, arm.n))
    phase, size = rng.uniform(0.0, 2.0 * np.pi, (5, arm.n)), rng.uniform(0.3, 1.0, (5, arm.n))
    angle = rate * t[:, None, None] + phase
    x = [np.sum(size * f, axis=1) for f in (np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle))]
    u = np.clip(np.minimum(t, seconds - t) / 1.0, 0.0, 1.0)[:, None]  # the first and the last second swell and fade
    way = np.where(t < 0.5 * seconds, 1.0, -1.0)[:, None]
    w = (u**3 * (10 - 15 * u + 6 * u**2), way * 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u))
    q, qd, qdd = x[0] * w[0], x[1] * w[0] + x[0] * w[1], x[2] * w[0] + 2 * x[1] * w[1] + x[0] * w[2]
    room = rng.uniform(0.6, 0.95) * 0.5 * (arm.high - arm.low)
    scale = np.minimum(room / np.max(np.abs(q), axis=0), 0.9 * arm.speed / np.max(np.abs(qd), axis=0))
    return Motion(t, 0.5 * (arm.low + arm.high) + scale * q, scale * qd, scale * qdd)


def point_to_point(arm: Arm, rng: np.random.Generator, seconds: float, share: float = 0.8) -> Motion:
    """From pose to pose with trapezoids of speed whose corners are rounded over some 40 ms, and a rest at each.

    Args:
        arm: Whose limits hold.
        rng: Random numbers.
        seconds: How long it lasts at most.
        share: Of the largest speed that the fastest joint of a move takes.
    """
    t = np.arange(0.0, seconds, STEP)
    bend, here = np.zeros((len(t), arm.n)), 0.5 * (arm.low + arm.high)
    start, at = here.copy(), 0.3
    while True:
        goal = 0.5 * (arm.low + arm.high) + rng.uniform(-0.45, 0.45, arm.n) * (arm.high - arm.low)
        ramp = rng.uniform(0.15, 0.4)
        cruise = max(np.max(np.abs(goal - here) / (share * arm.speed)) - ramp, 0.1)
        if at + cruise + 2.0 * ramp + 0.3 > seconds:
            break
        top = (goal - here) / (cruise + ramp)
        for begin, sign in ((at, 1.0), (at + ramp + cruise, -1.0)):
            # Whole steps, the same number up and down, so that every move ends at rest.
            i, k = round(begin / STEP), max(round(ramp / STEP), 1)
            bend[i : i + k] += sign * top / (k * STEP)
        here, at = goal, at + cruise + 2.0 * ramp + rng.uniform(0.15, 0.5)
    bend = ndimage.uniform_filter1d(bend, round(0.04 / STEP), axis=0, mode="constant")
    qd = cumulative_trapezoid(bend, t, axis=0, initial=0.0)
    return Motion(t, start + cumulative_trapezoid(qd, t, axis=0, initial=0.0), qd, bend)


def slow_sweeps(arm: Arm, rng: np.random.Generator, seconds: float) -> Motion:
    """The same at a tenth to a quarter of the speed, which is where friction shows."""
    return point_to_point(arm, rng, seconds, rng.uniform(0.1, 0.25))


PROGRAMMES = {
    "fourier": (fourier, fourier),
    "mixed": (fourier, point_to_point, slow_sweeps),
    "moves": (point_to_point, slow_sweeps),
    "repeated": (fourier,),
}


def programme(arm: Arm, rng: np.random.Generator, name: str, seconds: float) -> list[Motion]:
    """The motions of a case; "repeated" is one motion, played three times."""
    made = [motion(arm, rng, seconds) for motion in PROGRAMMES[name]]
    made = made * 3 if name == "repeated" else made
    return [dataclasses.replace(m, number=i) for i, m in enumerate(made)]
