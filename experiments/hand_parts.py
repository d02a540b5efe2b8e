"""Physics by hand that takes other parts than the nominal arm has: second joints, tendons, walls, bristles, heat.

Each part: given the arm's MJCF as a tree, a joint's number, the torque that it may have [N m or N], sizes and random
numbers, it alters the tree; and returns its true parameters, where it acts, and what it does to the compiled plant.
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from hand_arms import STEP, Plant


class Part(NamedTuple):
    """What a part is in truth, the joints on which it acts (none: all), and what it does to the compiled plant."""

    values: dict[str, float]
    joints: list[str]
    fit: Callable[[Plant], None] = lambda plant: None


def joints_of(tree: ET.Element) -> list[ET.Element]:
    """The joints in the order of their degrees of freedom."""
    return list(tree.iter("joint"))


def name_of(tree: ET.Element, j: int) -> str:
    """The name of a joint."""
    return str(joints_of(tree)[j].get("name"))


def split(tree: ET.Element, j: int) -> ET.Element:
    """A second joint behind one, on the same axis: the motor stays, all it carried moves with the new joint."""
    joint = joints_of(tree)[j]
    parent = next(b for b in tree.iter("body") if joint in list(b))
    inner = ET.Element("body")
    for child in [c for c in parent if c is not joint]:
        parent.remove(child)
        inner.append(child)
    ET.SubElement(parent, "inertial", mass="1e-6", pos="0 0 0", diaginertia="1e-8 1e-8 1e-8")
    twin = {k: v for k, v in joint.attrib.items() if k in ("type", "axis")}
    second = ET.Element("joint", {"name": f"{joint.get('name')} link", **twin})
    inner.insert(0, second)
    parent.append(inner)
    return second


def add_tool(tree: ET.Element) -> None:
    """A site on the last body, which makes it the tool."""
    list(tree.iter("body"))[-1].append(ET.Element("site", name="tool", pos=".05 .02 .05"))


def elasticity(tree, j, torque, sizes, rng):
    """A spring in the joint, on which what it carries swings at 6 to 12 Hz."""
    stiffness = sizes.carried[j] * (2.0 * np.pi * rng.uniform(6.0, 12.0)) ** 2
    damping = 2.0 * rng.uniform(0.02, 0.08) * np.sqrt(stiffness * sizes.carried[j])
    name = name_of(tree, j)
    split(tree, j).attrib |= {"stiffness": f"{stiffness}", "damping": f"{damping}"}
    return Part({"stiffness": stiffness}, [name])


def play(tree, j, torque, sizes, rng):
    """A second joint with limits, which give way as MuJoCo's do."""
    gap = rng.uniform(0.01, 0.05) * sizes.spread[j]
    name = name_of(tree, j)
    half = gap / 2.0
    split(tree, j).attrib |= {"range": f"{-half} {half}", "limited": "true", "solreflimit": ".006 .5"}
    return Part({"gap": gap}, [name])


def coupling(tree, j, torque, sizes, rng):
    """MuJoCo's friction of a tendon over this joint and the nearest like it; of two hinges where it has no like."""
    joints = joints_of(tree)
    alike = lambda j: [i for i, x in enumerate(joints) if i != j and x.get("type") == joints[j].get("type")]  # noqa: E731
    j = j if alike(j) else next(i for i in range(len(joints)) if alike(i))
    i = min(alike(j), key=lambda i: abs(i - j))
    sign = rng.choice([-1.0, 1.0])
    viscous = torque / np.hypot(sizes.qd[i], sizes.qd[j])
    dry = rng.choice([0.0, 0.5]) * torque
    tendon = ET.SubElement(ET.SubElement(tree, "tendon"), "fixed", damping=f"{viscous}", frictionloss=f"{dry}")
    names = [name_of(tree, min(i, j)), name_of(tree, max(i, j))]
    for name, coef in zip(names, (1.0, sign), strict=True):
        ET.SubElement(tendon, "joint", joint=name, coef=f"{coef}")
    return Part({"viscous": viscous, **({"coulomb": dry} if dry else {})}, names)


def push(tree, j, torque, sizes, rng):
    """A constant force on the last body's centre of mass, at once there and at once gone."""
    start, length = rng.uniform(2.0, 11.0), rng.uniform(0.5, 2.0)
    force = rng.normal(size=3)
    force *= 2.0 * torque / max(np.linalg.norm(sizes.reach[:, j] * force), 1e-9)
    which = int(rng.integers(2))

    def fit(plant):
        def outside(recording, t, model, data):
            data.xfrc_applied[-1, :3] = force * (recording == which and start < t < start + length)

        plant.outside.append(outside)

    values = {"t0": start, "t1": start + length, "recording": which + 1}
    return Part(values | dict(zip(("force_x", "force_y", "force_z"), force, strict=True)), [], fit)


