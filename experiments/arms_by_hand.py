"""Arms, loops and physics that share nothing with this library: MJCF written by hand, laws of MuJoCo itself.

    python experiments/arms_by_hand.py                    # cases 0 to 71, one or two effects, clean logs
    python experiments/arms_by_hand.py rough              # cases 0 to 47, friction everywhere and one more, rough logs
    python experiments/arms_by_hand.py --first 72 --last 107
    python experiments/arms_by_hand.py --table            # docs/arms-by-hand.md from what is there

`experiments/trials.py` hides physics by this library's own simulation of concealed effects.  A mistake in what a law
means could be in both.  Here friction is MuJoCo's `frictionloss`, viscosity its `damping`, a rotor its `armature`, a
spring its `stiffness`, a tilt its `gravity`, a payload a heavier last body; what MuJoCo has not (ripple, lag, delay) is
a line of NumPy.  Computed torque on an arm whose inertials are 5 % wrong; two recordings of 15 s of a sum of sines, or
three rough ones of 20 s: sines, point to point, slow sines.

Cases are appended to results/arms_by_hand_*.jsonl as they are done, so an interrupted run goes on where it stopped.
"""

import dataclasses
import json
import pathlib
from collections.abc import Callable
from typing import Literal

import mujoco
import numpy as np
import scipy.signal
import tyro

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot, robot_from_model

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "arms-by-hand.md"
STEP, EVERY = 0.0005, 4  # [s], steps a logged sample

