"""A circle of the tool, for any arm."""

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.control.postures import clear_postures, length
from irb140_jax.control.reference import RANK, Reference, along
from irb140_jax.errors import InputError
from irb140_jax.kinematics import forward_kinematics, jacobian
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, Samples

RADIUS, SHARE_OF_LENGTH = 0.1, 0.125


def circle(
    robot: Robot,
    *,
    duration: float = 30.0,
    dt: float = 0.001,
    radius: float | None = None,
    normal: Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    laps: float = 1.0,
    ramp: float = 2.0,
    posture: Joints | None = None,
) -> Reference:
    """The tool of any arm on a circle, from rest to rest; with six joints or more its orientation is kept, see `along`.

    The study says no more than that the circle takes 30 s.  Our defaults: one lap, level, of 0.1 m radius, passing
    through where the tool is in the starting posture, at the end of the circle that is furthest out along x.  An arm
    that is too short for it gets a smaller one, one that moves in a plane only a circle in that plane, and one that
    is singular at its reference, or can't make the circle from there, starts in another posture.

    Args:
        robot: Arm with n joints.
        duration: Time for all laps [s].
        dt: Spacing of the samples [s]; integrators that span two of them per step need half their step.
        radius: Radius [m]; default 0.1, or an eighth of the arm's length if that is less.
        normal: Direction of the circle's axis in the world, any length, shape (3,); default upwards, or for an arm that
            moves in a plane only, across it.
        centre: Centre in the world [m], shape (3,); default such that the circle starts where the tool is.
        laps: Number of turns; negative ones run clockwise about the normal.
        ramp: Time to come to full speed, and likewise to rest [s]; at most half of the duration.
        posture: Joint positions to start searching from and, with six joints or more, whose orientation is kept [rad or
            m], shape (n,); default `robot.reference`, or the first of `clear_postures` from which it works.

    Returns:
        The motion, duration / dt + 1 samples.

    Raises:
        InputError: Impossible times, or a circle that the arm does not reach.
    """
    if not 0.0 < ramp <= 0.5 * duration or not 0.0 < dt < duration:
        raise InputError(f"circle: duration {duration} s, ramp {ramp} s, dt {dt} s; 2 ramp <= duration, all above 0")
    if normal is not None:
        _plane(normal)  # what is wrong with it is no matter of the posture
    size = min(RADIUS, SHARE_OF_LENGTH * length(robot) or RADIUS) if radius is None else radius
    postures = clear_postures(robot) if posture is None else jnp.asarray(posture, float)[None]
    refused: InputError | None = None
    timing = {"duration": duration, "dt": dt, "laps": laps, "ramp": ramp}
    for start in postures:
        try:
            return _circle(robot, start, size, normal, centre, timing)
        except InputError as reason:
            refused = refused or reason
    raise refused or InputError(f"circle: robot '{robot.name}' has no posture to start from")


def _circle(
    robot: Robot, posture: Joints, radius: float, normal: Sequence[float] | None, centre: Sequence[float] | None,
    timing: dict[str, Any],
) -> Reference:  # fmt: skip
    """The circle from one posture."""
    duration, ramp = timing["duration"], timing["ramp"]
    axis, out = _plane(_normal(robot, posture) if normal is None else normal)
    tool = forward_kinematics(robot, posture)[:3, 3]
    middle = tool - radius * out if centre is None else jnp.asarray(centre, float)
    t = timing["dt"] * jnp.arange(round(duration / timing["dt"]) + 1)
    angle, rate, change = (2.0 * jnp.pi * timing["laps"] * x[:, None] for x in smooth_progress(t, duration, ramp))
    across = jnp.cross(axis, out)
    radial = jnp.cos(angle) * out + jnp.sin(angle) * across
    tangent = jnp.cos(angle) * across - jnp.sin(angle) * out
    points = middle + radius * radial
    return along(robot, t, points, radius * rate * tangent, radius * (change * tangent - rate**2 * radial), posture)


def _normal(robot: Robot, posture: Joints) -> tuple[float, ...]:
    """Upwards, or across the plane beyond which the tool can't move."""
    U, values, _ = np.linalg.svd(np.asarray(jacobian(robot, posture))[:3])
    flat = len(values) == 2 or values[2] <= RANK * values[0]
    if robot.n < 2 or not flat:
        return 0.0, 0.0, 1.0
    across = U[:, 2]
    # Of the two directions the one whose largest part is positive.
    return tuple((across * np.sign(across[np.argmax(np.abs(across))])).tolist())


def smooth_progress(t: Samples, duration: float, ramp: float) -> tuple[Samples, Samples, Samples]:
    """From 0 to 1 with a speed that rises and falls by the quintic 10 x^3 - 15 x^4 + 6 x^5: jerk has no jumps.

    Args:
        t: Time [s], shape (S,), within [0, duration].
        duration: Time of the whole [s].
        ramp: Time in which the speed rises, and falls again [s].

    Returns:
        Progress [1], its rate [1/s] and the rate's change [1/s^2], shape (S,) each.
    """
    top = 1.0 / (duration - ramp)

    def rise(time):
        x = jnp.clip(time / ramp, 0.0, 1.0)
        covered = ramp * x**4 * (2.5 - 3.0 * x + x**2) + jnp.maximum(time - ramp, 0.0)
        return covered, x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2 / ramp

    begun, ended = rise(t), rise(duration - t)
    late = t > 0.5 * duration
    progress = jnp.where(late, 1.0 - top * ended[0], top * begun[0])
    return progress, top * jnp.where(late, ended[1], begun[1]), top * jnp.where(late, -ended[2], begun[2])


def _plane(normal: Sequence[float]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Unit vectors along the normal, and in the plane as near to x as may be (to z for a plane across x)."""
    axis = np.asarray(normal, float)
    size = np.linalg.norm(axis)
    if axis.shape != (3,) or not size > 0.0:
        raise InputError(f"circle: normal {normal}; give three numbers that are not all zero")
    axis = axis / size
    out = np.eye(3)[0] - axis[0] * axis
    if np.linalg.norm(out) < 1e-6:
        out = np.eye(3)[2] - axis[2] * axis
    return jnp.asarray(axis), jnp.asarray(out / np.linalg.norm(out))
