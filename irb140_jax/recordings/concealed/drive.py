"""Hidden physics of motors, gears and current sensors."""

import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey


class RotorInertia(Hidden):
    """J qdd on the joint side, MuJoCo's own armature."""

    slug = "rotor_inertia"
    units = {"inertia": "{tau} s^2/{q}"}
    amplitudes = ("inertia",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"inertia": 1.0}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["inertia"] * survey.qdd[:, self.joint])

    def install(self, model, dofs):
        model.dof_armature[dofs[self.joint]] += self.parameters["inertia"]


class TorqueOffset(Hidden):
    """A constant in the logged torque which the arm doesn't feel."""

    slug = "torque_offset"
    units = {"offset": "{tau}"}
    amplitudes = ("offset",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"offset": rng.choice([-1.0, 1.0])}

    def torque(self, survey: Survey):
        return self.on_joint(survey, np.full(len(survey.t), self.parameters["offset"]))

    def act(self, plant: Plant):
        plant.torque[self.joint] -= self.parameters["offset"]


class TorqueGain(Hidden):
    """Real torque = gain x logged torque; the log holds (1/gain - 1) x real torque too much."""

    slug = "torque_gain"
    units = {"gain": "1"}
    amplitudes = ()

    @classmethod
    def drawn(cls, joints, share, survey, rng):
        return cls(joints, {"gain": 1.0 / (1.0 + share * rng.choice([-1.0, 1.0]))})

    def torque(self, survey: Survey):
        return self.on_joint(survey, (1.0 / self.parameters["gain"] - 1.0) * survey.tau[:, self.joint])

    def act(self, plant: Plant):
        plant.torque[self.joint] *= self.parameters["gain"]


class TransmissionCoupling(Hidden):
    """Friction on the relative speed v = qd_i + s qd_j of two joints: viscous v on joint i and s times that on j."""

    slug = "transmission_coupling"
    units = {"viscous": "{tau} s/{q}", "sign": "1"}
    amplitudes = ("viscous",)
    joints_acted_on = 2

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"viscous": 1.0, "sign": rng.choice([-1.0, 1.0])}

    def torque(self, survey: Survey):
        i, j = self.joints
        sign, torque = self.parameters["sign"], np.zeros_like(survey.tau)
        torque[:, i] = self.parameters["viscous"] * (survey.qd[:, i] + sign * survey.qd[:, j])
        torque[:, j] = sign * torque[:, i]
        return torque

    def act(self, plant: Plant):
        i, j = self.joints
        sign = self.parameters["sign"]
        drag = self.parameters["viscous"] * (plant.qd[i] + sign * plant.qd[j])
        plant.torque[i] -= drag
        plant.torque[j] -= sign * drag
