"""Frames and inertials of the links, out of a compiled MuJoCo model at its reference pose."""

from typing import NamedTuple

import mujoco
import numpy as np

from irb140_jax.robot.refuse import parent_joint


class RestingChain(NamedTuple):
    """The chain at q = reference.

    Attributes:
        data: MuJoCo's data at that pose.
        origin: World positions of the link frames, on the joint anchors [m], shape (n, 3).
        frame: World orientations of the link frames, those of their bodies, shape (n, 3, 3).
        rotation: Orientation of each link frame in the one before it, shape (n, 3, 3).
        position: Origin of each link frame in the one before it [m], shape (n, 3).
        base_rotation: Orientation of the base in the world, shape (3, 3).
        base_position: Position of the base in the world [m], shape (3,).
    """

    data: mujoco.MjData
    origin: np.ndarray
    frame: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    base_rotation: np.ndarray
    base_position: np.ndarray


def link_frames_at_rest(model: mujoco.MjModel) -> RestingChain:
    """Frames of all links; several joints on one body become links without mass, all but the last.

    Args:
        model: Compiled model of a serial chain.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, data)
    n = model.njnt
    origin = data.xanchor.copy()
    frame = data.xmat[model.jnt_bodyid].reshape(n, 3, 3)
    base = int(model.body_parentid[model.jnt_bodyid[0]])
    base_rotation, base_position = data.xmat[base].reshape(3, 3).copy(), data.xpos[base].copy()
    before_R = np.concatenate([base_rotation[None], frame[:-1]])
    before_p = np.concatenate([base_position[None], origin[:-1]])
    rotation = np.einsum("nji,njk->nik", before_R, frame)
    position = np.einsum("nji,nj->ni", before_R, origin - before_p)
    return RestingChain(data, origin, frame, rotation, position, base_rotation, base_position)


def link_inertials(model: mujoco.MjModel, chain: RestingChain) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it of every link, bodies welded to it included.

    Args:
        model: Compiled model of a serial chain.
        chain: Its frames at rest.

    Returns:
        Masses [kg], shape (n,); centres [m], shape (n, 3); inertias [kg m^2], shape (n, 3, 3); in link axes.
    """
    n = model.njnt
    mass, first = np.zeros(n), np.zeros((n, 3))
    members: list[list[tuple[float, np.ndarray, np.ndarray]]] = [[] for _ in range(n)]
    for body in range(1, model.nbody):
        link = parent_joint(model, body)
        if link < 0:
            continue
        m, c, inertia = _body_inertial(model, chain, body, link)
        mass[link] += m
        first[link] += m * c
        members[link].append((m, c, inertia))
    com = first / np.where(mass == 0.0, 1.0, mass)[:, None]
    total = np.zeros((n, 3, 3))
    for link, bodies in enumerate(members):
        for m, c, inertia in bodies:
            d = c - com[link]  # about the common centre at once: by way of the origin, light links would lose digits
            total[link] += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, 0.5 * (total + np.swapaxes(total, 1, 2))


def _body_inertial(
    model: mujoco.MjModel, chain: RestingChain, body: int, link: int
) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and inertia about it of one body, in the axes of the link that carries it."""
    to_link = chain.frame[link].T
    body_R = chain.data.xmat[body].reshape(3, 3)
    centre = to_link @ (chain.data.xpos[body] + body_R @ model.body_ipos[body] - chain.origin[link])
    principal = np.zeros(9)
    mujoco.mju_quat2Mat(principal, model.body_iquat[body])
    A = to_link @ body_R @ principal.reshape(3, 3)
    return float(model.body_mass[body]), centre, A @ np.diag(model.body_inertia[body]) @ A.T


def tool_frame(model: mujoco.MjModel, chain: RestingChain, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orientation, shape (3, 3), and position [m], shape (3,), of the tool in the last link's frame.

    The tool is the last site on the last link; without one, the last body welded to it (a URDF's tool0); without
    one, the link's centre of mass, for the link's own frame lies on the joint, where a push moves nothing.

    Args:
        model: Compiled model of a serial chain.
        chain: Its frames at rest.
        centre: Centre of mass of the last link in its frame [m], shape (3,).
    """
    last = model.njnt - 1
    to_link, own = chain.frame[-1].T, int(model.jnt_bodyid[-1])
    carried = [body for body in range(own, model.nbody) if parent_joint(model, body) == last]
    sites = [s for s in range(model.nsite) if int(model.site_bodyid[s]) in carried]
    body = int(model.site_bodyid[sites[-1]]) if sites else carried[-1]
    if not sites and body == own:
        return np.eye(3), centre
    R, p = chain.data.xmat[body].reshape(3, 3), chain.data.xpos[body]
    if sites:
        site_R = np.zeros(9)
        mujoco.mju_quat2Mat(site_R, model.site_quat[sites[-1]])
        p, R = p + R @ model.site_pos[sites[-1]], R @ site_R.reshape(3, 3)
    return to_link @ R, to_link @ (p - chain.origin[-1])
