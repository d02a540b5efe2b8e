"""A robot as scalars: what the recursions of this folder run on, and what of it is known at trace time."""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.dynamics.scalars import Matrix, Number, Vector
from irb140_jax.robot import Robot

# An entry this close to 0, 1 or -1 is taken to be it: the round-off of rotations that a model file gives as angles.
SNAP = 1e-15

Structure = tuple[float | None, ...]
"""For each entry of `packed`: 0, 1 or -1 if it is known to be that, else None."""


class Link(NamedTuple):
    """One link in scalars; the fields are those of `Robot`, the last three are `Robot.phi`."""

    rotation: Matrix
    position: Vector
    axis: Vector
    reference: Number
    mass: Number
    first: Vector
    inertia: Matrix
    is_slide: bool


class Chain(NamedTuple):
    """All links from base to tip, and gravity in base axes."""

    links: tuple[Link, ...]
    gravity: Vector


def packed(robot: Robot) -> Float[Array, " k"]:
    """Every number that rigid-body dynamics needs, in one vector: 26 a link, then gravity."""
    n = robot.n
    links = (robot.rotation.reshape(n, 9), robot.position, robot.axis, robot.reference[:, None], robot.phi)
    return jnp.concatenate([jnp.concatenate(links, axis=1).ravel(), robot.gravity])


def structure(robot: Robot) -> Structure:
    """What is known of `packed`: the zeros and ones of the geometry if the robot is concrete, nothing if it is traced.

    Inertial parameters count as unknown, so that a refitted robot does not make XLA compile again.
    """
    geometry = (robot.rotation, robot.position, robot.axis, robot.reference, robot.gravity)
    per_link = 26
    if any(isinstance(x, jax.core.Tracer) for x in geometry):
        return (None,) * (per_link * robot.n + 3)
    rotation, position, axis, reference, gravity = (np.asarray(x) for x in geometry)
    known: list[float | None] = []
    for i in range(robot.n):
        for x in (*rotation[i].ravel(), *position[i], *axis[i], reference[i]):
            known.append(_snapped(float(x)))
        known.extend([None] * 10)
    return (*known, *(_snapped(float(x)) for x in gravity))


def _snapped(x: float) -> float | None:
    return next((value for value in (0.0, 1.0, -1.0) if abs(x - value) <= SNAP), None)


def chain(numbers: Float[Array, " k"], known: Structure, is_slide: tuple[bool, ...]) -> Chain:
    """The links in scalars, out of `packed` and `structure`."""
    entries = [x if k is None else k for x, k in zip(jnp.unstack(numbers), known, strict=True)]
    take = iter(entries)

    def vector() -> Vector:
        x, y, z = itertools.islice(take, 3)
        return (x, y, z)

    links = []
    for slides in is_slide:
        rotation = (vector(), vector(), vector())
        position, axis, reference, mass, first = vector(), vector(), next(take), next(take), vector()
        xx, xy, xz, yy, yz, zz = itertools.islice(take, 6)
        inertia = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        links.append(Link(rotation, position, axis, reference, mass, first, inertia, slides))
    return Chain(tuple(links), vector())
