"""Recordings that are odd but honest are read; what is repaired, left out or doubted is stated."""

import dataclasses
import pathlib
import re

import equinox as eqx
import helpers_recordings as made
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import irb140_jax as irb
from irb140_jax.recordings import Recording
from irb140_jax.robot import irb140, irb140_path, robot_from_model
from testbed import runner
from testbed.cases import make


@pytest.fixture(scope="module")
def robot():
    return made.robot()


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording()


def passes(recording, robot, tmp_path):
    assert len(made.read_of(recording, robot, tmp_path).t) == len(recording.t)


def test_a_slow_motion_seen_by_a_coarse_encoder_is_not_taken_for_degrees(tmp_path):
    robot, arm = irb140(), mujoco.MjModel.from_xml_path(str(irb140_path()))
    slower, step = 8.0, np.radians(1.0)
    t, q, qd, qdd = made.motion(6, size=3.0, duration=3.0, rate=2000.0)
    tau = made.rigid_torque(arm, q, qd / slower, qdd / slower**2)
    slow = Recording(t=slower * t, q=step * np.round(q / step), tau=tau, joint_names=robot.joint_names)
    np.testing.assert_array_equal(made.read_of(slow, robot, tmp_path).q, slow.q)


@pytest.mark.parametrize("seed", range(3))
def test_a_rotor_or_a_load_that_makes_a_wrists_torque_a_hundred_times_as_large_is_no_other_unit(tmp_path, seed):
    light = made.model()
    light.body_mass[-1:], light.body_inertia[-1:] = 0.005, 1e-5
    robot = robot_from_model(light, source="a wrist of nearly no mass")
    passes(made.recording(seed=seed, friction=0.0), robot, tmp_path)
    geared = made.recording(seed=seed, friction=0.0, arm=light)
    rotor = 0.1 * np.gradient(made.motion(3, seed=seed)[2][:, 2], geared.t)
    passes(dataclasses.replace(geared, tau=geared.tau + rotor[:, None] * np.array([0, 0, 1.0])), robot, tmp_path)


def test_a_zero_within_reach_of_a_diagnosis_passes(robot, tmp_path):
    sound = made.recording(seed=2, speeds=False)
    for j in (0, 1):
        passes(dataclasses.replace(sound, q=sound.q + 0.4 * np.eye(3)[j]), robot, tmp_path)


@pytest.mark.parametrize(("seed", "mass", "place"), [
    (5, 4.9, (-0.21, 0.30, -0.35)), (3, 1.5, (-0.09, -0.34, -0.02)), (4, 1.8, (-0.30, -0.34, 0.03)),
    (0, 3.5, (0.20, -0.26, -0.09)), (3, 2.3, (0.26, -0.26, 0.07)),
])  # fmt: skip
def test_a_payload_that_the_model_leaves_out_is_no_wrong_channel(robot, tmp_path, seed, mass, place):
    arm = made.model()
    own = arm.body_mass[-1]
    arm.body_ipos[-1] = (own * arm.body_ipos[-1] + mass * np.array(place)) / (own + mass)
    arm.body_mass[-1] = own + mass
    # Each looks like a channel that is wrong otherwise, and that stays said.
    notes = made.read_of(made.recording(seed=seed, speeds=False, arm=arm, friction=0.0), robot, tmp_path).notes
    assert any("a payload that the model leaves out" in note for note in notes)


@pytest.mark.parametrize("angle", [1.2, 1.9])
def test_a_centre_of_mass_that_hangs_elsewhere_on_the_last_link_is_no_wrong_zero_or_axis(robot, tmp_path, angle):
    sound = made.recording(seed=1, speeds=False)
    com, axis = np.array(robot.com), np.asarray(robot.axis)[-1]
    com[-1] = Rotation.from_rotvec(angle * axis).apply(com[-1])
    made.read_of(sound, eqx.tree_at(lambda r: r.com, robot, jnp.asarray(com)), tmp_path)


