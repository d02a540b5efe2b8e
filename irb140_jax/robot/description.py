"""The only reader of robot models: what an MJCF or URDF file says, compiled by MuJoCo, before any joint is chosen."""

import pathlib
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import mujoco

from irb140_jax.errors import RobotError
from irb140_jax.robot.inertia import Inertial
from irb140_jax.robot.light import light_model
from irb140_jax.robot.urdf import prepared_urdf

NOTHING: Mapping[str, Any] = MappingProxyType({})
Compiled = TypeVar("Compiled")


class Description(NamedTuple):
    """All of a model, with what MuJoCo does not keep of it.

    Attributes:
        model: Compiled model.
        source: Where it came from, for messages.
        effort: Largest torques by joint name [N m or N]; what the model's actuators allow, if less, wins.
        velocity: Largest speeds by joint name [rad/s or m/s].
        notes: Sentences on the whole of it.
        link_notes: What was supplied or mended, by body, as the rest of "link x has ...".
        broken: Inertials that MuJoCo would not take, by body; they count, not the model's.
        unweighed: Bodies whose mass is unknown, since it is that of a mesh that is not there: its file, by their names.
        floating: Bodies that float though the compiled model has them fixed, as URDF has it.
        mimics: Joints that follow others, of which the compiled model knows nothing: follower, leader, factor, offset.
    """

    model: mujoco.MjModel
    source: str
    effort: Mapping[str, float] = NOTHING
    velocity: Mapping[str, float] = NOTHING
    notes: tuple[str, ...] = ()
    link_notes: Mapping[str, str] = NOTHING
    broken: Mapping[str, Inertial] = NOTHING
    unweighed: Mapping[str, str] = NOTHING
    floating: frozenset[str] = frozenset()
    mimics: tuple[tuple[str, str, float, float], ...] = ()


def description(path: str | pathlib.Path) -> Description:
    """Read an MJCF or URDF file.

    Args:
        path: The file; its meshes need not be there.

    Raises:
        RobotError: It can't be read, or MuJoCo can't compile it.
    """
    path = pathlib.Path(path)
    root = _root(path)
    if root.tag == "robot":
        urdf = prepared_urdf(root, str(path))
        model, warned = _compiled(lambda: mujoco.MjModel.from_xml_string(urdf.text), path)
        return Description(
            model, str(path), urdf.effort, urdf.velocity, warned, urdf.link_notes, urdf.broken,
            floating=urdf.floating, mimics=urdf.mimics,
        )  # fmt: skip
    light, warned = _compiled(lambda: light_model(path), path)
    return Description(light.model, str(path), notes=warned, link_notes=light.notes, unweighed=light.unweighed)


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
