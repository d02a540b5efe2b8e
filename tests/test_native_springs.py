"""A transmission that bends, made of MuJoCo's own second joint on a spring."""

import mujoco
import numpy as np
from helpers_native import HEAD, PENDULUM, recorded

from irb140_jax.mismatch import diagnose
from irb140_jax.robot import robot_from_model

STIFFNESS = 2500.0  # N m/rad
BENDING = HEAD + f"""<body pos="0 0 1"><joint name="swing" axis="0 1 0" range="-3 3" armature=".02"/>
 <inertial mass="1e-6" pos="0 0 0" diaginertia="1e-8 1e-8 1e-8"/>
 <body><joint name="link" axis="0 1 0" stiffness="{STIFFNESS}" damping="2"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.5" size=".03" density="2700"/></body></body></worldbody></mujoco>"""


def test_a_spring_that_takes_less_than_half_a_hundredth_of_the_torque_is_named():
    rng = np.random.default_rng(0)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(PENDULUM), source="native")
    recordings = [recorded(PENDULUM, lambda true: None, rng, truly=BENDING) for _ in range(2)]
    d = diagnose(robot, recordings).diagnosis.to_json()
    assert [f["effect"] for f in d["findings"]] == ["joint_elasticity"]
    spring = d["findings"][0]["parameters"]["stiffness"]
    assert abs(spring["value"] / STIFFNESS - 1.0) < 0.2
    assert abs(spring["value"] - STIFFNESS) < 2.0 * spring["std"]
