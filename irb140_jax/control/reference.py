"""Motions to follow: a circle of the tool, by inverse kinematics."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.errors import InputError
from irb140_jax.kinematics import damped_least_squares, forward_kinematics, jacobian, pose_error
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, JointSamples, Pose, Samples

# Poses solved one after the other, each from the one before; those between start from their interpolation.
NODES = 300
# Newton steps from there: the error is squared each time, from some 1e-5.
POLISH = 4
# Error of the tool along the path that is taken for round-off [m, rad].
REACHED = 1e-9

Points = Float[Array, "S 3"]


class Reference(eqx.Module):
    """A motion to follow, sampled at even spacing.

    Attributes:
        t: Time [s], shape (S,), evenly spaced.
        q: Joint positions [rad or m], shape (S, n).
        qd: Joint velocities [rad/s or m/s], shape (S, n).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (S, n).
    """

    t: Samples
    q: JointSamples
    qd: JointSamples
    qdd: JointSamples


def circle(
    robot: Robot,
    *,
    duration: float = 30.0,
    dt: float = 0.001,
    radius: float = 0.1,
    normal: Sequence[float] = (0.0, 0.0, 1.0),
    centre: Sequence[float] | None = None,
    laps: float = 1.0,
    ramp: float = 2.0,
    posture: Joints | None = None,
) -> Reference:
    """The tool on a circle, from rest to rest; with six joints its orientation is kept.

    The study says no more than that the circle takes 30 s.  Our defaults: one lap, level, of 0.1 m radius, passing
    through where the tool is in the starting posture, at the end of the circle that is furthest out along x.

    Args:
        robot: Arm with 3 joints, whose position follows, or with 6.
        duration: Time for all laps [s].
        dt: Spacing of the samples [s]; integrators that span two of them per step need half their step.
        radius: Radius [m].
        normal: Direction of the circle's axis in the world, any length, shape (3,).
        centre: Centre in the world [m], shape (3,); default such that the circle starts where the tool is.
        laps: Number of turns; negative ones run clockwise about the normal.
        ramp: Time to come to full speed, and likewise to rest [s]; at most half of the duration.
        posture: Joint positions to start searching from and, with six joints, whose orientation is kept [rad], shape
            (n,); default `robot.reference`.

    Returns:
        The motion, duration / dt + 1 samples.

    Raises:
        InputError: Another number of joints, impossible times, or a circle that the arm does not reach.
    """
    if not 0.0 < ramp <= 0.5 * duration or not 0.0 < dt < duration:
        raise InputError(f"circle: duration {duration} s, ramp {ramp} s, dt {dt} s; 2 ramp <= duration, all above 0")
    posture = robot.reference if posture is None else jnp.asarray(posture, float)
    axis, out = _plane(normal)
    tool = forward_kinematics(robot, posture)[:3, 3]
    middle = tool - radius * out if centre is None else jnp.asarray(centre, float)
    t = dt * jnp.arange(round(duration / dt) + 1)
    angle, rate, change = (2.0 * jnp.pi * laps * x[:, None] for x in smooth_progress(t, duration, ramp))
    across = jnp.cross(axis, out)
    radial = jnp.cos(angle) * out + jnp.sin(angle) * across
    tangent = jnp.cos(angle) * across - jnp.sin(angle) * out
    points = middle + radius * radial
    return along(robot, t, points, radius * rate * tangent, radius * (change * tangent - rate**2 * radial), posture)


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


def along(
    robot: Robot, t: Samples, points: Points, velocity: Points, acceleration: Points, posture: Joints
) -> Reference:
    """The joints' motion that takes the tool along points; with six joints its orientation is that of the posture.

    Args:
        robot: Arm with 3 or 6 joints.
        t: Time [s], shape (S,).
        points: Tool positions in the world [m], shape (S, 3).
        velocity: Their rates [m/s], shape (S, 3).
        acceleration: Rates of these [m/s^2], shape (S, 3).
        posture: Joint positions to start searching from [rad or m], shape (n,).

    Raises:
        InputError: Another number of joints, or points out of reach.
    """
    if robot.n not in (3, 6):
        raise InputError(
            f"a path of the tool asks for 3 joints (position) or 6 (orientation, too), but robot '{robot.name}' has "
            f"{robot.n}: take robot.first_joints(robot, 3), or give the joints' own motion as a Reference"
        )
    q, qd, qdd, error = _followed(robot, points, velocity, acceleration, posture)
    worst = float(error.max())
    if not worst <= REACHED:
        raise InputError(
            f"robot '{robot.name}' does not reach the path: {worst:.2g} m or rad are left at t = "
            f"{float(t[int(error.argmax())]):.3g} s; move or shrink it, or start from another posture"
        )
    if bool(jnp.any((q < robot.lower) | (q > robot.upper))):
        joint = robot.joint_names[int(jnp.argmax(jnp.any((q < robot.lower) | (q > robot.upper), axis=0)))]
        raise InputError(f"the path takes '{joint}' of robot '{robot.name}' beyond its limits; move it or shrink it")
    return Reference(t, q, qd, qdd)


@jax.jit
def _followed(robot: Robot, points: Points, velocity: Points, acceleration: Points, posture: Joints):
    whole = robot.n == 6
    T_start = forward_kinematics(robot, posture)

    def pose_at(point) -> Pose:
        return T_start.at[:3, 3].set(point)

    def joint_rates(q, v):
        J = jacobian(robot, q)[: 6 if whole else 3]
        return jnp.linalg.solve(J, jnp.concatenate([v, jnp.zeros(3)]) if whole else v)

    def node(q, point):
        q = damped_least_squares(robot, pose_at(point), q, orientation=whole).q
        return q, q

    def polished(q, point, v, a):
        for _ in range(POLISH):
            J = jacobian(robot, q)[: 6 if whole else 3]
            q = q + jnp.linalg.solve(J, pose_error(robot, pose_at(point), q, whole))
        qd = joint_rates(q, v)
        # v = J qd, so a = J qdd + Jd qd.
        drift = jax.jvp(lambda q: jacobian(robot, q), (q,), (qd,))[1] @ qd
        J = jacobian(robot, q)[: 6 if whole else 3]
        wanted = jnp.concatenate([a, jnp.zeros(3)]) if whole else a
        qdd = jnp.linalg.solve(J, wanted - drift[: 6 if whole else 3])
        return q, qd, qdd, jnp.linalg.norm(pose_error(robot, pose_at(point), q, whole))

    count = points.shape[0]
    chosen = np.unique(np.linspace(0, count - 1, min(NODES, count)).round().astype(int))
    _, nodes = jax.lax.scan(node, posture, points[chosen])
    guess = jax.vmap(lambda x: jnp.interp(jnp.arange(count), chosen, x), in_axes=1, out_axes=1)(nodes)
    return jax.vmap(polished)(guess, points, velocity, acceleration)


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