OPENING = """# Arms and physics by hand

Written by `experiments/arms_by_hand.py` from `results/arms_by_hand_*.jsonl`; don't edit. Six arms (a pendulum, two
links, SCARA, gantry, cylindrical, seven joints) whose MJCF, control and hidden physics are written in that script:
MuJoCo's own `frictionloss`, `damping`, `armature`, `stiffness` and `gravity` where it has the physics. Inertials 5 %
wrong, two recordings of 15 s that begin and end in motion, positions with 1e-5 of noise, torques with 1 %; effects of
6 to 25 % of the joint's torque, inertials as they are; delays of 6 to 22 ms, lags of 15 to 60 ms, zeros off by 0.02 to
0.06, payloads of 0.3 to 1 of the last link. Nothing is left out for being invisible: a zero of a vertical slide, or a
gain where nothing but inertia acts, can't be seen by anyone.

## One or two laws, a clean log
"""
OPENING_ROUGH = """## Friction on every joint, a rough log, and one more law beneath

The same arms with MuJoCo's `frictionloss` (15 % of the joint's torque, give or take 40 %) and `damping` (10 %) on every
joint; one more law of 6 to 25 % beneath, in five of six cases; three recordings of 20 s: sines, point to point, sines
at a third of the speed. Encoders of 17 bits (slides 5 um), 2 % of coloured torque noise with spikes, uneven
samples, lost ones, gaps of 20 ms.
"""
ARMS = {
    "pendulum": """<body pos="0 0 1"><joint name="swing" axis="0 1 0" range="-3 3" armature=".02"/>
<geom type="capsule" fromto="0 0 0 0 0 -.5" size=".03" density="2700"/></body>""",
    "two": """<body pos="0 0 1"><joint name="upper" axis="0 1 0" range="-2.8 2.8" armature=".05"/>
<geom type="capsule" fromto="0 0 0 0 0 -.4" size=".04" density="2700"/>
<body pos="0 0 -.4"><joint name="lower" axis="0 1 0" range="-2.5 2.5" armature=".02"/>
<geom type="capsule" fromto="0 0 0 0 0 -.35" size=".03" density="2700"/></body></body>""",
    "scara": """<body pos="0 0 .3"><joint name="shoulder" axis="0 0 1" range="-2.2 2.2" armature=".05"/>
<geom type="capsule" fromto="0 0 0 .25 0 0" size=".05" density="2500"/>
<body pos=".25 0 0"><joint name="elbow" axis="0 0 1" range="-2.4 2.4" armature=".03"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".04" density="2500"/>
<body pos=".2 0 0"><joint name="lift" type="slide" axis="0 0 -1" range="0 .2" armature="1.5"/>
<geom type="cylinder" size=".012 .15" density="7800"/>
<body pos="0 0 -.15"><joint name="spin" axis="0 0 1" range="-3 3" armature=".004"/>
<geom type="box" size=".04 .02 .02" pos=".01 .005 0" density="2700"/></body></body></body></body>""",
    "gantry": """<body pos="0 0 1"><joint name="x" type="slide" axis="1 0 0" range="-.5 .5" armature="2"/>
<geom type="box" size=".3 .05 .05" density="1500"/>
<body><joint name="y" type="slide" axis="0 1 0" range="-.4 .4" armature="1"/>
<geom type="box" size=".08 .08 .08" density="1500"/>
<body><joint name="z" type="slide" axis="0 0 1" range="-.3 .3" armature="1"/>
<geom type="box" size=".03 .03 .25" density="2700"/></body></body></body>""",
    "cylindrical": """<body><joint name="turn" axis="0 0 1" range="-2.5 2.5" armature=".3"/>
<geom type="cylinder" size=".08 .4" pos="0 0 .4" density="1500"/>
<body pos="0 0 .3"><joint name="rise" type="slide" axis="0 0 1" range="0 .4" armature="2"/>
<geom type="box" size=".1 .08 .08" density="2000"/>
<body><joint name="reach" type="slide" axis="1 0 0" range="0 .35" armature="1"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" density="2700"/>
<body pos=".4 0 0"><joint name="wrist" axis="0 1 0" range="-1.8 1.8" armature=".01"/>
<geom type="capsule" fromto="0 0 0 .15 0 .02" size=".025" density="2700"/></body></body></body></body>""",
    "seven": """<body pos="0 0 .16"><joint name="a1" axis="0 0 1" range="-2.9 2.9" armature=".4"/>
<geom type="capsule" fromto="0 -.02 0 0 -.01 .2" size=".06" density="1800"/>
<body pos="0 0 .2"><joint name="a2" axis="0 1 0" range="-2 2" armature=".4"/>
<geom type="capsule" fromto="0 .03 0 0 .02 .2" size=".06" density="1800"/>
<body pos="0 0 .2"><joint name="a3" axis="0 0 1" range="-2.9 2.9" armature=".25"/>
<geom type="capsule" fromto="0 .02 0 .01 .02 .2" size=".05" density="1800"/>
<body pos="0 0 .2"><joint name="a4" axis="0 -1 0" range="-2 2" armature=".25"/>
<geom type="capsule" fromto="0 0 0 0 .02 .2" size=".05" density="1800"/>
<body pos="0 0 .2"><joint name="a5" axis="0 0 1" range="-2.9 2.9" armature=".1"/>
<geom type="capsule" fromto="0 .01 0 0 .03 .19" size=".045" density="1800"/>
<body pos="0 0 .2"><joint name="a6" axis="0 1 0" range="-2 2" armature=".08"/>
<geom type="capsule" fromto="0 0 0 0 0 .06" size=".045" density="1800"/>
<body pos="0 0 .08"><joint name="a7" axis="0 0 1" range="-3 3" armature=".03"/>
<geom type="box" size=".06 .03 .04" pos=".03 .01 .04" density="1800"/>
</body></body></body></body></body></body></body>""",
}


@dataclasses.dataclass
class Sizes:
    """What a joint does along a motion of the unaltered arm, RMS of each, shape (n,)."""

    tau: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    spread: np.ndarray


@dataclasses.dataclass
class Plant:
    """The true arm and what stands between the logged torque and its joints.

    Attributes:
        model: Of MuJoCo.
        forces: Laws (t, q, qd, logged torque) -> torque on the joints.
        drive: Logged torque to the torque that the motor makes, step by step.
        log: Arrays t, q, tau -> those that are logged.
    """

    model: mujoco.MjModel
    forces: list[Callable]
    drive: list[Callable]
    log: list[Callable]


