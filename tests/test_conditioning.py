"""Smoothing, differentiation and bandwidth: known motions come out as they are, whatever the log did to them."""

import dataclasses

import numpy as np
import pytest
from helpers import random_robot
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from irb140_jax import dynamics
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel, predict
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import condition, conditioned
from irb140_jax.recordings.direction import direction_of
from irb140_jax.recordings.low_pass import Band, filtered, kernels
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.smooth import signal_weights

BAND = Band(torque=15.0, position=24.0, rate=200.0, step=5)
RATE = 500.0  # Hz of the logs


def times(duration=8.0, rate=RATE):
    return np.arange(round(duration * rate)) / rate


def logged(t, q, tau=None):
    """A recording of one joint."""
    q = np.asarray(q).reshape(len(t), 1)
    return Recording(t, q, np.zeros_like(q) if tau is None else np.asarray(tau).reshape(len(t), 1), ("joint1",))


def wave(t, frequency=1.0):
    """Position, speed and acceleration of a sine of amplitude 1."""
    w = 2.0 * np.pi * frequency
    return np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)


def worst(estimate, truth, rows: np.ndarray | bool = True):
    """Largest error in some rows, as a share of the largest true value."""
    return np.max(np.where(rows, np.abs(estimate - truth), 0.0)) / np.max(np.abs(truth))


@pytest.mark.parametrize("frequency", [0.2, 1.0, 4.0])
@pytest.mark.parametrize("rate", [125.0, 500.0, 1000.0])
def test_derivatives_of_sines_well_inside_the_band_are_right_to_a_hundredth(frequency, rate):
    t = times(rate=rate)
    r = condition(logged(t, wave(t, frequency)[0]), BAND)
    # Ripple of the window's pass band, and linear interpolation onto the grid; more where it is differentiated twice.
    for estimate, truth, ripple in zip((r.q, r.qd, r.qdd), wave(r.t, frequency), (1e-3, 4e-3, 1.3e-2), strict=True):
        linear = (2.0 * np.pi * frequency / rate) ** 2 / 8.0
        assert worst(estimate[:, 0], truth) < ripple + linear


def test_derivatives_of_parabolas_are_exact():
    t = times()
    r = condition(logged(t, 0.3 - 0.7 * t + 0.45 * t**2), BAND)
    # At the log's own samples, where nothing is interpolated: rounding, differentiated twice; and at frequencies where
    # the parabola's power is below rounding it counts as noise.
    at_samples = np.isclose((r.t * RATE) % 1.0, 0.0, atol=1e-6) | np.isclose((r.t * RATE) % 1.0, 1.0, atol=1e-6)
    assert at_samples.sum() > 100
    np.testing.assert_allclose(r.qd[at_samples, 0], (-0.7 + 0.9 * r.t)[at_samples], atol=3e-7)
    np.testing.assert_allclose(r.qdd[at_samples, 0], 0.9, atol=5e-5)


def test_ends_that_the_smoother_cannot_fill_are_left_out_unless_padded():
    t = times()
    recording = logged(t, wave(t)[0])
    inside, padded = condition(recording, BAND), condition(recording, BAND, pad=True)
    assert inside.t[0] > t[0] and inside.t[-1] < t[-1]
    assert padded.t[0] == t[0] and padded.t[-1] >= t[-1] - 1.0 / BAND.rate
    assert np.isfinite(padded.qdd).all()


@pytest.mark.parametrize("fastest", [0.7, 3.0])
def test_a_recording_that_begins_and_ends_in_motion_is_smoothed_well_up_to_its_ends(fastest):
    rng, t = np.random.default_rng(1), times(15.0)
    rate, phase = 2.0 * np.pi * rng.uniform(0.1, fastest, 4), rng.uniform(0.0, 2.0 * np.pi, 4)
    q = np.sum(np.sin(rate * t[:, None] + phase), axis=1) + 1e-5 * rng.normal(size=len(t))
    r = condition(logged(t, q), BAND)
    truth = -np.sum(rate**2 * np.sin(rate * r.t[:, None] + phase), axis=1)
    ends = (r.t < 1.0) | (r.t > t[-1] - 1.0)
    error = np.sqrt(np.mean((r.qdd[ends, 0] - truth[ends]) ** 2) / np.mean(truth**2))
    assert error < 0.01


