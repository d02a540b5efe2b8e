"""Arms whose MJCF, motions, control and loggers are written by hand: nothing here is this library's own simulation."""

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Callable

import mujoco
import numpy as np
import scipy.signal

from irb140_jax.recordings.recording import Recording

STEP, EVERY = 0.0005, 4  # [s], steps a logged sample
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
    """What the joints do along a motion of the unaltered arm.

    Attributes:
        tau, qd, qdd: RMS of each joint's, shape (n,).
        middle, spread: Mean and standard deviation of its positions, shape (n,).
        carried: Mean inertia of what it carries, without its rotor, shape (n,).
        path: Where the tool goes, shape (P, 3); the last body's centre of mass where there is no tool.
        reach: RMS of how joints move that, shape (3, n).
    """

    tau: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    middle: np.ndarray
    spread: np.ndarray
    carried: np.ndarray
    path: np.ndarray
    reach: np.ndarray


@dataclasses.dataclass
class Plant:
    """The true arm and what stands between the logged torque and its joints.

    Attributes:
        model: Of MuJoCo.
        driven: Its degrees of freedom that have motors and encoders, shape (n,).
        forces: Laws (t, q, qd, logged torque) -> torque on the joints.
        drive: Logged torque to the torque that the motor makes, step by step.
        log: Arrays t, q, tau -> those that are logged.
        outside: What the surroundings do to it: (number of the recording, t, model, data), before every step.
    """

    model: mujoco.MjModel
    driven: np.ndarray
    forces: list[Callable] = dataclasses.field(default_factory=list)
    drive: list[Callable] = dataclasses.field(default_factory=list)
    log: list[Callable] = dataclasses.field(default_factory=list)
    outside: list[Callable] = dataclasses.field(default_factory=list)


def tree_of(arm: str) -> ET.Element:
    """An arm's MJCF, without contacts, with motors nowhere: torques are applied."""
    return ET.fromstring(
        '<mujoco><compiler angle="radian" inertiafromgeom="auto"/>'
        f'<option timestep="{STEP}" integrator="implicitfast"/><default><geom contype="0" conaffinity="0"/></default>'
        f"<worldbody>{ARMS[arm]}</worldbody></mujoco>"
    )


def compiled(tree: ET.Element) -> mujoco.MjModel:
    """The model of an MJCF tree."""
    return mujoco.MjModel.from_xml_string(ET.tostring(tree, encoding="unicode"))


def plant_of(model: mujoco.MjModel, nominal: mujoco.MjModel) -> Plant:
    """A plant without any laws, driven where the nominal arm has joints."""
    names = [nominal.joint(i).name for i in range(nominal.nv)]
    return Plant(model, np.array([int(model.joint(name).dofadr[0]) for name in names]))


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


def trapezoids(model: mujoco.MjModel, rng: np.random.Generator) -> Callable:
    """Motion t -> (q, qd, qdd): from pose to pose in 0.5 to 1.7 s at constant speed, reached in 0.1 to 0.3 s at once.

    The acceleration steps four times a move, as drives with trapezoids of speed make it; 0.3 s of rest at each pose.
    """
    low, high = model.jnt_range.T
    poses = (low + high) / 2.0 + rng.uniform(-0.35, 0.35, (60, model.nv)) * (high - low)
    ends, rises = np.cumsum(rng.uniform(0.8, 2.0, 60)), rng.uniform(0.1, 0.3, 60)

    def motion(t):
        i = int(np.searchsorted(ends, t))
        began = ends[i - 1] if i else 0.0
        T, step, now = ends[i] - began - 0.3, poses[i + 1] - poses[i], t - began
        rise = min(rises[i], 0.45 * T)
        bend = ((now < rise) - float(T - rise <= now < T)) / rise
        speed = np.clip(min(now, T - now) / rise, 0.0, 1.0)
        ramp = lambda s: 0.5 * np.clip(s, 0.0, rise) ** 2 / rise + max(s - rise, 0.0)  # noqa: E731
        way = ramp(now) - ramp(now - T + rise)
        return poses[i] + step * way / (T - rise), step * speed / (T - rise), step * bend / (T - rise)

    return motion


def clean(t, q, tau, slide, rng):
    """What a good logger keeps: every 2 ms, positions with 1e-5 of noise, torques with 1 % of their RMS."""
    t, q, tau = t[::EVERY], q[::EVERY], tau[::EVERY]
    tau = tau + 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    return t, q + 1e-5 * rng.normal(size=q.shape), tau


def abrupt(t, q, tau, slide, rng):
    """The same logger, of motions that start and stop at once."""
    return clean(t, q, tau, slide, rng)


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
    nominal: mujoco.MjModel, plant: Plant, rng: np.random.Generator, motion: Callable, logger: Callable, number: int = 0
) -> Recording:
    """Computed torque and proportional-derivative feedback on what the encoders say, at every step."""
    n, true, driven = nominal.nv, mujoco.MjData(plant.model), plant.driven
    model, torque = mujoco.MjData(nominal), np.zeros(n)
    wanted = motion(nominal, rng)
    true.qpos[driven], true.qvel[driven], _ = wanted(0.0)
    q, tau, t = [], [], np.arange(0.0, SECONDS[logger], STEP)
    for now in t:
        at, speed, bend = wanted(now)
        model.qpos[:], model.qvel[:] = true.qpos[driven], true.qvel[driven]
        mujoco.mj_forward(nominal, model)
        mujoco.mj_mulM(nominal, model, torque, bend + 40.0 * (speed - model.qvel) + 400.0 * (at - model.qpos))
        torque += model.qfrc_bias
        made = torque.copy()
        for drive in plant.drive:
            made = drive(made)
        for force in plant.forces:
            made = made + force(now, model.qpos, model.qvel, torque)
        true.qfrc_applied[driven] = made
        for act in plant.outside:
            act(number, now, plant.model, true)
        q.append(model.qpos.copy())
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


SECONDS = {clean: 15.0, abrupt: 15.0, rough: 20.0, untouched: 15.0}
MOTIONS = {clean: (sines, sines), abrupt: (trapezoids, trapezoids), rough: (sines, point_to_point, slow_sines)}


def sizes_of(model: mujoco.MjModel) -> Sizes:
    """How large things are along a motion of the unaltered arm."""
    r = recorded(model, plant_of(model, model), np.random.default_rng(0), sines, untouched)
    qd = np.gradient(r.q, r.t, axis=0)
    rms = lambda x: np.sqrt(np.mean(x**2, axis=0))  # noqa: E731
    data, path, reach, carried = mujoco.MjData(model), [], [], []
    for q in r.q[:: len(r.q) // 300]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        path.append((data.site_xpos if model.nsite else data.xipos)[-1].copy())
        reach.append(np.zeros((3, model.nv)))
        mujoco.mj_jac(model, data, reach[-1], None, path[-1], model.nbody - 1)
        mass = np.zeros((model.nv, model.nv))
        for row, unit in zip(mass, np.eye(model.nv), strict=True):
            mujoco.mj_mulM(model, data, row, unit)
        carried.append(np.diag(mass) - model.dof_armature)
    return Sizes(
        rms(r.tau), rms(qd), rms(np.gradient(qd, r.t, axis=0)), np.mean(r.q, axis=0), np.std(r.q, axis=0),
        np.mean(carried, axis=0), np.array(path), rms(np.array(reach)),
    )  # fmt: skip
