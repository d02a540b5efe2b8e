"""Joints that something stops: on motions of one joint, by hand, and in a whole diagnosis."""

import sys

import mujoco
import numpy as np
import pytest
from helpers import ROOT, recordings_folder

from irb140_jax.mismatch import diagnose
from irb140_jax.mismatch.validation.blocked import blocked
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.machines import so101_model, so101_recording
from irb140_jax.robot import Robot, load_robot, robot_from_model

sys.path.insert(0, str(ROOT / "experiments"))
import real_servos

FLAT = """<mujoco><worldbody><body><joint name="a" axis="0 0 1"/><inertial mass="1" pos="0.2 0 0"
diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>"""
UPRIGHT = FLAT.replace('axis="0 0 1"', 'axis="0 1 0"').replace('mass="1"', 'mass="{mass}"')
DT, STOP, FRICTION = 0.01, -0.5, 0.4
T = np.arange(0.0, 20.0, DT)
WANTED = np.sin(2.0 * np.pi * 0.2 * T)


def recorded(q: np.ndarray, tau: np.ndarray) -> Conditioned:
    column = lambda x: np.asarray(x)[:, None]  # noqa: E731
    qd = np.gradient(q, DT)
    moves = column(np.abs(qd) > 1e-3)
    return Conditioned(
        "r", T, column(q), column(qd), column(0.0 * q), column(tau), np.ones_like(moves), moves, np.array([1e-3]),
        np.zeros(1), column(np.sign(qd) * moves[:, 0]), column(0.0 * q), (),
    )  # fmt: skip


def robot(text: str) -> Robot:
    return robot_from_model(mujoco.MjModel.from_xml_string(text))


def servo(q: np.ndarray) -> np.ndarray:
    """Torque of a servo that wants to be elsewhere, beside dry friction where it moves."""
    return 20.0 * (WANTED - q) + FRICTION * np.sign(np.gradient(q, DT))


def test_a_joint_against_a_stop_is_found_with_its_place_and_how_often_it_stands_there():
    q = np.maximum(WANTED, STOP)
    (found,) = blocked(robot(FLAT), [recorded(q, servo(q))])
    assert found.joint == 0 and found.position == pytest.approx(STOP) and len(found.times) == 4
    for k, (_, begin, end) in enumerate(found.times):  # the sine is below a half from 7/12 to 11/12 of each period
        assert begin == pytest.approx(35.0 / 12.0 + 5.0 * k, abs=0.02)
        assert end == pytest.approx(55.0 / 12.0 + 5.0 * k, abs=0.02)
    assert found.torque == pytest.approx(20.0 * (1.0 + STOP), rel=0.01)
    assert found.usual == pytest.approx(FRICTION, rel=0.05)


@pytest.mark.parametrize(("mass", "stops"), [(0.1, 1), (5.0, 0)])
def test_a_model_that_needs_the_torque_there_has_no_stop(mass, stops):
    q = np.maximum(WANTED, STOP)
    assert len(blocked(robot(UPRIGHT.format(mass=mass)), [recorded(q, servo(q))])) == stops


@pytest.mark.parametrize("tau", [2.0 * FRICTION, -20.0], ids=["held by friction", "pushed away from the end"])
def test_a_joint_that_rests_at_an_end_of_its_range_need_not_be_blocked(tau):
    q = np.minimum(WANTED, 0.5)
    rests = q == 0.5
    assert not blocked(robot(FLAT), [recorded(q, np.where(rests, tau, servo(q)))])


def test_a_spring_that_pushes_back_at_the_end_of_the_range_is_no_stop():
    q = np.clip(WANTED, -0.5, 0.5)
    torque = 20.0 * (2.0 * q) ** 15 + FRICTION * np.sign(np.gradient(q, DT))
    assert not blocked(robot(FLAT), [recorded(q, torque)])


def test_a_brake_in_the_middle_of_the_range_is_no_stop():
    q = np.where(T < 5.0, 0.0, WANTED)
    assert not blocked(robot(FLAT), [recorded(q, np.where(T < 5.0, -20.0, servo(q)))])


def test_a_real_hobby_arm_whose_wrist_is_blocked_is_told_so():
    recordings_folder()
    arm = load_robot(so101_model(), ("wrist_roll",))
    result = diagnose(arm, [real_servos.only(so101_recording("single_joint_wrist_roll"), "wrist_roll")]).diagnosis
    stop = result.unexplained[0]
    # Its origin says: four visits, at -1.023 rad when pushed little and at -1.034 when pushed hard.
    assert stop.joints == ("wrist_roll",) and "stands still at -1.034 rad, 4 times" in stop.where
    assert result.notes[0].startswith("wrist_roll stands still") and result.notes[0] in result.summary
    # Dry friction shows once these rows are left out.
    assert [f.effect for f in result.findings if f.joints == ("wrist_roll",)]