def test_jittered_time_costs_little_accuracy():
    t = times()
    t = t + np.random.default_rng(0).uniform(-0.3, 0.3, len(t)) / RATE
    r = condition(logged(t, wave(t)[0]), BAND)
    q, qd, qdd = wave(r.t)
    # Cubic interpolation between the samples.
    assert worst(r.qd[:, 0], qd) < 3e-3 and worst(r.qdd[:, 0], qdd) < 1e-2
    assert worst(r.q[:, 0], q) < 1e-3


def test_two_alternating_time_steps_cost_little_accuracy():
    t = np.cumsum(np.where(np.arange(1000) % 2, 0.008, 0.012))
    r = condition(logged(t, wave(t)[0]), BAND)
    assert worst(r.qd[:, 0], wave(r.t)[1]) < 5e-3 and worst(r.qdd[:, 0], wave(r.t)[2]) < 2e-2


def test_lost_samples_do_not_count_and_the_rest_stays_accurate():
    t = times()
    lost = (t > 3.0) & (t < 3.1)
    r = condition(logged(t[~lost], wave(t)[0][~lost]), BAND)
    in_gap = (r.t > 3.01) & (r.t < 3.09)
    assert not r.usable[in_gap].any()
    far = np.abs(r.t - 3.05) > 0.5
    assert r.usable[far].mean() > 0.9
    assert worst(r.qdd[:, 0], wave(r.t)[2], far) < 1e-2


def test_single_lost_samples_are_bridged():
    t = times()
    kept = np.random.default_rng(1).random(len(t)) > 0.03
    kept[[0, -1]] = True
    r = condition(logged(t[kept], wave(t)[0][kept]), BAND)
    assert r.usable.mean() > 0.9
    assert worst(r.qdd[:, 0], wave(r.t)[2]) < 1e-2


def test_quantised_positions_give_speeds_far_better_than_their_steps():
    t, step = times(), 1e-3
    q, _, _ = wave(t, 0.5)
    r = condition(logged(t, step * np.round(q / step)), BAND)
    naive = np.max(np.abs(np.diff(step * np.round(q / step)) * RATE - np.diff(q) * RATE))
    # White rounding noise step/sqrt(12) through the differentiator: a few hundredths of what differences make.
    assert np.max(np.abs(r.qd[:, 0] - wave(r.t, 0.5)[1])) < 0.1 * naive


def test_resting_speed_is_three_deviations_of_what_encoder_noise_makes():
    t, rng = times(20.0), np.random.default_rng(2)
    q = 0.2 * wave(t, 0.3)[0]
    r = condition(logged(t, q + 2e-3 * rng.normal(size=len(t))), BAND)
    error = np.std(r.qd[:, 0] - 0.2 * wave(r.t, 0.3)[1])
    # Where noise ends and signal begins is known to a window's resolution: a few tenths of the speed's small noise.
    assert r.rest_speed[0] == pytest.approx(3.0 * error, rel=0.4)


def test_encoder_noise_above_the_motion_does_not_fill_the_acceleration():
    t, rng = times(20.0), np.random.default_rng(3)
    q = wave(t, 0.3)[0]
    noise = 2e-5 * rng.normal(size=len(t))
    r = condition(logged(t, q + noise), BAND)
    error = np.std(r.qdd[:, 0] - wave(r.t, 0.3)[2])
    # White noise of density 2 sigma^2/rate through w^2 up to the band's end.
    in_band = 2e-5 * np.sqrt(2.0 / RATE * (2.0 * np.pi) ** 4 * BAND.position**5 / 5.0)
    assert error < 0.1 * in_band  # the motion ends at 0.3 Hz, the band far above


def through(sign, step=0.005):
    """The direction of these signs, 0 for unknown."""
    speeds = np.asarray(sign, dtype=float)[:, None]
    speeds = np.where(speeds == 0.0, 1e-9, speeds)
    return direction_of(speeds, np.zeros_like(speeds), np.array([1e-4]), np.array([1e-3]), 1.0 / step)[:, 0]


def test_over_a_reversal_that_sticks_the_direction_runs_evenly_from_sign_to_sign():
    d = through([-1.0] * 100 + [0.0] * 9 + [1.0] * 100)
    assert d[:99] == pytest.approx(-1.0) and d[109:] == pytest.approx(1.0)
    # A hundredth of a second at either end it still comes to rest from the speed at which it counts as slow.
    assert d[101:108] == pytest.approx(np.linspace(-1.0, 1.0, 7))


