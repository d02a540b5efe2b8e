"""The only reader of robot models: MuJoCo compiles MJCF or URDF, we take a chain or tree of joints out of it."""

import pathlib
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TypeVar

import jax.numpy as jnp
import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.choose import Choice, Wish, choose
from irb140_jax.robot.drive import Drives, drives
from irb140_jax.robot.inertia import Inertial
from irb140_jax.robot.light import light_model
from irb140_jax.robot.links import link_frames_at_rest, link_inertials, tool_frame
from irb140_jax.robot.refuse import refuse_impossible_numbers, refuse_unsupported
from irb140_jax.robot.robot import Robot
from irb140_jax.robot.urdf import prepared_urdf

Compiled = TypeVar("Compiled")


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
    path = pathlib.Path(path)
    root = _root(path)
    if root.tag == "robot":
        urdf = prepared_urdf(root, str(path))
        model, warned = _compiled(lambda: mujoco.MjModel.from_xml_string(urdf.text), path)
        wish = Wish(joints, hold or {}, fix_base, urdf.floating, urdf.mimics)
        return _robot(model, wish, urdf.broken, str(path), urdf.effort, urdf.velocity, urdf.link_notes, warned)
    light, warned = _compiled(lambda: light_model(path), path)
    return _robot(light.model, Wish(joints, hold or {}, fix_base), {}, str(path), {}, {}, light.notes, warned,
                  light.unweighed)  # fmt: skip


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
    return _robot(model, Wish(joints, hold or {}, fix_base), {}, source, effort or {}, velocity or {}, {}, notes)


def _robot(
    model: mujoco.MjModel,
    wish: Wish,
    broken: Mapping[str, Inertial],
    source: str,
    effort: Mapping[str, float],
    velocity: Mapping[str, float],
    link_notes: Mapping[str, str],
    notes: tuple[str, ...],
    unweighed: Mapping[str, str] = MappingProxyType({}),
) -> Robot:
    choice = choose(model, wish, source)
    refuse_unsupported(model, choice, source)
    for body, file in unweighed.items():
        if choice.carrier[model.body(body).id] >= 0:
            raise RobotError(f"{source}: body '{body}' has its mass from a mesh that is not there ({file}): put the "
                             "file there, or give the body an <inertial>")
    own = list(choice.joints)
    dofs = model.jnt_dofadr[own]
    names = tuple(model.joint(i).name for i in own)
    tree = link_frames_at_rest(model, choice)
    mass, com, inertia, mended = link_inertials(model, choice, tree, broken, source)
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
        velocity_limit=np.minimum(_velocity_limit(model, source)[own], _by_name(velocity, names)),
        effort_limit=np.minimum(drive.effort, _by_name(effort, names)),
    )  # fmt: skip
    refuse_impossible_numbers(fields, names, source)
    return Robot(
        **{key: jnp.array(value, dtype=float) for key, value in fields.items()},
        joint_names=names,
        is_slide=tuple(int(kind) == int(mujoco.mjtJoint.mjJNT_SLIDE) for kind in model.jnt_type[own]),
        name=_name(model, source),
        notes=(*_of_links(model, choice, link_notes), *mended, *notes, *choice.notes),
        parent=choice.parent,
    )


def _of_links(model: mujoco.MjModel, choice: Choice, notes: Mapping[str, str]) -> list[str]:
    """Notes on links that the robot moves."""
    return [note for name, note in notes.items() if choice.carrier[model.body(name).id] >= 0]


def _root(path: pathlib.Path) -> ET.Element:
    if not path.is_file():
        raise RobotError(f"{path}: there is no such file: give the MJCF or URDF file of the robot")
    try:
        root = ET.parse(path).getroot()
    except (ET.ParseError, UnicodeDecodeError, LookupError) as error:
        raise RobotError(f"{path}: not an XML file ({error}): give an MJCF or URDF file") from error
    if root.tag not in ("mujoco", "robot"):
        raise RobotError(f"{path}: root element <{root.tag}>; allowed: <mujoco> (MJCF) or <robot> (URDF): convert it")
    return root


def _compiled(compile_model: Callable[[], Compiled], path: pathlib.Path) -> tuple[Compiled, tuple[str, ...]]:
    """What MuJoCo compiles, and its warnings as notes: by itself it would print them and leave a log file behind."""
    warned: list[str] = []
    mujoco.set_mju_user_warning(warned.append)
    try:
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always")
            compiled = compile_model()
        said = [*warned, *(str(warning.message) for warning in raised)]
        return compiled, tuple(f"MuJoCo warns: {' '.join(text.split())}" for text in said)
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise RobotError(f"{path}: MuJoCo can't compile this model: {reason}: mend the file there") from error
    finally:
        mujoco.set_mju_user_warning(None)


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
