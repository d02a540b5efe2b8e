"""MuJoCo models of the nominal arm and of the true one, whose inertials are wrong by a few per cent."""

import pathlib

import mujoco
import numpy as np

_OFF = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_ACTUATION


def arm_spec(mjcf: str | pathlib.Path) -> mujoco.MjSpec:
    """The editable model of an MJCF file, or of MJCF text."""
    text = str(mjcf)
    if text.lstrip().startswith("<"):
        return mujoco.MjSpec.from_string(text)
    return mujoco.MjSpec.from_file(text)


def arm_model(spec: mujoco.MjSpec, dt: float) -> mujoco.MjModel:
    """Compile the arm alone: no contacts between its drawn shapes, no stops, no actuators; drives act on the joints.

    Args:
        spec: The editable model.
        dt: Step of the engine [s].

    Returns:
        The compiled model.
    """
    model = spec.compile()
    model.opt.disableflags |= int(_OFF)
    model.opt.timestep = dt
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Dry friction as stiff as the step allows: it takes one step to stop a joint, not the 20 ms of MuJoCo's default.
    model.dof_solref[:] = (-1.0, -1.0 / dt)
    model.dof_solimp[:, :2] = 0.9999
    return model


def perturb_inertials(model: mujoco.MjModel, relative_error: float, rng: np.random.Generator) -> None:
    """Make mass, centre of mass and inertia of every moving body wrong, in place, and physically possible still.

    The mass distribution is scaled and shifted as a whole, so that some density always has these inertials:
    m -> m exp(e), Sigma -> (I + E) Sigma (I + E)^T with Sigma the second moments about the centre of mass, and c moves
    by e times the root mean square distance of the body's mass from the body's frame.

    Args:
        model: The model to change.
        relative_error: Relative standard deviation of each quantity.
        rng: Source of the errors.

    Source: Wensing, Kim, Slotine, IEEE Robotics and Automation Letters 3(1), 2018 (pseudo-inertia).
    """
    for body in range(1, model.nbody):
        draws = rng.normal(size=10)
        if model.body_weldid[body] == 0 or model.body_mass[body] == 0.0:
            continue
        inertia, frame = model.body_inertia[body], np.zeros(9)
        mujoco.mju_quat2Mat(frame, model.body_iquat[body])
        R, mass, com = frame.reshape(3, 3), model.body_mass[body], model.body_ipos[body].copy()
        sigma = R @ np.diag(0.5 * inertia.sum() - inertia) @ R.T
        size = np.sqrt((np.trace(sigma) / mass + com @ com) / 3.0)
        stretch = np.zeros((3, 3))
        # Half of the error each way, as a moment is a length squared.
        stretch[np.triu_indices(3)] = 0.5 * relative_error * draws[4:]
        stretch = np.eye(3) + np.diag(np.diag(stretch)) + 0.5 * (np.triu(stretch, 1) + np.triu(stretch, 1).T)
        moments, axes = np.linalg.eigh(stretch @ sigma @ stretch.T)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        mujoco.mju_mat2Quat(model.body_iquat[body], axes.ravel())
        model.body_inertia[body] = moments.sum() - moments
        model.body_mass[body] = mass * np.exp(relative_error * draws[0])
        model.body_ipos[body] = com + relative_error * size * draws[1:4]
    mujoco.mj_setConst(model, mujoco.MjData(model))


def rigid_torque(model: mujoco.MjModel, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Inverse dynamics by MuJoCo along a motion, M qdd + C qd + g + passive torque, without dry friction.

    Args:
        model: The arm; its n joints are all there is.
        q, qd, qdd: Motion, shape (T, n).

    Returns:
        Joint torques [N m or N], shape (T, n).
    """
    data, tau = mujoco.MjData(model), np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        tau[k] = data.qfrc_inverse + data.qfrc_constraint
    return tau
