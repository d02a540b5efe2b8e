"""Pushes as MuJoCo applies them: at once there, at once gone, at a point of which the model knows nothing."""

import mujoco
import numpy as np
import pytest
from helpers_native import CYLINDRICAL, recorded

from irb140_jax.mismatch import diagnose
from irb140_jax.robot import robot_from_model


def test_a_push_that_is_at_once_there_and_gone_in_one_of_three_recordings_is_all_that_is_named():
    def pushed(t, plant):
        plant.xfrc_applied[-1, :3] = np.array([20.0, 40.0, 5.0]) * (5.03 < t < 6.21)

    rng = np.random.default_rng(0)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(CYLINDRICAL), source="native")
    during = [{}, {"pushed": pushed}, {}]
    recordings = [recorded(CYLINDRICAL, lambda true: None, rng, **d) for d in during]
    found = diagnose(robot, recordings).diagnosis.to_json()["findings"]
    assert [f["effect"] for f in found] == ["external_wrench"]
    push = {name: (p["value"], p["std"]) for name, p in found[0]["parameters"].items()}
    for name, true, off in (("t0", 5.03, 0.02), ("t1", 6.21, 0.02), ("force_x", 20.0, 2.0), ("force_y", 40.0, 4.0)):
        assert abs(push[name][0] - true) < off
        assert push[name][1] < off  # one recording of three knows of it, and knows it well


@pytest.mark.parametrize(("begins", "named"), [(-1.0, False), (4.0, True)])
def test_a_push_begins_or_ends_while_it_is_recorded(begins, named):
    """A force that is there all the time in one recording is a property of the arm there, or of its sensors."""

    def pushed(t, plant):
        plant.xfrc_applied[-1, :3] = np.array([20.0, 40.0, 5.0]) * (t > begins)

    rng = np.random.default_rng(0)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(CYLINDRICAL), source="native")
    during = [{}, {"pushed": pushed}, {}]
    recordings = [recorded(CYLINDRICAL, lambda true: None, rng, **d) for d in during]
    found = diagnose(robot, recordings).diagnosis.to_json()["findings"]
    assert ("external_wrench" in [f["effect"] for f in found]) == named
