"""Recordings of arms, and of physics that MuJoCo has itself, from a loop that is not ours."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import robot_from_model

HEAD = '<mujoco><compiler angle="radian" inertiafromgeom="true"/><option timestep="0.001"/><worldbody>'
SCARA = HEAD + """<body pos="0 0 .3"><joint name="shoulder" axis="0 0 1" range="-2.2 2.2" armature=".05"/>
 <geom type="capsule" fromto="0 0 0 .25 0 0" size=".05" density="2500"/>
 <body pos=".25 0 0"><joint name="elbow" axis="0 0 1" range="-2.4 2.4" armature=".03"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".04" density="2500"/>
  <body pos=".2 0 0"><joint name="lift" type="slide" axis="0 0 -1" range="0 .2" armature="1.5"/>
   <geom type="cylinder" size=".012 .15" density="7800"/>
</body></body></body></worldbody></mujoco>"""
CYLINDRICAL = HEAD + """<body pos="0 0 .3"><joint name="turn" axis="0 0 1" range="-2.5 2.5" armature=".05"/>
 <geom type="box" size=".15 .05 .1" pos=".1 .02 0" density="1500"/>
 <body pos=".1 0 0"><joint name="reach" type="slide" axis="1 0 0" range="0 .4" armature="1"/>
  <geom type="capsule" fromto="0 0 0 .4 0 0" size=".04" density="2500"/></body></body></worldbody></mujoco>"""
LIFT_AND_TURN = HEAD + """<body pos="0 0 .3"><joint name="rise" type="slide" axis="0 0 1" range="0 .4" armature="1"/>
 <geom type="box" size=".05 .05 .1" density="1500"/>
 <body pos=".1 0 0"><joint name="turn" axis="0 0 1" range="-2.5 2.5" armature=".001"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".03" density="2500"/></body></body></worldbody></mujoco>"""
PENDULUM = HEAD + """<body pos="0 0 1"><joint name="swing" axis="0 1 0" range="-3 3" armature=".02"/>
 <geom type="capsule" fromto="0 0 0 0 0 -.5" size=".03" density="2700"/></body></worldbody></mujoco>"""


TWO_LINKS = HEAD + """<body pos="0 0 1"><joint name="upper" axis="0 1 0" range="-1.5 1.5" armature=".05"/>
 <geom type="capsule" fromto="0 0 0 .3 0 0" size=".04" density="2500"/>
 <body pos=".3 0 0"><joint name="lower" axis="0 1 0" range="-2 2" armature=".02"/>
  <geom type="capsule" fromto="0 0 0 .25 0 0" size=".03" density="2500"/></body></body></worldbody></mujoco>"""


def model_of(xml: str) -> mujoco.MjModel:
    """Without contacts."""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return model


def recorded(
    xml: str, hide: Callable[[mujoco.MjModel], None], rng: np.random.Generator, seconds: float = 12.0,
    under: Callable[[mujoco.MjModel, np.ndarray], None] = lambda model, load: None,
    pushed: Callable[[float, mujoco.MjData], None] = lambda t, plant: None,
    truly: str = "",
) -> Recording:  # fmt: skip
    """A sum of sines under computed torque and proportional-derivative feedback; torques with 1 % of noise.

    What a model is under the torques that reach its links (`under`) it becomes before every step, and is `pushed`.
    The true arm may be another (`truly`), with joints of its own that no motor drives.
    """
    nominal, true = model_of(xml), model_of(truly or xml)
    hide(true)
    n = nominal.nv
    names = tuple(nominal.joint(j).name for j in range(n))
    driven = [true.joint(name).dofadr[0] for name in names]
    model, plant, torque = mujoco.MjData(nominal), mujoco.MjData(true), np.zeros(n)
    low, high = nominal.jnt_range.T
    middle, reach = 0.5 * (low + high), 0.3 * (high - low)
    rate, phase = 2.0 * np.pi * rng.uniform(0.15, 0.8, (3, n)), rng.uniform(0.0, 2.0 * np.pi, (3, n))
    wave = lambda f, t, power: reach * np.mean(f(rate * t + phase) * rate**power, axis=0)  # noqa: E731
    plant.qpos[driven], plant.qvel[driven] = middle + wave(np.sin, 0.0, 0), wave(np.cos, 0.0, 1)
    q, tau = [], []
    times = np.arange(0.0, seconds, 0.001)
    for t in times:
        model.qpos[:], model.qvel[:] = plant.qpos[driven], plant.qvel[driven]
        off = middle + wave(np.sin, t, 0) - model.qpos, wave(np.cos, t, 1) - model.qvel
        mujoco.mj_forward(nominal, model)
        mujoco.mj_mulM(nominal, model, torque, -wave(np.sin, t, 2) + 40.0 * off[1] + 400.0 * off[0])
        torque += model.qfrc_bias
        plant.qfrc_applied[driven] = torque
        q.append(model.qpos.copy())
        tau.append(torque.copy())
        under(true, torque + plant.qfrc_constraint[driven])
        pushed(t, plant)
        mujoco.mj_step(true, plant)
    q, tau = np.array(q)[::2], np.array(tau)[::2]
    noise = 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    return Recording(times[::2], q + 1e-5 * rng.normal(size=q.shape), tau + noise, names, source="native")


def findings(xml: str, hide: Callable[[mujoco.MjModel], None], seed: int, **during) -> list[dict[str, Any]]:
    """What a diagnosis of two recordings finds."""
    rng = np.random.default_rng(seed)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(xml), source="native")
    return diagnose(robot, [recorded(xml, hide, rng, **during) for _ in range(2)]).diagnosis.to_json()["findings"]


def found(xml: str, hide: Callable[[mujoco.MjModel], None], seed: int, **during) -> dict[tuple[str, ...], tuple]:
    """Value and standard deviation of the first parameter of every finding."""
    first = lambda f: next(iter(f["parameters"].values()))  # noqa: E731
    said = findings(xml, hide, seed, **during)
    return {(f["effect"], *f["joints"]): (first(f)["value"], first(f)["std"]) for f in said}


def named(xml: str, hide: Callable[[mujoco.MjModel], None], seed: int, **during) -> dict[tuple[str, ...], float]:
    """The first parameter of every finding."""
    return {key: value for key, (value, _) in found(xml, hide, seed, **during).items()}
