"""A robot's first joints, with everything beyond them as one body."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.errors import RobotError
from irb140_jax.robot.robot import Robot
from irb140_jax.types import Joints, Mat3, Vec3

_CUT = (
    "rotation position axis reference armature damping frictionloss stiffness springref gear lower upper "
    "velocity_limit effort_limit"
)


def first_joints(robot: Robot, count: int, held: Joints | None = None) -> Robot:
    """The arm's first joints; the links beyond stand still and count as part of the one kept that carries them.

    The rotors of the joints held stand still, too: their armature counts for nothing.

    Args:
        robot: Arm with n joints.
        count: Joints to keep, 1 <= count <= n.
        held: Joint positions at which the others are held [rad or m], shape (n,); default `robot.reference`, at which
            the IRB 140's wrist is straight.  Those of the joints kept don't matter.

    Returns:
        A robot with `count` joints and the same tool; of a tree whose last link kept no longer carries it, the tool is
        at that link's centre of mass.

    Raises:
        RobotError: The robot doesn't have that many joints.
    """
    if not 1 <= count <= robot.n:
        raise RobotError(f"robot '{robot.name}': {count} joints asked of {robot.n}; give a number from 1 to {robot.n}")
    if count == robot.n:
        return robot
    travel = jnp.zeros(robot.n) if held is None else jnp.asarray(held) - robot.reference
    parts = [[(robot.mass[i], robot.com[i], robot.inertia[i])] for i in range(count)]
    # Where each link is on the link kept that carries it: itself, or for a link that nothing kept moves, none.
    on, rotations, positions = [*range(count)], [jnp.eye(3)] * count, [jnp.zeros(3)] * count
    for i in range(count, robot.n):
        before = robot.parent[i]
        on.append(on[before] if before >= 0 else -1)
        R, p = (rotations[before], positions[before]) if before >= 0 else (jnp.eye(3), jnp.zeros(3))
        p = p + R @ robot.position[i]
        R = R @ robot.rotation[i]
        if robot.is_slide[i]:
            p = p + travel[i] * (R @ robot.axis[i])
        else:
            R = R @ _rotation(robot.axis[i], travel[i])
        rotations.append(R)
        positions.append(p)
        if on[i] >= 0:
            parts[on[i]].append((robot.mass[i], p + R @ robot.com[i], R @ robot.inertia[i] @ R.T))
    mass, com, inertia = (jnp.stack(x) for x in zip(*(_lumped(part) for part in parts), strict=True))
    tool_rotation, tool_position = jnp.eye(3), com[-1]
    if on[-1] == count - 1:
        tool_rotation, tool_position = R @ robot.tool_rotation, p + R @ robot.tool_position
    kept = {name: getattr(robot, name)[:count] for name in _CUT.split()}
    return Robot(
        **kept,
        mass=mass,
        com=com,
        inertia=inertia,
        gravity=robot.gravity,
        base_rotation=robot.base_rotation,
        base_position=robot.base_position,
        tool_rotation=tool_rotation,
        tool_position=tool_position,
        joint_names=robot.joint_names[:count],
        is_slide=robot.is_slide[:count],
        name=f"{robot.name}, first {count} joints",
        notes=robot.notes,
        parent=robot.parent[:count],
    )


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
