"""The three models as MuJoCo simulates them, and what a recording puts on the joints of each: torque, or commands."""

import copy
import dataclasses
from collections.abc import Sequence

import jax
import mujoco
import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.corrected.native import limited, native_robot
from irb140_jax.mismatch.inertials.consistent import of_bodies_or_nominal
from irb140_jax.mismatch.motion.laws import law_of, without_those
from irb140_jax.oracle.mujoco import mass_matrix
from irb140_jax.oracle.rollout import positions, positions_under_law, simulated_model
from irb140_jax.recordings.condition import Commanded, Conditioned
from irb140_jax.recordings.drive import Drive
from irb140_jax.robot import Robot, robot_mjcf, with_phi

ENDLESS = 1e5  # [rad/s^2 or m/s^2] faster, no motor turns anything
FLYWHEEL = 1e6  # [kg m^2 or kg] rotor of a joint that follows the recording
FILE = "file"  # corrected.xml alone, where it can't hold all effects


@dataclasses.dataclass(frozen=True)
class Simulated:
    """A diagnosis's models for simulation.

    Attributes:
        model: The corrected model.
        compiled: By name; "file" is the text of corrected.xml, and "corrected" the same but for laws that are more
            than MJCF's numbers, which act beside it.
        gear: Joint torque in that file per torque that the controller asks for, shape (n,).
    """

    model: CorrectedModel
    compiled: dict[str, mujoco.MjModel]
    gear: np.ndarray

    def weightless(self, recording: Conditioned) -> np.ndarray:
        """Joints that carry nothing in one of the models, so that the recorded torque would spin them up without end,
        shape (n,)."""
        most = np.abs(recording.tau).max(axis=0)
        lightest = np.min([np.diagonal(mass_matrix(m, recording.q[0])) for m in self.compiled.values()], axis=0)
        return most > ENDLESS * lightest

    def torque(self, name: str, tau: np.ndarray, missing: np.ndarray) -> np.ndarray:
        """Torque put on the joints of a model beside that of its servos, (T, n) [N m or N].

        Args:
            name: Of the model.
            tau: What was logged, (T, n) [N m or N]; zero where servos are simulated.
            missing: What of it corrected.xml can't hold, (T, n) [N m or N].
        """
        if name in ("nominal", "refit"):
            return tau
        return (tau if name == FILE else tau - missing) * self.gear

    def driven(self, name: str, drive: Drive | None) -> mujoco.MjModel:
        """A model as a recording drives it: with position servos in the place of its motors where there are any.

        Args:
            name: Of the model.
            drive: Of the servos; an unknown gain counts as zero, and so does a lag.
        """
        if drive is None:
            return self.compiled[name]
        out, gear = copy.copy(self.compiled[name]), 1.0
        if name not in ("nominal", "refit"):
            gear, drive = self.gear, limited(self.model, drive)
        kp, kd, limit = gear * np.nan_to_num(drive.kp), gear * np.nan_to_num(drive.kd), gear * drive.limit
        out.actuator_gear[:, 0], out.actuator_gainprm[:, 0] = 1.0, kp
        out.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_AFFINE
        out.actuator_biasprm[:, 1], out.actuator_biasprm[:, 2] = -kp, -kd
        out.actuator_forcelimited[:] = np.isfinite(limit)
        out.actuator_forcerange[:] = np.stack([-limit, limit], axis=1)
        return out


def simulated(model: CorrectedModel, nominal: mujoco.MjModel, step: float) -> Simulated | None:
    """The models compiled; None where MuJoCo has other joints than the robot.

    Args:
        model: The corrected model.
        nominal: The model as given, compiled.
        step: Time step [s].
    """
    corrected = simulated_corrected(model, step)
    file = corrected.compiled["corrected"] if without_those(model) is model else (
        compiled_robot(native_robot(model), step))
    compiled = {"nominal": nominal, "refit": compiled_robot(_refitted(model), step), FILE: file} | corrected.compiled
    if any(m.nv != model.robot.n for m in compiled.values()):
        return None
    return dataclasses.replace(corrected, compiled=compiled)


def simulated_corrected(model: CorrectedModel, step: float) -> Simulated:
    """The corrected model alone, compiled; `step` is that of the simulation [s]."""
    native = native_robot(without_those(model))
    gear = np.asarray(native.gear) / np.asarray(model.robot.gear)
    return Simulated(model, {"corrected": compiled_robot(native, step)}, gear)


def followers(models: Sequence[Simulated], recordings: Sequence[Conditioned]) -> np.ndarray:
    """Joints that have to follow the recording, (n,): nothing moves them as it should in one of the models."""
    unknown = [np.isnan(r.servo.drive.kp) for r in recordings if r.servo is not None]
    return np.any([*(m.weightless(r) for m in models for r in recordings), *unknown], axis=0)


def positions_of(
    models: Sequence[Simulated], name: str, drives: Sequence[Drive | None], start: np.ndarray, speed: np.ndarray,
    tau: np.ndarray, control: np.ndarray, began: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Where one of the models goes in motions side by side, (B, S + 1, n) [rad or m]; see `rollout.positions`.

    Args:
        models: Of each motion.
        name: Which model.
        drives: Of each motion's servos, None where there are none.
        start, speed, tau, control: As `rollout.positions` has them.
        began: Time since its recording began at which each motion starts, shape (B,) [s].
    """
    driven = [m.driven(name, drive) for m, drive in zip(models, drives, strict=True)]
    law = law_of([m.model for m in models], drives, [m.gear for m in models], began) if name == "corrected" else None
    if law is None:
        return positions(driven, start, speed, tau, control)
    free = driven[0].dof_armature < FLYWHEEL

    def on_free(*state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        level, torque = law(*state)
        return free * level, free * torque

    return positions_under_law(driven, start, speed, tau, control, on_free)


def asked(servo: Commanded) -> np.ndarray:
    """Controls of those servos: commanded positions, and commanded speeds as positions ahead, shape (T, n)."""
    kp, kd = servo.drive.kp, servo.drive.kd
    ahead = np.divide(kd, kp, out=np.zeros_like(kp), where=np.isfinite(kp) & np.isfinite(kd))
    return servo.command + ahead * servo.asked_speed


def led(models: dict[str, mujoco.MjModel], joints: np.ndarray) -> dict[str, mujoco.MjModel]:
    """The models with such large rotors on some joints that nothing but the torque of `leading` moves them.

    Args:
        models: Compiled, by name.
        joints: Which joints, shape (n,).
    """
    out = {name: copy.copy(model) for name, model in models.items()}
    for model in out.values():
        model.dof_armature[joints] = FLYWHEEL
    return out


def leading(torque: np.ndarray, recording: Conditioned, joints: np.ndarray) -> np.ndarray:
    """The torque with that on the rotors of `led` in place of it, by which those joints follow the recording."""
    return np.where(joints, FLYWHEEL * recording.qdd, torque)


def compiled_robot(robot: Robot, step: float) -> mujoco.MjModel:
    """A robot compiled for simulation.

    Args:
        robot: The robot.
        step: Time step [s].
    """
    bare = jax.tree.map(np.asarray, robot)  # a number at a time is quicker out of NumPy
    return simulated_model(robot_mjcf(bare), step)


def _refitted(model: CorrectedModel) -> Robot:
    """Refitted inertials of possible bodies, in the way of `native_robot`."""
    phi = of_bodies_or_nominal(model.phi_refit, np.asarray(model.robot.phi))
    return with_phi(model.robot, on_device(phi))
