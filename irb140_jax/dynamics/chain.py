"""A robot as scalars: what the recursions of this folder run on, and what of it is known at trace time."""

import itertools
from collections import OrderedDict
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from irb140_jax.dynamics.regroup import regrouping
from irb140_jax.dynamics.scalars import Matrix, Number, Vector
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import Parents

# An entry this close to 0, 1 or -1 is taken to be it: the round-off of rotations that a model file gives as angles.
SNAP = 1e-15
# Plans kept; more than the robots that one program works on at a time.
KEPT = 64

Known = tuple[float | None, ...]


class Plan(eqx.Module):
    """What a robot's geometry says before any sample is seen.

    Attributes:
        known: For each number of `numbers`, 0, 1 or -1 if it is that for sure, else None.
        regroup: Map of the inertial parameters onto fewer of the same torques; None if the geometry is traced.
        is_slide: True for prismatic joints.
        parent: Link that each link sits on, -1 for the base.
    """

    known: Known = eqx.field(static=True)
    regroup: Float[Array, "k k"] | None
    is_slide: tuple[bool, ...] = eqx.field(static=True)
    parent: Parents = eqx.field(static=True)


class Link(NamedTuple):
    """One link in scalars: the fields of `Robot`; mass, first moment and inertia are those of `Robot.phi`."""

    rotation: Matrix
    position: Vector
    axis: Vector
    reference: Number
    mass: Number
    first: Vector
    inertia: Matrix
    is_slide: bool


class Chain(NamedTuple):
    """All links from the base outward, gravity in base axes, and the link that each sits on (see `Robot.parent`)."""

    links: tuple[Link, ...]
    gravity: Vector
    parent: Parents


_plans: OrderedDict[tuple, tuple[tuple, Plan]] = OrderedDict()


def plan(robot: Robot, regrouped: bool = True) -> Plan:
    """What can be known of the robot: the zeros and ones of its geometry if that is concrete, nothing if it is traced.

    Inertial parameters count as unknown, so that a refitted robot does not make XLA compile again.
    """
    geometry = (robot.rotation, robot.position, robot.axis, robot.reference, robot.gravity)
    if any(isinstance(x, Tracer) for x in geometry):
        return Plan((None,) * (26 * robot.n + 3), None, robot.is_slide, robot.parent)
    key = (*map(id, geometry), robot.is_slide, robot.parent, regrouped)
    if key not in _plans:
        # The arrays are kept beside their plan, so that their ids can't pass to others.
        _plans[key] = (geometry, _plan(robot, regrouped))
        if len(_plans) > KEPT:
            _plans.popitem(last=False)
    return _plans[key][1]


def _plan(robot: Robot, regrouped: bool) -> Plan:
    rotation, position, axis = (np.asarray(x) for x in (robot.rotation, robot.position, robot.axis))
    reference, gravity = np.asarray(robot.reference), np.asarray(robot.gravity)
    regroup, gone = regrouping(rotation, position, axis, robot.is_slide, robot.parent)
    known: list[float | None] = []
    for i in range(robot.n):
        known.extend(_snapped(x) for x in (*rotation[i].ravel(), *position[i], *axis[i], reference[i]))
        known.extend(0.0 if regrouped and zero else None for zero in gone[i])
    known.extend(_snapped(x) for x in gravity)
    with jax.ensure_compile_time_eval():
        return Plan(tuple(known), jnp.asarray(regroup) if regrouped else None, robot.is_slide, robot.parent)


def _snapped(x: float) -> float | None:
    return next((value for value in (0.0, 1.0, -1.0) if abs(x - value) <= SNAP), None)


def numbers(robot: Robot, ahead: Plan) -> Float[Array, " k"]:
    """Every number that rigid-body dynamics needs, in one vector: 26 a link, then gravity."""
    n = robot.n
    phi = robot.phi if ahead.regroup is None else (ahead.regroup @ robot.phi.ravel()).reshape(n, 10)
    links = (robot.rotation.reshape(n, 9), robot.position, robot.axis, robot.reference[:, None], phi)
    return jnp.concatenate([jnp.concatenate(links, axis=1).ravel(), robot.gravity])


def chain(robot: Robot, ahead: Plan) -> Chain:
    """The links in scalars."""
    entries = [x if k is None else k for x, k in zip(jnp.unstack(numbers(robot, ahead)), ahead.known, strict=True)]
    take = iter(entries)

    def vector() -> Vector:
        x, y, z = itertools.islice(take, 3)
        return (x, y, z)

    links = []
    for slides in ahead.is_slide:
        rotation = (vector(), vector(), vector())
        position, axis, reference, mass, first = vector(), vector(), next(take), next(take), vector()
        xx, xy, xz, yy, yz, zz = itertools.islice(take, 6)
        inertia = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        links.append(Link(rotation, position, axis, reference, mass, first, inertia, slides))
    return Chain(tuple(links), vector(), ahead.parent)
