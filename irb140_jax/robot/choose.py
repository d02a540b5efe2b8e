"""Which of a model's joints make the robot, and where all others are held."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.couplings import Coupling, couplings
from irb140_jax.robot.description import Description
from irb140_jax.robot.tree import Parents, path

MOST_JOINTS = 40

SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
FREE = int(mujoco.mjtJoint.mjJNT_FREE)


ASKED = "it is to be held"


class Choice(NamedTuple):
    """The robot's joints in a compiled model.

    Attributes:
        joints: Their indices, in the robot's order.
        parent: The robot's `parent`.
        qpos: The model's positions with the robot's joints at their reference and all others held, shape (nq,).
        carrier: For each body the place of its last joint in `joints`, -1 where none of them moves it.
        notes: Which joints are held, and where.
    """

    joints: tuple[int, ...]
    parent: Parents
    qpos: np.ndarray
    carrier: tuple[int, ...]
    notes: tuple[str, ...]


class Wish(NamedTuple):
    """What is asked of a model.

    Attributes:
        joints: Names of the joints to keep, or None for all that can be kept.
        hold: Positions of joints to hold, by name [rad or m].
        fix_base: Whether a floating base stands still.
    """

    joints: Sequence[str] | None
    hold: Mapping[str, float]
    fix_base: bool


def choose(said: Description, wish: Wish) -> Choice:
    """The joints asked for, ordered into branches, the last one named on the last branch.

    Args:
        said: What the model's file says.
        wish: What is asked of it.

    Raises:
        RobotError: A joint there is not or that can't be kept, a floating base that is not held, too few or too many.
    """
    model, source = said.model, said.source
    names = [model.joint(j).name for j in range(model.njnt)]
    _refuse_unknown(model, names, wish, source)
    coupled = couplings(model, said.mimics)
    left_out = dict(_left_out(model, names, wish, coupled))
    if wish.joints is None:
        joints = [j for j in range(model.njnt) if j not in left_out]
    else:
        joints = sorted(names.index(name) for name in dict.fromkeys(wish.joints) if name not in wish.hold)
        for j in joints:
            if j in left_out:
                raise RobotError(f"{source}: joint '{names[j]}' can't be diagnosed: {left_out[j]}: hold it with --hold "
                                 f"{names[j]}=VALUE, or leave out its columns")
    _refuse_number(len(joints), model, left_out, wish, source)
    if not wish.fix_base:
        _refuse_floating(said, joints)
    last = next((names.index(n) for n in reversed(wish.joints or ()) if names.index(n) in joints), None)
    joints, parent = _in_branches(model, joints, last)
    qpos = _held_pose(model, names, wish, joints, coupled)
    carrier = tuple(_carrier(model, body, joints) for body in range(model.nbody))
    notes = (*_held_notes(model, joints, qpos, left_out), *_tree_notes(names, joints, parent))
    return Choice(tuple(joints), parent, qpos, carrier, notes)


def scalar_joints(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of all hinges and slides, in the model's order."""
    names = [model.joint(j).name for j in range(model.njnt) if int(model.jnt_type[j]) in SCALAR]
    return tuple(name for name in names if name)


def _refuse_unknown(model: mujoco.MjModel, names: list[str], wish: Wish, source: str) -> None:
    movable = scalar_joints(model)
    for name in (*(wish.joints or ()), *wish.hold):
        if name not in names:
            raise RobotError(f"{source}: the model has no joint '{name}'; its movable joints are {_listed(movable)}")
    for name, value in wish.hold.items():
        if name not in movable:
            raise RobotError(f"{source}: joint '{name}' has no single position to hold; it is held at its reference")
        if not np.isfinite(value):
            raise RobotError(f"{source}: joint '{name}' is to be held at {value}; give a number [rad or m]")


def _left_out(
    model: mujoco.MjModel, names: list[str], wish: Wish, coupled: list[Coupling]
) -> Iterator[tuple[int, str]]:
    """Joints that can't be kept, or are not to be, and why as the end of a sentence; the first reason counts last."""
    for coupling in coupled:
        for j in coupling.joints:
            yield j, coupling.reason
    for j, name in enumerate(names):
        kind = int(model.jnt_type[j])
        if kind not in SCALAR:
            yield j, f"it is a {'free' if kind == FREE else 'ball'} joint, which no column of a recording can hold"
        elif not name:
            yield j, "it has no name, and recordings are matched by name"
        elif name in wish.hold:
            yield j, ASKED


def _refuse_number(count: int, model: mujoco.MjModel, left_out: dict[int, str], wish: Wish, source: str) -> None:
    if count == 0:
        why = next((f": {_joint(model, j)}: {reason}" for j, reason in left_out.items()), "")
        raise RobotError(f"{source}: no joint is left to diagnose, of {model.njnt} in the model{why}: give a model "
                         "with a joint that can be recorded")
    if count > MOST_JOINTS:
        named = "are named" if wish.joints is not None else "can be recorded"
        raise RobotError(f"{source}: {count} joints {named}, 1 to {MOST_JOINTS} are allowed at once: name those of an "
                         "arm, by the columns of the recording")


def _refuse_floating(said: Description, joints: list[int]) -> None:
    model = said.model
    for j in joints:
        for body in _way(model, int(model.jnt_bodyid[j])):
            name, first = model.body(body).name, int(model.body_jntadr[body])
            is_free = model.body_jntnum[body] > 0 and int(model.jnt_type[first]) == FREE
            if name in said.floating or is_free:
                raise RobotError(f"{said.source}: body '{name}' floats and carries joint '{model.joint(j).name}'; a "
                                 "base that moves can't be diagnosed from joint torques: if it was held still, add "
                                 "--fix-base")


