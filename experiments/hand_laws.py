"""Physics to hide in an arm by hand: MuJoCo's own where it has the law, else a line of NumPy.

Each law: what it alters, given the plant, a joint, the torque that it may have [N m or N], sizes and random numbers;
and its true parameters.
"""

import mujoco
import numpy as np
from hand_arms import STEP


def coulomb(plant, j, torque, sizes, rng):
    plant.model.dof_frictionloss[plant.driven[j]] += torque
    return {"coulomb": torque}


def viscous(plant, j, torque, sizes, rng):
    plant.model.dof_damping[plant.driven[j]] += torque / sizes.qd[j]
    return {"viscous": torque / sizes.qd[j]}


def rotor(plant, j, torque, sizes, rng):
    plant.model.dof_armature[plant.driven[j]] += torque / sizes.qdd[j]
    return {"inertia": torque / sizes.qdd[j]}


def spring(plant, j, torque, sizes, rng):
    rest = rng.uniform(-1.0, 1.0) * sizes.spread[j]
    plant.model.jnt_stiffness[j] = torque / sizes.spread[j]
    plant.model.qpos_spring[j] = rest
    return {"stiffness": torque / sizes.spread[j]}


def tilt(plant, j, torque, sizes, rng):
    angle, about = rng.uniform(0.02, 0.08), rng.uniform(0.0, 2.0 * np.pi)
    lean = np.array([np.sin(angle) * np.cos(about), np.sin(angle) * np.sin(about), -np.cos(angle)])
    plant.model.opt.gravity[:] = 9.81 * lean
    return {"tilt": angle}


def payload(plant, j, torque, sizes, rng):
    mass = rng.uniform(0.3, 1.0) * plant.model.body_mass[-1]
    where = plant.model.body_ipos[-1] + rng.uniform(-0.05, 0.05, 3)
    body, m0 = plant.model, plant.model.body_mass[-1]
    # A small ball, as a change of the last body's own mass, centre and inertia.
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, body.body_iquat[-1])
    R = frame.reshape(3, 3)
    com = (m0 * body.body_ipos[-1] + mass * where) / (m0 + mass)
    about = lambda m, d: m * (d @ d * np.eye(3) - np.outer(d, d))  # noqa: E731
    inertia = R @ np.diag(body.body_inertia[-1]) @ R.T + about(m0, body.body_ipos[-1] - com)
    inertia += about(mass, where - com) + 0.4 * mass * 0.02**2 * np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    body.body_mass[-1], body.body_ipos[-1], body.body_inertia[-1] = m0 + mass, com, moments
    mujoco.mju_mat2Quat(body.body_iquat[-1], axes.ravel())
    return {"mass": mass}


def gain(plant, j, torque, sizes, rng):
    value = 1.0 + rng.choice([-1.0, 1.0]) * torque / sizes.tau[j]
    plant.drive.append(lambda tau: np.where(np.arange(len(tau)) == j, value * tau, tau))
    return {"gain": value}


def offset(plant, j, torque, sizes, rng):
    value = torque * rng.choice([-1.0, 1.0])
    plant.drive.append(lambda tau: np.where(np.arange(len(tau)) == j, tau - value, tau))
    return {"offset": value}


def ripple(plant, j, torque, sizes, rng):
    n, phase = rng.uniform(2.0, 12.0) / max(sizes.spread[j], 0.05), rng.uniform(0.0, 2.0 * np.pi)
    n = n / (2.0 * np.pi)
    top = np.sqrt(2.0) * torque
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -top * np.sin(2.0 * np.pi * n * q[j] + phase))
    return {"amplitude": top, "cycles_per_rad": n}


def asymmetric(plant, j, torque, sizes, rng):
    forth, back = torque * rng.uniform(1.0, 1.5), torque * rng.uniform(0.3, 0.7)
    mean, shift, still = (forth + back) / 2.0, (forth - back) / 2.0, 0.01 * sizes.qd[j]
    plant.model.dof_frictionloss[plant.driven[j]] += mean
    # A constant torque would be an offset: what differs is friction, of which there is none to see at rest.
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -shift * abs(np.tanh(qd[j] / still)))
    return {"coulomb_pos": forth, "coulomb_neg": back}