def test_a_drive_that_lags_by_much_is_no_reversed_torque(tmp_path):
    arm = made.model(pendulum=True)
    t = np.arange(3000) / 250
    w, a = np.array([8.5, 10.0, 11.0]), np.array([0.3, 0.2, 0.2])
    wave = lambda f, k: (f(np.outer(t, w)) @ (a * w**k))[:, None]  # noqa: E731
    q, qd, qdd = wave(np.sin, 0), wave(np.cos, 1), -wave(np.sin, 2)
    tau = made.rigid_torque(arm, q, qd, qdd) + 6.0 * np.sign(qd) + 2.0 * qd
    late = np.interp(t - 0.3, t, tau[:, 0])[:, None]
    recording = made.read_of(Recording(t, q, late, ("hinge",)), made.robot(pendulum=True), tmp_path)
    assert "comes about 3" in " ".join(recording.notes)


def later(recording, delay):
    tau = np.stack([np.interp(recording.t - delay, recording.t, x) for x in recording.tau.T], axis=1)
    return dataclasses.replace(recording, tau=tau)


@pytest.mark.parametrize("delay", [0.155, -0.1])
def test_torque_that_is_out_of_step_by_more_than_a_diagnosis_finds_is_stated(sound, robot, tmp_path, delay):
    for recording, arm in [*((r, irb140()) for r in made.shipped()), (sound, robot)]:
        notes = " ".join(made.read_of(later(recording, delay), arm, tmp_path).notes)
        (said,) = re.findall(r"most joints comes about (\d+) ms (\w+)", notes)
        assert float(said[0]) == pytest.approx(1000 * abs(delay), abs=5) and (said[1] == "after") == (delay > 0)


@pytest.mark.parametrize("delay", [0.0, 0.025])
def test_delays_that_a_diagnosis_finds_are_no_note_of_the_reading(sound, robot, tmp_path, delay):
    for recording, arm in [*((r, irb140()) for r in made.shipped()), (sound, robot)]:
        assert made.read_of(later(recording, delay), arm, tmp_path).notes == ()


def test_a_dead_torque_leaves_its_joint_out_and_says_so(sound, robot, tmp_path):
    tau = sound.tau.copy()
    tau[:, 1] = 0.0
    again = made.read_of(dataclasses.replace(sound, tau=tau), robot, tmp_path)
    assert again.torque_lost is not None and again.torque_lost.all(axis=0).tolist() == [False, True, False]
    assert "tau.elbow is 0 in every row" in " ".join(again.notes) and "elbow is not judged" in " ".join(again.notes)


def test_a_torque_that_freezes_is_left_out_from_there_on(sound, robot, tmp_path):
    tau = sound.tau.copy()
    tau[1200:, 0] = tau[1200, 0]
    again = made.read_of(dataclasses.replace(sound, tau=tau), robot, tmp_path)
    assert again.torque_lost is not None
    np.testing.assert_array_equal(np.flatnonzero(again.torque_lost[:, 0]), np.arange(1200, len(tau)))
    assert not again.torque_lost[:, 1:].any() and "tau.shoulder is frozen" in " ".join(again.notes)


@pytest.mark.parametrize("step", [0.05, 2.0])
def test_a_coarse_torque_is_not_frozen(sound, robot, tmp_path, step):
    coarse = dataclasses.replace(sound, tau=step * np.round(sound.tau / step))
    assert made.read_of(coarse, robot, tmp_path).torque_lost is None


def test_an_encoder_that_wraps_is_unwrapped_and_stated(sound, robot, tmp_path):
    q = sound.q + 2.9
    again = made.read_of(dataclasses.replace(sound, q=(q + np.pi) % (2 * np.pi) - np.pi), robot, tmp_path)
    turns = (again.q - q) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.broadcast_to(np.round(turns[0]), turns.shape), atol=1e-9)
    assert "unwrapped" in " ".join(again.notes)


