"""A short time in which nothing explains most of the torque is left out of a diagnosis, which says so."""

import dataclasses

import numpy as np
import pytest
from scipy import signal

from irb140_jax.mismatch import diagnose
from irb140_jax.mismatch.validation.competitors import Axis
from irb140_jax.mismatch.validation.unexplained import Structure, When
from irb140_jax.mismatch.validation.unexplained_time import common_time, without
from irb140_jax.recordings import Recording
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import robot_from_model


def left(joint: int, when: When | None) -> Structure:
    return Structure(joint, 0.5, 0.01, "time", 1.0, 0.1, Axis("t", 0), when)


def test_the_time_of_most_joints_is_common_where_theirs_overlap():
    one, other, later = When(1, 3.0, 4.0, 0.9, 0.7), When(1, 3.5, 4.5, 0.8, 0.9), When(1, 8.0, 9.0, 0.9, 0.9)
    assert common_time([left(0, one), left(2, other)], 3, 30.0) == When(1, 3.0, 4.5, 0.8, 0.7)
    assert common_time([left(0, one)], 1, 30.0) == one
    for rest, joints, recorded in (
        ([left(0, one)], 2, 30.0),  # no more than half of the joints
        ([left(0, one), left(1, None)], 2, 30.0),
        ([left(0, one), left(1, later)], 2, 30.0),
        ([left(0, one), left(1, other._replace(recording=0))], 2, 30.0),
        ([left(0, one), left(1, other)], 2, 7.0),  # not short
        ([left(0, one), left(1, other._replace(of_torque=0.3))], 2, 30.0),  # most of the torque is explained
        ([], 2, 30.0),
    ):
        assert common_time(rest, joints, recorded) is None


def test_what_comes_before_and_after_stays():
    t = 2.0 + np.arange(4000) / 200.0
    motion = np.stack([np.sin(t), np.cos(t)], axis=1)
    one, other = (
        Recording(t=t, q=motion, tau=2.0 * motion, joint_names=("a", "b"), source=name, sha256="x") for name in "mn"
    )
    parts = without([one, other], [("m", 10.0, 12.0)])
    assert parts is not None
    before, after, untouched = parts
    assert before.source == "m (2 to 9.795 s)" and after.source.startswith("m (12.2") and untouched is other
    assert before.t[-1] < 10.0 and after.t[0] > 12.0 and len(before.t) + len(after.t) > 3500
    np.testing.assert_array_equal(after.tau[:, 0], 2.0 * np.sin(after.t))
    only = without([one], [("m", 2.5, 12.0)]) or []
    assert [r.t[0] > 12.0 for r in only] == [True]  # half a second before it is nothing
    assert without([one, one], [("m", 10.0, 12.0)]) is None


@pytest.fixture(scope="module")
def arm():
    xml = random_robot(2, 3, slides=0.0)
    robot = robot_from_model(arm_spec(xml).compile(), "random")
    hidden = [Concealment("viscous_friction", (robot.joint_names[1],), 0.3)]
    return robot, conceal(xml, hidden, three_motions(robot, 8.0, seed=2), seed=3)


def test_seconds_of_another_torque_are_told_and_spoil_nothing_else(arm):
    robot, case = arm
    recordings, hit = list(case.recordings), case.recordings[1]
    low = signal.butter(2, 3.0, fs=1.0 / float(np.median(np.diff(hit.t))), output="sos")
    other = signal.sosfiltfilt(low, np.random.default_rng(0).normal(size=hit.tau.shape), axis=0)
    other *= 3.0 * np.std(hit.tau, axis=0) / np.std(other, axis=0)
    then = (hit.t > 3.0) & (hit.t < 4.5)
    recordings[1] = dataclasses.replace(hit, tau=np.where(then[:, None], other, hit.tau))
    result = diagnose(robot, recordings)
    diagnosis = result.diagnosis
    (finding,) = diagnosis.findings
    (effect,) = case.truth["effects"]
    assert (finding.effect, list(finding.joints)) == (effect["effect"], effect["joints"])
    assert finding.parameters["viscous"].value == pytest.approx(effect["parameters"]["viscous"]["value"], rel=0.01)
    assert diagnosis.unexplained and all(f"s of {hit.source}" in u.where for u in diagnosis.unexplained)
    assert diagnosis.notes[0].startswith("Nothing explains most of the torque of")
    assert diagnosis.notes[0] in diagnosis.summary
    assert result.views.notes == diagnosis.notes
    assert [r.file for r in diagnosis.provenance.recordings] == [r.source for r in recordings]
    assert all((f.rmse_corrected or 0.0) < 2.0 * (f.noise_floor or 0.0) for f in diagnosis.fit.values())


def test_fast_motion_stays_where_a_part_of_its_torque_is_without_a_name(arm):
    robot, _ = arm
    fast = three_motions(robot, 6.0, seed=2)[0]
    slow = [three_motions(robot, 20.0, seed=seed)[2] for seed in (3, 4)]
    hidden = [Concealment("rotor_inertia", ("joint2",), 0.2)]
    case = conceal(random_robot(2, 3, slides=0.0), hidden, [fast, *slow], seed=3)
    recordings = []
    for r in case.recordings:
        qd = np.gradient(r.q, r.t, axis=0)
        drag = np.tanh(3.0 * qd * np.roll(qd, 1, axis=1))  # of two joints' speeds: no law of the library
        recordings.append(dataclasses.replace(r, tau=r.tau + 0.5 * np.std(case.recordings[0].tau, axis=0) * drag))
    diagnosis = diagnose(robot, recordings).diagnosis
    assert any(f"s of {recordings[0].source}" in u.where for u in diagnosis.unexplained)
    assert not any(note.startswith("Nothing explains") for note in diagnosis.notes)
    (finding,) = diagnosis.findings
    inertia, true = finding.parameters["inertia"], case.truth["effects"][0]["parameters"]["inertia"]["value"]
    assert finding.effect == "rotor_inertia" and inertia.value is not None and inertia.std is not None
    assert abs(inertia.value - true) < 3.0 * inertia.std < true
