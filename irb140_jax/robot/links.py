"""Frames and inertials of the links, out of a compiled MuJoCo model with the robot's joints at their reference."""

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from irb140_jax.errors import RobotError
from irb140_jax.robot.choose import Choice
from irb140_jax.robot.inertia import Inertial, described, is_lopsided, is_negative, possible

# An axis turned into its link's frame this close to the one in the file is the one in the file.
SAME_AXIS = 1e-12


class RestingTree(NamedTuple):
    """The robot at q = reference, all other joints where they are held.

    Attributes:
        data: MuJoCo's data at that pose.
        origin: World positions of the link frames, on the joint anchors [m], shape (n, 3).
        frame: World orientations of the link frames, those of their bodies, shape (n, 3, 3).
        axis: Joint axes in the link frames, shape (n, 3).
        rotation: Orientation of each link frame in that of the link before, shape (n, 3, 3).
        position: Origin of each link frame in that of the link before [m], shape (n, 3).
        base_rotation: Orientation of the base in the world, shape (3, 3).
        base_position: Position of the base in the world [m], shape (3,).
    """

    data: mujoco.MjData
    origin: np.ndarray
    frame: np.ndarray
    axis: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    base_rotation: np.ndarray
    base_position: np.ndarray


def link_frames_at_rest(model: mujoco.MjModel, choice: Choice) -> RestingTree:
    """Frames of all links; several joints on one body become links without mass, all but the last.

    Args:
        model: Compiled model.
        choice: Its joints that make the robot.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = choice.qpos
    mujoco.mj_kinematics(model, data)
    joints = list(choice.joints)
    n, bodies = len(joints), model.jnt_bodyid[joints]
    origin = data.xanchor[joints]
    frame = data.xmat[bodies].reshape(n, 3, 3)
    axis = np.einsum("nji,nj->ni", frame, data.xaxis[joints])
    given = model.jnt_axis[joints]
    axis = np.where(np.abs(axis - given).max(axis=1, keepdims=True) < SAME_AXIS, given, axis)
    base = int(model.body_parentid[model.jnt_bodyid[min(joints)]])
    base_rotation, base_position = data.xmat[base].reshape(3, 3).copy(), data.xpos[base].copy()
    before = [i + 1 for i in choice.parent]
    before_R = np.concatenate([base_rotation[None], frame])[before]
    before_p = np.concatenate([base_position[None], origin])[before]
    rotation = np.einsum("nji,njk->nik", before_R, frame)
    position = np.einsum("nji,nj->ni", before_R, origin - before_p)
    return RestingTree(data, origin, frame, axis, rotation, position, base_rotation, base_position)


def link_inertials(
    model: mujoco.MjModel, choice: Choice, tree: RestingTree, given: Mapping[str, Inertial], source: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Mass, centre of mass and inertia about it of every link, bodies that stand still on it included.

    Args:
        model: Compiled model.
        choice: Its joints that make the robot.
        tree: Their frames at rest.
        given: Inertials of bodies that MuJoCo would not take, by name; they count, not the model's.
        source: Where the model came from, for messages.

    Returns:
        Masses [kg], shape (n,); centres [m], shape (n, 3); inertias [kg m^2], shape (n, 3, 3), in link axes; and notes
        on what was mended.

    Raises:
        RobotError: A link would have negative mass or inertia.
    """
    n = len(choice.joints)
    mass, com, inertia, notes = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3)), []
    for link in range(n):
        bodies = [body for body in range(1, model.nbody) if choice.carrier[body] == link]
        mass[link], com[link], whole = _lumped([_body_inertial(model, tree, body, link, given) for body in bodies])
        parts = {name: given[name] for body in bodies if (name := model.body(body).name) in given}
        broken = {name: x for name, x in parts.items() if is_negative(x.mass, x.inertia) or is_lopsided(x.inertia)}
        if broken:
            notes.append(_what_was_mended(mass[link], whole, broken, source))
        inertia[link] = possible(whole) if parts else whole
    return mass, com, inertia, notes


def _lumped(parts: list[Inertial]) -> Inertial:
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / (mass if mass else 1.0)
    total = np.zeros((3, 3))
    for m, c, about_own in parts:
        d = c - com  # about the common centre at once: by way of the origin, light links would lose digits
        total += about_own + m * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, com, 0.5 * (total + total.T))


def _body_inertial(
    model: mujoco.MjModel, tree: RestingTree, body: int, link: int, given: Mapping[str, Inertial]
) -> Inertial:
    """Mass, centre and inertia about it of one body, in the axes of the link that carries it."""
    to_link = tree.frame[link].T
    body_R, raw = tree.data.xmat[body].reshape(3, 3), given.get(model.body(body).name)
    com = model.body_ipos[body] if raw is None else raw.com
    centre = to_link @ (tree.data.xpos[body] + body_R @ com - tree.origin[link])
    if raw is not None:
        A = to_link @ body_R
        return Inertial(raw.mass, centre, A @ raw.inertia @ A.T)
    principal = np.zeros(9)
    mujoco.mju_quat2Mat(principal, model.body_iquat[body])
    A = to_link @ body_R @ principal.reshape(3, 3)
    return Inertial(float(model.body_mass[body]), centre, A @ np.diag(model.body_inertia[body]) @ A.T)


def _what_was_mended(mass: float, whole: np.ndarray, broken: Mapping[str, Inertial], source: str) -> str:
    """What was wrong with the link's parts, and what it counts with."""
    name, part = next(iter(broken.items()))
    what = f"link '{name}' has mass {part.mass:g} kg and principal moments of inertia {described(part.inertia)}"
    more = f" (as broken: {', '.join(repr(b) for b in list(broken)[1:])})" if len(broken) > 1 else ""
    if is_negative(mass, whole) or min(x.mass for x in broken.values()) < 0.0:
        raise RobotError(f"{source}: {what}{more}; none may be negative: mend its <inertial>")
    if not is_lopsided(whole):
        return f"{what}{more}, which no body has; with all that is fixed to it, it is a possible one"
    return (
        f"{what}{more}, of which the largest exceeds the sum of the others; no body has that: with all that is fixed "
        f"to it, it counts with {described(possible(whole))}"
    )


def tool_frame(
    model: mujoco.MjModel, choice: Choice, tree: RestingTree, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Orientation, shape (3, 3), and position [m], shape (3,), of the tool in the last link's frame.

    The tool is the last site on the last link; without one, the last body that stands still on it (a URDF's tool0);
    without one, the link's centre of mass, for the link's own frame lies on the joint, where a push moves nothing.

    Args:
        model: Compiled model.
        choice: Its joints that make the robot.
        tree: Their frames at rest.
        centre: Centre of mass of the last link in its frame [m], shape (3,).
    """
    last = len(choice.joints) - 1
    to_link, own = tree.frame[-1].T, int(model.jnt_bodyid[choice.joints[-1]])
    carried = [body for body in range(own, model.nbody) if choice.carrier[body] == last]
    sites = [s for s in range(model.nsite) if int(model.site_bodyid[s]) in carried]
    body = int(model.site_bodyid[sites[-1]]) if sites else carried[-1]
    if not sites and body == own:
        return np.eye(3), centre
    R, p = tree.data.xmat[body].reshape(3, 3), tree.data.xpos[body]
    if sites:
        site_R = np.zeros(9)
        mujoco.mju_quat2Mat(site_R, model.site_quat[sites[-1]])
        p, R = p + R @ model.site_pos[sites[-1]], R @ site_R.reshape(3, 3)
    return to_link @ R, to_link @ (p - tree.origin[-1])
