"""Rigid-body torque along a motion: recursive Newton-Euler in world axes, all samples at once, in plain NumPy.

Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5.
"""

import dataclasses

import numpy as np

from testbed.arms import Arm


@dataclasses.dataclass(frozen=True)
class Frames:
    """Where the joints' frames are, one array entry a sample.

    Attributes:
        turned: Orientations in the world, n of shape (T, 3, 3).
        origin: Origins [m], n of shape (T, 3).
        axis: Joint axes in the world, n of shape (T, 3).
    """

    turned: list[np.ndarray]
    origin: list[np.ndarray]
    axis: list[np.ndarray]


def frames(arm: Arm, q: np.ndarray) -> Frames:
    """Frames of all joints at positions q, shape (T, n) [rad or m]."""
    T = len(q)
    R, p = np.broadcast_to(np.eye(3), (T, 3, 3)), np.zeros((T, 3))
    turned, origin, axis = [], [], []
    for k in range(arm.n):
        p = p + R @ arm.place[k]
        R = R @ arm.rest[k]
        if arm.slide[k]:
            p = p + (R @ arm.axis[k]) * q[:, k, None]
        else:
            R = R @ _turns(arm.axis[k], q[:, k])
        turned.append(R)
        origin.append(p)
        axis.append(R @ arm.axis[k])
    return Frames(turned, origin, axis)


def torque(arm: Arm, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Torque that moves the bodies and rotors of an arm, all of shape (T, n) [rad, s; N m or N]."""
    at, T = frames(arm, q), len(q)
    w, dw, a = np.zeros((T, 3)), np.zeros((T, 3)), np.broadcast_to(-arm.gravity, (T, 3))
    force, moment = np.zeros((arm.n, T, 3)), np.zeros((arm.n, T, 3))
    before = np.zeros((T, 3))
    for k in range(arm.n):
        z, v, bend = at.axis[k], qd[:, k, None], qdd[:, k, None]
        step = at.origin[k] - before
        a = a + np.cross(dw, step) + np.cross(w, np.cross(w, step))
        if arm.slide[k]:
            a = a + 2.0 * v * np.cross(w, z) + bend * z
        else:
            dw = dw + bend * z + v * np.cross(w, z)
            w = w + v * z
        before = at.origin[k]
        for b in np.flatnonzero(arm.link == k):
            c = at.turned[k] @ arm.com[b]
            f = arm.mass[b] * (a + np.cross(dw, c) + np.cross(w, np.cross(w, c)))
            J = at.turned[k] @ arm.inertia[b] @ at.turned[k].swapaxes(1, 2)
            spin = lambda x, J=J: np.einsum("tij,tj->ti", J, x)  # noqa: E731
            force[k] += f
            moment[k] += spin(dw) + np.cross(w, spin(w)) + np.cross(c, f)
    tau = np.zeros((T, arm.n))
    for k in reversed(range(arm.n)):
        tau[:, k] = np.einsum("ti,ti->t", force[k] if arm.slide[k] else moment[k], at.axis[k])
        if k:
            force[k - 1] += force[k]
            moment[k - 1] += moment[k] + np.cross(at.origin[k] - at.origin[k - 1], force[k])
    return tau + arm.rotor * qdd


def own_inertia(arm: Arm, q: np.ndarray, j: int) -> np.ndarray:
    """What joint j carries, its rotor left out, at positions q (T, n): shape (T,) [kg m^2 or kg]."""
    alone = dataclasses.replace(arm, gravity=np.zeros(3), rotor=np.zeros(arm.n))
    bend = np.zeros_like(q)
    bend[:, j] = 1.0
    return torque(alone, q, np.zeros_like(q), bend)[:, j]


def tool(arm: Arm, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the tool is, (T, 3) [m], and how the joints move it, (T, 3, n)."""
    at = frames(arm, q)
    x = at.origin[-1] + at.turned[-1] @ arm.tool
    columns = [
        at.axis[k] if arm.slide[k] else np.cross(at.axis[k], x - at.origin[k]) for k in range(arm.n)
    ]  # fmt: skip
    return x, np.stack(columns, axis=2)


def _turns(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle)[:, None, None] * K + (1.0 - np.cos(angle))[:, None, None] * (K @ K)
