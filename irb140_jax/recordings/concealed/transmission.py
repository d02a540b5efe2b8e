"""Hidden physics between motor and link: a second joint on the same axis, inside the transmission.

The named joint stays on the motor's side, with the rotor's inertia, and that is where encoders and torque are; the
link moves by that joint and the inner one together.
"""

import math

import mujoco
import numpy as np

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey
from irb140_jax.recordings.concealed.plant import rigid_torque

DAMPING_RATIO = 0.05  # of the link on its transmission, the order seen in gear units


class _TwoSided(Hidden):
    """A motor side and a link side of one joint."""

    def edit(self, spec, names):
        motor = spec.joint(names[self.joint])
        link = motor.parent
        if len(link.joints) > 1:
            raise InputError(f"{self.slug}: joint {motor.name!r} shares its body with others; give each a body")
        if motor.armature <= 0.0:
            raise InputError(f"{self.slug}: joint {motor.name!r} needs an armature, the inertia on the motor's side")
        link.add_joint(
            name=self.inner_name(motor.name), type=motor.type, axis=motor.axis, pos=motor.pos, armature=0.0, damping=0.0
        )

    @staticmethod
    def inner_name(name: str) -> str:
        """Name of the joint inside the transmission."""
        return f"{name} inside"

    def begin(self, plant: Plant):
        model = plant.model
        self._joint = model.joint(self.inner_name(model.joint(int(model.dof_jntid[plant.dofs[self.joint]])).name))
        self._inner = (int(self._joint.qposadr[0]), int(self._joint.dofadr[0]))


class Elasticity(_TwoSided):
    """tau = K (q_motor - q_link); no softer than a mode of the link at 8 Hz."""

    slug = "joint_elasticity"
    units = {"stiffness": "{tau}/{q}"}
    amplitudes = ()

    @classmethod
    def drawn(cls, joints, share, survey, rng):
        inertia = link_inertia(survey, joints[0])
        reference = inertia * (2.0 * math.pi * 20.0) ** 2
        unit = cls(joints, {"stiffness": reference})
        wanted = reference * unit.share(survey) / max(share, 1e-12)
        return cls(joints, {"stiffness": max(wanted, inertia * (2.0 * math.pi * 8.0) ** 2)})

    def torque(self, survey: Survey):
        j = self.joint
        carried = survey.load[:, j] - survey.model.dof_armature[j] * survey.qdd[:, j]
        bend = carried / self.parameters["stiffness"]
        rate = survey.rate_of(bend)
        moved = [x.copy() for x in (survey.q, survey.qd, survey.qdd)]
        for x, change in zip(moved, (bend, rate, survey.rate_of(rate)), strict=True):
            x[:, j] -= change
        rotor = survey.model.dof_armature[j] * (survey.qdd[:, j] - moved[2][:, j])
        return rigid_torque(survey.model, *moved) - survey.load + self.on_joint(survey, rotor)

    def begin(self, plant: Plant):
        super().begin(plant)
        inertia = inner_inertia(plant, self._inner[1])
        self._damping = 2.0 * DAMPING_RATIO * math.sqrt(self.parameters["stiffness"] * inertia)
        plant.model.jnt_stiffness[self._joint.id] = self.parameters["stiffness"]
        plant.model.dof_damping[self._inner[1]] = self._damping
        # Bent by the load from the start, as it would be after standing still.
        plant.data.qpos[self._inner[0]] = -plant.data.qfrc_bias[self._inner[1]] / self.parameters["stiffness"]


class Backlash(_TwoSided):
    """A dead zone of full width `gap` between motor and link, hard beyond it: a mode of the link at 30 Hz.

    Its torque has no size of its own, so the gap is set directly: up to 0.02 rad (or m) times the share.
    """

    slug = "backlash"
    units = {"gap": "{q}"}
    amplitudes = ()

    @classmethod
    def drawn(cls, joints, share, survey, rng):
        return cls(joints, {"gap": 0.02 * share * rng.uniform(0.5, 1.0)})

    def torque(self, survey: Survey):
        j, moved = self.joint, survey.q.copy()
        moved[:, j] -= 0.5 * self.parameters["gap"] * np.sign(survey.load[:, j])
        return rigid_torque(survey.model, moved, survey.qd, survey.qdd) - survey.load

    def begin(self, plant: Plant):
        super().begin(plant)
        inertia = inner_inertia(plant, self._inner[1])
        self._stiffness = inertia * (2.0 * math.pi * 30.0) ** 2
        self._damping = 0.3 * inertia * 2.0 * math.pi * 30.0
        # On the flank that the load presses against, as it would be after standing still.
        load = plant.data.qfrc_bias[self._inner[1]]
        slack = math.copysign(0.5 * self.parameters["gap"], load)
        plant.data.qpos[self._inner[0]] = -slack - load / self._stiffness

    def act(self, plant: Plant):
        position, speed = plant.data.qpos[self._inner[0]], plant.data.qvel[self._inner[1]]
        beyond = position - max(-0.5 * self.parameters["gap"], min(0.5 * self.parameters["gap"], position))
        if beyond != 0.0:
            plant.inner[self._inner[1]] -= self._stiffness * beyond + self._damping * speed


def link_inertia(survey: Survey, joint: int) -> float:
    """Mean inertia about a joint of all that it carries, without the rotor [kg m^2 or kg]."""
    model, data = survey.model, mujoco.MjData(survey.model)
    values = []
    for q in survey.q[:: max(1, len(survey.q) // 20)]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        values.append(_diagonal(model, data, joint) - model.dof_armature[joint])
    return float(np.mean(values))


def inner_inertia(plant: Plant, dof: int) -> float:
    """Inertia about the joint inside the transmission, at the plant's present posture [kg m^2 or kg]."""
    mujoco.mj_forward(plant.model, plant.data)
    return _diagonal(plant.model, plant.data, dof)


def _diagonal(model: mujoco.MjModel, data: mujoco.MjData, dof: int) -> float:
    """Diagonal entry of the mass matrix."""
    unit, column = np.zeros(model.nv), np.zeros(model.nv)
    unit[dof] = 1.0
    mujoco.mj_mulM(model, data, column, unit)
    return float(column[dof])
