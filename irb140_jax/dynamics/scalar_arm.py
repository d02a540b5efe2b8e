"""A robot in scalars with its drives: what a controller and a simulation ask of it at every step.

Lists of scalars instead of vectors, since a loop whose state is a handful of scalars is what XLA compiles best.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import jax.numpy as jnp

from irb140_jax.dynamics.chain import Chain, Plan, chain
from irb140_jax.dynamics.joint_space import UNSTAGED, solved, terms
from irb140_jax.dynamics.newton_euler import Motion, inward, link_wrench, next_motion, outward, placements
from irb140_jax.dynamics.scalars import ZERO, Number, cross, dot, plus, scale
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import serial

Scalars = Sequence[Number]
Result = TypeVar("Result")


class ScalarArm(NamedTuple):
    """The links, and by joint what `Robot` says of the drives; n scalars each."""

    links: Chain
    armature: Scalars
    damping: Scalars
    frictionloss: Scalars
    stiffness: Scalars
    springref: Scalars

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.armature)


def scalar_arm(robot: Robot, ahead: Plan) -> ScalarArm:
    """The robot in scalars.

    Args:
        robot: Arm with n joints.
        ahead: Its `chain.plan`, made where the robot's geometry is concrete.
    """
    drives = (robot.armature, robot.damping, robot.frictionloss, robot.stiffness, robot.springref)
    return ScalarArm(chain(robot, ahead), *(list(jnp.unstack(jnp.asarray(x))) for x in drives))


def passive(arm: ScalarArm, q: Scalars, qd: Scalars) -> Scalars:
    """Friction and springs of the model, d qd + f sign(qd) + k (q - q0) [N m or N]; see `passive_torque`."""
    friction = [d * v + f * jnp.sign(v) for d, f, v in zip(arm.damping, arm.frictionloss, qd, strict=True)]
    springs = [k * (x - rest) for k, x, rest in zip(arm.stiffness, q, arm.springref, strict=True)]
    return [a + b for a, b in zip(friction, springs, strict=True)]


def torque(arm: ScalarArm, q: Scalars, qd: Scalars, qdd: Scalars, carried: Scalars | None = None) -> Scalars:
    """Torque of a motion, M qdd + C qd + g + passive; with `carried`, C acts on those speeds instead.

    Args:
        arm: From `scalar_arm`.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        qdd: Joint accelerations [rad/s^2 or m/s^2].
        carried: Speeds v of C(q, qd) v [rad/s or m/s], as controllers built on passivity ask; default qd.

    Returns:
        tau [N m or N], n scalars.
    """
    rigid = _recursive(arm, q, qd, qdd) if carried is None else _in_terms(arm, q, qd, qdd, carried)
    rotors = [j * a for j, a in zip(arm.armature, qdd, strict=True)]
    return [x + y + z for x, y, z in zip(rigid, rotors, passive(arm, q, qd), strict=True)]


def acceleration(arm: ScalarArm, q: Scalars, qd: Scalars, tau: Scalars, christoffel: bool) -> Scalars:
    """Accelerations under torques, qdd = M^-1 (tau - C qd - g - passive).

    Args:
        arm: From `scalar_arm`.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        tau: Joint torques [N m or N].
        christoffel: Whether C is formed by Christoffel symbols as in equations 14 to 16 of the study, or C qd + g come
            from the Newton-Euler recursion: the same number by either way.

    Returns:
        qdd [rad/s^2 or m/s^2], n scalars.
    """
    n = arm.n
    M, C, g = terms(arm.links, list(q), list(qd))
    if christoffel:
        bias = [sum((C[i][j] * qd[j] for j in range(n)), g[i]) for i in range(n)]
    else:
        bias = _recursive(arm, q, qd, [0.0] * n)
    for i in range(n):
        M[i][i] = M[i][i] + arm.armature[i]
    rest = passive(arm, q, qd)
    return stored(q, lambda: solved(M, [tau[i] - bias[i] - rest[i] for i in range(n)]))


def stored(q: Scalars, work: Callable[[], Result]) -> Result:
    """Result of the function, computed once and stored before anything uses it (see `stage`)."""
    return staged(always(*(jnp.asarray(x) for x in q)), work)


def _recursive(arm: ScalarArm, q: Scalars, qd: Scalars, qdd: Scalars) -> Scalars:
    """Torque of the rigid bodies by the Newton-Euler recursion."""
    if arm.n <= UNSTAGED and arm.links.parent == serial(arm.n):
        return _in_one_go(arm.links, q, qd, qdd)
    predicate = always(*(jnp.asarray(x) for x in q))
    return inward(arm.links, *outward(arm.links, list(q), list(qd), list(qdd), predicate), predicate)


def _in_one_go(links: Chain, q: Scalars, qd: Scalars, qdd: Scalars) -> Scalars:
    """The same recursion without stages: half the time to compile, and no slower for so short a chain."""
    places, motion, motions = placements(links, list(q)), Motion(ZERO, ZERO, scale(-1.0, links.gravity)), []
    for place, speed, change in zip(places, qd, qdd, strict=True):
        motion = next_motion(place, motion, speed, change)
        motions.append(motion)
    torques: list[Number] = []
    force, moment = ZERO, ZERO
    for place, motion in zip(reversed(places), reversed(motions), strict=True):
        own = link_wrench(place.link, motion)
        force, moment = plus(own[0], force), plus(own[1], moment)
        torques.append(dot(place.link.axis, force if place.link.is_slide else moment))
        force, moment = place.to_parent(force), place.to_parent(moment)
        moment = plus(moment, cross(place.position, force))
    return torques[::-1]


def _in_terms(arm: ScalarArm, q: Scalars, qd: Scalars, qdd: Scalars, carried: Scalars) -> Scalars:
    M, C, g = terms(arm.links, list(q), list(qd))
    rows = range(arm.n)
    return [g[i] + sum(M[i][j] * qdd[j] + C[i][j] * carried[j] for j in rows) for i in rows]