def test_a_smoother_that_rings_where_a_joint_sticks_shows_no_reversals():
    """Brought to rest, held for 80 ms, and off the other way, as a smoother of 32 Hz shows it."""
    rate, slope = 1000.0, 3.0
    t = np.arange(-1.0, 1.0, 1.0 / rate)
    true = slope * (np.minimum(t + 0.04, 0.0) + np.maximum(t - 0.04, 0.0))[:, None]
    smooth, qdd = (filtered(x, kernels(32.0, rate)[0]) for x in (true, np.gradient(true, 1.0 / rate, axis=0)))
    ringing = smooth[np.abs(t) < 0.03]
    assert np.ptp(np.sign(ringing)) == 2.0 and np.abs(ringing).max() > 1e-3
    d = direction_of(smooth, qdd, np.array([1e-4]), np.array([1e-3]), rate)[:, 0]
    np.testing.assert_allclose(d, np.clip(t / 0.04, -1.0, 1.0), atol=0.12)


def test_over_a_quick_reversal_the_direction_turns_when_the_speed_does():
    # At a constant deceleration, through zero a fifth of the way between two samples.
    rate, speed = 200.0, 0.05 * (np.arange(-20, 20) + 0.2)[:, None]
    d = direction_of(speed, np.full_like(speed, 0.05 * rate), np.array([1e-6]), np.array([1e-3]), rate)[:, 0]
    assert d[:20] == pytest.approx(-1.0, abs=1e-4) and d[21:] == pytest.approx(1.0, abs=1e-4)
    # The sample stands for half a step to either side: it moved backwards for .3 of its time, forwards for .7.
    assert d[20] == pytest.approx(0.7 - 0.3, abs=1e-3)


def test_noise_rounds_the_direction_off_no_further_than_it_hides_the_sign():
    speed = np.concatenate([-np.ones(100), [-9e-4, -3e-4, 3e-4, 9e-4], np.ones(100)])[:, None]
    d = direction_of(speed, np.zeros_like(speed), np.array([3e-4]), np.array([1e-3]), 200.0)
    assert d == pytest.approx(np.tanh(speed / 3e-4), abs=1e-6)


def test_a_joint_that_starts_has_run_up_to_its_friction_and_one_that_ends_at_rest_is_held():
    d = through([0.0] * 100 + [1.0] * 100 + [0.0] * 10)
    assert d[:81] == pytest.approx(0.0, abs=1e-5) and d[90] == pytest.approx(0.5)
    assert d[110:] == pytest.approx(1.0)


def test_after_a_long_rest_friction_is_not_known():
    d = through([1.0] * 100 + [0.0] * 60)
    assert d[100:] == pytest.approx(0.0, abs=1e-5)


def test_a_joint_that_never_moves_has_no_direction():
    assert through([0.0] * 200) == pytest.approx(0.0, abs=1e-5)


def test_torque_where_a_joint_sticks_comes_nearer_than_by_the_speed_alone():
    """A mass on dry friction, dragged by a stiff spring: what the spring gives is the torque."""
    dt, t = 1e-4, np.arange(0.0, 8.0, 1e-4)
    mass, friction, spring, damper = 1.0, 10.0, 1e3, 60.0
    goal, goal_speed, _ = wave(t, 0.25)
    q, torque, x, v = np.empty_like(t), np.empty_like(t), 0.0, 0.0
    for i in range(len(t)):
        q[i], torque[i] = x, spring * (goal[i] - x) + damper * (goal_speed[i] - v)
        free = v + dt * torque[i] / mass
        v = np.sign(free) * max(abs(free) - dt * friction / mass, 0.0)  # rests if friction can take all of it
        x += dt * v
    every, step = slice(None, None, 20), 2e-5
    r = condition(logged(t[every], step * np.round(q[every] / step), torque[every]), BAND)
    error = lambda d: np.sqrt(np.mean((mass * r.qdd + friction * d - np.interp(r.t, t, torque)[:, None]) ** 2))  # noqa: E731
    assert error(r.direction) < 0.8 * error(np.tanh(r.qd / r.rest_speed))


def test_a_joint_at_rest_does_not_count_and_a_moving_one_does():
    t = times()
    q = np.where(t < 4.0, 0.0, 0.5 * (t - 4.0) ** 2)
    r = condition(logged(t, q), BAND)
    assert not r.usable[r.t < 3.5].any()
    assert r.usable[r.t > 4.5].all()


def test_a_reversal_is_no_rest():
    t = times()
    r = condition(logged(t, wave(t)[0]), BAND)
    assert r.usable.all()


def test_notes_of_the_recording_are_kept():
    recording = dataclasses.replace(logged(times(), wave(times())[0]), notes=("joint1 was in degrees",))
    assert condition(recording, BAND).notes == ("joint1 was in degrees",)


