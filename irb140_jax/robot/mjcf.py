"""Out of a model that MuJoCo compiled to a `Robot`: the joints kept, with what stands still on their links."""

import pathlib
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.errors import RobotError
from irb140_jax.robot.choose import Choice, Wish, choose, scalar_joints
from irb140_jax.robot.description import Description, description
from irb140_jax.robot.drive import Drives, ServoGains, drives, servo_gains
from irb140_jax.robot.links import link_frames_at_rest, link_inertials, tool_frame
from irb140_jax.robot.refuse import refuse_impossible_numbers, refuse_unsupported
from irb140_jax.robot.robot import Robot


def load_robot(
    path: str | pathlib.Path,
    joints: Sequence[str] | None = None,
    hold: Mapping[str, float] | None = None,
    fix_base: bool = False,
) -> Robot:
    """Read an MJCF or URDF file: any tree of joints, of which some make the robot and all others stand still.

    Args:
        path: The model file; meshes need not be there.  MJCF may give speed limits as
            <custom><numeric name="velocity_limit" data="..."/>.
        joints: Names of the joints to keep; by default all hinges and slides that can be recorded: those with a name
            that no mimic, tendon or closed loop ties to others.  Of several branches, the one with the joint named
            last carries the tool.
        hold: Positions of joints to hold, by name [rad or m]; joints left out otherwise are held at their reference.
        fix_base: Whether a floating base stands still.

    Returns:
        The robot, with everything the file says of armature, damping, frictionloss, stiffness, gear and limits; its
        `notes` say which joints are held, and where.

    Raises:
        RobotError: The file can't be read, or the joints kept are touched by what a `Robot` can't represent; the
            message names it.
    """
    return _robot(description(path), Wish(joints, hold or {}, fix_base))


def movable_joints(path: str | pathlib.Path) -> tuple[str, ...]:
    """Names of all hinges and slides of a model file, of which `load_robot` may be given some.

    Args:
        path: MJCF or URDF file.

    Raises:
        RobotError: The file can't be read.
    """
    return scalar_joints(description(path).model)


def servos_of(path: str | pathlib.Path, joints: Sequence[str]) -> ServoGains:
    """Gains of the servos that a model file gives some joints, NaN where it gives none.

    Args:
        path: MJCF or URDF file.
        joints: Their names.

    Raises:
        RobotError: The file can't be read.
    """
    model = description(path).model
    own = [model.joint(name).id for name in joints]
    return ServoGains(*(values[own] for values in servo_gains(model)))


def robot_from_model(
    model: mujoco.MjModel,
    source: str = "model",
    effort: Mapping[str, float] | None = None,
    velocity: Mapping[str, float] | None = None,
    notes: tuple[str, ...] = (),
    joints: Sequence[str] | None = None,
    hold: Mapping[str, float] | None = None,
    fix_base: bool = False,
) -> Robot:
    """Take the robot out of a compiled model; what stands still on a link is merged into it.

    Args:
        model: Compiled model.
        source: Where it came from, for messages.
        effort: Largest torques by joint name [N m or N]; what the model's actuators allow, if less, wins.
        velocity: Largest speeds by joint name [rad/s or m/s], where the model does not hold them.
        notes: Plain sentences to keep with the robot.
        joints, hold, fix_base: As in `load_robot`.

    Raises:
        RobotError: The joints kept are touched by what a `Robot` can't represent.
    """
    said = Description(model, source, effort=effort or {}, velocity=velocity or {}, notes=notes)
    return _robot(said, Wish(joints, hold or {}, fix_base))


