"""Physics that MuJoCo has itself (frictionloss, damping, armature), on an arm and in a loop that are not ours."""

import mujoco
import numpy as np
import pytest

from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import robot_from_model

SCARA = """<mujoco><compiler angle="radian" inertiafromgeom="true"/><option timestep="0.001"/><worldbody>
<body pos="0 0 .3"><joint name="shoulder" axis="0 0 1" range="-2.2 2.2" armature=".05"/>
 <geom type="capsule" fromto="0 0 0 .25 0 0" size=".05" density="2500"/>
 <body pos=".25 0 0"><joint name="elbow" axis="0 0 1" range="-2.4 2.4" armature=".03"/>
  <geom type="capsule" fromto="0 0 0 .2 0 0" size=".04" density="2500"/>
  <body pos=".2 0 0"><joint name="lift" type="slide" axis="0 0 -1" range="0 .2" armature="1.5"/>
   <geom type="cylinder" size=".012 .15" density="7800"/>
</body></body></body></worldbody></mujoco>"""
HIDDEN = {("coulomb_friction", "shoulder"): 0.2, ("viscous_friction", "lift"): 25.0, ("rotor_inertia", "elbow"): 0.04}


def recorded(rng: np.random.Generator, seconds: float = 12.0) -> Recording:
    """A sum of sines under computed torque and proportional-derivative feedback; torques with 1 % of noise."""
    nominal, true = (mujoco.MjModel.from_xml_string(SCARA) for _ in range(2))
    for model in (nominal, true):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    true.dof_frictionloss[0] = HIDDEN["coulomb_friction", "shoulder"]
    true.dof_damping[2] = HIDDEN["viscous_friction", "lift"]
    true.dof_armature[1] += HIDDEN["rotor_inertia", "elbow"]
    model, plant, torque = mujoco.MjData(nominal), mujoco.MjData(true), np.zeros(3)
    middle, reach = np.array([0.0, 0.0, 0.1]), np.array([1.2, 1.2, 0.06])
    rate, phase = 2.0 * np.pi * rng.uniform(0.15, 0.8, (3, 3)), rng.uniform(0.0, 2.0 * np.pi, (3, 3))
    wave = lambda f, t, power: reach * np.mean(f(rate * t + phase) * rate**power, axis=0)  # noqa: E731
    plant.qpos[:], plant.qvel[:] = middle + wave(np.sin, 0.0, 0), wave(np.cos, 0.0, 1)
    q, tau = [], []
    times = np.arange(0.0, seconds, 0.001)
    for t in times:
        off = middle + wave(np.sin, t, 0) - plant.qpos, wave(np.cos, t, 1) - plant.qvel
        model.qpos[:], model.qvel[:] = plant.qpos, plant.qvel
        mujoco.mj_forward(nominal, model)
        mujoco.mj_mulM(nominal, model, torque, -wave(np.sin, t, 2) + 40.0 * off[1] + 400.0 * off[0])
        torque += model.qfrc_bias
        plant.qfrc_applied[:] = torque
        q.append(plant.qpos.copy())
        tau.append(torque.copy())
        mujoco.mj_step(true, plant)
    q, tau = np.array(q)[::2], np.array(tau)[::2]
    noise = 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    return Recording(
        t=times[::2], q=q + 1e-5 * rng.normal(size=q.shape), tau=tau + noise, qd=None, qdd=None, extras={},
        joint_names=("shoulder", "elbow", "lift"), source="native", notes=(),
    )  # fmt: skip


def test_what_mujoco_itself_calls_friction_damping_and_armature_is_named():
    rng = np.random.default_rng(0)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(SCARA), source="scara")
    found = diagnose(robot, [recorded(rng) for _ in range(2)]).diagnosis["findings"]
    values = {(f["effect"], *f["joints"]): next(iter(f["parameters"].values()))["value"] for f in found}
    assert values == pytest.approx(HIDDEN, rel=0.03)
