"""Closed loops in MuJoCo with its own position actuators as the plant: recordings of commands and positions."""

import mujoco
import numpy as np

from irb140_jax.recordings import Recording

JOINTS = ("shoulder", "elbow")
KP, KD = (60.0, 30.0), (2.0, 0.8)
STEP = 2.5e-4  # s of the simulation: a servo's damping through a step of 1 ms looks like 1 ms of delay
RATE = 200.0  # Hz of the log
NOISE = 1e-4  # rad, a 16 bit encoder


def two_links(kp=KP, kd=KD, shoulder="", elbow="", limit=None, actuators=None, gear=1.0):
    """MJCF of two links on position actuators; further attributes of the joints are the concealed physics."""
    limited = "" if limit is None else f'forcerange="-{limit} {limit}"'
    own = "".join(f'<position joint="{joint}" kp="{kp[i]}" kv="{kd[i]}" gear="{gear}" {limited}/>'
                  for i, joint in enumerate(JOINTS))  # fmt: skip
    return f"""<mujoco model="two_links"><compiler angle="radian"/>
<option timestep="{STEP}" gravity="0 0 -9.81"/><worldbody>
  <body><joint name="shoulder" axis="0 1 0" {shoulder}/>
    <inertial pos="0 0 -.15" mass="1.2" diaginertia=".012 .012 .002"/>
    <body pos="0 0 -.3"><joint name="elbow" axis="0 1 0" {elbow}/>
      <inertial pos="0 0 -.12" mass=".7" diaginertia=".006 .006 .001"/>
</body></body></worldbody><actuator>{own if actuators is None else actuators}</actuator></mujoco>"""


def given(error, qd):
    """Torque that servos give at an error (2,) and a speed (2,): their law."""
    return np.array(KP) * error - np.array(KD) * qd


def closed_loop(xml, seed=1, duration=10.0, delay=0.0, noise=NOISE, lag=0.0, law=None):
    """A recording of commands and positions, and the torque that MuJoCo's actuators gave, (T, 2) [N m].

    Commands act `delay` late [s].  With a lag [s] or a law like `given` there are no actuators: torque by that law
    comes so much later.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration / STEP)) * STEP
    waves = [(rng.uniform(0.1, 0.35), rng.uniform(0.15, 1.6), rng.uniform(0.0, 6.0)) for _ in range(10)]
    wave = lambda k: sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in waves[5 * k : 5 * k + 5])  # noqa: E731
    command = np.stack([wave(0), wave(1)], axis=1)
    return _logged(xml, t, command, rng, seed, noise, late=round(delay / STEP), lag=round(lag / STEP), law=law)


def to_and_fro(xml, pushed, seed=1, noise=2e-5):
    """The same, faster and faster to and fro between two postures, while torques that nobody knows push the joints.

    Args:
        xml: The plant.
        pushed: Standard deviation of those torques, of any frequency below 60 Hz [N m].
        seed: Of all that is random.
        noise: Of the encoders [rad].
    """
    rng, sweeps = np.random.default_rng(seed), np.arange(3.0, 0.5, -0.2)
    t = np.arange(round(sweeps.sum() / STEP)) * STEP
    ends = np.cumsum(sweeps)
    k = np.searchsorted(ends, t, side="right")
    there = 1.0 - np.abs(2.0 * (t - ends[k] + sweeps[k]) / sweeps[k] - 1.0)
    held = round(0.008 / STEP)
    push = pushed * np.repeat(rng.normal(size=(len(t) // held + 1, 2)), held, axis=0)[: len(t)]
    command = np.stack([0.6 * there, 1.2 * there - 0.6], axis=1)
    return _logged(xml, t, command, rng, seed, noise, push=push)


def _logged(xml, t, command, rng, seed, noise, late=0, push=None, lag=0, law=None):
    model = mujoco.MjModel.from_xml_string(xml)
    data, q, torque = mujoco.MjData(model), np.empty_like(command), np.empty_like(command)
    data.qpos[:], made = command[0], []
    for i in range(len(t)):
        q[i], wanted = data.qpos, command[max(i - late, 0)]
        made.append((law or given)(wanted - data.qpos, data.qvel))
        data.qfrc_applied[:] = made[max(i - lag, 0)] if lag or law else 0.0
        data.qfrc_applied[:] += 0.0 if push is None else push[i]
        data.ctrl[:] = wanted if model.nu else ()
        mujoco.mj_step(model, data)
        torque[i] = made[max(i - lag, 0)] if lag or law else data.qfrc_actuator
    rows = slice(round(0.5 / STEP), None, round(1.0 / RATE / STEP))
    q = q[rows] + noise * rng.normal(size=q[rows].shape)
    recording = Recording(
        t=t[rows], q=q, tau=np.full_like(q, np.nan), qdes=command[rows], joint_names=JOINTS, source=f"run_{seed}.csv"
    )
    return recording, torque[rows]
