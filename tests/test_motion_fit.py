"""Parameters of servos that follow the recorded motion."""

import dataclasses
import pathlib
import sys
import types

import numpy as np
import pytest
from helpers import ROOT, recordings_folder
from helpers_servo import KD, KP, RATE, closed_loop, two_links
from scipy import stats

import irb140_jax as irb
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import DiagnoseConfig, diagnose
from irb140_jax.mismatch.motion import fit
from irb140_jax.mismatch.motion.fit import FREEDOM, _improvement, _information, _student, _weights
from irb140_jax.mismatch.motion.free import FreeParameters, as_estimated, as_predicted
from irb140_jax.mismatch.regression.gaussian import log_odds_of_any, log_odds_of_some
from irb140_jax.mismatch.regression.sensor_noise import scatter_by_sensor
from irb140_jax.mismatch.regression.sufficient_data import comparison
from irb140_jax.mismatch.selection.explain import explain
from irb140_jax.mismatch.validation.held_out import recordings_of_blocks
from irb140_jax.recordings import stated_drive

sys.path.insert(0, str(ROOT / "experiments"))
import real_servos

LIBRARY = ("coulomb_friction", "viscous_friction", "rotor_inertia", "torque_offset")
STATED = stated_drive(np.array(KP), np.array(KD))
GOAL = 0.0325  # rad, mean absolute error of position on runs that are kept back: see real_bam_xl330.py


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "arm.xml"
    path.write_text(two_links(actuators=""))
    return irb.load_robot(path)


def _weaker_than_stated(seeds):
    """Logs of two servos of 0.8 times the stated gains, whose joints rub with 0.5 and 0.25 N m."""
    kp, kd = (tuple(0.8 * x for x in gains) for gains in (KP, KD))
    plant = two_links(kp, kd, shoulder='frictionloss="0.5"', elbow='frictionloss="0.25"')
    return [dataclasses.replace(closed_loop(plant, seed)[0], drive=STATED) for seed in seeds]


# --- its parts -------------------------------------------------------------------------------------------------------


def test_the_usual_size_of_an_error_is_that_of_students_distribution():
    square = stats.f(1, FREEDOM).rvs((4000, 2), random_state=1) * [4.0, 0.01]  # squares of Student's t
    weight, size = _student(square)
    np.testing.assert_allclose(size, [4.0, 0.01], rtol=0.1)
    assert weight[np.argmax(square[:, 0]), 0] < 0.1 < 1.0 < weight[np.argmin(square[:, 0]), 0]


def test_joints_that_follow_the_recording_and_short_windows_count_for_nothing():
    errors = np.random.default_rng(2).normal(size=(6, 40, 3))
    errors[..., 1], errors[0] = np.nan, np.nan
    weight = _weights(errors)
    assert weight.shape == (6, 1, 3) and np.isnan(weight[0]).all() and np.isnan(weight[..., 1]).all()
    assert (weight[1:, :, [0, 2]] > 0.0).all()
    assert np.isfinite(_weights(0.0 * errors)[1:, :, [0, 2]]).all()


def test_the_improvement_is_the_share_of_the_error_that_is_gone():
    errors = np.random.default_rng(0).normal(size=(20, 50, 3))
    errors[:, :5], errors[..., 2] = np.nan, np.nan
    assert abs(_improvement(0.5 * errors, errors) - 0.5) < 1e-9
    assert abs(_improvement(errors, errors)) < 1e-9


@pytest.mark.parametrize("repeats", [1, 4])
def test_windows_that_are_wrong_alike_tell_as_much_as_one(repeats):
    """Of scores with the information's covariance, each `repeats` times over in its motion."""
    rng, motions, own = np.random.default_rng(3), 4000, np.array([[2.0, 0.5], [0.5, 1.0]])
    scores = np.repeat(rng.multivariate_normal(np.zeros(2), own, motions), repeats, axis=0)
    far = np.full(2, np.inf)
    free = types.SimpleNamespace(precision=np.eye(2), mean=np.zeros(2), low=-far, high=far)
    given = np.tile(own, (len(scores), 1, 1)), scores, np.arange(motions).repeat(repeats).tolist(), np.zeros(2)
    told = _information(*given, free)  # pyright: ignore[reportArgumentType]: what it asks of free parameters
    assert abs(told - 1.0 / repeats) < 0.1 / repeats


def test_what_masses_say_of_gains_is_in_one_of_the_priors(robot):
    """Both servos are a fifth weaker than is stated, and both joints rub."""
    data = comparison(robot, _weaker_than_stated((1, 2)), 0.05, lambda _: None)
    scatter = np.hypot(*scatter_by_sensor(robot, data.recordings, data.smooth, data.band))
    ex = explain(robot, data.smooth, data.band, [CATALOGUE[slug] for slug in LIBRARY], 0.05, scatter)
    assert data.servo is not None
    some = recordings_of_blocks(ex) == 0
    stated, *found = (
        prior_of(ex, data.servo.drive, without)
        for prior_of, without in ((as_predicted, None), (as_estimated, None), (as_estimated, some))
    )
    np.testing.assert_array_equal(stated.gains, [[0.0, w] for w in data.servo.drive.kp_width])
    for prior in found:
        off, width = (prior.gains - [-0.2, 0.0]).T
        assert (np.abs(off) < 2.0 * width).all() and (width < 0.6 * data.servo.drive.kp_width).all()


