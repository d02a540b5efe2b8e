"""Recordings that contradict themselves or the robot are refused, and the message says what would mend them."""

import dataclasses
import re

import equinox as eqx
import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.recordings import Recording
from irb140_jax.robot import irb140


@pytest.fixture(scope="module")
def robot():
    return made.robot()


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording()


def test_positions_in_degrees_beside_speeds_in_radians_are_recognised(sound, robot, tmp_path):
    message = made.refusal(dataclasses.replace(sound, q=np.degrees(sound.q)), robot, tmp_path)
    assert "q.shoulder is in degrees and qd.shoulder in radians" in message and '"q.shoulder" = "deg"' in message


def test_speeds_in_degrees_are_recognised(sound, robot, tmp_path):
    message = made.refusal(dataclasses.replace(sound, qd=np.degrees(sound.qd)), robot, tmp_path)
    assert "qd.shoulder in degrees" in message and '"qd.shoulder" = "deg"' in message


@pytest.mark.parametrize("speeds", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_everything_in_degrees_is_recognised(robot, tmp_path, speeds, seed):
    sound = made.recording(seed=seed)
    degrees = dataclasses.replace(sound, **{name: np.degrees(getattr(sound, name)) for name in ("q", "qd")})
    degrees = degrees if speeds else dataclasses.replace(degrees, qd=None)
    assert "look like degrees" in made.refusal(degrees, robot, tmp_path).replace("looks", "look")


def test_a_small_motion_in_degrees_within_the_limits_is_recognised_by_its_torque(robot, tmp_path):
    sound = made.recording(size=0.05, speeds=False, friction=0.05)
    degrees = dataclasses.replace(sound, q=np.degrees(sound.q))
    assert np.max(np.abs(degrees.q)) < 2 * np.pi, "so small that the joint limits do not show it"
    assert "look like degrees" in made.refusal(degrees, robot, tmp_path)


def test_one_joint_on_the_motor_side_is_recognised(sound, robot, tmp_path):
    q = sound.q * np.array([1.0, 50.0, 1.0])
    assert "column q.elbow reaches" in made.refusal(dataclasses.replace(sound, q=q, qd=None), robot, tmp_path)


def test_exchanged_speeds_are_recognised(sound, robot, tmp_path):
    message = made.refusal(dataclasses.replace(sound, qd=sound.qd[:, [0, 2, 1]]), robot, tmp_path)
    assert "qd.wrist follows q.elbow" in message and "qd.elbow follows q.wrist" in message


def test_reversed_speeds_are_recognised(sound, robot, tmp_path):
    message = made.refusal(dataclasses.replace(sound, qd=sound.qd * np.array([1, -1, 1])), robot, tmp_path)
    assert "column qd.elbow has the opposite sign" in message


def test_speeds_of_another_scale_are_recognised(sound, robot, tmp_path):
    assert "does not fit q.shoulder" in made.refusal(dataclasses.replace(sound, qd=sound.qd / 7), robot, tmp_path)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("pair", [[1, 0, 2], [0, 2, 1], [2, 1, 0]])
def test_exchanged_torques_are_recognised(robot, tmp_path, seed, pair):
    sound = made.recording(seed=seed)
    a, b = (sound.joint_names[k] for k in np.flatnonzero(np.array(pair) != np.arange(3)))
    message = made.refusal(dataclasses.replace(sound, tau=sound.tau[:, pair]), robot, tmp_path)
    assert "exchanged" in message and f"tau.{a} fits joint {b}" in message and f"tau.{b} fits joint {a}" in message


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("joint", [0, 1, 2])
def test_a_torque_of_the_wrong_sign_is_recognised(robot, tmp_path, seed, joint):
    sound = made.recording(seed=seed)
    sign = np.where(np.arange(3) == joint, -1.0, 1.0)
    message = made.refusal(dataclasses.replace(sound, tau=sound.tau * sign), robot, tmp_path)
    assert f"column tau.{sound.joint_names[joint]} of the wrong sign" in message and "= -1" in message


def test_torque_on_the_motor_side_is_recognised(sound, robot, tmp_path):
    assert "gear ratio" in made.refusal(dataclasses.replace(sound, tau=sound.tau / 100), robot, tmp_path)


def test_a_robot_without_any_torque_that_changes_is_refused(sound, robot, tmp_path):
    assert "dead channels" in made.refusal(dataclasses.replace(sound, tau=np.zeros_like(sound.tau)), robot, tmp_path)


@pytest.mark.parametrize("factor", [1000.0, 0.02])
@pytest.mark.parametrize("kind", [{}, {"pendulum": True}])
def test_torque_in_another_unit_is_refused_with_the_factor_that_mends_it(tmp_path, kind, factor):
    sound, robot = made.recording(friction=0.1, **kind), made.robot(**kind)
    message = made.refusal(dataclasses.replace(sound, tau=factor * sound.tau), robot, tmp_path)
    assert ("mN m" in message) == (factor == 1000.0)
    (said,) = re.findall(rf'"tau.{sound.joint_names[0]}" = (\S+?),? ', message + " ")
    assert float(said) == pytest.approx(1.0 / factor, rel=0.1)


@pytest.mark.parametrize("factor", [0.15, 0.05, 0.01])
def test_torque_of_the_irb_140_on_the_motors_side_is_not_taken_for_degrees(tmp_path, factor):
    for recording in made.shipped():
        message = made.refusal(dataclasses.replace(recording, tau=factor * recording.tau), irb140(), tmp_path)
        (said,) = re.findall(r'"tau.joint2" = (\S+?),? ', message + " ")
        assert "degrees" not in message and "gear ratio" in message
        assert float(said) == pytest.approx(1 / factor, rel=0.2)


@pytest.mark.parametrize("factor", [0.01, 1000.0])
def test_torque_of_one_joint_in_another_unit_is_refused_and_no_other_joint_is_named(tmp_path, factor):
    for recording in made.shipped():
        tau = recording.tau * np.where(np.arange(6) == 1, factor, 1.0)
        message = made.refusal(dataclasses.replace(recording, tau=tau), irb140(), tmp_path)
        (said,) = re.findall(r'would be "tau.joint2" = (\S+)$', message)
        assert "column tau.joint2 has the shape" in message and float(said) == pytest.approx(1 / factor, rel=0.25)


@pytest.mark.parametrize("joint", [0, 1])
def test_torque_of_one_joint_in_another_unit_is_refused_on_an_arm_of_three(sound, robot, tmp_path, joint):
    tau = sound.tau * np.where(np.arange(3) == joint, 0.01, 1.0)
    message = made.refusal(dataclasses.replace(sound, tau=tau), robot, tmp_path)
    assert f"tau.{sound.joint_names[joint]} has the shape" in message


def test_torque_in_percent_of_the_rated_is_refused(sound, robot, tmp_path):
    percent = dataclasses.replace(sound, tau=100.0 / np.array([15.0, 5.0, 0.6]) * sound.tau)
    assert "percent of the rated torque" in made.refusal(percent, robot, tmp_path)


@pytest.mark.parametrize("joint", [0, 1])
def test_positions_of_the_wrong_sign_are_recognised(robot, tmp_path, joint):
    sound = made.recording(seed=1, speeds=False)
    sign = np.where(np.arange(3) == joint, -1.0, 1.0)
    said = made.refusal(dataclasses.replace(sound, q=sign * sound.q), robot, tmp_path)
    assert sound.joint_names[joint] in said and "= -1" in said


def test_an_axis_that_the_model_has_the_other_way_round_is_recognised(robot, tmp_path):
    sound = made.recording(seed=2, speeds=False)
    sign = np.array([1.0, -1.0, 1.0])
    message = made.refusal(dataclasses.replace(sound, q=sign * sound.q, tau=sign * sound.tau), robot, tmp_path)
    assert "both count the other way round" in message and '"q.elbow" = -1' in message and '"tau.elbow" = -1' in message


def test_exchanged_positions_are_recognised(robot, tmp_path):
    sound = made.recording(seed=1, speeds=False)
    assert "exchanged" in made.refusal(dataclasses.replace(sound, q=sound.q[:, [1, 0, 2]]), robot, tmp_path)


def test_gravity_turned_round_in_the_model_is_recognised(sound, robot, tmp_path):
    turned = eqx.tree_at(lambda r: r.gravity, robot, -robot.gravity)
    assert "gravity in the model looks reversed" in made.refusal(sound, turned, tmp_path)


@pytest.mark.parametrize("offset", [2.5, -1.6])
def test_a_zero_far_off_is_recognised_with_its_offset(robot, tmp_path, offset):
    sound = made.recording(seed=1, speeds=False)
    message = made.refusal(dataclasses.replace(sound, q=sound.q + np.array([0.0, offset, 0.0])), robot, tmp_path)
    (said,) = re.findall(r'"q.elbow" = (\S+?),', message)
    assert float(said) == pytest.approx(-offset, abs=0.15)


@pytest.mark.parametrize("offset", [2.5, -1.6])
def test_the_first_joints_zero_far_off_is_recognised_and_may_be_how_the_base_is_mounted(robot, tmp_path, offset):
    sound = made.recording(seed=3, speeds=False)
    message = made.refusal(dataclasses.replace(sound, q=sound.q + np.array([offset, 0.0, 0.0])), robot, tmp_path)
    (said,) = re.findall(r'"q.shoulder" = (\S+?),', message)
    assert float(said) == pytest.approx(-offset, abs=0.15) and "how its base is mounted" in message


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_robot_that_does_not_move_is_refused(sound, robot, tmp_path, noise):
    q = np.full_like(sound.q, 0.3) + noise * np.random.default_rng(0).normal(size=sound.q.shape)
    assert "does not move" in made.refusal(dataclasses.replace(sound, q=q, qd=None), robot, tmp_path)
