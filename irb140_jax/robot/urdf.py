"""URDF as it is found in the field, made ready for MuJoCo: links, inertials and joints, nothing else.

Meshes under package:// paths, transmissions and simulator plugins are not needed for dynamics and often can't be
resolved, so they are left out.  What a URDF means by leaving something out is kept: a link without <inertial> has none.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from irb140_jax.errors import RobotError
from irb140_jax.robot.inertia import NEGLIGIBLE, Inertial, is_lopsided, moments

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

KNOWN_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
# How a base floats; MuJoCo gets it fixed, and nothing may be diagnosed on it unless it was held.
FLOATING = ("floating", "planar")


class PreparedURDF(NamedTuple):
    """A URDF that MuJoCo compiles, and what it would not have kept.

    Attributes:
        text: The XML.
        effort: Largest torque by joint name [N m or N], where the file gives one above zero.
        velocity: Largest speed by joint name [rad/s or m/s], where the file gives one above zero.
        link_notes: What was supplied, by link, as the rest of "link x has ...".
        broken: Inertials that MuJoCo would refuse, by link; it gets none for them.
        floating: Links that a floating or planar joint carries.
        mimics: Joints that follow others: follower, leader, factor, offset.
    """

    text: str
    effort: dict[str, float]
    velocity: dict[str, float]
    link_notes: dict[str, str]
    broken: dict[str, Inertial]
    floating: frozenset[str]
    mimics: tuple[tuple[str, str, float, float], ...]


def prepared_urdf(robot: ET.Element, source: str) -> PreparedURDF:
    """Strip a URDF to what dynamics needs.

    Args:
        robot: Its root element, <robot>.
        source: The file's name, for messages.

    Raises:
        RobotError: A xacro file, a unknown joint type, or broken references.
    """
    _refuse(robot, source)
    bare = ET.Element("robot", {"name": robot.get("name", "robot")})
    bare.append(_compiler(robot))
    links = {link.get("name", "") for link in robot.findall("link")}
    for link in robot.findall("link"):
        kept = ET.SubElement(bare, "link", {"name": link.get("name", "")})
        kept.extend(link.findall("inertial"))
    if "world" not in links and _attributes(robot, "joint/parent", "link") & {"world"}:
        ET.SubElement(bare, "link", {"name": "world"})
        links.add("world")
    for joint in robot.findall("joint"):
        bare.append(_bare_joint(joint, links, source))
    broken = {link.get("name", ""): raw for link in bare.findall("link") if (raw := _broken(link, source))}
    for link in bare.findall("link"):
        if link.get("name") in broken:
            link.remove(link.findall("inertial")[0])
    effort, velocity = (_limits(robot, key, source) for key in ("effort", "velocity"))
    text = ET.tostring(bare, encoding="unicode")
    return PreparedURDF(
        text, effort, velocity, _notes(robot), broken, _floating(robot), tuple(_mimics(robot, source))
    )


def _refuse(robot: ET.Element, source: str) -> None:
    for element in robot.iter():
        is_xacro = "xacro" in str(element.tag) or any("${" in value for value in element.attrib.values())
        if is_xacro:
            raise RobotError(f"{source}: this is xacro, not a URDF: expand it first (xacro {source} > robot.urdf)")
    for joint in robot.findall("joint"):
        name, kind = joint.get("name", ""), joint.get("type", "")
        if kind not in KNOWN_TYPES:
            known = ", ".join(KNOWN_TYPES)
            raise RobotError(f"{source}: joint '{name}' is of type '{kind}'; known: {known}: fix it or remove it")
    for tag in ("link", "joint"):
        names = [element.get("name", "") for element in robot.findall(tag)]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise RobotError(f"{source}: two {tag}s have the name '{twice}'; names are unique: rename one")


def _compiler(robot: ET.Element) -> ET.Element:
    """MuJoCo's own section, with the options of the file that concern dynamics."""
    allowed = ("angle", "eulerseq", "balanceinertia", "settotalmass")
    given = robot.find("mujoco/compiler")
    options = {} if given is None else {k: v for k, v in given.attrib.items() if k in allowed}
    bounds = {"boundmass": str(NEGLIGIBLE), "boundinertia": str(NEGLIGIBLE), "fusestatic": "false"}
    section = ET.Element("mujoco")
    ET.SubElement(section, "compiler", {**options, **bounds})
    return section


