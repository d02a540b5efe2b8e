"""Starts and stops as abrupt as drives make them: what happens between two samples of the log is no physics."""

import mujoco
import numpy as np
import pytest

from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import robot_from_model

MASSES = np.array([18.0, 9.0, 4.0])  # kg, of what slides along x, y and z
GANTRY = """<mujoco><worldbody>
<body><joint name="x" type="slide" axis="1 0 0" range="-.5 .5"/><inertial pos="0 0 0" mass="9" diaginertia="1 1 1"/>
<body><joint name="y" type="slide" axis="0 1 0" range="-.4 .4"/><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
<body><joint name="z" type="slide" axis="0 0 1" range="-.3 .3"/><inertial pos="0 0 0" mass="4" diaginertia="1 1 1"/>
</body></body></body></worldbody></mujoco>"""


def trapezoids(t, rng, reach):
    """Position and acceleration at times t: moves at constant speed from point to point, with 0.3 s of rest between."""
    q, qdd, here, began = np.zeros((len(t), 3)), np.zeros((len(t), 3)), np.zeros(3), 0.0
    while began < t[-1]:
        T, rise = rng.uniform(0.5, 1.7), rng.uniform(0.1, 0.2)
        step = rng.uniform(-reach, reach) - here
        u = (t - began)[:, None]
        ramp = lambda s: 0.5 * np.clip(s, 0.0, rise) ** 2 / rise + np.clip(s - rise, 0.0, None)  # noqa: B023, E731
        q += step * (ramp(u) - ramp(u - (T - rise))) / (T - rise)
        for first, sign in ((0.0, 1.0), (T - rise, -1.0)):
            qdd += np.where((u >= first) & (u < first + rise), sign * step / (T - rise) / rise, 0.0)
        here, began = here + step, began + T + 0.3
    return q, qdd


@pytest.mark.parametrize("seed", range(3))
def test_steps_of_the_torque_between_samples_are_no_left_out_physics(seed):
    rng, t = np.random.default_rng(seed), 0.002 * np.arange(7500)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(GANTRY), source="gantry")
    recordings = []
    for k in range(2):
        q, qdd = trapezoids(t, rng, np.array([0.35, 0.28, 0.2]))
        tau = MASSES * np.array([1.02, 0.97, 1.03]) * (qdd + np.array([0.0, 0.0, 9.81]))
        tau += 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
        q += 1e-5 * rng.normal(size=q.shape)
        recordings.append(Recording(t, q, tau, ("x", "y", "z"), source=f"trapezoids {k}"))
    diagnosis = diagnose(robot, recordings).diagnosis.to_json()
    assert diagnosis["findings"] == [] and diagnosis["unexplained"] == []
