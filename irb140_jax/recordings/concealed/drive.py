"""Hidden physics of motors, current sensors and the log: what the torque in the log is not."""

import math

import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Log, Plant, Survey


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


class TorqueRipple(Hidden):
    """A sin(2 pi n q + phase): cogging or gear mesh, at 3 to 25 Hz where the joint is fastest."""

    slug = "torque_ripple"
    units = {"amplitude": "{tau}", "cycles_per_rad": "1/{q}", "phase": "rad"}
    amplitudes = ("amplitude",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        cycles = rng.uniform(3.0, 25.0) / survey.peak(joints[0])
        return {"amplitude": 1.0, "cycles_per_rad": cycles, "phase": rng.uniform(-math.pi, math.pi)}

    def ripple(self, q):
        p = self.parameters
        return p["amplitude"] * np.sin(2.0 * math.pi * p["cycles_per_rad"] * q + p["phase"])

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.ripple(survey.q[:, self.joint]))

    def act(self, plant: Plant):
        plant.torque[self.joint] -= self.ripple(plant.q[self.joint])


class ActuatorLag(Hidden):
    """T d(real)/dt = logged - real; at most 4 ms, as a slower drive would not hold this controller stable."""

    slug = "actuator_lag"
    units = {"time_constant": "s"}
    amplitudes = ("time_constant",)
    largest = {"time_constant": 4e-3}

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"time_constant": 1e-3}

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.parameters["time_constant"] * survey.rate_of(survey.tau[:, self.joint]))

    def begin(self, plant: Plant):
        self._before: tuple[float, float] | None = None
        # By the trapezoidal rule, so that it lags by the time constant whatever the engine's step.
        self._step = plant.dt / (2.0 * self.parameters["time_constant"] + plant.dt)

    def act(self, plant: Plant):
        logged = plant.torque[self.joint]
        logged_before, real = self._before or (logged, logged)
        real += self._step * (logged + logged_before - 2.0 * real)
        self._before = (logged, real)
        plant.torque[self.joint] = real


class TimeDelay(Hidden):
    """Positions are logged late: q_logged(t) = q(t - delay), on all joints; at most 12 ms."""

    slug = "time_delay"
    units = {"delay": "s"}
    amplitudes = ("delay",)
    largest = {"delay": 12e-3}
    joints_acted_on = 0

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"delay": 1e-3}

    def torque(self, survey: Survey):
        return self.parameters["delay"] * survey.rate_of(survey.tau)

    def measured(self, log: Log):
        if self.parameters["delay"] == 0.0:
            return log
        before = log.t - self.parameters["delay"]
        late = lambda x: np.stack([np.interp(before, log.t, column) for column in x.T], axis=1)  # noqa: E731
        return log._replace(q=late(log.q), qd=late(log.qd), qdd=late(log.qdd))
