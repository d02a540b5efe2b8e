"""What of the torque is a spike of the log, and what is physics that only looks like one."""

import numpy as np
import pytest

from irb140_jax.recordings.condition import condition
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording

BAND = Band(torque=15.0, position=24.0, rate=200.0, step=5)
T = np.arange(4000) / 500.0


def conditioned(tau):
    """One or more joints that swing, with a torque each."""
    tau = np.asarray(tau).reshape(len(T), -1)
    n = tau.shape[1]
    return condition(Recording(T, np.repeat(np.sin(2.0 * np.pi * T)[:, None], n, axis=1), tau, tuple("abc"[:n])), BAND)


def usual(seed, joints=1):
    """A torque with noise, (T, joints)."""
    return 5.0 * np.sin(3.0 * T)[:, None] + 0.05 * np.random.default_rng(seed).normal(size=(len(T), joints))


def test_spikes_are_taken_off_the_torque_and_told():
    clean = usual(3)
    spiked = clean.copy()
    spiked[np.random.default_rng(4).choice(len(T), 12, replace=False)] += 100.0
    with_spikes, without = conditioned(spiked), conditioned(clean)
    # Means of neighbours instead of 12 samples, of a slope of 0.03 a sample and noise of 0.05.
    assert np.max(np.abs(with_spikes.tau - without.tau)) < 0.3
    assert "12 torque spikes" in with_spikes.notes[-1] and not without.notes


def test_steps_and_flat_tops_of_the_torque_are_no_spikes():
    square = np.sign(np.sin(2.0 * np.pi * T)) + 0.02 * np.random.default_rng(4).normal(size=len(T))
    assert conditioned(square).notes == ()


@pytest.mark.parametrize("samples", [2, 3, 5])
def test_blows_of_some_samples_are_no_spikes(samples):
    tau = usual(5)
    for start in (500, 900, 1300):
        tau[start : start + samples, 0] += 40.0 * np.sin(np.pi * (np.arange(samples) + 0.5) / samples)
    assert conditioned(tau).notes == ()


def test_what_shakes_two_joints_at_once_is_no_spike():
    tau = usual(6, joints=2)
    tau[700, 0] += 30.0
    assert "1 torque spike was" in conditioned(tau).notes[-1]
    tau[700, 1] += 30.0
    assert conditioned(tau).notes == ()


def test_a_row_of_zeros_is_lost():
    tau = 20.0 + usual(7, joints=2)
    clean = conditioned(tau.copy())
    tau[700] = 0.0
    mended = conditioned(tau)
    assert "2 torque spikes" in mended.notes[-1]
    assert np.max(np.abs(mended.tau - clean.tau)) < 0.2


def test_the_least_step_of_a_coarse_channel_is_no_spike():
    assert conditioned(np.round(3.0 * np.sin(0.5 * T)[:, None] + 2.0 * usual(8) / 5.0)).notes == ()
