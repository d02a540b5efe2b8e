"""Arms as plain arrays: the IRB 140 out of its file, and random ones of 2 to 7 joints."""

import dataclasses
import pathlib
import xml.etree.ElementTree as ET

import mujoco
import numpy as np

IRB140 = pathlib.Path(__file__).parents[1] / "assets" / "irb140.xml"
GRAVITY = 9.81  # m/s^2
SPEED = 2.5  # rad/s, largest speed of a random arm's hinge; its slides take a tenth of it


@dataclasses.dataclass(frozen=True)
class Arm:
    """A serial chain; frame k sits at joint k and turns with it.

    Attributes:
        xml: MJCF text of it.
        names: Of the joints.
        slide: Which of them are slides, shape (n,).
        place: Origin of each frame in the one before [m], shape (n, 3).
        rest: Its orientation in the one before at q = 0, shape (n, 3, 3).
        axis: Of each joint in its own frame, shape (n, 3).
        low, high: Range of motion [rad or m], shape (n,).
        speed: Largest speed [rad/s or m/s], shape (n,).
        link: Which frame carries each body, shape (B,).
        mass: Of the bodies [kg], shape (B,).
        com: Centres of mass in that frame [m], shape (B, 3).
        inertia: About them, in the axes of that frame [kg m^2], shape (B, 3, 3).
        rotor: Inertia of each drive at its joint [kg m^2 or kg], shape (n,).
        gravity: [m/s^2], shape (3,).
        tool: In the last frame [m], shape (3,).
    """

    xml: str
    names: tuple[str, ...]
    slide: np.ndarray
    place: np.ndarray
    rest: np.ndarray
    axis: np.ndarray
    low: np.ndarray
    high: np.ndarray
    speed: np.ndarray
    link: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    rotor: np.ndarray
    gravity: np.ndarray
    tool: np.ndarray

    @property
    def n(self) -> int:
        """How many joints."""
        return len(self.names)


def arm_of(xml: str) -> Arm:
    """The arm that an MJCF text of a serial chain describes; MuJoCo only compiles it."""
    m = mujoco.MjModel.from_xml_string(xml)
    bodies = m.jnt_bodyid
    if np.any(m.jnt_pos) or np.any(m.qpos0) or np.any(m.body_pos[: bodies[0]]):
        raise ValueError("joints have to sit at the origin of their bodies, and the base at the world's")
    spin = [_rotation(q) for q in m.body_iquat[bodies]]
    limits = m.numeric_data if m.nnumeric else np.where(m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE, 0.1, 1.0) * SPEED
    return Arm(
        xml=xml, names=tuple(m.joint(k).name for k in range(m.njnt)), slide=m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE,
        place=m.body_pos[bodies].copy(), rest=np.array([_rotation(q) for q in m.body_quat[bodies]]),
        axis=m.jnt_axis.copy(), low=m.jnt_range[:, 0].copy(), high=m.jnt_range[:, 1].copy(), speed=np.array(limits),
        link=np.arange(m.njnt), mass=m.body_mass[bodies].copy(), com=m.body_ipos[bodies].copy(),
        inertia=np.array([R @ np.diag(d) @ R.T for R, d in zip(spin, m.body_inertia[bodies], strict=True)]),
        rotor=m.dof_armature.copy(), gravity=m.opt.gravity.copy(), tool=m.site_pos[-1].copy(),
    )  # fmt: skip


def irb140() -> Arm:
    """The ABB IRB 140, read from its MJCF file."""
    return arm_of(IRB140.read_text(encoding="utf-8"))


