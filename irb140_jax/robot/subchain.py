"""Some of a robot's joints; the others are held, and what they carry counts to the links that are left."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.errors import RobotError
from irb140_jax.robot.robot import Robot
from irb140_jax.types import Joints, Mat3, Vec3

_CUT = "axis reference armature damping frictionloss stiffness springref gear lower upper velocity_limit effort_limit"
# Where a link is on the link kept that carries it; None: it is that link.
Placed = tuple[Mat3, Vec3] | None


def first_joints(robot: Robot, count: int, held: Joints | None = None) -> Robot:
    """The arm's first joints; the links beyond stand still and count as part of the one kept that carries them.

    Args:
        robot: Arm with n joints.
        count: Joints to keep, 1 <= count <= n.
        held: See `subset`; at its default the IRB 140's wrist is straight.

    Returns:
        A robot with `count` joints and the same tool, see `subset`.

    Raises:
        RobotError: The robot doesn't have that many joints.
    """
    if not 1 <= count <= robot.n:
        raise RobotError(f"robot '{robot.name}': {count} joints asked of {robot.n}; give a number from 1 to {robot.n}")
    return subset(robot, range(count), held)


def subset(robot: Robot, joints: Sequence[int | str], held: Joints | None = None) -> Robot:
    """The robot with these joints alone; the others stand still, and each link counts to the one kept that carries it.

    The rotors of the joints held stand still, too: their armature counts for nothing.  What no kept joint moves is
    part of the base.

    Args:
        robot: Arm with n joints.
        joints: Which to keep, by name or counted from 0, k of them; in the robot's order, however they are given.
        held: Joint positions at which the others are held [rad or m], shape (n,); default `robot.reference`.  Those of
            the joints kept don't matter.

    Returns:
        A robot with k joints and the same tool; where the last link kept doesn't carry it, the tool is at that link's
        centre of mass.

    Raises:
        RobotError: No joint, one that isn't there, or one twice.
    """
    keep = _places(robot, joints)
    if len(keep) == robot.n:
        return robot
    travel = jnp.zeros(robot.n) if held is None else jnp.asarray(held) - robot.reference
    bodies: list[list[tuple[Float[Array, ""], Vec3, Mat3]]] = []
    geometry: list[tuple[Mat3, Vec3]] = []
    # For each link the link kept that carries it, -1 for the base, and its place there.
    on: list[int] = []
    placed: list[Placed] = []
    parent: list[int] = []
    for i in range(robot.n):
        before = robot.parent[i]
        carrier, there = (on[before], placed[before]) if before >= 0 else (-1, None)
        R, p = _moved(there, robot.rotation[i], robot.position[i])
        body = robot.mass[i], robot.com[i], robot.inertia[i]
        if i in keep:
            parent.append(carrier)
            geometry.append((R, p))
            bodies.append([body])
            on.append(len(bodies) - 1)
            placed.append(None)
            continue
        if robot.is_slide[i]:
            p = p + travel[i] * (R @ robot.axis[i])
        else:
            R = R @ _rotation(robot.axis[i], travel[i])
        on.append(carrier)
        placed.append((R, p))
        if carrier >= 0:
            bodies[carrier].append((body[0], p + R @ body[1], R @ body[2] @ R.T))
    mass, com, inertia = (jnp.stack(x) for x in zip(*(_lumped(parts) for parts in bodies), strict=True))
    rotation, position = (jnp.stack(x) for x in zip(*geometry, strict=True))
    tool = jnp.eye(3), com[-1]
    if on[-1] == len(keep) - 1:
        tool = _moved(placed[-1], robot.tool_rotation, robot.tool_position)
    prefix = keep == tuple(range(len(keep)))
    chosen = np.array(keep)
    return Robot(
        **{name: getattr(robot, name)[chosen] for name in _CUT.split()},
        rotation=rotation,
        position=position,
        mass=mass,
        com=com,
        inertia=inertia,
        gravity=robot.gravity,
        base_rotation=robot.base_rotation,
        base_position=robot.base_position,
        tool_rotation=tool[0],
        tool_position=tool[1],
        joint_names=tuple(robot.joint_names[i] for i in keep),
        is_slide=tuple(robot.is_slide[i] for i in keep),
        name=f"{robot.name}, {'first ' * prefix}{len(keep)}{'' if prefix else f' of {robot.n}'} joints",
        notes=robot.notes,
        parent=tuple(parent),
    )


def _places(robot: Robot, joints: Sequence[int | str]) -> tuple[int, ...]:
    """Places of the joints in the robot, rising."""
    known = {name: i for i, name in enumerate(robot.joint_names)} | {i: i for i in range(robot.n)}
    unknown = [joint for joint in joints if joint not in known]
    if unknown or not len(joints) or len({known[joint] for joint in joints}) != len(joints):
        raise RobotError(
            f"robot '{robot.name}': joints {list(joints)} asked; give some of {', '.join(robot.joint_names)}, or of 0 "
            f"to {robot.n - 1}, none twice"
        )
    return tuple(sorted(known[joint] for joint in joints))


def _moved(placed: Placed, rotation: Mat3, position: Vec3) -> tuple[Mat3, Vec3]:
    """Where something is that is placed on a link, which is placed itself."""
    if placed is None:
        return rotation, position
    return placed[0] @ rotation, placed[1] + placed[0] @ position


def _lumped(parts: list[tuple[Float[Array, ""], Vec3, Mat3]]) -> tuple[Float[Array, ""], Vec3, Mat3]:
    """Mass, centre and inertia about it of several bodies as one."""
    if len(parts) == 1:
        return parts[0]
    mass = sum((m for m, _, _ in parts), jnp.zeros(()))
    com = sum((m * c for m, c, _ in parts), jnp.zeros(3)) / jnp.where(mass == 0.0, 1.0, mass)
    inertia = jnp.zeros((3, 3))
    for m, c, about_own in parts:
        d = c - com
        inertia = inertia + about_own + m * (d @ d * jnp.eye(3) - jnp.outer(d, d))
    return mass, com, 0.5 * (inertia + inertia.T)


def _rotation(axis: Vec3, angle: Float[Array, ""]) -> Mat3:
    """Rotation by an angle about a unit vector (Rodrigues' formula)."""
    x, y, z = axis
    zero = jnp.zeros_like(x)
    S = jnp.stack([zero, -z, y, z, zero, -x, -y, x, zero]).reshape(3, 3)
    return jnp.eye(3) + jnp.sin(angle) * S + (1.0 - jnp.cos(angle)) * S @ S
