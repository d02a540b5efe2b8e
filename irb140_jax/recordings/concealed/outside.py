"""Physics that is in no library: what a diagnosis must flag and locate, and must not give a wrong name.

Unlike in nature: in the drive, in the gears, between joints, in what the arm carries, in time.  Those of `TUNED_ON`
may be looked at while a detector is built; the others, `JUDGED_ON`, only judge it.
"""

import math

import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey


class _OnOneJoint(Hidden):
    """A torque on one joint that depends on what all joints do now: size x `pattern(q, qd, tau, t)`.

    `other` is another joint involved; `fast`, `middle` and `span` (shape (n,) each) and `level` scale the pattern.
    """

    units = {"size": "{tau}", "other": "1", "draw": "1"}
    amplitudes = ("size",)

    @classmethod
    def drawn(cls, joints, share, survey, rng):
        n = survey.q.shape[1]
        others = [i for i in range(n) if i != joints[0]] or [joints[0]]
        unit = cls(joints, {"size": 1.0, "other": float(rng.choice(others)), "draw": rng.uniform()})
        unit.look(survey)
        out = cls(joints, {**unit.parameters, "size": share / max(unit.share(survey), 1e-300)})
        out.look(survey)
        return out

    def look(self, survey: Survey):
        """Take the scales of the pattern from what the arm does."""
        self.fast = np.abs(survey.qd).max(axis=0)
        self.middle, self.span = survey.q.mean(axis=0), np.ptp(survey.q, axis=0)
        self.level, self.end = survey.rms(self.joint), float(survey.t.max())

    @property
    def other(self) -> int:
        """The other joint."""
        return int(self.parameters["other"])

    def pattern(self, q, qd, tau, t):
        """Torque that the drive must give in addition, over `size`; arguments (..., n) and t (...)."""
        raise NotImplementedError

    def torque(self, survey: Survey):
        pattern = self.pattern(survey.q, survey.qd, survey.load, survey.t)
        return self.on_joint(survey, self.parameters["size"] * pattern)

    def act(self, plant: Plant):
        pattern = self.pattern(plant.q, plant.qd, plant.torque, plant.t)
        plant.torque[self.joint] -= self.parameters["size"] * float(pattern)


class MagneticSaturation(_OnOneJoint):
    """Iron that saturates: the more torque is asked, the smaller the share that comes, |tau| tau/(1 + |tau|)."""

    slug = "magnetic_saturation"

    def pattern(self, q, qd, tau, t):
        tau = tau[..., self.joint] / self.level
        return np.abs(tau) * tau / (1.0 + np.abs(tau))


class BackEmfSag(_OnOneJoint):
    """A drive that gives the less of what is asked, the faster it turns: |qd| tau."""

    slug = "back_emf_sag"

    def pattern(self, q, qd, tau, t):
        return np.abs(qd[..., self.joint]) / self.fast[self.joint] * tau[..., self.joint] / self.level


class DeadZone(_OnOneJoint):
    """A drive that does nothing below a threshold of torque, and is that much short above: sign(tau), rounded off."""

    slug = "drive_dead_zone"

    def pattern(self, q, qd, tau, t):
        return np.clip(tau[..., self.joint] / (0.15 * self.level), -1.0, 1.0)


class CrossDamping(_OnOneJoint):
    """Seals squeezed by a neighbour's speed: |qd_other| sign(qd)."""

    slug = "cross_damping"

    def pattern(self, q, qd, tau, t):
        speed = np.abs(qd[..., self.other]) / self.fast[self.other]
        return speed * np.tanh(qd[..., self.joint] / (0.02 * self.fast[self.joint]))


class CableOverTwoJoints(_OnOneJoint):
    """A cable whose pull depends on two joints together: sin(3 x_j + 3 x_other), x from -1 to 1."""

    slug = "cable_over_two_joints"

    def pattern(self, q, qd, tau, t):
        x = 2.0 * (q - self.middle) / self.span
        return np.sin(3.0 * x[..., self.joint] + 3.0 * x[..., self.other] + 2.0 * math.pi * self.parameters["draw"])


