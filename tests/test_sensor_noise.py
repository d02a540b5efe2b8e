"""What the sensors scatter by comes from the sensors, whatever the model leaves out."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.mismatch.regression.sensor_noise import coarse_positions, scatter_by_sensor
from irb140_jax.mismatch.regression.sufficient_data import comparable
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import condition
from irb140_jax.recordings.low_pass import Band, kernels
from irb140_jax.recordings.sensors import torque_scatter

BAND = Band(20.0, 32.0, 200.0, 4)
NOISE = 0.05


@pytest.mark.parametrize("friction", [0.0, 5.0])
def test_torque_noise_is_told_whatever_the_model_leaves_out(friction):
    recording = made.recording(friction=friction, noise=NOISE, duration=20.0)
    expected = NOISE * np.sqrt(np.sum(kernels(BAND.torque, 250.0)[0] ** 2))  # of white noise behind the same filter
    np.testing.assert_allclose(torque_scatter(recording, BAND), expected, rtol=0.15)


def test_encoder_noise_counts_where_torque_is_exact():
    rough, fine = (
        dataclasses.replace(r, q=r.q + std * np.random.default_rng(0).normal(size=r.q.shape))
        for std, r in ((3e-4, made.recording(noise=0.0, speeds=False)), (0.0, made.recording(noise=0.0, speeds=False)))
    )
    loud, quiet = (np.hypot(*scatter_by_sensor(made.robot(), [r], [condition(r, BAND)], BAND)) for r in (rough, fine))
    assert np.all(loud > 3.0 * quiet)


@pytest.mark.parametrize(("step", "said"), [(0.0, False), (np.radians(1.0), True)])
def test_positions_that_limit_the_comparison_are_said(step, said):
    recording = made.recording(speeds=False, duration=20.0)
    if step:
        recording = dataclasses.replace(recording, q=step * np.round(recording.q / step))
    robot = made.robot()
    band, recordings, smooth, _ = comparable(robot, [recording])
    notes = coarse_positions(robot, *scatter_by_sensor(robot, recordings, smooth, band), np.ones(robot.n, dtype=bool))
    assert [n.startswith("Positions are coarse") for n in notes] == ([True] if said else [])


def test_the_band_of_a_recording_leaves_its_scatter_finite():
    recording = made.recording(duration=5.0, speeds=False)
    band = choose_band([recording], made.robot())
    assert np.isfinite(scatter_by_sensor(made.robot(), [recording], [condition(recording, band)], band)).all()
