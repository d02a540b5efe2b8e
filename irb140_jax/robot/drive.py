"""What actuators add to the joints they drive: gear, effort limit, rotor inertia and damping."""

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
