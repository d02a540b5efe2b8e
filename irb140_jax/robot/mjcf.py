"""The only reader of robot models: MuJoCo compiles MJCF or URDF, we take a serial chain out of it."""

import pathlib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping

import jax.numpy as jnp
import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.drive import drives
from irb140_jax.robot.links import link_frames_at_rest, link_inertials, tool_frame
from irb140_jax.robot.refuse import refuse_impossible_numbers, refuse_unsupported
from irb140_jax.robot.robot import Robot
from irb140_jax.robot.urdf import prepared_urdf


def load_robot(path: str | pathlib.Path) -> Robot:
    """Read an MJCF or URDF file of a serial chain of hinges and slides.

    Args:
        path: The model file.  MJCF may give speed limits as <custom><numeric name="velocity_limit" data="..."/>.

    Returns:
        The robot, with everything the file says of armature, damping, frictionloss, stiffness, gear and limits.

    Raises:
        RobotError: The file can't be read, or holds what a `Robot` can't represent; the message names it.
    """
    path = pathlib.Path(path)
    root = _root(path)
    if root.tag == "robot":
        urdf = prepared_urdf(root, str(path))
        model, warned = _compiled(lambda: mujoco.MjModel.from_xml_string(urdf.text), path)
        return robot_from_model(model, str(path), urdf.effort, urdf.velocity, (*urdf.notes, *warned))
    model, warned = _compiled(lambda: mujoco.MjModel.from_xml_path(str(path)), path)
    return robot_from_model(model, str(path), notes=warned)


def robot_from_model(
    model: mujoco.MjModel,
    source: str = "model",
    effort: Mapping[str, float] | None = None,
    velocity: Mapping[str, float] | None = None,
    notes: tuple[str, ...] = (),
) -> Robot:
    """Take the serial chain out of a compiled model; welded bodies are merged into the link that carries them.

    Args:
        model: Compiled model.
        source: Where it came from, for messages.
        effort: Largest torques by joint name [N m or N]; what the model's actuators allow, if less, wins.
        velocity: Largest speeds by joint name [rad/s or m/s], where the model does not hold them.
        notes: Plain sentences to keep with the robot.

    Raises:
        RobotError: The model holds what a `Robot` can't represent.
    """
    refuse_unsupported(model, source)
    names = tuple(model.joint(i).name for i in range(model.njnt))
    chain = link_frames_at_rest(model)
    mass, com, inertia = link_inertials(model, chain)
    drive = drives(model)
    limited = model.jnt_limited.astype(bool)
    spring, damper = _enabled(model, "SPRING"), _enabled(model, "DAMPER")
    dry = _enabled(model, "FRICTIONLOSS") * _enabled(model, "CONSTRAINT")
    gravity = _enabled(model, "GRAVITY") * model.opt.gravity
    tool_rotation, tool_position = tool_frame(model, chain, com[-1])
    fields = dict(
        rotation=chain.rotation, position=chain.position, axis=model.jnt_axis, reference=model.qpos0,
        mass=mass, com=com, inertia=inertia,
        armature=model.dof_armature + drive.armature, damping=damper * (model.dof_damping.ravel() + drive.damping),
        frictionloss=dry * model.dof_frictionloss, stiffness=spring * model.jnt_stiffness.ravel(),
        springref=model.qpos_spring, gear=drive.gear, gravity=chain.base_rotation.T @ gravity,
        base_rotation=chain.base_rotation, base_position=chain.base_position,
        tool_rotation=tool_rotation, tool_position=tool_position,
        lower=np.where(limited, model.jnt_range[:, 0], -np.inf), upper=np.where(limited, model.jnt_range[:, 1], np.inf),
        velocity_limit=np.minimum(_velocity_limit(model, source), _by_name(velocity, names)),
        effort_limit=np.minimum(drive.effort, _by_name(effort, names)),
    )  # fmt: skip
    refuse_impossible_numbers(fields, names, source)
    return Robot(
        **{key: jnp.array(value, dtype=float) for key, value in fields.items()},
        joint_names=names,
        is_slide=tuple(int(kind) == int(mujoco.mjtJoint.mjJNT_SLIDE) for kind in model.jnt_type),
        name=_name(model, source),
        notes=notes,
    )


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


def _compiled(
    compile_model: Callable[[], mujoco.MjModel], path: pathlib.Path
) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The model, and MuJoCo's warnings as notes: by itself it would print them and leave a log file behind."""
    warned: list[str] = []
    mujoco.set_mju_user_warning(lambda text: warned.append(f"MuJoCo warns: {' '.join(text.split())}"))
    try:
        return compile_model(), tuple(warned)
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


def _by_name(values: Mapping[str, float] | None, names: tuple[str, ...]) -> np.ndarray:
    return np.array([(values or {}).get(name, np.inf) for name in names])


def _name(model: mujoco.MjModel, source: str) -> str:
    """The model's own name; the file's, where it has none but MuJoCo's default."""
    name = model.names.split(b"\0", 1)[0].decode()
    return pathlib.Path(source).stem if name in ("", "MuJoCo Model") else name