def random_arm(rng: np.random.Generator, n: int) -> Arm:
    """An arm that nobody built: n joints whose links shrink towards the tool, hinges mostly."""
    root = ET.Element("mujoco", model=f"random{n}")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    parent, here = ET.SubElement(root, "worldbody"), np.array([0.0, 0.0, rng.uniform(0.1, 0.4)])
    mass, length = rng.uniform(4.0, 20.0), rng.uniform(0.25, 0.5)
    carried = sum(mass * 0.7**k for k in range(n)) * (length * 0.5 * n) ** 2 / 3.0
    rolled = True
    for k in range(n):
        # A roll about the link's own direction, never two in a row; a pitch; rarely a slide along the link.
        kind = "roll" if not rolled and rng.random() < 0.5 else "slide" if n < 5 and rng.random() < 0.12 else "pitch"
        rolled = kind == "roll"
        axis = (0, 0, 1) if kind != "pitch" else ((0, 1, 0) if rng.random() < 0.75 else (1, 0, 0))
        body = ET.SubElement(parent, "body", name=f"link{k + 1}", pos=_text(here))
        reach = rng.uniform(0.15, 0.35) if kind == "slide" else rng.uniform(1.2, 2.6)
        middle = 0.0 if kind != "pitch" else rng.uniform(-0.5, 0.5)
        rotor = mass if kind == "slide" else carried * rng.uniform(0.03, 0.15)
        ET.SubElement(
            body, "joint", name=f"j{k + 1}", axis=_text(axis), range=_text((middle - reach, middle + reach)),
            type="slide" if kind == "slide" else "hinge", armature=f"{rotor:.6g}",
        )  # fmt: skip
        middle_of = np.array([*rng.normal(0.0, 0.08 * length, 2), length * rng.uniform(0.35, 0.6)])
        thin = rng.uniform(0.12, 0.3) * length
        round_ = mass * np.array([length**2 / 12 + thin**2 / 4, length**2 / 12 + thin**2 / 4, thin**2 / 2])
        ET.SubElement(
            body, "inertial", pos=_text(middle_of), mass=f"{mass:.6g}",
            diaginertia=_text(round_ * np.exp(0.1 * rng.normal()) * np.array([1.0, 1.05, 1.0])),
        )  # fmt: skip
        here, parent = np.array([*rng.normal(0.0, 0.1 * length, 2), length]), body
        mass, length, carried = mass * rng.uniform(0.55, 0.8), length * rng.uniform(0.7, 0.95), carried * 0.45
    ET.SubElement(parent, "site", name="tool", pos=_text(here))
    return arm_of(ET.tostring(root, encoding="unicode"))


def built(arm: Arm, rng: np.random.Generator, error: float) -> Arm:
    """The arm as it was built: every body's mass, centre and moments of inertia off by this relative error.

    Second moments are scaled along their principal axes, so that what comes out is a body again.
    """
    mass = arm.mass * np.exp(error * rng.normal(size=len(arm.mass)))
    com, inertia = arm.com.copy(), arm.inertia.copy()
    for b, J in enumerate(arm.inertia):
        second, axes = np.linalg.eigh(0.5 * np.trace(J) * np.eye(3) - J)  # mass times mean squares, along the axes
        com[b] += error * np.sqrt(max(np.sum(second), 0.0) / arm.mass[b]) * rng.normal(size=3)
        second = np.maximum(second, 0.0) * np.exp(error * rng.normal(size=3)) * mass[b] / arm.mass[b]
        sigma = axes @ np.diag(second) @ axes.T
        inertia[b] = np.trace(sigma) * np.eye(3) - sigma
    return dataclasses.replace(arm, mass=mass, com=com, inertia=inertia)


def with_body(arm: Arm, link: int, mass: float, com: np.ndarray, inertia: np.ndarray) -> Arm:
    """The arm carrying one more body on a link."""
    return dataclasses.replace(
        arm, link=np.append(arm.link, link), mass=np.append(arm.mass, mass), com=np.vstack([arm.com, com]),
        inertia=np.concatenate([arm.inertia, inertia[None]]),
    )  # fmt: skip


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix about an axis (Rodrigues), shape (3, 3)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def _rotation(quat: np.ndarray) -> np.ndarray:
    w, v = quat[0], quat[1:]
    half = np.linalg.norm(v)
    return np.eye(3) if half == 0.0 else turn(v, 2.0 * np.arctan2(half, w))


def _text(values) -> str:
    return " ".join(f"{v:.6g}" for v in values)
