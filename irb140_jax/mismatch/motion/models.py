"""The three models as MuJoCo simulates them, and the torque that a recording puts on the joints of each."""

import dataclasses

import jax.numpy as jnp
import mujoco
import numpy as np

from irb140_jax.mismatch.consistent import consistent, is_body
from irb140_jax.mismatch.model import CorrectedModel, torques_along
from irb140_jax.mismatch.native import native_robot
from irb140_jax.oracle.mujoco import inverse_dynamics, oracle_model
from irb140_jax.oracle.rollout import simulated_model
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.robot import Robot, robot_mjcf, with_phi

MODELS = ("nominal", "refit", "corrected")


@dataclasses.dataclass(frozen=True)
class Simulated:
    """A diagnosis's models for simulation.

    Attributes:
        model: The corrected model.
        compiled: By name; "corrected" is the text of corrected.xml.
        gear: Joint torque in that file per torque that the controller asks for, shape (n,).
    """

    model: CorrectedModel
    compiled: dict[str, mujoco.MjModel]
    gear: np.ndarray

    def torque(self, name: str, recording: Conditioned) -> np.ndarray:
        """Torque on the joints of a model along a recording, (T, n) [N m or N]: what was logged and, for the corrected
        model, what the effects that MJCF can't hold take or give along the recorded motion."""
        if name != "corrected":
            return recording.tau
        return (recording.tau - self.missing(recording)) * self.gear

    def missing(self, recording: Conditioned) -> np.ndarray:
        """What the log would hold beyond corrected.xml by the named laws, (T, n) [N m or N]."""
        if not any(named.effect.not_in_mjcf for named in self.model.named):
            return np.zeros_like(recording.tau)
        laws = dataclasses.replace(self.model, discrepancy=None)
        native = oracle_model(self.compiled["corrected"])
        moving = zip(recording.q, recording.qd, recording.qdd, strict=True)
        own = np.array([inverse_dynamics(native, *x) for x in moving]) + native.dof_frictionloss * recording.direction
        return torques_along(laws, recording).corrected - own / self.gear


def simulated(model: CorrectedModel, step: float) -> Simulated | None:
    """The models compiled; None where MuJoCo has other joints than the robot.

    Args:
        model: The corrected model.
        step: Time step [s].
    """
    robots = {"nominal": model.robot, "refit": _refitted(model), "corrected": native_robot(model)}
    compiled = {name: simulated_model(robot_mjcf(robot), step) for name, robot in robots.items()}
    if any(m.nv != model.robot.n for m in compiled.values()):
        return None
    gear = np.asarray(robots["corrected"].gear) / np.asarray(model.robot.gear)
    return Simulated(model, compiled, gear)


def _refitted(model: CorrectedModel) -> Robot:
    """Refitted inertials of possible bodies, in the way of `native_robot`."""
    nominal = np.asarray(model.robot.phi)
    phi = consistent(model.phi_refit, nominal)
    phi = np.where(np.array([is_body(p) for p in nominal])[:, None], phi, nominal)
    return with_phi(model.robot, jnp.asarray(phi))
