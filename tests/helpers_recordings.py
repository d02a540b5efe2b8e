"""Recordings made with MuJoCo's own inverse dynamics, to be spoiled by the tests."""

import functools
import pathlib

import mujoco
import numpy as np
import pandas as pd
import pytest

import irb140_jax as irb
from irb140_jax.errors import RecordingError
from irb140_jax.recordings import Recording, read_recording, write_recording
from irb140_jax.recordings.conceal import demo_case
from irb140_jax.robot import robot_from_model

ARM = """
<mujoco><compiler angle="radian" autolimits="true"/><option gravity="0 0 -9.81"/>
<worldbody><body>
  <joint name="shoulder" axis="0 1 0" range="-3 3"/><inertial pos="0.2 0 0.02" mass="4" diaginertia="0.02 0.06 0.06"/>
  <body pos="0.5 0 0">
    <joint name="elbow" axis="0 1 0" range="-2.5 2.5"/>
    <inertial pos="0.2 0.02 0" mass="2" diaginertia="0.01 0.03 0.03"/>
    <body pos="0.4 0 0">
      <joint name="wrist" axis="1 0 0" range="-3 3"/>
      <inertial pos="0 0.05 0.03" mass="1" diaginertia="0.002 0.002 0.002"/>
      {more}
    </body></body></body></worldbody></mujoco>
"""
SLIDE = """<body><joint name="lift" type="slide" axis="0 0 1" range="-0.3 0.3"/>
           <inertial pos="0 0 0.1" mass="0.7" diaginertia="0.001 0.001 0.001"/></body>"""
PENDULUM = """<mujoco><compiler angle="radian"/><worldbody><body><joint name="hinge" axis="0 1 0"/>
              <inertial pos="0 0 -0.3" mass="1.5" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>"""


def model(slide: bool = False, pendulum: bool = False) -> mujoco.MjModel:
    text = PENDULUM if pendulum else ARM.format(more=SLIDE if slide else "")
    return mujoco.MjModel.from_xml_string(text)


def robot(**kind: bool) -> irb.Robot:
    return robot_from_model(model(**kind), source="test arm")


@functools.cache
def shipped() -> tuple[Recording, ...]:
    """Sound recordings of the IRB 140, of the demo."""
    return demo_case(1, duration=8.0).recordings


def motion(
    n: int, *, seed: int = 0, duration: float = 8.0, rate: float = 250.0, size: float = 0.9, slide: bool = False
):
    """t, q, qd, qdd of a sum of sines."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * rate)) / rate
    w = 2 * np.pi * rng.uniform(0.15, 0.9, (3, n))
    a, p = size * rng.uniform(0.2, 0.4, (3, n)), rng.uniform(0, 6.3, (3, n))
    if slide:
        a[:, -1] *= 0.15
    angle = w[:, None] * t[None, :, None] + p[:, None]
    q = (a[:, None] * np.sin(angle)).sum(0)
    return t, q, ((a * w)[:, None] * np.cos(angle)).sum(0), -((a * w**2)[:, None] * np.sin(angle)).sum(0)


def rigid_torque(arm: mujoco.MjModel, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Torque by MuJoCo's inverse dynamics, without limits and contacts."""
    arm.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, tau = mujoco.MjData(arm), np.zeros_like(q)
    for i in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], qd[i], qdd[i]
        mujoco.mj_inverse(arm, data)
        tau[i] = data.qfrc_inverse
    return tau


def recording(
    *, seed: int = 0, friction: float = 0.3, noise: float = 0.02, speeds: bool = True, size: float = 0.9,
    duration: float = 8.0, rate: float = 250.0, arm: mujoco.MjModel | None = None, **kind: bool,
) -> Recording:
    """A sound recording: rigid torque of `arm` plus viscous and dry friction and noise."""
    true = model(**kind) if arm is None else arm
    names = tuple(true.joint(i).name for i in range(true.njnt))
    slide = kind.get("slide", False)
    t, q, qd, qdd = motion(len(names), seed=seed, size=size, duration=duration, rate=rate, slide=slide)
    rng = np.random.default_rng(seed + 1000)
    tau = rigid_torque(true, q, qd, qdd) + friction * (np.sign(qd) + 0.3 * qd) + noise * rng.normal(size=q.shape)
    q = q + 1e-5 * rng.normal(size=q.shape)
    return Recording(t=t, q=q, tau=tau, qd=qd if speeds else None, joint_names=names, source="made")


def frame(made: Recording) -> pd.DataFrame:
    return pd.DataFrame(irb.recordings.recording_columns(made))


def read_of(recording: Recording, robot: irb.Robot, folder: pathlib.Path) -> Recording:
    """A recording as it is read from a file."""
    return read_recording(write_recording(recording, folder / "log.parquet"), robot)


def refusal(recording: Recording, robot: irb.Robot, folder: pathlib.Path) -> str:
    """Why a recording is refused: one line that names its file."""
    with pytest.raises(RecordingError) as caught:
        read_of(recording, robot, folder)
    message = str(caught.value)
    assert "\n" not in message and "log.parquet" in message
    return message