def wall(tree, j, torque, sizes, rng):
    """A springy wall before the tool, where the tool is for a tenth of the time."""
    normal = rng.normal(size=3) * (sizes.path.std(axis=0) > 0.01)
    normal /= np.linalg.norm(normal)
    position = float(np.quantile(sizes.path @ normal, rng.uniform(0.85, 0.95)))
    deep = np.maximum(sizes.path @ normal - position, 0.0)
    stiffness = float(3.0 * torque / max(np.sqrt(np.mean(deep**2)) * abs(sizes.reach[:, j] @ normal), 1e-6))

    def fit(plant):
        def outside(recording, t, model, data):
            depth = max(data.site_xpos[-1] @ normal - position, 0.0)
            force = -stiffness * depth * normal
            data.xfrc_applied[-1, :3] = force
            data.xfrc_applied[-1, 3:] = np.cross(data.site_xpos[-1] - data.xipos[-1], force)

        plant.outside.append(outside)

    inward = dict(zip(("normal_x", "normal_y", "normal_z"), -normal, strict=True))
    return Part({"stiffness": stiffness, "position": -position, **inward}, [], fit)


def bristles(tree, j, torque, sizes, rng):
    """LuGre's, whose bristles are damped."""
    stiffness = torque / (sizes.spread[j] * rng.uniform(0.004, 0.03))
    damped = 0.3 * torque / sizes.qd[j]
    z = [0.0]

    def law(t, q, qd, tau):
        rate = qd[j] - stiffness / torque * abs(qd[j]) * z[0]
        z[0] += STEP * rate
        return np.eye(len(q))[j] * -(stiffness * z[0] + damped * rate * abs(qd[j]) / (abs(qd[j]) + sizes.qd[j]))

    return Part({"coulomb": torque, "stiffness": stiffness}, [name_of(tree, j)],
                lambda plant: plant.forces.append(law))  # fmt: skip


def warming(tree, j, torque, sizes, rng):
    """Viscous friction that falls from the start of every recording."""
    cold, drop, time = torque / sizes.qd[j], rng.uniform(0.3, 0.6), rng.uniform(3.0, 12.0)
    law = lambda t, q, qd, tau: np.eye(len(q))[j] * -cold * (1.0 - drop * (1.0 - np.exp(-t / time))) * qd[j]  # noqa: E731
    return Part({"viscous_cold": cold, "relative_drop": drop, "time_constant": time},
                [name_of(tree, j)], lambda plant: plant.forces.append(law))  # fmt: skip


def rubbing(tree, j, torque, sizes, rng):
    """MuJoCo's dry friction, and a round bump of more around a place."""
    centre, width = rng.uniform(-1.0, 1.0) * sizes.spread[j] + sizes.middle[j], rng.uniform(0.4, 1.2) * sizes.spread[j]
    depth, still = rng.uniform(0.6, 2.0), 0.01 * sizes.qd[j]

    def law(t, q, qd, tau):
        bump = 0.5 + 0.5 * np.cos(np.clip((q[j] - centre) / width, -1.0, 1.0) * np.pi)
        return np.eye(len(q))[j] * -torque * depth * bump * np.tanh(qd[j] / still)

    def fit(plant):
        plant.model.dof_frictionloss[plant.driven[j]] += torque
        plant.forces.append(law)

    return Part({"coulomb": torque, "depth": depth, "centre": centre}, [name_of(tree, j)], fit)


def falling(tree, j, torque, sizes, rng):
    """MuJoCo's dry friction, and more at low speed."""
    speed, top, still = rng.uniform(0.1, 0.3) * sizes.qd[j], rng.uniform(0.5, 1.5) * torque, 0.01 * sizes.qd[j]
    power = rng.choice([1.0, 2.0])

    def law(t, q, qd, tau):
        return np.eye(len(q))[j] * -top * np.exp(-((abs(qd[j]) / speed) ** power)) * np.tanh(qd[j] / still)

    def fit(plant):
        plant.model.dof_frictionloss[plant.driven[j]] += torque
        plant.forces.append(law)

    return Part({"coulomb": torque, "static": torque + top}, [name_of(tree, j)], fit)


PARTS = {
    "joint_elasticity": elasticity, "backlash": play, "transmission_coupling": coupling, "external_wrench": push,
    "contact": wall, "presliding_hysteresis": bristles, "thermal_friction_drift": warming,
    "position_dependent_friction": rubbing, "stribeck_friction": falling,
}  # fmt: skip
