"""The corrected model for a MuJoCo simulation of the user's own, laws included that MJCF has no numbers for."""

import pathlib
from collections.abc import Sequence

import mujoco
import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.mismatch.corrected.native import native_mjcf, native_robot
from irb140_jax.mismatch.motion.laws import law_of, without_those
from irb140_jax.mismatch.output.store import load_model
from irb140_jax.oracle.rollout import frictionless, joint_load


class CorrectedMujoco:
    """corrected.xml, and friction and servo laws that it can't hold.

    Attributes:
        model: The file's model; what `act` sets is not in it.  For a scene, attach its bodies to a `MjSpec` of yours.
    """

    def __init__(self, folder: str | pathlib.Path, effects: Sequence[Effect] = ()):
        """Read a diagnosis.

        Args:
            folder: Where it was saved.
            effects: What `DiagnoseConfig.effects` had beyond the catalogue.

        Raises:
            InputError: The folder holds no readable diagnosis.
        """
        corrected = load_model(folder, effects)
        bare = without_those(corrected)
        self.model = mujoco.MjModel.from_xml_string(native_mjcf(bare))
        gear = np.asarray(native_robot(bare).gear) / np.asarray(corrected.robot.gear)
        self._law = law_of([corrected], [corrected.drive], [gear], np.zeros(1))
        self._own, self._bare = self.model.dof_frictionloss.copy(), frictionless(self.model)
        self._inverse = mujoco.MjData(self._bare)
        self._servos = corrected.drive is not None

    def act(self, data: mujoco.MjData) -> None:
        """Set the friction of `model` and `data.qfrc_applied` to what the laws are at the state in `data`.

        Before a step of the simulation, every 5 ms at least.  Torques of your own on the joints are to be added to
        `data.qfrc_applied` after it.
        """
        if self._law is None:
            return
        state = np.concatenate([[data.time], data.qpos, data.qvel])
        load = joint_load(self._bare, self._inverse, state, data.qacc)
        control = data.ctrl if self._servos else np.zeros(self.model.nv)
        level, torque = self._law(*(np.asarray(x)[None] for x in (data.time, data.qpos, data.qvel, load, control)))
        self.model.dof_frictionloss[:] = self._own + level[0]
        data.qfrc_applied[:] = -torque[0]
