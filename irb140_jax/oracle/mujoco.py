"""MuJoCo's C engine as an oracle: NumPy in, NumPy out.

Rigid body, armature, damping and springs are in.  Constraints (dry friction, joint limits, contacts) are out, because
MuJoCo softens them: `frictionloss` must be compared apart.
"""

import copy
import pathlib

import mujoco
import numpy as np
from jaxtyping import Float

Vector = Float[np.ndarray, " n"]
Matrix = Float[np.ndarray, "n n"]


def oracle_model(source: str | pathlib.Path | mujoco.MjModel) -> mujoco.MjModel:
    """A compiled model without constraints, from a path, an XML string or another model (which stays as it is).

    Args:
        source: Path of an MJCF or URDF file, its text, or a compiled model.
    """
    if not isinstance(source, str | pathlib.Path):
        model = copy.copy(source)
    elif str(source).lstrip().startswith("<"):
        model = mujoco.MjModel.from_xml_string(str(source))
    else:
        model = mujoco.MjModel.from_xml_path(str(source))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return model


def inverse_dynamics(model: mujoco.MjModel, q: Vector, qd: Vector, qdd: Vector) -> Vector:
    """Joint torques of a motion, `mj_inverse`.

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (n,).

    Returns:
        tau [N m or N], shape (n,).
    """
    return inverse_dynamics_along(model, *(np.asarray(x)[None] for x in (q, qd, qdd)))[0]


def inverse_dynamics_along(
    model: mujoco.MjModel, q: Float[np.ndarray, "T n"], qd: Float[np.ndarray, "T n"], qdd: Float[np.ndarray, "T n"]
) -> Float[np.ndarray, "T n"]:
    """Joint torques along T samples of a motion, `mj_inverse`; no sample knows of the others.

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (T, n).
        qd: Joint velocities [rad/s or m/s], shape (T, n).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (T, n).

    Returns:
        tau [N m or N], shape (T, n).
    """
    data, out = mujoco.MjData(model), np.empty(np.shape(qdd))
    for i, row in enumerate(zip(q, qd, qdd, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(model, data)
        out[i] = data.qfrc_inverse
    return out


def forward_dynamics(model: mujoco.MjModel, q: Vector, qd: Vector, tau: Vector) -> Vector:
    """Joint accelerations under given torques, `mj_forward`.

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
        tau: Joint torques [N m or N], shape (n,).

    Returns:
        qdd [rad/s^2 or m/s^2], shape (n,).
    """
    data = _data(model, q, qd)
    data.qfrc_applied[:] = tau
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def mass_matrix(model: mujoco.MjModel, q: Vector) -> Matrix:
    """Mass matrix with armature, by MuJoCo's composite rigid bodies; shape (n, n).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
    """
    data = _data(model, q, np.zeros(model.nv))
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, M)
    except TypeError:  # MuJoCo before 3.17 takes the sparse matrix itself
        mujoco.mj_fullM(model, M, data.qM)
    return M


def bias(model: mujoco.MjModel, q: Vector, qd: Vector) -> Vector:
    """Coriolis, centrifugal and gravity torque C qd + g, without damping and springs; shape (n,).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
    """
    data = _data(model, q, qd)
    mujoco.mj_forward(model, data)
    return data.qfrc_bias.copy()


def passive(model: mujoco.MjModel, q: Vector, qd: Vector) -> Vector:
    """Torque that springs and damping ask of the motors, of the sign of ours: + for qd > 0; shape (n,).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
    """
    data = _data(model, q, qd)
    mujoco.mj_forward(model, data)
    return -data.qfrc_passive.copy()


def forward_kinematics(model: mujoco.MjModel, q: Vector) -> Float[np.ndarray, "4 4"]:
    """Pose of the tool in the world: the model's last site, or without sites its last body (see `_point`).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
    """
    data = _data(model, q, np.zeros(model.nv))
    mujoco.mj_kinematics(model, data)
    T = np.eye(4)
    T[:3, :3] = (data.site_xmat if model.nsite else data.xmat)[-1].reshape(3, 3)
    T[:3, 3] = _point(model, data)
    return T


def _point(model: mujoco.MjModel, data: mujoco.MjData) -> Vector:
    """Where the last site is; without sites, where the last body is, or if it has a joint, its centre of mass."""
    if model.nsite:
        return data.site_xpos[-1]
    return (data.xipos if model.body_jntnum[-1] else data.xpos)[-1]


def jacobian(model: mujoco.MjModel, q: Vector) -> Float[np.ndarray, "6 n"]:
    """Geometric Jacobian of that tool in world axes, linear over angular; shape (6, n).

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
    """
    data = _data(model, q, np.zeros(model.nv))
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    J = np.zeros((6, model.nv))
    body = model.site_bodyid[-1] if model.nsite else model.nbody - 1
    mujoco.mj_jac(model, data, J[:3], J[3:], _point(model, data), int(body))
    return J


def energies(model: mujoco.MjModel, q: Vector, qd: Vector) -> tuple[float, float]:
    """Potential energy (springs included, zero at the world's origin) and kinetic energy [J].

    Args:
        model: From `oracle_model`.
        q: Joint positions [rad or m], shape (n,).
        qd: Joint velocities [rad/s or m/s], shape (n,).
    """
    data = _data(model, q, qd)
    mujoco.mj_forward(model, data)
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    return float(data.energy[0]), float(data.energy[1])


def _data(model: mujoco.MjModel, q: Vector, qd: Vector) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = q
    data.qvel[:] = qd
    return data