def test_stamps_of_a_clock_slower_than_the_rows_are_spread_and_stated(sound, robot, tmp_path):
    tick = 0.0156  # s, of an operating system; rows come every 4 ms
    coarse = made.read_of(dataclasses.replace(sound, t=np.floor(sound.t / tick) * tick, qd=None), robot, tmp_path)
    # A row is up to a tick older than its stamp; spread evenly, half of that is an offset of all.
    assert np.ptp(coarse.t - sound.t) < 0.25 * tick and np.abs(coarse.t - sound.t).max() < tick
    assert any("the clock ticks every 15.6 ms" in note for note in coarse.notes)


def test_single_positions_out_of_line_are_replaced_and_stated(sound, robot, tmp_path):
    q = sound.q.copy()
    q[[300, 900], 1] += 1.5
    again = made.read_of(dataclasses.replace(sound, q=q), robot, tmp_path)
    # Four milliseconds of this motion bend by less than this.
    np.testing.assert_allclose(again.q, sound.q, atol=1e-3)
    assert "q.elbow: 2 single positions out of line, the first at sample 301" in " ".join(again.notes)


def test_a_saturated_torque_passes_and_is_stated(sound, robot, tmp_path):
    limit = np.quantile(np.abs(sound.tau[:, 0]), 0.9)
    again = made.read_of(dataclasses.replace(sound, tau=np.clip(sound.tau, -limit, limit)), robot, tmp_path)
    assert any(note.startswith("tau.shoulder rests at its") for note in again.notes)


def test_a_joint_beyond_its_limits_passes_and_is_stated(robot, tmp_path):
    again = made.read_of(made.recording(size=6.0), robot, tmp_path)
    assert "beyond the limits in the model" in " ".join(again.notes)


@pytest.mark.parametrize("seed", range(6))
def test_a_model_wrong_by_half_passes(robot, tmp_path, seed):
    arm = made.model()
    rng = np.random.default_rng(seed)
    arm.body_mass[1:] *= rng.uniform(0.5, 1.5, arm.nbody - 1)
    arm.body_ipos[1:] *= rng.uniform(0.5, 1.5, (arm.nbody - 1, 1))
    arm.body_inertia[1:] *= rng.uniform(0.5, 1.5, (arm.nbody - 1, 1))
    passes(made.recording(seed=seed, arm=arm), robot, tmp_path)


@pytest.mark.parametrize("seed", range(4))
def test_friction_above_everything_passes(robot, tmp_path, seed):
    passes(made.recording(seed=seed, friction=60.0), robot, tmp_path)


@pytest.mark.parametrize("seed", range(4))
def test_noise_above_everything_passes(robot, tmp_path, seed):
    passes(made.recording(seed=seed, noise=300.0), robot, tmp_path)


@pytest.mark.parametrize("gravity", [[4.0, 0, -8.9], [0, 6.9, -6.9], [-3.0, 3.0, -8.8]])
def test_a_tilted_base_passes(robot, tmp_path, gravity):
    arm = made.model()
    arm.opt.gravity[:] = gravity
    passes(made.recording(arm=arm), robot, tmp_path)


def test_a_heavy_payload_passes(robot, tmp_path):
    arm = made.model()
    arm.body_mass[-1] *= 10
    passes(made.recording(arm=arm), robot, tmp_path)


def test_a_payload_that_turns_gravity_round_passes(robot, tmp_path):
    arm = made.model()
    arm.body_ipos[-1] *= -1.0
    arm.body_ipos[-2] *= -0.5
    passes(made.recording(arm=arm), robot, tmp_path)


def test_a_counterbalance_that_carries_more_than_gravity_passes(robot, tmp_path):
    sound = made.recording(friction=0.0)
    passes(dataclasses.replace(sound, tau=sound.tau - 60 * np.sin(sound.q) - 80 * sound.q), robot, tmp_path)