class RotorGyroscope(_OnOneJoint):
    """A spinning rotor turned by a neighbour: qd_j qd_other, which no rigid link of the model makes."""

    slug = "rotor_gyroscope"

    def pattern(self, q, qd, tau, t):
        return (qd[..., self.joint] / self.fast[self.joint]) * (qd[..., self.other] / self.fast[self.other])


class Hum(_OnOneJoint):
    """A machine nearby: a sinusoid in time, 0.35 to 0.9 Hz."""

    slug = "hum"

    def pattern(self, q, qd, tau, t):
        return np.sin(2.0 * math.pi * (0.35 + 0.55 * self.parameters["draw"]) * t)


class DriftingZero(_OnOneJoint):
    """A current sensor whose zero wanders with time: rises, then falls."""

    slug = "drifting_zero"

    def pattern(self, q, qd, tau, t):
        s = np.asarray(t) / self.end
        return np.sin(2.0 * math.pi * (0.8 + 0.5 * self.parameters["draw"]) * s) * (0.4 + s)


class Slosh(_OnOneJoint):
    """Liquid in a tank: an oscillator of 1.2 to 2.4 Hz shaken by the joint's acceleration pushes back."""

    slug = "slosh"
    DAMPING = 0.08

    def _step(self, x, v, qdd, dt):
        omega = 2.0 * math.pi * (1.2 + 1.2 * self.parameters["draw"])
        v += dt * (qdd - 2.0 * self.DAMPING * omega * v - omega**2 * x)
        return x + dt * v, v, omega**2 * (x + dt * v)

    def torque(self, survey: Survey):
        torque, x, v = np.zeros(len(survey.t)), 0.0, 0.0
        for k in range(1, len(torque)):
            if survey.recording[k] != survey.recording[k - 1]:
                x = v = 0.0
                continue
            x, v, torque[k] = self._step(x, v, survey.qdd[k, self.joint], survey.t[k] - survey.t[k - 1])
        return self.on_joint(survey, self.parameters["size"] * torque)

    def begin(self, plant: Plant):
        self._state = (0.0, 0.0, 0.0)
        self._before = 0.0

    def act(self, plant: Plant):
        qd = float(plant.qd[self.joint])
        x, v, _ = self._state
        self._state = self._step(x, v, (qd - self._before) / plant.dt, plant.dt)
        self._before = qd
        plant.torque[self.joint] -= self.parameters["size"] * self._state[2]


class TorqueCrosstalk(_OnOneJoint):
    """A log that holds part of another joint's torque."""

    slug = "torque_crosstalk"

    def pattern(self, q, qd, tau, t):
        return tau[..., self.other] / self.level


class SnapThrough(_OnOneJoint):
    """A latch: the pull changes sign within a twentieth of the range."""

    slug = "snap_through"

    def pattern(self, q, qd, tau, t):
        centre = self.middle[self.joint] + (self.parameters["draw"] - 0.5) * 0.4 * self.span[self.joint]
        x = (q[..., self.joint] - centre) / (0.05 * self.span[self.joint])
        return x * np.exp(0.5 - 0.5 * x**2)


class LeakingTank(_OnOneJoint):
    """What the arm carries grows lighter as time goes: the joint's own torque, more and more of it missing."""

    slug = "leaking_tank"

    def pattern(self, q, qd, tau, t):
        return tau[..., self.joint] / self.level * (np.asarray(t) / self.end) ** 2


TUNED_ON: tuple[type[Hidden], ...] = (MagneticSaturation, CrossDamping, RotorGyroscope, Hum, Slosh, SnapThrough)
JUDGED_ON: tuple[type[Hidden], ...] = (
    BackEmfSag, DeadZone, CableOverTwoJoints, DriftingZero, TorqueCrosstalk, LeakingTank,
)  # fmt: skip
OUTSIDE: dict[str, type[Hidden]] = {kind.slug: kind for kind in (*TUNED_ON, *JUDGED_ON)}