@given(
    torque=st.floats(2.0, 20.0), rate=st.floats(100.0, 400.0), step=st.integers(1, 9), extra=st.integers(0, 400)
)
@settings(max_examples=60, deadline=None)
def test_the_low_pass_keeps_ramps_at_the_samples_that_it_says(torque, rate, step, extra):
    band = Band(torque, 1.6 * torque, rate, step)
    length = len(band.low_pass()) + step + extra
    ramp = np.arange(length, dtype=float)
    kept = band.kept(length)
    assert len(kept) == len(band.apply(ramp))
    # Symmetric taps that add up to 1: a ramp is its own mean, to rounding.
    np.testing.assert_allclose(band.apply(ramp), kept, rtol=1e-9)
    np.testing.assert_allclose(band.apply(np.ones((length, 2, 3))), 1.0, rtol=1e-12)


@pytest.mark.parametrize("step", [1, 5])
def test_the_low_pass_is_the_plain_convolution_at_the_kept_samples(step):
    band = dataclasses.replace(BAND, step=step)
    x = np.random.default_rng(5).normal(size=(700, 2))
    whole = np.stack([np.convolve(column, band.low_pass(), mode="same") for column in x.T], axis=1)
    np.testing.assert_allclose(band.apply(x), whole[band.kept(len(x))], atol=1e-12)


def test_the_low_pass_passes_what_is_below_the_cut_off_and_stops_what_is_above():
    t = times(rate=BAND.rate)
    size = lambda f: np.sqrt(2.0 * np.mean(BAND.apply(np.sin(2.0 * np.pi * f * t)) ** 2))  # noqa: E731
    assert size(0.5 * BAND.torque) == pytest.approx(1.0, abs=3e-3)
    assert size(BAND.torque) == pytest.approx(0.5, abs=0.03)
    assert size(1.6 * BAND.torque) < 2e-3


def test_too_short_a_recording_leaves_nothing():
    assert BAND.apply(np.ones((10, 2))).shape == (0, 2)
    assert len(BAND.kept(10)) == 0


@pytest.mark.parametrize("rate", [60.0, 125.0, 500.0, 1000.0])
def test_the_chosen_band_fits_the_recording_and_leaves_no_aliases(rate):
    robot = random_robot("H", 3)[0]
    t = times(20.0, rate)
    q = 0.8 * wave(t, 0.4)[0] + 0.1 * wave(t, 2.0)[0] + 2e-5 * np.random.default_rng(6).normal(size=len(t))
    recording = dataclasses.replace(logged(t, q), joint_names=robot.joint_names)
    torque = dynamics.inverse_dynamics_batch(robot, *(x[:, None] for x in (q, *_derivatives(t))))
    band = choose_band([dataclasses.replace(recording, tau=np.asarray(torque))], robot)
    assert 0.0 < band.torque <= 20.0 and band.torque < band.position <= 0.5 * rate
    assert band.rate <= rate + 1e-9
    assert band.rate / band.step >= 2.0 * band.torque
    # The low-pass must still do something between its cut-off and half the rate at which samples are kept.
    assert band.torque > 2.0


def _derivatives(t):
    fast, slow = wave(t, 2.0), wave(t, 0.4)
    return [0.8 * a + 0.1 * b for a, b in zip(slow[1:], fast[1:], strict=True)]


def corrected_model(robot, *named):
    phi = np.asarray(robot.phi)
    return CorrectedModel(robot, phi, 1.1 * phi, named, BAND, np.full(robot.n, 1e-3))


@pytest.mark.parametrize("rate", [125.0, 500.0])
def test_predictions_have_one_row_a_row_and_are_right_up_to_the_ends(rate):
    robot = random_robot("H", 3)[0]
    t = np.append(times(4.0, rate), 4.0)
    q, qd, qdd = 0.5 * np.array(wave(t + 0.6, 0.5))  # no symmetry about either end
    recording = dataclasses.replace(logged(t, q), joint_names=robot.joint_names)
    named = Named(CATALOGUE["viscous_friction"], (0,), (0,), np.array([2.5]), np.zeros(0))
    out = predict(corrected_model(robot, named), recording)
    assert set(out) == {"nominal", "refit", "corrected"} and all(x.shape == q[:, None].shape for x in out.values())
    motion = [x[:, None] for x in (q, qd, qdd)]
    nominal = np.asarray(dynamics.inverse_dynamics_batch(robot, *motion))
    moving = np.abs(qd) > 0.1  # else dry friction is rounded off
    scale = np.max(np.abs(nominal))
    # Ripple of the smoother, interpolation back onto the rows, and what is guessed of the motion beyond the ends.
    assert np.max(np.abs(out["nominal"] - nominal)[moving]) < 0.02 * scale
    np.testing.assert_array_equal(out["refit"], out["nominal"])
    # The corrected model: heavier by a tenth, and rubbing.
    rigid = np.asarray(dynamics.regressor_batch(robot, *motion)) @ np.asarray(robot.phi).ravel()
    expected = nominal + 0.1 * rigid + 2.5 * motion[1]
    assert np.max(np.abs(out["corrected"] - expected)[moving]) < 0.02 * np.max(np.abs(expected))