def test_a_joint_that_stands_still_passes_and_is_stated(sound, robot, tmp_path):
    _, q, qd, qdd = made.motion(3)
    for x, value in ((q, 0.4), (qd, 0.0), (qdd, 0.0)):
        x[:, 1] = value
    still = dataclasses.replace(sound, q=q, qd=qd, tau=made.rigid_torque(made.model(), q, qd, qdd))
    assert "Joint elbow stands still" in " ".join(made.read_of(still, robot, tmp_path).notes)


def test_a_joint_that_is_carried_along_without_power_passes(sound, robot, tmp_path):
    drag = -0.02 * np.sign(sound.qd) + 0.01 * np.random.default_rng(0).normal(size=sound.q.shape)
    passes(dataclasses.replace(sound, tau=np.where(np.arange(3) == 1, drag, sound.tau)), robot, tmp_path)


@pytest.mark.parametrize("step", [1e-3, 5e-3])
def test_coarse_encoders_pass(robot, tmp_path, step):
    sound = made.recording(speeds=False)
    passes(dataclasses.replace(sound, q=step * np.round(sound.q / step)), robot, tmp_path)


def test_joints_that_move_in_step_pass(tmp_path):
    arm = made.model()
    t, q, qd, qdd = made.motion(1, seed=3)
    q, qd, qdd = (np.repeat(x, 3, axis=1) * np.array([1.0, 0.8, 1.2]) for x in (q, qd, qdd))
    tau = made.rigid_torque(arm, q, qd, qdd) + 0.5 * np.sign(qd)
    passes(Recording(t, q, tau, ("shoulder", "elbow", "wrist"), qd=qd), made.robot(), tmp_path)


@pytest.mark.parametrize("kind", [{"slide": True}, {"pendulum": True}])
def test_slides_and_single_joints_pass(tmp_path, kind):
    passes(made.recording(**kind), made.robot(**kind), tmp_path)


def test_a_pendulum_that_turns_over_many_times_passes(tmp_path):
    arm = made.model(pendulum=True)
    t = np.arange(2000) / 250
    q, qd, qdd = (x[:, None] for x in (6 * t + 0.3 * np.sin(3 * t), 6 + 0.9 * np.cos(3 * t), -2.7 * np.sin(3 * t)))
    tau = made.rigid_torque(arm, q, qd, qdd) + 0.2 * np.sign(qd)
    passes(Recording(t, q, tau, ("hinge",), qd=qd), made.robot(pendulum=True), tmp_path)


def test_noisy_logged_speeds_pass(sound, robot, tmp_path):
    noise = np.random.default_rng(0).normal(size=sound.qd.shape)
    passes(dataclasses.replace(sound, qd=sound.qd + 2 * noise), robot, tmp_path)


@pytest.mark.parametrize("seed", range(3))
def test_the_irb_140_with_random_physics_left_out_passes(tmp_path, seed):
    path = pathlib.Path(irb.__file__).parents[1] / "assets" / "irb140.xml"
    arm, robot = mujoco.MjModel.from_xml_path(str(path)), irb.load_robot(path)
    passes(made.recording(arm=arm, seed=seed, friction=2.0, noise=0.3, size=1.2), robot, tmp_path)


def test_a_torque_of_wrong_inertials_that_has_the_sign_of_its_own_is_not_refused(tmp_path):
    """The model's torque of joint 4 is a fortieth of what is logged, and the poses are few: it looks turned round."""
    runner.read_case(make("final", 39, "06588fc"), tmp_path)


def test_a_centre_of_mass_that_looks_like_another_zero_is_told_and_not_refused(tmp_path):
    _, recordings, _ = runner.read_case(make("final", 53, "06588fc"), tmp_path)
    assert any("the zero of q.j3" in note and "payload" in note for r in recordings for note in r.notes)