def test_odds_that_parameters_are_not_zero_are_the_ratio_of_prior_and_posterior_density_there():
    mean, cov, prior = np.array([0.3, -0.5]), np.array([[0.04, 0.01], [0.01, 0.09]]), np.array([1.0, 2.0])
    # That of a Gaussian at zero but for a constant.
    density = lambda mean, cov: -0.5 * (mean @ np.linalg.inv(cov) @ mean + np.log(np.linalg.det(cov)))  # noqa: E731
    ratio = density(np.zeros(2), np.diag(prior**2)) - density(mean, cov)
    assert abs(log_odds_of_some(mean, cov, prior) - ratio) < 1e-12
    ratio = stats.norm.logpdf(0.0, 0.0, 2.0) - stats.norm.logpdf(0.0, 1.3, 0.2)
    assert abs(log_odds_of_any(1.3, 0.2, 2.0) - ratio) < 1e-12


def test_effects_of_which_nothing_need_be_left_are_not_needed():
    """One is five standard deviations from zero, one is three, and one has two amplitudes of which one is six."""
    candidates = [types.SimpleNamespace(slug=slug, joints=(0,)) for slug in ("sure", "unsure", "both")]
    space = types.SimpleNamespace(kinds=types.SimpleNamespace(log_prior=lambda chosen: -3.0 * len(chosen)))
    ex = types.SimpleNamespace(chosen=(0, 1, 2), others=lambda i: tuple({0, 1, 2} - {i}), space=space,
                               data=types.SimpleNamespace(candidates=candidates))  # fmt: skip
    own = [(0, np.array([0]), np.array([20.0])), (1, np.array([1]), np.array([20.0])),
           (2, np.array([2, 3]), np.array([20.0, 20.0]))]  # fmt: skip
    free = types.SimpleNamespace(ex=ex, own_amplitudes=lambda: own)
    found = types.SimpleNamespace(x=np.array([5.0, 3.0, 0.0, 6.0]), precision=np.eye(4))
    assert fit._unneeded(free, found) == (("unsure", (0,)),)  # pyright: ignore[reportArgumentType]: what it asks of them


def test_where_the_torque_lags_commands_and_damping_are_as_unsure(robot):
    """No simulation holds a lag: in one the same time is lost by commands, or by damping that is less."""
    rubbing = two_links(shoulder='frictionloss="0.5"', elbow='frictionloss="0.25"', actuators="")
    logs = [dataclasses.replace(closed_loop(rubbing, seed, lag=0.008)[0], drive=STATED) for seed in (1, 2)]
    result = diagnose(robot, logs, DiagnoseConfig(effects=(CATALOGUE["coulomb_friction"],)))
    data = comparison(robot, logs, 0.05, lambda _: None)
    scatter = np.hypot(*scatter_by_sensor(robot, data.recordings, data.smooth, data.band))
    ex = explain(robot, data.smooth, data.band, [CATALOGUE["coulomb_friction"]], 0.05, scatter,
                 later=lambda times: data.later(times).smooth)  # fmt: skip
    free = FreeParameters.of(ex, result.model, data, (), as_predicted)
    width = {(w.kind, w.at): unit for w, unit in zip(free.parameters, free.unit, strict=True)}
    assert data.servo is not None
    lag = ex.torque_lag(data.servo.drive)
    assert lag > 0.006 and width["later", -1] > lag and all(width["kd", j] > lag * KP[j] for j in (0, 1))


# --- whole diagnoses -------------------------------------------------------------------------------------------------


def test_gains_that_are_stated_wrong_and_friction_follow_the_motion(robot, monkeypatch):
    """Both servos are a fifth weaker than is stated, and both joints rub."""
    runs, tried = _weaker_than_stated((1, 2, 3)), []
    monkeypatch.setattr(fit, "_improvement", lambda *errors: tried.append(_improvement(*errors)) or tried[-1])
    result = diagnose(robot, runs[:2], DiagnoseConfig(effects=tuple(CATALOGUE[slug] for slug in LIBRARY)))
    found = {f.joints[0]: f.parameters["coulomb"] for f in result.diagnosis.findings if "coulomb" in f.parameters}
    assert set(found) == {"shoulder", "elbow"}
    for joint, true in (("shoulder", 0.5), ("elbow", 0.25)):
        value, std = found[joint].value, found[joint].std
        assert value and std and abs(value - true) < 2.0 * std
    (said,) = (note for note in result.diagnosis.notes if "follows the positions best" in note)
    assert len(tried) > 1 and f"nearer to the positions by {100 * max(tried):.0f} %" in said
    # A second after a start whose speed it is not told, it is where the robot is.
    apart = real_servos.off(result, runs[2:])["corrected"][0][int(RATE) :]
    assert (np.sqrt(np.mean(apart**2, axis=0)) < 5e-4 * np.ptp(runs[2].q, axis=0)).all()


def test_what_the_motion_speaks_against_is_not_named(robot, monkeypatch):
    """The friction of the elbow is taken to be such: it is not named, and a note says so."""
    against = ("coulomb_friction", (1,))
    monkeypatch.setattr(fit, "_unneeded", lambda free, found: (against,))
    config = DiagnoseConfig(effects=(CATALOGUE["coulomb_friction"],))
    found = diagnose(robot, _weaker_than_stated((1, 2)), config).diagnosis
    assert {f.joints for f in found.findings} == {("shoulder",)}
    assert any(n.startswith("Coulomb friction on elbow would fit the torque") for n in found.notes)


def test_a_real_servo_goes_where_its_numbers_in_motion_say(tmp_path: pathlib.Path):
    """A hobby servo from goals and positions alone: the runs with another gain are kept back."""
    recordings_folder()
    said = real_servos.bam(tmp_path)
    (finding,) = said["findings"]
    assert finding["effect"] == "load_dependent_friction"
    assert said["position_error"]["corrected"] <= GOAL < 0.5 * said["position_error"]["refit"]