def _bare_joint(joint: ET.Element, links: set[str], source: str) -> ET.Element:
    name, kind = joint.get("name", ""), joint.get("type", "")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = "" if element is None else element.get("link", "")
        if link not in links:
            raise RobotError(f"{source}: joint '{name}' has {end} '{link}', but no such link exists: add or rename it")
    kind = "fixed" if kind in FLOATING else kind
    kept = ET.Element("joint", {"name": name, "type": kind})
    moving = () if kind == "fixed" else ("axis", "limit", "dynamics")
    kept.extend(element for tag in ("origin", "parent", "child", *moving) for element in joint.findall(tag))
    if kind != "fixed" and joint.find("axis") is None:
        ET.SubElement(kept, "axis", {"xyz": "1 0 0"})  # the default that URDF defines
    return kept


def _broken(link: ET.Element, source: str) -> Inertial | None:
    """The link's inertial where MuJoCo would refuse it: where no body has it, or a rod has no thickness; else None."""
    mass = _numbers(link.find("inertial/mass"), ("value",), link, source)[0]
    xx, xy, xz, yy, yz, zz = _numbers(link.find("inertial/inertia"), _INERTIA, link, source)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, _, high = moments(inertia)
    if mass >= 0.0 and (low > 0.0 or high == 0.0) and not is_lopsided(inertia):
        return None
    origin = link.find("inertial/origin")
    placed = {} if origin is None else origin.attrib
    com, rpy = (_triple(placed.get(key, "0 0 0"), link, source) for key in ("xyz", "rpy"))
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    return Inertial(mass, com, R @ inertia @ R.T)


def _triple(text: str, link: ET.Element, source: str) -> np.ndarray:
    try:
        x, y, z = (float(word) for word in text.split())
        return np.array([x, y, z])
    except ValueError as error:
        name = link.get("name")
        raise RobotError(f"{source}: link '{name}': '{text}' in its <inertial>: give three numbers") from error


def _floating(robot: ET.Element) -> frozenset[str]:
    return frozenset(
        child.get("link", "") for joint in robot.findall("joint") if joint.get("type") in FLOATING
        for child in joint.findall("child")
    )  # fmt: skip


def _mimics(robot: ET.Element, source: str) -> Iterator[tuple[str, str, float, float]]:
    still = ("fixed", *FLOATING)
    moving = {joint.get("name", "") for joint in robot.findall("joint") if joint.get("type") not in still}
    for joint in robot.findall("joint"):
        mimic, name = joint.find("mimic"), joint.get("name", "")
        if mimic is None or name not in moving:
            continue
        try:
            yield name, mimic.get("joint", ""), float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
        except ValueError as error:
            raise RobotError(f"{source}: joint '{name}': {error}: give numbers in its <mimic>") from error


def _numbers(element: ET.Element | None, keys: tuple[str, ...], link: ET.Element, source: str) -> list[float]:
    """Attributes as numbers, 0 for what is not given."""
    texts = ["0" if element is None else element.get(key, "0") for key in keys]
    try:
        numbers = [float(text) for text in texts]
        if not np.all(np.isfinite(numbers)):
            raise ValueError(f"not finite: {' '.join(texts)}")
        return numbers
    except ValueError as error:
        raise RobotError(f"{source}: link '{link.get('name')}': {error}: give numbers in its <inertial>") from error


def _limits(robot: ET.Element, key: str, source: str) -> dict[str, float]:
    """A <limit> attribute by joint; zero is the usual way of saying that nobody knows it."""
    limits = {}
    for joint in robot.findall("joint"):
        element = joint.find("limit")
        text = "0" if element is None else element.get(key, "0")
        try:
            value = float(text)
        except ValueError as error:
            name = joint.get("name", "")
            raise RobotError(f"{source}: joint '{name}' has {key} limit '{text}': give a number") from error
        if value > 0.0:
            limits[joint.get("name", "")] = value
    return limits


def _notes(robot: ET.Element) -> dict[str, str]:
    moved = {
        child.get("link") for joint in robot.findall("joint") if joint.get("type") not in ("fixed", *FLOATING)
        for child in joint.findall("child")
    }  # fmt: skip
    notes = {}
    for link in robot.findall("link"):
        name, inertia, mass = link.get("name"), link.find("inertial/inertia"), link.find("inertial/mass")
        if name in moved and (mass is None or not _any(mass, ("value",))):
            notes[str(name)] = "no mass of its own in the file"
        elif name in moved and (inertia is None or not _any(inertia, ("ixx", "iyy", "izz"))):
            notes[str(name)] = "no rotational inertia in the file and counts as a point mass"
    return notes


def _any(element: ET.Element, keys: tuple[str, ...]) -> bool:
    return any(element.get(key, "0").strip(" +-0.eE") for key in keys)


def _attributes(robot: ET.Element, path: str, key: str) -> set[str]:
    return {element.get(key, "") for element in robot.findall(path)}