def load(plant, j, torque, sizes, rng):
    share, base = 0.7 * torque / sizes.tau[j], 0.3 * torque
    still = 0.01 * sizes.qd[j]

    def law(t, q, qd, tau):
        # The transmitted torque is what friction leaves of the motor's: solved for friction that opposes the speed.
        along = np.sign(qd[j]) * tau[j]
        size = (base + share * along) / (1.0 + share) if along > base else (base - share * along) / (1.0 - share)
        return np.eye(len(q))[j] * -size * np.tanh(qd[j] / still)

    plant.forces.append(law)
    return {"load_coefficient": share, "coulomb": base}


def stribeck(plant, j, torque, sizes, rng):
    speed, top = rng.uniform(0.1, 0.3) * sizes.qd[j], rng.uniform(0.8, 1.5) * torque
    power, still = rng.choice([1.0, 2.0]), 0.01 * sizes.qd[j]

    def law(t, q, qd, tau):
        return np.eye(len(q))[j] * -top * np.exp(-((abs(qd[j]) / speed) ** power)) * np.tanh(qd[j] / still)

    plant.model.dof_frictionloss[plant.driven[j]] += torque
    plant.forces.append(law)
    return {"coulomb": torque, "static": torque + top}


def uneven(plant, j, torque, sizes, rng):
    n, phase, still = (
        rng.uniform(1.0, 6.0) / max(sizes.spread[j], 0.05),
        rng.uniform(0.0, 2.0 * np.pi),
        0.01 * sizes.qd[j],
    )
    plant.model.dof_frictionloss[plant.driven[j]] += torque

    def law(t, q, qd, tau):
        return np.eye(len(q))[j] * -0.6 * torque * np.sin(n * q[j] + phase) * np.tanh(qd[j] / still)

    plant.forces.append(law)
    return {}


def drag(plant, j, torque, sizes, rng):
    power = rng.choice([0.4, 2.0])
    speed = np.sqrt(2.0) * sizes.qd[j] * np.sin(np.linspace(0.0, 2.0 * np.pi, 99))
    value = torque / np.sqrt(np.mean(np.abs(speed) ** (2 * power)))
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -value * np.sign(qd[j]) * abs(qd[j]) ** power)
    return {"coefficient": value, "exponent": float(power)}


def lag(plant, j, torque, sizes, rng):
    time = rng.uniform(0.015, 0.06)
    state = np.full(len(plant.driven), np.nan)

    def law(tau):
        # Backward Euler: at low frequencies exactly `time` late.
        state[j] = tau[j] if np.isnan(state[j]) else state[j] + (tau[j] - state[j]) * STEP / (time + STEP)
        return np.where(np.arange(len(tau)) == j, state[j], tau)

    plant.drive.append(law)
    return {"time_constant": time}


def delay(plant, j, torque, sizes, rng):
    steps = int(rng.choice([-1, 1]) * rng.integers(12, 48))
    plant.log.append(lambda t, q, tau: (t[48:-48], q[48:-48], tau[48 - steps : len(t) - 48 - steps]))
    return {"delay": -steps * STEP}  # a torque that is logged late belongs to an earlier position


def zero(plant, j, torque, sizes, rng):
    value = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.06)
    plant.log.append(lambda t, q, tau: (t, q + value * (np.arange(q.shape[1]) == j), tau))
    return {"offset": value}


LAWS = {
    "coulomb_friction": coulomb, "viscous_friction": viscous, "rotor_inertia": rotor, "gravity_spring": spring,
    "gravity_tilt": tilt, "payload": payload, "torque_gain": gain, "torque_offset": offset, "torque_ripple": ripple,
    "asymmetric_friction": asymmetric, "load_dependent_friction": load, "nonlinear_viscous_friction": drag,
    "actuator_lag": lag, "time_delay": delay, "encoder_offset": zero,
    "stribeck_friction": stribeck, "position_dependent_friction": uneven,
}  # fmt: skip
ORDINARY = ("coulomb_friction", "viscous_friction")
BENEATH_ONLY = ("stribeck_friction", "position_dependent_friction")
# Which ordinary friction a law stands for on its joint.
INSTEAD_OF = {
    "asymmetric_friction": "coulomb_friction", "load_dependent_friction": "coulomb_friction",
    "stribeck_friction": "coulomb_friction", "position_dependent_friction": "coulomb_friction",
    "nonlinear_viscous_friction": "viscous_friction", "presliding_hysteresis": "coulomb_friction",
    "thermal_friction_drift": "viscous_friction",
}  # fmt: skip
EVERYWHERE = ("gravity_tilt", "payload", "time_delay")
