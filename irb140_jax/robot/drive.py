"""What actuators add to the joints they drive: gear, effort limit, rotor inertia and damping; gains of servos."""

from typing import NamedTuple

import mujoco
import numpy as np


class Drives(NamedTuple):
    """By joint, all on the joint side.

    Attributes:
        gear: Joint torque per unit of actuator force, 1 without actuator, shape (n,).
        effort: Largest torque [N m or N], inf where nothing limits it, shape (n,).
        armature: Rotor inertia [kg m^2 or kg], shape (n,).
        damping: Viscous friction [N m s/rad or N s/m], shape (n,).
    """

    gear: np.ndarray
    effort: np.ndarray
    armature: np.ndarray
    damping: np.ndarray


def drives(model: mujoco.MjModel) -> Drives:
    """Read the actuators; rotor inertia and damping count with the square of the gear, as in MuJoCo's own dynamics.

    Args:
        model: Compiled model; of two actuators at one joint, which no robot may have, the last one counts.
    """
    n = model.njnt
    gear, armature, damping = np.ones(n), np.zeros(n), np.zeros(n)
    effort = np.where(model.jnt_actfrclimited, np.abs(model.jnt_actfrcrange).max(axis=1), np.inf)
    count = model.actuator_trntype.shape[0]
    # Fields of the actuator that older versions of MuJoCo do not have.
    rotor = getattr(model, "actuator_armature", np.zeros(count))
    damper = np.reshape(getattr(model, "actuator_damping", np.zeros(count)), count)
    for a in range(count):
        j = driven_joint(model, a)
        if j is None:
            continue
        gear[j] = model.actuator_gear[a, 0]
        armature[j] = gear[j] ** 2 * rotor[a]
        damping[j] = gear[j] ** 2 * damper[a]
        effort[j] = min(effort[j], abs(gear[j]) * _force_limit(model, a))
    return Drives(gear, effort, armature, damping)


class ServoGains(NamedTuple):
    """Gains of the servos that a model's actuators are, by joint and on the joint side; NaN where it has none.

    Attributes:
        kp: Torque per position error [N m/rad or N/m], shape (n,).
        kd: Torque per speed error [N m s/rad or N s/m], shape (n,).
        limit: Largest torque [N m or N], inf where nothing limits it, shape (n,).
        low, high: Range of the commands [rad or m], shape (n,).
    """

    kp: np.ndarray
    kd: np.ndarray
    limit: np.ndarray
    low: np.ndarray
    high: np.ndarray


def servo_gains(model: mujoco.MjModel) -> ServoGains:
    """Read actuators of MJCF's kinds `position` and `velocity`, and `general` ones that are of the same law.

    force = gainprm[0] ctrl + biasprm[0] + biasprm[1] length + biasprm[2] velocity, length = gear q, torque = gear force

    Args:
        model: Compiled model.

    Source: MuJoCo documentation, XML reference, actuator/general, position and velocity.
    """
    n = model.njnt
    kp, kd = np.full((2, n), np.nan)
    limit, low, high = np.full(n, np.inf), np.full(n, -np.inf), np.full(n, np.inf)
    plain = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_AFFINE), int(mujoco.mjtDyn.mjDYN_NONE)
    for a in range(model.actuator_trntype.shape[0]):
        j = driven_joint(model, a)
        kinds = model.actuator_gaintype[a], model.actuator_biastype[a], model.actuator_dyntype[a]
        if j is None or tuple(map(int, kinds)) != plain:
            continue
        gain, (bias, spring, damper) = float(model.actuator_gainprm[a, 0]), model.actuator_biasprm[a, :3]
        gear = float(model.actuator_gear[a, 0])
        position, velocity = spring == -gain, spring == 0.0 and damper == -gain
        if bias or gain <= 0.0 or not (position or velocity):
            continue
        kp[j], kd[j] = gear**2 * gain * position, -(gear**2) * damper
        if model.actuator_forcelimited[a]:
            limit[j] = abs(gear) * float(np.abs(model.actuator_forcerange[a]).min())
        if model.actuator_ctrllimited[a] and position:
            low[j], high[j] = sorted(model.actuator_ctrlrange[a] / gear)
    limit = np.minimum(limit, np.where(model.jnt_actfrclimited, np.abs(model.jnt_actfrcrange).min(axis=1), np.inf))
    return ServoGains(kp, kd, limit, low, high)


def driven_joint(model: mujoco.MjModel, actuator: int) -> int | None:
    """The joint that an actuator drives directly, or None."""
    on_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trnid[actuator, 0]) if int(model.actuator_trntype[actuator]) in on_joint else None


def _force_limit(model: mujoco.MjModel, a: int) -> float:
    """Largest actuator force: its own range, and for a motor also what the control range allows."""
    limit = np.inf
    if model.actuator_forcelimited[a]:
        limit = float(np.abs(model.actuator_forcerange[a]).max())
    is_motor = (
        int(model.actuator_gaintype[a]) == int(mujoco.mjtGain.mjGAIN_FIXED)
        and int(model.actuator_biastype[a]) == int(mujoco.mjtBias.mjBIAS_NONE)
    )
    if is_motor and model.actuator_ctrllimited[a]:
        limit = min(limit, abs(float(model.actuator_gainprm[a, 0])) * float(np.abs(model.actuator_ctrlrange[a]).max()))
    return limit