def _in_branches(model: mujoco.MjModel, joints: list[int], last: int | None) -> tuple[list[int], Parents]:
    """The joints depth first, of several branches at a link the one with joint `last` last; and their parents."""
    before = {j: _joint_before(model, j, joints) for j in joints}
    towards = {last} if last is not None else set()
    while last is not None and (last := before[last]) is not None:
        towards.add(last)
    order: list[int] = []

    def visit(joint: int | None) -> None:
        order.extend([joint] if joint is not None else [])
        for j in sorted((j for j in joints if before[j] == joint), key=lambda j: (j in towards, j)):
            visit(j)

    visit(None)
    place = {None: -1, **{j: i for i, j in enumerate(order)}}
    return order, tuple(place[before[j]] for j in order)


def _joint_before(model: mujoco.MjModel, joint: int, joints: list[int]) -> int | None:
    """The nearest of the joints on the way to the base."""
    body = int(model.jnt_bodyid[joint])
    earlier = [j for j in joints if int(model.jnt_bodyid[j]) == body and j < joint]
    if earlier:
        return earlier[-1]
    return _last_joint(model, int(model.body_parentid[body]), joints)


def _last_joint(model: mujoco.MjModel, body: int, joints: list[int]) -> int | None:
    for b in _way(model, body):
        own = [j for j in joints if int(model.jnt_bodyid[j]) == b]
        if own:
            return max(own)
    return None


def _carrier(model: mujoco.MjModel, body: int, joints: list[int]) -> int:
    joint = _last_joint(model, body, joints)
    return -1 if joint is None else joints.index(joint)


def _way(model: mujoco.MjModel, body: int) -> Iterator[int]:
    """Bodies from this one to the world, which is left out."""
    while body:
        yield body
        body = int(model.body_parentid[body])


def _held_pose(
    model: mujoco.MjModel, names: list[str], wish: Wish, joints: list[int], coupled: list[Coupling]
) -> np.ndarray:
    """Reference positions, those of `hold`, and what followers make of them."""
    qpos = model.qpos0.copy()
    for name, value in wish.hold.items():
        qpos[model.jnt_qposadr[names.index(name)]] = value
    for coupling in coupled:
        if coupling.follower is not None and names[coupling.follower] not in wish.hold:
            qpos[model.jnt_qposadr[coupling.follower]] = coupling.position(qpos)
    for j in joints:
        qpos[model.jnt_qposadr[j]] = model.qpos0[model.jnt_qposadr[j]]
    return qpos


def _held_notes(
    model: mujoco.MjModel, joints: list[int], qpos: np.ndarray, left_out: dict[int, str]
) -> Iterator[str]:
    """What is held: for want of columns or as asked, in one sentence, and for other reasons in another."""
    held = [j for j in range(model.njnt) if j not in joints and int(model.jnt_type[j]) in SCALAR]
    plain = [_position(model, j, qpos) for j in held if left_out.get(j, ASKED) == ASKED]
    tied = [f"{_position(model, j, qpos)} ({left_out[j]})" for j in held if left_out.get(j, ASKED) != ASKED]
    if plain:
        yield f"held still: {', '.join(plain)}"
    if tied:
        yield f"held still, since no column can tell of them: {', '.join(tied)}"
    for j in range(model.njnt):
        if int(model.jnt_type[j]) not in SCALAR and _moves_any(model, j, joints):
            kind = "base floats in the file and" if int(model.jnt_type[j]) == FREE else "ball joint"
            yield f"the {kind} is held still at its reference: body '{model.body(model.jnt_bodyid[j]).name}'"


def _moves_any(model: mujoco.MjModel, joint: int, joints: list[int]) -> bool:
    """Whether this joint moves, or is moved by, any of the joints."""
    body = int(model.jnt_bodyid[joint])
    return _last_joint(model, body, joints) is not None or any(
        body in _way(model, int(model.jnt_bodyid[j])) for j in joints
    )


def _position(model: mujoco.MjModel, joint: int, qpos: np.ndarray) -> str:
    value = qpos[model.jnt_qposadr[joint]]
    unit = "m" if int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else "rad"
    low, high = model.jnt_range[joint]
    beyond = model.jnt_limited[joint] and not low - 1e-9 <= value <= high + 1e-9
    outside = f" (outside its limits {low:.4g} to {high:.4g})" if beyond else ""
    return f"{_joint(model, joint)} at {value:.4g} {unit}{outside}"


def _tree_notes(names: list[str], joints: list[int], parent: Parents) -> Iterator[str]:
    n = len(joints)
    if path(parent, n - 1) != tuple(range(n)):
        yield (
            f"the robot branches; payload, contact and pushes are looked for on the link of its last joint, "
            f"'{names[joints[-1]]}'"
        )
    if parent.count(-1) > 1:
        yield "its branches part at the base, which is taken to stand still"


def _joint(model: mujoco.MjModel, joint: int) -> str:
    name = model.joint(joint).name
    return f"'{name}'" if name else f"a nameless joint of body '{model.body(model.jnt_bodyid[joint]).name}'"


def _listed(names: Sequence[str], most: int = 20) -> str:
    shown = ", ".join(f"'{name}'" for name in names[:most])
    return shown + (f" and {len(names) - most} more" if len(names) > most else "") if names else "none"