def test_predictions_follow_the_rows_where_time_jitters_and_samples_are_lost():
    robot = random_robot("H", 3)[0]
    t = times(4.0)
    t = t + np.random.default_rng(7).uniform(-0.2, 0.2, len(t)) / RATE
    t = t[(t < 2.0) | (t > 2.05)]
    recording = dataclasses.replace(logged(t, 0.5 * wave(t, 0.5)[0]), joint_names=robot.joint_names)
    out = predict(corrected_model(robot), recording)
    nominal = np.asarray(dynamics.inverse_dynamics_batch(robot, *(0.5 * x[:, None] for x in wave(t, 0.5))))
    moving = np.abs(wave(t, 0.5)[1]) > 0.2
    assert out["nominal"].shape == nominal.shape
    assert np.max(np.abs(out["nominal"] - nominal)[moving]) < 0.02 * np.max(np.abs(nominal))


def test_predictions_for_another_robot_are_refused_with_both_lists_of_joints():
    robot = random_robot("H", 3)[0]
    t = times(2.0)
    recording = dataclasses.replace(logged(t, wave(t)[0]), joint_names=("elbow",))
    with pytest.raises(InputError, match="elbow.*joint1"):
        predict(corrected_model(robot), recording)


def test_a_joint_that_sticks_while_its_encoder_flickers_between_two_counts_is_at_rest():
    count, t = 2.0 * np.pi / 4096.0, times()
    moving = np.where(t < 4.0, np.sin(2.0 * np.pi * 0.5 * t), 0.0)
    flicker = (np.sin(2.0 * np.pi * 3.0 * t) > 0) & (t >= 4.0)
    smooth = condition(logged(t, count * (np.round(moving / count) + flicker)), BAND)
    stuck = (smooth.t > 4.5) & (smooth.t < 7.5)
    assert not smooth.usable[stuck].any() and smooth.usable[(smooth.t > 0.5) & (smooth.t < 3.5)].mean() > 0.8


def test_what_samples_leave_open_of_a_step_is_how_far_the_low_passed_torque_is_off():
    fine, rng = 4000.0, np.random.default_rng(0)
    taps, t = kernels(BAND.torque, RATE)[0], times(4.0)
    rise = np.cumsum(kernels(BAND.torque, fine)[0])
    after = (np.arange(len(rise)) - len(rise) // 2) / fine
    off = []
    for begins in 2.0 - rng.uniform(0.0, 1.0 / RATE, 200):
        low_passed = filtered((t >= begins)[:, None].astype(float), taps)[:, 0]
        off.append(low_passed - np.interp(t - begins, after, rise))
    smooth = condition(logged(t, wave(t)[0], (t >= 2.0).astype(float)), BAND)
    std = np.interp(smooth.t, t, np.sqrt(np.mean(np.square(off), axis=0)))
    near = np.abs(smooth.t - 2.0) < 0.02  # the main lobe of the low-pass
    np.testing.assert_allclose(smooth.unsure[near, 0], std[near], rtol=0.15)
    assert smooth.unsure[np.abs(smooth.t - 2.0) > 0.5].max() < 0.01 * std.max()


@pytest.mark.parametrize("duration", [15.0, 60.0])
def test_noise_is_no_motion_at_frequencies_where_it_happens_to_be_strong(duration):
    t = times(duration)
    shares = []
    for seed in range(30):
        q = np.sin(2.0 * np.pi * 0.7 * t) + 2e-5 * np.random.default_rng(seed).normal(size=len(t))
        weights, _, f = signal_weights(q[:, None], np.zeros(1), RATE)
        shares.append(np.abs(weights[f > 5.0]).max())
    assert np.mean(np.array(shares) > 0.0) <= 0.2 and np.max(shares) < 0.2


def test_noise_of_many_joints_is_no_motion_of_a_combination_of_them():
    t = times(15.0)
    shares = []
    for seed in range(10):
        q = np.sin(2.0 * np.pi * 0.7 * t)[:, None] + 2e-5 * np.random.default_rng(seed).normal(size=(len(t), 7))
        weights, _, f = signal_weights(q, np.zeros(7), RATE)
        shares.append(np.mean(np.sum(np.abs(weights[f > 5.0]) ** 2, axis=2)))  # of the noise's power
    assert np.max(shares) < 1e-4


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0 / 3.0])
@pytest.mark.parametrize("still", [[5], [0], [3, 4, 5], [0, 1, 2, 3, 4]])
@pytest.mark.parametrize("rate", [100.0, 250.0, 500.0])
def test_joints_that_stand_exactly_still_have_no_weight(value, still, rate):
    t = times(12.0, rate)
    q = np.sin(2.0 * np.pi * np.linspace(0.3, 0.8, 6) * t[:, None])
    q = q + 2e-5 * np.random.default_rng(0).normal(size=q.shape)
    q[:, still] = value
    moving, few = np.setdiff1d(np.arange(6), still), 10  # the lowest lines are kept of every joint
    weights, floor, _ = signal_weights(q, np.zeros(6), rate)
    assert np.isfinite(weights).all() and not floor[still].any() and floor[moving].all()
    assert not weights[few:, still].any() and not weights[few:, :, still].any()
    assert weights[few:, moving, moving].any()


