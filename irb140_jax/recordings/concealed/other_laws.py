"""The kinds of physics of the vocabulary under other formulas than the library's: nature does not read our files.

Each carries a name of the vocabulary, for that is what it is, and a law of its own; a diagnosis should give it the name
all the same.
"""

import math

import numpy as np

from irb140_jax.recordings.concealed import drive, friction, surroundings
from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey


class StribeckOtherExponent(friction.Stribeck):
    """(Fc + (Fs - Fc) exp(-|qd/vs|^delta)) sign(qd), delta from 0.7 to 1.5 instead of 2."""

    units = {**friction.Stribeck.units, "exponent": "1"}

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {**super().shapes(joints, survey, rng), "exponent": rng.uniform(0.7, 1.5)}

    def level(self, qd):
        p = self.parameters
        fall = np.exp(-(np.abs(qd / p["stribeck_velocity"]) ** p["exponent"]))
        return p["coulomb"] + (p["static"] - p["coulomb"]) * fall


class MaxwellSlip(Hidden):
    """Four springs in parallel, each of which slips at a force of its own (Al-Bender, Lampaert, Swevers 2005)."""

    slug = "presliding_hysteresis"
    units = {"coulomb": "{tau}", "stiffness": "{tau}/{q}"}
    amplitudes = ("coulomb", "stiffness")
    SHARES = np.array([0.4, 0.3, 0.2, 0.1])  # of the slip force; weaker springs slip later
    STRETCH = np.array([0.5, 1.0, 2.0, 4.0])  # where each slips, over the mean

    @classmethod
    def shapes(cls, joints, survey, rng):
        travel = np.ptp(survey.q[:, joints[0]])
        return {"coulomb": 1.0, "stiffness": 1.0 / (travel * rng.uniform(0.003, 0.015))}

    def begin(self, plant: Plant):
        self._forces = np.zeros(len(self.SHARES))

    def _moved(self, forces, dx):
        if self.parameters["coulomb"] == 0.0:
            return forces
        limit = self.SHARES * self.parameters["coulomb"]
        give = self.STRETCH * self.parameters["coulomb"] / self.parameters["stiffness"]
        return np.clip(forces + limit / give * dx, -limit, limit)

    def torque(self, survey: Survey):
        q, torque, forces = survey.q[:, self.joint], np.zeros(len(survey.t)), np.zeros(len(self.SHARES))
        for k in range(1, len(q)):
            fresh = survey.recording[k] != survey.recording[k - 1]
            forces = np.zeros(len(self.SHARES)) if fresh else self._moved(forces, q[k] - q[k - 1])
            torque[k] = forces.sum()
        return self.on_joint(survey, torque)

    def act(self, plant: Plant):
        self._forces = self._moved(self._forces, plant.qd[self.joint] * plant.dt)
        plant.torque[self.joint] -= self._forces.sum()


class HeatDrivenDrift(friction.ThermalDrift):
    """Viscous friction that falls with the heat it makes: dT/dt = (power/power_mean - T)/time_constant."""

    def begin(self, plant: Plant):
        self._heat = 0.0

    def _drag(self, qd, dt):
        p = self.parameters
        power = (qd / p["speed"]) ** 2
        self._heat += dt / p["time_constant"] * (power - self._heat)
        return p["viscous_cold"] * (1.0 - p["relative_drop"] * (1.0 - math.exp(-self._heat))) * qd

    units = {**friction.ThermalDrift.units, "speed": "{q}/s"}

    @classmethod
    def shapes(cls, joints, survey, rng):
        speed = float(np.sqrt(np.mean(survey.qd[:, joints[0]] ** 2)))
        return {**super().shapes(joints, survey, rng), "relative_drop": rng.uniform(0.6, 0.85), "speed": 0.7 * speed}

    def torque(self, survey: Survey):
        torque, self._heat = np.zeros(len(survey.t)), 0.0
        for k in range(1, len(torque)):
            if survey.recording[k] != survey.recording[k - 1]:
                self._heat = 0.0
            else:
                torque[k] = self._drag(survey.qd[k, self.joint], survey.t[k] - survey.t[k - 1])
        return self.on_joint(survey, torque)

    def act(self, plant: Plant):
        plant.torque[self.joint] -= self._drag(plant.qd[self.joint], plant.dt)


class TwoHarmonicRipple(drive.TorqueRipple):
    """A (sin(2 pi n q + phase) + 0.45 sin(4 pi n q + 2.2 phase))."""

    def ripple(self, q):
        p = self.parameters
        angle = 2.0 * math.pi * p["cycles_per_rad"] * q
        return p["amplitude"] * (np.sin(angle + p["phase"]) + 0.45 * np.sin(2.0 * angle + 2.2 * p["phase"]))


class HardeningSpring(surroundings.GravitySpring):
    """k (x + hardening x^3 / span^2), x = q - rest: a dress pack that pulls tight."""

    units = {**surroundings.GravitySpring.units, "hardening": "1", "span": "{q}"}

    @classmethod
    def shapes(cls, joints, survey, rng):
        span = float(np.ptp(survey.q[:, joints[0]]))
        return {**super().shapes(joints, survey, rng), "hardening": rng.uniform(0.5, 1.5), "span": span}

    def pull(self, q):
        p = self.parameters
        x = q - p["rest"]
        return p["stiffness"] * (x + p["hardening"] * x**3 / p["span"] ** 2)


class SaturatingViscous(friction.NonlinearViscous):
    """k qd/(1 + |qd|/speed): drag that levels off (Padthe et al. 2008; Waiboer et al. 2005 for the shape)."""

    units = {"coefficient": "{tau} s/{q}", "speed": "{q}/s"}

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"coefficient": 1.0, "speed": survey.peak(joints[0]) * rng.uniform(0.08, 0.25)}

    def level(self, qd):
        p = self.parameters
        return p["coefficient"] * np.abs(qd) / (1.0 + np.abs(qd) / p["speed"])


class LoadDependentOtherPower(friction.LoadDependent):
    """(Fc + mu |load|^0.8 typical^0.2) sign(qd): gear losses grow a little less than the load."""

    units = {**friction.LoadDependent.units, "typical": "{tau}"}

    @classmethod
    def shapes(cls, joints, survey, rng):
        typical = float(np.mean(np.abs(survey.load[:, joints[0]])))
        return {**super().shapes(joints, survey, rng), "typical": typical}

    def _level(self, load):
        p = self.parameters
        return p["coulomb"] + p["load_coefficient"] * np.abs(load) ** 0.8 * p["typical"] ** 0.2

    def torque(self, survey: Survey):
        return self.on_joint(survey, self._level(survey.load[:, self.joint]) * np.sign(survey.qd[:, self.joint]))

    def act(self, plant: Plant):
        plant.friction[self.joint] += float(self._level(plant.load[self.joint]))


class RoughStretchWithEdges(friction.PositionDependent):
    """Fc (1 + depth) within width of the centre, falling to Fc linearly over as much again: a worn stretch of teeth."""

    def level(self, q):
        p = self.parameters
        inside = np.clip(2.0 - np.abs(q - p["centre"]) / p["width"], 0.0, 1.0)
        return p["coulomb"] * (1.0 + p["depth"] * inside)


OTHER_LAWS: dict[str, type[Hidden]] = {
    kind.slug: kind
    for kind in (
        StribeckOtherExponent, MaxwellSlip, HeatDrivenDrift, TwoHarmonicRipple, HardeningSpring, SaturatingViscous,
        LoadDependentOtherPower, RoughStretchWithEdges,
    )
}  # fmt: skip