def spec_of(arm: str) -> mujoco.MjSpec:
    """An arm, without contacts, with motors nowhere: torques are applied."""
    xml = (
        '<mujoco><compiler angle="radian" inertiafromgeom="true"/>'
        f'<option timestep="{STEP}" integrator="implicitfast"/><default><geom contype="0" conaffinity="0"/></default>'
        f"<worldbody>{ARMS[arm]}</worldbody></mujoco>"
    )
    return mujoco.MjSpec.from_string(xml)


# Each law: what it alters, given the plant, a joint, the torque that it may have [N m or N], sizes and random numbers;
# and its true parameters.


def coulomb(plant, j, torque, sizes, rng):
    plant.model.dof_frictionloss[j] += torque
    return {"coulomb": torque}


def viscous(plant, j, torque, sizes, rng):
    plant.model.dof_damping[j] += torque / sizes.qd[j]
    return {"viscous": torque / sizes.qd[j]}


def rotor(plant, j, torque, sizes, rng):
    plant.model.dof_armature[j] += torque / sizes.qdd[j]
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
    mean, shift = (forth + back) / 2.0, (forth - back) / 2.0
    plant.model.dof_frictionloss[j] += mean
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -shift)
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

    plant.model.dof_frictionloss[j] += torque
    plant.forces.append(law)
    return {"coulomb": torque, "static": torque + top}


def uneven(plant, j, torque, sizes, rng):
    n, phase, still = (
        rng.uniform(1.0, 6.0) / max(sizes.spread[j], 0.05),
        rng.uniform(0.0, 2.0 * np.pi),
        0.01 * sizes.qd[j],
    )
    plant.model.dof_frictionloss[j] += torque

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
    state = np.full(plant.model.nv, np.nan)

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
    "nonlinear_viscous_friction": "viscous_friction",
}  # fmt: skip
EVERYWHERE = ("gravity_tilt", "payload", "time_delay")


def wrong(model: mujoco.MjModel, rng: np.random.Generator) -> None:
    """Every body's mass, centre and moments of inertia, 5 % wrong."""
    for b in range(1, model.nbody):
        grown = 1.0 + 0.05 * rng.normal()
        radius = np.sqrt(model.body_inertia[b].sum() / 2.0 / model.body_mass[b])
        model.body_mass[b] *= grown
        model.body_inertia[b] *= grown * (1.0 + 0.05 * rng.normal() + 0.01 * rng.normal(size=3))
        model.body_ipos[b] += 0.05 * radius * rng.normal(size=3)


def sines(model: mujoco.MjModel, rng: np.random.Generator, slower: float = 1.0) -> Callable:
    """Motion t -> (q, qd, qdd): four sines on each joint, that begin and end as they please."""
    low, high = model.jnt_range.T
    middle, reach = (low + high) / 2.0, 0.35 * (high - low)
    rate = 2.0 * np.pi * rng.uniform(0.1, 0.7, (4, model.nv)) / slower
    phase = rng.uniform(0.0, 2.0 * np.pi, (4, model.nv))
    wave = lambda f, t, power: reach * np.mean(f(rate * t + phase) * rate**power, axis=0)  # noqa: E731
    return lambda t: (middle + wave(np.sin, t, 0), wave(np.cos, t, 1), -wave(np.sin, t, 2))


def slow_sines(model: mujoco.MjModel, rng: np.random.Generator) -> Callable:
    """The same at a third of the speed."""
    return sines(model, rng, 3.0)


def point_to_point(model: mujoco.MjModel, rng: np.random.Generator) -> Callable:
    """Motion t -> (q, qd, qdd): from pose to pose in 1 to 2 s of fifth order, with 0.3 s of rest at each."""
    low, high = model.jnt_range.T
    poses = (low + high) / 2.0 + rng.uniform(-0.35, 0.35, (40, model.nv)) * (high - low)
    ends = np.cumsum(rng.uniform(1.3, 2.3, 40))

    def motion(t):
        i = int(np.searchsorted(ends, t))
        began = ends[i - 1] if i else 0.0
        T, step = ends[i] - began - 0.3, poses[i + 1] - poses[i]
        u = min((t - began) / T, 1.0)
        return (
            poses[i] + step * (10 * u**3 - 15 * u**4 + 6 * u**5),
            step * (30 * u**2 - 60 * u**3 + 30 * u**4) / T,
            step * (60 * u - 180 * u**2 + 120 * u**3) / T**2,
        )

    return motion