def test_a_joint_that_is_shaken_by_another_one_keeps_a_motion_that_its_own_encoder_can_not_tell():
    t, rng = times(15.0), np.random.default_rng(0)
    shaking = np.asarray(signal.lfilter([1.0], [1.0, -1.6, 0.8], rng.normal(size=len(t))))  # strongest at 37 Hz
    motion = 1e-4 * shaking[:, None] * np.array([1.0, -0.01])
    logged_q = np.sin(2.0 * np.pi * 0.7 * t)[:, None] + motion + 2e-5 * rng.normal(size=motion.shape)
    together, _, f = signal_weights(logged_q, np.zeros(2), RATE)
    alone, _, _ = signal_weights(logged_q[:, 1:], np.zeros(1), RATE)
    at = np.argmin(np.abs(f - 37.0))
    assert abs(alone[at, 0, 0]) < 0.2
    assert together[at, 1] @ [1.0, -0.01] == pytest.approx(-0.01, rel=0.2)


def test_weak_motion_above_a_band_without_any_is_kept():
    t = times(15.0)
    weak = np.sin(2.0 * np.pi * 12.0 * t) + np.random.default_rng(0).normal(size=len(t))
    q = np.sin(2.0 * np.pi * 0.7 * t) + 2e-5 * weak
    weights, _, f = signal_weights(q[:, None], np.zeros(1), RATE)
    share = np.abs(weights[:, 0, 0])
    # Averages reach three tenths of a frequency to either side, and the window a bin or two.
    assert share[np.argmin(np.abs(f - 12.0))] > 0.9 and share[(f > 18.0) & (f < 100.0)].max() == 0.0


def test_samples_leave_nothing_open_of_a_smooth_torque_nor_much_of_a_noisy_one():
    t, rng = times(), np.random.default_rng(0)
    noise = rng.normal(size=len(t))
    clean, noisy = (condition(logged(t, wave(t)[0], 10.0 * wave(t, 2.0)[0] + x), BAND) for x in (0.0, noise))
    left = np.std(filtered(noise[:, None], kernels(BAND.torque, RATE)[0]))
    assert clean.unsure.max() < 1e-3 and np.sqrt(np.mean(noisy.unsure**2)) < 0.3 * left


def test_a_joint_that_creeps_is_at_rest_beside_recordings_in_which_it_moves():
    t = times()
    creeping, slow, moving = (logged(t, x * wave(t, 0.5)[0]) for x in (2e-4, 2e-2, 1.0))
    alone, beside, no_creep = (conditioned(x, BAND)[0] for x in ((creeping,), (creeping, moving), (slow, moving)))
    assert alone.usable.mean() > 0.9 and no_creep.usable.mean() > 0.9 and not beside.usable.any()


def test_slow_motion_over_many_counts_is_no_rest():
    count, t = 2.0 * np.pi / 4096.0, times()
    q = count * np.round(0.1 * t / count)
    assert condition(logged(t, q), BAND).usable.all()
