"""Inverse dynamics by the recursive Newton-Euler algorithm."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from irb140_jax.dynamics.chain import Chain, Link, Plan, chain, plan
from irb140_jax.dynamics.passive import passive_torque
from irb140_jax.dynamics.scalars import (
    ZERO,
    Number,
    Vector,
    apply,
    cross,
    dot,
    minus,
    mul,
    plus,
    scale,
    sub,
    transpose,
    turn,
)
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.dynamics.trig import sincos
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints

Wrench = tuple[Vector, Vector]


class Placement(NamedTuple):
    """How a link sits on its parent at the current joint position."""

    link: Link
    cos: Number
    sin: Number
    position: Vector

    def to_link(self, v: Vector) -> Vector:
        """Parent axes to link axes."""
        v = apply(transpose(self.link.rotation), v)
        return v if self.link.is_slide else turn(self.link.axis, self.cos, mul(-1.0, self.sin), v)

    def to_parent(self, v: Vector) -> Vector:
        """Link axes to parent axes."""
        v = v if self.link.is_slide else turn(self.link.axis, self.cos, self.sin, v)
        return apply(self.link.rotation, v)


class Motion(NamedTuple):
    """Motion of a link in its own axes; `linear` is the acceleration of the frame's origin less gravity."""

    velocity: Vector
    angular: Vector
    linear: Vector


def placements(arm: Chain, q: list[Number]) -> list[Placement]:
    """Where the joint coordinates put each link on its parent."""
    result = []
    for link, coordinate in zip(arm.links, q, strict=True):
        angle = sub(coordinate, link.reference)
        if link.is_slide:
            offset = apply(link.rotation, scale(angle, link.axis))
            result.append(Placement(link, 1.0, 0.0, plus(link.position, offset)))
        else:
            sine, cosine = sincos(jnp.asarray(angle))
            result.append(Placement(link, cosine, sine, link.position))
    return result


def next_motion(place: Placement, parent: Motion, qd: Number, qdd: Number) -> Motion:
    """Motion of the link from that of its parent (outward pass)."""
    axis, p = place.link.axis, place.position
    swing = plus(cross(parent.angular, p), cross(parent.velocity, cross(parent.velocity, p)))
    velocity, angular = place.to_link(parent.velocity), place.to_link(parent.angular)
    linear = place.to_link(plus(parent.linear, swing))
    rate = scale(qd, axis)
    if place.link.is_slide:
        coriolis = cross(velocity, rate)
        return Motion(velocity, angular, plus(linear, plus(scale(qdd, axis), plus(coriolis, coriolis))))
    angular = plus(angular, plus(scale(qdd, axis), cross(velocity, rate)))
    return Motion(plus(velocity, rate), angular, linear)


def link_wrench(link: Link, motion: Motion) -> tuple[Vector, Vector]:
    """Force, and moment about the link's origin, that move the link so; linear in its inertial parameters.

    f = m a + alpha x h + w x (w x h),  n = I alpha + w x (I w) + h x a,  with h = m c and I about the origin.
    """
    w, alpha, a = motion
    h = link.first
    force = plus(scale(link.mass, a), plus(cross(alpha, h), cross(w, cross(w, h))))
    moment = plus(apply(link.inertia, alpha), plus(cross(w, apply(link.inertia, w)), cross(h, a)))
    return force, moment


def outward(
    arm: Chain, q: list[Number], qd: list[Number], qdd: list[Number], predicate: Bool[Array, ""]
) -> tuple[list[Placement], list[Motion]]:
    """Placements and motions of all links, from the base outward; the predicate is for `staged`."""
    stored = staged(predicate, lambda: [place[1:] for place in placements(arm, q)])
    places = [Placement(link, *place) for link, place in zip(arm.links, stored, strict=True)]
    motions = [Motion(ZERO, ZERO, scale(-1.0, arm.gravity))]  # of the base, then the links
    for before, place, *rates in zip(arm.parent, places, qd, qdd, strict=True):
        motions.append(staged(predicate, partial(next_motion, place, motions[before + 1], *rates)))
    return places, motions[1:]


def inward(
    arm: Chain, places: list[Placement], motions: list[Motion], predicate: Bool[Array, ""]
) -> list[Number]:
    """Joint torques from the motions, tips to base."""
    passed: list[list[tuple[Placement, Wrench]]] = [[] for _ in places]
    torques: list[Number] = []
    for i in reversed(range(len(places))):
        wrench = staged(predicate, partial(_carried_wrench, places[i].link, motions[i], passed[i]))
        if arm.parent[i] >= 0:
            passed[arm.parent[i]].append((places[i], wrench))
        torques.append(dot(places[i].link.axis, wrench[0] if places[i].link.is_slide else wrench[1]))
    return torques[::-1]


def _carried_wrench(link: Link, motion: Motion, outer: list[tuple[Placement, Wrench]]) -> Wrench:
    """Wrench that the link's joint carries: the link's own and those of the joints that sit on it."""
    force, moment = link_wrench(link, motion)
    for place, wrench in outer:
        passed = place.to_parent(wrench[0])
        arm = minus(place.to_parent(wrench[1]), cross(passed, place.position))
        force, moment = plus(force, passed), plus(moment, arm)
    return force, moment


@shape_checked
def inverse_dynamics(robot: Robot, q: Joints, qd: Joints, qdd: Joints) -> Joints:
    """Joint torques of a motion, tau = M(q) qdd + C(q, qd) qd + g(q) + passive, M with armature.

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        qdd: Joint accelerations [rad/s^2 or m/s^2].

    Returns:
        Joint torques [N m or N].

    Source: Luh, Walker, Paul (1980); inertial parameters about the link's origin as in Khalil, Dombre, Modeling,
        Identification and Control of Robots (2002), sec. 9.5.
    """
    return _inverse_dynamics(robot, plan(robot), q, qd, qdd)


@jax.jit
def _inverse_dynamics(robot: Robot, ahead: Plan, q: Joints, qd: Joints, qdd: Joints) -> Joints:
    rigid = rigid_torque(chain(robot, ahead), q, qd, qdd)
    return rigid + robot.armature * qdd + passive_torque(robot, q, qd)


def rigid_torque(
    arm: Chain, q: Float[Array, "n *T"], qd: Float[Array, "n *T"], qdd: Float[Array, "n *T"] | None
) -> Float[Array, "n *T"]:
    """Torques of the rigid bodies alone, shape (n,) for one sample, (n, T) for a batch; qdd = 0 if it is None."""
    predicate = always(q, qd)
    accelerations: list[Number] = [0.0] * len(arm.links) if qdd is None else list(qdd)
    torques = inward(arm, *outward(arm, list(q), list(qd), accelerations, predicate), predicate)
    return jnp.stack([jnp.broadcast_to(jnp.asarray(x, q.dtype), q.shape[1:]) for x in torques])