def clean(t, q, tau, slide, rng):
    """What a good logger keeps: every 2 ms, positions with 1e-5 of noise, torques with 1 % of their RMS."""
    t, q, tau = t[::EVERY], q[::EVERY], tau[::EVERY]
    tau = tau + 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    return t, q + 1e-5 * rng.normal(size=q.shape), tau


def rough(t, q, tau, slide, rng):
    """What a poor one keeps: encoders of 17 bits (5 um), coloured noise of 2 %, spikes, uneven samples, gaps."""
    at = np.arange(EVERY, len(t) - EVERY, EVERY) + rng.integers(-1, 2, (len(t) - 1) // EVERY - 1)
    lost = rng.random(len(at)) < 0.01
    for begin in rng.integers(0, len(at), 4):
        lost[begin : begin + 10] = True
    t, q, tau = t[at[~lost]], q[at[~lost]], tau[at[~lost]]
    unit = np.where(slide, 5e-6, 2.0 * np.pi / 2**17)
    noise = scipy.signal.lfilter([np.sqrt(1.0 - 0.6**2)], [1.0, -0.6], rng.normal(size=tau.shape), axis=0)
    noise += np.where(rng.random(tau.shape) < 0.002, rng.normal(size=tau.shape) * 20.0, 0.0)
    return t, np.round(q / unit) * unit, tau + 0.02 * np.sqrt(np.mean(tau**2, axis=0)) * noise


def recorded(
    nominal: mujoco.MjModel, plant: Plant, rng: np.random.Generator, motion: Callable, logger: Callable
) -> Recording:
    """Computed torque and proportional-derivative feedback on what the encoders say, at every step."""
    n, true = nominal.nv, mujoco.MjData(plant.model)
    model, torque = mujoco.MjData(nominal), np.zeros(n)
    wanted = motion(nominal, rng)
    true.qpos[:], true.qvel[:], _ = wanted(0.0)
    q, tau, t = [], [], np.arange(0.0, SECONDS[logger], STEP)
    for now in t:
        at, speed, bend = wanted(now)
        model.qpos[:], model.qvel[:] = true.qpos, true.qvel
        mujoco.mj_forward(nominal, model)
        mujoco.mj_mulM(nominal, model, torque, bend + 40.0 * (speed - true.qvel) + 400.0 * (at - true.qpos))
        torque += model.qfrc_bias
        made = torque.copy()
        for drive in plant.drive:
            made = drive(made)
        for force in plant.forces:
            made = made + force(now, true.qpos, true.qvel, torque)
        true.qfrc_applied[:] = made
        q.append(true.qpos.copy())
        tau.append(torque.copy())
        mujoco.mj_step(plant.model, true)
    q, tau = np.array(q), np.array(tau)
    for log in plant.log:
        t, q, tau = log(t, q, tau)
    t, q, tau = logger(t, q, tau, nominal.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE, rng)
    return Recording(t - t[0], q, tau, tuple(nominal.joint(i).name for i in range(n)), source="by hand")


def untouched(t, q, tau, slide, rng):
    """Everything, to learn sizes from."""
    return t, q, tau


SECONDS = {clean: 15.0, rough: 20.0, untouched: 15.0}
MOTIONS = {clean: (sines, sines), rough: (sines, point_to_point, slow_sines)}


def sizes_of(arm: str) -> Sizes:
    """How large things are along a motion of the unaltered arm."""
    model = spec_of(arm).compile()
    r = recorded(model, Plant(model, [], [], []), np.random.default_rng(0), sines, untouched)
    qd = np.gradient(r.q, r.t, axis=0)
    rms = lambda x: np.sqrt(np.mean(x**2, axis=0))  # noqa: E731
    return Sizes(rms(r.tau), rms(qd), rms(np.gradient(qd, r.t, axis=0)), np.std(r.q, axis=0))


def case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm, its nominal model, two clean recordings, and what is hidden in them: every sixth round hides nothing."""
    rng = np.random.default_rng([seed, 140])
    arm = list(ARMS)[seed % len(ARMS)]
    count = 0 if (seed // len(ARMS)) % 6 == 5 else int(rng.choice([1, 1, 2]))
    clean_laws = [slug for slug in LAWS if slug not in BENEATH_ONLY]
    return arm, *hidden(arm, [str(slug) for slug in rng.choice(clean_laws, count, replace=False)], clean, rng)


def rough_case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm with MuJoCo's friction on all its joints, three rough recordings; all but every sixth round hide more."""
    rng = np.random.default_rng([seed, 141])
    arm = list(ARMS)[seed % len(ARMS)]
    beneath = [slug for slug in LAWS if slug not in ORDINARY]
    slugs = [] if (seed // len(ARMS)) % 6 == 5 else [str(rng.choice(beneath))]
    return arm, *hidden(arm, slugs, rough, rng)


def hidden(
    arm: str, slugs: list[str], logger: Callable, rng: np.random.Generator
) -> tuple[Robot, list[Recording], list[dict]]:
    """The nominal arm, recordings of one with other inertials and these laws, and their truth."""
    sizes, nominal, true = sizes_of(arm), spec_of(arm).compile(), spec_of(arm).compile()
    wrong(true, rng)
    plant, truth = Plant(true, [], [], []), []

    def hide(slug: str, j: int, share: float) -> None:
        values = LAWS[slug](plant, j, share * sizes.tau[j], sizes, rng)
        names = [nominal.joint(i).name for i in (range(nominal.nv) if slug in EVERYWHERE else [j])]
        truth.append({"effect": slug, "joints": names, "parameters": {k: float(v) for k, v in values.items()}})

    at = [int(rng.integers(nominal.nv)) for _ in slugs]
    for slug, j in zip(slugs, at, strict=True):
        hide(slug, j, rng.uniform(0.06, 0.25))
    if logger is rough:
        instead = {(INSTEAD_OF.get(slug), j) for slug, j in zip(slugs, at, strict=True)}
        for slug, share in zip(ORDINARY, (0.15, 0.1), strict=True):
            for j in range(nominal.nv):
                if (slug, j) not in instead:
                    hide(slug, j, share * rng.uniform(0.6, 1.4))
    recordings = [recorded(nominal, plant, rng, motion, logger) for motion in MOTIONS[logger]]
    return robot_from_model(nominal, source=arm), recordings, truth


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    kind: tyro.conf.Positional[Literal["clean", "rough"]] = "clean"
    first: int = 0
    last: int | None = None
    """The last seed; 71 of the clean ones, 47 of the rough ones."""
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the page from the results that are there."""


KINDS = {"clean": (case, 71), "rough": (rough_case, 47)}


def judged(kind: str, seed: int) -> dict:
    arm, robot, recordings, truth = KINDS[kind][0](seed)
    d = diagnose(robot, recordings).diagnosis
    return {
        "seed": seed, "arm": arm, "truth": truth, "found": d["findings"], "unexplained": d["unexplained"],
        "verdict": d["verdict"], "fit": d["fit"], "exact": {*map(key, d["findings"])} == {*map(key, truth)},
        "not_testable": [x for x in d["not_testable"] if x["effect"] in {e["effect"] for e in truth}],
    }  # fmt: skip


def key(effect: dict) -> tuple[str, ...]:
    """What it is and where."""
    return effect["effect"], *sorted(effect["joints"])


def say(items: list[dict]) -> str:
    """Effects with their joints, in words."""
    return "; ".join(f"{i['effect']} on {', '.join(i['joints'])}" for i in items) or "nothing"


def without(items: list[dict], others: list[dict]) -> list[dict]:
    """Those that are not among the others."""
    return [i for i in items if key(i) not in {*map(key, others)}]


def table(cases: list[dict], ordinary: tuple[str, ...] = ()) -> list[str]:
    """Lines with all figures of one kind; the `ordinary` laws, which every joint has, are counted apart."""
    apart = ["ordinary friction", "named"] if ordinary else []
    heads = ["arm", "cases", "exact, nothing added", "hidden", "named", "listed as not testable", *apart]
    lines = [f"| {' | '.join([*heads, 'findings not there'])} |", "|---" * (len(heads) + 1) + "|"]
    for arm, part in [*((a, [c for c in cases if c["arm"] == a]) for a in ARMS), ("all", cases)]:
        laws = [(c, e) for c in part for e in c["truth"]]
        missed = [(c, e) for c in part for e in without(c["truth"], c["found"])]
        count = lambda pairs, usual: sum((e["effect"] in ordinary) == usual for _, e in pairs)  # noqa: E731
        listed = sum(e["effect"] in {x["effect"] for x in c["not_testable"]} for c, e in missed)
        row = [len(part), sum(c["exact"] for c in part), count(laws, False), count(laws, False) - count(missed, False)]
        row += [listed, *((count(laws, True), count(laws, True) - count(missed, True)) if ordinary else ())]
        row += [sum(len(without(c["found"], c["truth"])) for c in part)]
        lines.append(f"| {arm} | {' | '.join(map(str, row))} |")
    values = []
    for c in cases:
        found = {key(f): f["parameters"] for f in c["found"]}
        for e in c["truth"]:
            own = found.get(key(e), {})
            values += [(own[k]["value"], own[k]["std"], v) for k, v in e["parameters"].items() if k in own and v]
    error = np.median([abs(v / true - 1.0) for v, _, true in values])
    cover = np.mean([abs(v - true) <= 1.645 * std for v, std, true in values])
    nothing = [c for c in cases if all(e["effect"] in ordinary for e in c["truth"])]
    false = sum(len(without(c["found"], c["truth"])) for c in nothing)
    more = "Nothing more was hidden" if ordinary else "Nothing was hidden"
    return [
        *lines,
        "",
        f"{more} in {len(nothing)} of them; findings not there: {false}. Median error of the parameters of what",
        f"is named {100 * error:.2g} %; {100 * cover:.0f} % of their 90 % intervals cover the truth.",
        "",
        "### Every case that is not exact",
        "",
        "| case | arm | hidden | missed | added | verdict |",
        "|---|---|---|---|---|---|",
        *(
            f"| {c['seed']} | {c['arm']} | {say([e for e in c['truth'] if e['effect'] not in ordinary])} "
            f"| {say(without(c['truth'], c['found']))} | {say(without(c['found'], c['truth']))} | {c['verdict']} |"
            for c in cases
            if not c["exact"]
        ),
        "",
    ]


def read(path: pathlib.Path) -> list[dict]:
    """The cases that are done."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return sorted(map(json.loads, lines), key=lambda c: c["seed"])


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    paths = {kind: config.out / f"arms_by_hand_{kind}.jsonl" for kind in KINDS}
    done = {c["seed"] for c in read(paths[config.kind])}
    last = KINDS[config.kind][1] if config.last is None else config.last
    for seed in range(config.first, last + 1) if not config.table else ():
        if seed in done:
            continue
        c = judged(config.kind, seed)
        with paths[config.kind].open("a", encoding="utf-8") as file:
            file.write(json.dumps(c) + "\n")
        missed, added = say(without(c["truth"], c["found"])), say(without(c["found"], c["truth"]))
        mark = "ok  " if c["exact"] else f"MISS missed {missed}; added {added};"
        print(f"{mark} {seed} {c['arm']}: hidden {say(c['truth'])}; {c['verdict']}", flush=True)
    lines = []
    for kind, opening, ordinary in (("clean", OPENING, ()), ("rough", OPENING_ROUGH, ORDINARY)):
        if cases := read(paths[kind]):
            lines += [opening, *table(cases, ordinary)]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
