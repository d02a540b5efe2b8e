"""Inverse dynamics by the recursive Newton-Euler algorithm."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from irb140_jax.dynamics.chain import Chain, Link, Structure, chain, packed, structure
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
)  # fmt: skip
from irb140_jax.robot import Robot
from irb140_jax.types import Joints


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


def placement(link: Link, q: Number) -> Placement:
    """Where joint coordinate q puts the link."""
    angle = sub(q, link.reference)
    if link.is_slide:
        return Placement(link, 1.0, 0.0, plus(link.position, apply(link.rotation, scale(angle, link.axis))))
    return Placement(link, jnp.cos(angle), jnp.sin(angle), link.position)


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


def outward(arm: Chain, q: list[Number], qd: list[Number], qdd: list[Number]) -> tuple[list[Placement], list[Motion]]:
    """Placements and motions of all links, base to tip."""
    motion = Motion(ZERO, ZERO, scale(-1.0, arm.gravity))
    places, motions = [], []
    for i, link in enumerate(arm.links):
        places.append(placement(link, q[i]))
        motion = next_motion(places[i], motion, qd[i], qdd[i])
        motions.append(motion)
    return places, motions


def inward(places: list[Placement], motions: list[Motion]) -> list[Number]:
    """Joint torques from the motions, tip to base."""
    force, moment = ZERO, ZERO
    torques: list[Number] = []
    for i in reversed(range(len(places))):
        own_force, own_moment = link_wrench(places[i].link, motions[i])
        force, moment = plus(force, own_force), plus(moment, own_moment)
        torques.append(dot(places[i].link.axis, force if places[i].link.is_slide else moment))
        force, moment = places[i].to_parent(force), places[i].to_parent(moment)
        moment = minus(moment, cross(force, places[i].position))
    return torques[::-1]


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
    rigid = _rigid_torque(packed(robot), structure(robot), robot.is_slide, q, qd, qdd)
    return rigid + robot.armature * qdd + passive_torque(robot, q, qd)


@partial(jax.jit, static_argnums=(1, 2))
def _rigid_torque(numbers, known: Structure, is_slide: tuple[bool, ...], q, qd, qdd):
    arm = chain(numbers, known, is_slide)
    torques = inward(*outward(arm, list(q), list(qd), list(qdd)))
    return jnp.stack([jnp.broadcast_to(jnp.asarray(x, q.dtype), q.shape[1:]) for x in torques])
