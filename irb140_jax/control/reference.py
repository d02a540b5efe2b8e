"""A path of the tool as a motion of the joints, by inverse kinematics."""

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
# Newton steps of a node with more joints than the tool needs, until all of them are where they belong.
SETTLE = 10
# Error of the tool along the path that is taken for round-off [m, rad].
REACHED = 1e-9
# Share of the largest singular value below which the tool can't move in a direction at all.
RANK = 1e-6

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


def along(
    robot: Robot, t: Samples, points: Points, velocity: Points, acceleration: Points, posture: Joints
) -> Reference:
    """The joints' motion that takes the tool along points; with six joints or more its orientation is kept.

    Joints that the tool has no need of are held to the posture as far as they can be: what the tool's motion leaves
    free at the posture, the null space N of its Jacobian there, stays, N (q - posture) = 0.

    Args:
        robot: Arm with n joints.
        t: Time [s], shape (S,).
        points: Tool positions in the world [m], shape (S, 3).
        velocity: Their rates [m/s], shape (S, 3).
        acceleration: Rates of these [m/s^2], shape (S, 3).
        posture: Joint positions to start searching from [rad or m], shape (n,).

    Raises:
        InputError: Points out of reach, or joints beyond their limits.

    Source: Baillieul (1985), Kinematic programming alternatives for redundant manipulators, with constant rows.
    """
    moves, rest = _directions(robot, posture)
    q, qd, qdd, error = _followed(robot, points, velocity, acceleration, posture, moves, rest)
    worst = float(error.max())
    if not worst <= REACHED:
        few = "with fewer than 3 joints, give the joints' own motion as a Reference" if robot.n < 3 else ""
        raise InputError(
            f"robot '{robot.name}' does not reach the path: {worst:.2g} m or rad are left at t = "
            f"{float(t[int(error.argmax())]):.3g} s; {few or 'move or shrink it, or start from another posture'}"
        )
    if bool(jnp.any((q < robot.lower) | (q > robot.upper))):
        joint = robot.joint_names[int(jnp.argmax(jnp.any((q < robot.lower) | (q > robot.upper), axis=0)))]
        raise InputError(f"the path takes '{joint}' of robot '{robot.name}' beyond its limits; move it or shrink it")
    return Reference(t, q, qd, qdd)


def task_rows(robot: Robot) -> int:
    """How much of the tool's pose follows: 3 (position), from six joints on 6 (orientation, too)."""
    return 6 if robot.n >= 6 else 3


def _directions(robot: Robot, posture: Joints) -> tuple[Float[Array, "r m"], Float[Array, "k n"]]:
    """Rows onto the directions in which the tool can move at the posture, and onto what it ignores of the joints."""
    rows = task_rows(robot)
    U, values, V = np.linalg.svd(np.asarray(jacobian(robot, posture))[:rows])
    rank = int(np.sum(values > RANK * values[0]))
    moves = np.eye(rows) if rank == rows else U[:, :rank].T
    return jnp.asarray(moves), jnp.asarray(V[rank:])


@jax.jit
def _followed(
    robot: Robot, points: Points, velocity: Points, acceleration: Points, posture: Joints,
    moves: Float[Array, "r m"], rest: Float[Array, "k n"],
):  # fmt: skip
    rows = task_rows(robot)
    whole, free = rows == 6, robot.n - moves.shape[0]
    T_start = forward_kinematics(robot, posture)

    def pose_at(point) -> Pose:
        return T_start.at[:3, 3].set(point)

    def task(v):
        """A velocity of the tool, or its rate, as what the square system asks for."""
        return jnp.concatenate([moves @ (jnp.concatenate([v, jnp.zeros(3)]) if whole else v), jnp.zeros(free)])

    def system(q):
        return jnp.concatenate([moves @ jacobian(robot, q)[:rows], rest])

    def missing(q, point):
        return jnp.concatenate([moves @ pose_error(robot, pose_at(point), q, whole), rest @ (posture - q)])

    def newton(q, point, steps: int):
        return jax.lax.fori_loop(0, steps, lambda _, q: q + jnp.linalg.solve(system(q), missing(q, point)), q)

    def node(q, point):
        q = damped_least_squares(robot, pose_at(point), q, orientation=whole).q
        q = newton(q, point, SETTLE) if free else q
        return q, q

    def polished(q, point, v, a):
        q = newton(q, point, POLISH)
        qd = jnp.linalg.solve(system(q), task(v))
        # v = J qd, so a = J qdd + Jd qd.
        drift = jax.jvp(system, (q,), (qd,))[1] @ qd
        qdd = jnp.linalg.solve(system(q), task(a) - drift)
        error = jnp.concatenate([pose_error(robot, pose_at(point), q, whole), rest @ (posture - q)])
        return q, qd, qdd, jnp.linalg.norm(error)

    count = points.shape[0]
    chosen = np.unique(np.linspace(0, count - 1, min(NODES, count)).round().astype(int))
    _, nodes = jax.lax.scan(node, posture, points[chosen])
    guess = jax.vmap(lambda x: jnp.interp(jnp.arange(count), chosen, x), in_axes=1, out_axes=1)(nodes)
    return jax.vmap(polished)(guess, points, velocity, acceleration)