def _robot(said: Description, wish: Wish) -> Robot:
    model, source = said.model, said.source
    choice = choose(said, wish)
    refuse_unsupported(model, choice, source)
    for body, file in said.unweighed.items():
        if choice.carrier[model.body(body).id] >= 0:
            raise RobotError(f"{source}: body '{body}' has its mass from a mesh that is not there ({file}): put the "
                             "file there, or give the body an <inertial>")
    own = list(choice.joints)
    dofs = model.jnt_dofadr[own]
    names = tuple(model.joint(i).name for i in own)
    tree = link_frames_at_rest(model, choice)
    mass, com, inertia, mended = link_inertials(model, choice, tree, said.broken, source)
    drive = Drives(*(values[own] for values in drives(model)))
    limited = model.jnt_limited[own].astype(bool)
    lower, upper = model.jnt_range[own].T
    reference = model.qpos0[model.jnt_qposadr[own]]
    spring, damper = _enabled(model, "SPRING"), _enabled(model, "DAMPER")
    dry = _enabled(model, "FRICTIONLOSS") * _enabled(model, "CONSTRAINT")
    gravity = _enabled(model, "GRAVITY") * model.opt.gravity
    tool_rotation, tool_position = tool_frame(model, choice, tree, com[-1])
    fields = dict(
        rotation=tree.rotation, position=tree.position, axis=tree.axis, reference=reference,
        mass=mass, com=com, inertia=inertia,
        armature=model.dof_armature[dofs] + drive.armature,
        damping=damper * (model.dof_damping.ravel()[dofs] + drive.damping),
        frictionloss=dry * model.dof_frictionloss[dofs], stiffness=spring * model.jnt_stiffness.ravel()[own],
        springref=model.qpos_spring[model.jnt_qposadr[own]], gear=drive.gear, gravity=tree.base_rotation.T @ gravity,
        base_rotation=tree.base_rotation, base_position=tree.base_position,
        tool_rotation=tool_rotation, tool_position=tool_position,
        lower=np.where(limited, lower, -np.inf), upper=np.where(limited, upper, np.inf),
        velocity_limit=np.minimum(_velocity_limit(model, source)[own], _by_name(said.velocity, names)),
        effort_limit=np.minimum(drive.effort, _by_name(said.effort, names)),
    )  # fmt: skip
    refuse_impossible_numbers(fields, names, source)
    return Robot(
        **{key: on_device(value) for key, value in fields.items()},
        joint_names=names,
        is_slide=tuple(int(kind) == int(mujoco.mjtJoint.mjJNT_SLIDE) for kind in model.jnt_type[own]),
        name=_name(model, source),
        notes=(*_of_links(model, choice, said.link_notes), *mended, *said.notes, *choice.notes),
        parent=choice.parent,
    )


def _of_links(model: mujoco.MjModel, choice: Choice, notes: Mapping[str, str]) -> list[str]:
    """Notes on bodies that the robot moves, one sentence for all of whom the same is to be said."""
    alike: dict[str, list[str]] = {}
    for name, note in notes.items():
        if choice.carrier[model.body(name).id] >= 0:
            alike.setdefault(note, []).append(f"'{name}'")
    return [
        f"link {names[0]} has {note}" if len(names) == 1 else f"each of the links {', '.join(names)} has {note}"
        for note, names in alike.items()
    ]


def _enabled(model: mujoco.MjModel, part: str) -> float:
    """0 if <option><flag> switches this part of the physics off, else 1."""
    return float(not model.opt.disableflags & int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{part}")))


def _velocity_limit(model: mujoco.MjModel, source: str) -> np.ndarray:
    i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, "velocity_limit")
    if i < 0:
        return np.full(model.njnt, np.inf)
    start, size = int(model.numeric_adr[i]), int(model.numeric_size[i])
    values = model.numeric_data[start : start + size]
    if size != model.njnt or not np.all(values > 0.0):
        raise RobotError(
            f"{source}: <numeric name='velocity_limit'> is {values}; allowed: positive numbers; "
            f"give one for each of the {model.njnt} joints"
        )
    return values


def _by_name(values: Mapping[str, float], names: tuple[str, ...]) -> np.ndarray:
    return np.array([values.get(name, np.inf) for name in names])


def _name(model: mujoco.MjModel, source: str) -> str:
    """The model's own name; the file's, where it has none but MuJoCo's default."""
    name = model.names.split(b"\0", 1)[0].decode()
    return pathlib.Path(source).stem if name in ("", "MuJoCo Model") else name
