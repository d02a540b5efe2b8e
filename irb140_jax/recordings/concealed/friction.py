"""Hidden friction.  Dry friction is MuJoCo's own `frictionloss`, its level set anew at every step.

MuJoCo solves for the friction force as a constraint, so a joint can truly stick; a law that depends on speed, load,
position or direction only has to say how high the level is.
"""

from typing import ClassVar

import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey


class Coulomb(Hidden):
    """Fc sign(qd)."""

    slug: ClassVar[str] = "coulomb_friction"
    units: ClassVar[dict[str, str]] = {"coulomb": "{tau}"}
    amplitudes: ClassVar[tuple[str, ...]] = ("coulomb",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"coulomb": 1.0}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["coulomb"] * np.sign(survey.qd[:, self.joint]))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.parameters["coulomb"]


class Viscous(Hidden):
    """Fv qd, MuJoCo's own joint damping."""

    slug: ClassVar[str] = "viscous_friction"
    units: ClassVar[dict[str, str]] = {"viscous": "{tau} s/{q}"}
    amplitudes: ClassVar[tuple[str, ...]] = ("viscous",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"viscous": 1.0}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["viscous"] * survey.qd[:, self.joint])

    def install(self, model, dofs):
        model.dof_damping[dofs[self.joint]] += self.parameters["viscous"]


class Asymmetric(Hidden):
    """Fc+ while qd > 0, Fc- while qd < 0."""

    slug: ClassVar[str] = "asymmetric_friction"
    units: ClassVar[dict[str, str]] = {"coulomb_pos": "{tau}", "coulomb_neg": "{tau}"}
    amplitudes: ClassVar[tuple[str, ...]] = ("coulomb_pos", "coulomb_neg")

    @classmethod
    def shapes(cls, joints, survey, rng):
        # Unequal enough to be worth a name: 1.35 to 2.2 times as much in one direction as in the other.
        ratio = rng.uniform(1.35, 2.2)
        up, down = (ratio, 1.0) if rng.random() < 0.5 else (1.0, ratio)
        return {"coulomb_pos": up, "coulomb_neg": down}

    def level(self, qd):
        return np.where(qd > 0.0, self.parameters["coulomb_pos"], self.parameters["coulomb_neg"])

    def torque(self, survey: Survey):
        qd = survey.qd[:, self.joint]
        return self.on_joint(survey, self.level(qd) * np.sign(qd))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.level(plant.qd[self.joint])


class Stribeck(Hidden):
    """(Fc + (Fs - Fc) exp(-(qd/vs)^2)) sign(qd)."""

    slug: ClassVar[str] = "stribeck_friction"
    units: ClassVar[dict[str, str]] = {"coulomb": "{tau}", "static": "{tau}", "stribeck_velocity": "{q}/s"}
    amplitudes: ClassVar[tuple[str, ...]] = ("coulomb", "static")

    @classmethod
    def shapes(cls, joints, survey, rng):
        speed = survey.peak(joints[0]) * rng.uniform(0.02, 0.2)
        return {"coulomb": 1.0, "static": rng.uniform(1.35, 2.0), "stribeck_velocity": speed}

    def level(self, qd):
        p = self.parameters
        return p["coulomb"] + (p["static"] - p["coulomb"]) * np.exp(-((qd / p["stribeck_velocity"]) ** 2))

    def torque(self, survey: Survey):
        qd = survey.qd[:, self.joint]
        return self.on_joint(survey, self.level(qd) * np.sign(qd))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.level(plant.qd[self.joint])


class LoadDependent(Hidden):
    """(Fc + mu |transmitted torque|) sign(qd); transmitted: what carries and accelerates links and rotor."""

    slug: ClassVar[str] = "load_dependent_friction"
    units: ClassVar[dict[str, str]] = {"load_coefficient": "1", "coulomb": "{tau}"}
    amplitudes: ClassVar[tuple[str, ...]] = ("load_coefficient", "coulomb")

    @classmethod
    def shapes(cls, joints, survey, rng):
        # The load's part is 1 to 3 times the constant part, on average.
        mean = float(np.mean(np.abs(survey.load[:, joints[0]])))
        return {"load_coefficient": 1.0, "coulomb": mean / rng.uniform(1.0, 3.0)}

    def torque(self, survey: Survey):
        level = self.parameters["coulomb"] + self.parameters["load_coefficient"] * np.abs(survey.load[:, self.joint])
        return self.on_joint(survey, level * np.sign(survey.qd[:, self.joint]))

    def act(self, plant: Plant):
        p, j = self.parameters, self.joint
        plant.friction[j] += p["coulomb"] + p["load_coefficient"] * abs(plant.load[j])
