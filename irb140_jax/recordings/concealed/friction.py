"""Hidden friction.  Dry friction is MuJoCo's own `frictionloss`, its level set anew at every step.

MuJoCo solves for the friction force as a constraint, so a joint can truly stick; a law that depends on speed, load,
position or direction only has to say how high the level is.
"""

import math

import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey


class Coulomb(Hidden):
    """Fc sign(qd)."""

    slug = "coulomb_friction"
    units = {"coulomb": "{tau}"}
    amplitudes = ("coulomb",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"coulomb": 1.0}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["coulomb"] * np.sign(survey.qd[:, self.joint]))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.parameters["coulomb"]


class Viscous(Hidden):
    """Fv qd, MuJoCo's own joint damping."""

    slug = "viscous_friction"
    units = {"viscous": "{tau} s/{q}"}
    amplitudes = ("viscous",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"viscous": 1.0}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["viscous"] * survey.qd[:, self.joint])

    def install(self, model, dofs):
        model.dof_damping[dofs[self.joint]] += self.parameters["viscous"]


class Asymmetric(Hidden):
    """Fc+ while qd > 0, Fc- while qd < 0."""

    slug = "asymmetric_friction"
    units = {"coulomb_pos": "{tau}", "coulomb_neg": "{tau}"}
    amplitudes = ("coulomb_pos", "coulomb_neg")

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

    slug = "stribeck_friction"
    units = {"coulomb": "{tau}", "static": "{tau}", "stribeck_velocity": "{q}/s"}
    amplitudes = ("coulomb", "static")

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

    slug = "load_dependent_friction"
    units = {"load_coefficient": "1", "coulomb": "{tau}"}
    amplitudes = ("load_coefficient", "coulomb")

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


class NonlinearViscous(Hidden):
    """k |qd|^a sign(qd): thinner (a < 1) or thicker (a > 1) with speed."""

    slug = "nonlinear_viscous_friction"
    units = {"coefficient": "{tau} (s/{q})^a", "exponent": "1"}
    amplitudes = ("coefficient",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        low, high = (0.35, 0.7) if rng.random() < 0.5 else (1.5, 2.2)
        return {"coefficient": 1.0, "exponent": rng.uniform(low, high)}

    def level(self, qd):
        return self.parameters["coefficient"] * np.abs(qd) ** self.parameters["exponent"]

    def torque(self, survey: Survey):
        qd = survey.qd[:, self.joint]
        return self.on_joint(survey, self.level(qd) * np.sign(qd))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.level(plant.qd[self.joint])


class ThermalDrift(Hidden):
    """Fv (1 - drop (1 - exp(-t/T))) qd: every recording starts cold, and warms up in seconds instead of minutes."""

    slug = "thermal_friction_drift"
    units = {"viscous_cold": "{tau} s/{q}", "relative_drop": "1", "time_constant": "s"}
    amplitudes = ("viscous_cold",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        span = float(survey.t.max())
        return {"viscous_cold": 1.0, "relative_drop": rng.uniform(0.4, 0.75),
                "time_constant": span * rng.uniform(0.15, 0.5)}

    def level(self, t):
        p = self.parameters
        return p["viscous_cold"] * (1.0 - p["relative_drop"] * (1.0 - np.exp(-t / p["time_constant"])))

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.level(survey.t) * survey.qd[:, self.joint])

    def act(self, plant: Plant):
        plant.torque[self.joint] -= self.level(plant.t) * plant.qd[self.joint]


class PositionDependent(Hidden):
    """Fc (1 + depth exp(-((q - centre)/width)^2)) sign(qd): a rough stretch of the gear."""

    slug = "position_dependent_friction"
    units = {"coulomb": "{tau}", "depth": "1", "centre": "{q}", "width": "{q}"}
    amplitudes = ("coulomb",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        q = survey.q[:, joints[0]]
        low, high = np.quantile(q, [0.2, 0.8])
        return {"coulomb": 1.0, "depth": rng.uniform(1.0, 2.5), "centre": rng.uniform(low, high),
                "width": (high - low) * rng.uniform(0.12, 0.3)}

    def level(self, q):
        p = self.parameters
        return p["coulomb"] * (1.0 + p["depth"] * np.exp(-(((q - p["centre"]) / p["width"]) ** 2)))

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.level(survey.q[:, self.joint]) * np.sign(survey.qd[:, self.joint]))

    def act(self, plant: Plant):
        plant.friction[self.joint] += self.level(plant.q[self.joint])


class Presliding(Hidden):
    """Dahl's bristles: F = stiffness z, dz/dt = qd (1 - F sign(qd) / Fc).

    Over a move dx in one direction the law has an exact solution, F -> Fc s + (F - Fc s) exp(-stiffness |dx| / Fc).
    """

    slug = "presliding_hysteresis"
    units = {"coulomb": "{tau}", "stiffness": "{tau}/{q}"}
    amplitudes = ("coulomb", "stiffness")

    @classmethod
    def shapes(cls, joints, survey, rng):
        travel = np.ptp(survey.q[:, joints[0]])
        return {"coulomb": 1.0, "stiffness": 1.0 / (travel * rng.uniform(0.002, 0.02))}

    def begin(self, plant: Plant):
        self._force = 0.0

    def _moved(self, force, dx):
        coulomb = self.parameters["coulomb"]
        if coulomb == 0.0 or dx == 0.0:
            return force
        limit = math.copysign(coulomb, dx)
        return limit + (force - limit) * math.exp(-self.parameters["stiffness"] * abs(dx) / coulomb)

    def torque(self, survey: Survey):
        q, torque, force = survey.q[:, self.joint], np.zeros(len(survey.t)), 0.0
        for k in range(1, len(q)):
            fresh = survey.recording[k] != survey.recording[k - 1]
            force = 0.0 if fresh else self._moved(force, q[k] - q[k - 1])
            torque[k] = force
        return self.on_joint(survey, torque)

    def act(self, plant: Plant):
        self._force = self._moved(self._force, plant.qd[self.joint] * plant.dt)
        plant.torque[self.joint] -= self._force
