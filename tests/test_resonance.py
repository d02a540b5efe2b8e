"""The first grid of a spring's stiffness is as fine as its resonance is narrow."""

import numpy as np
import pytest
from helpers_effects import SCALES
from scipy import signal

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.effects.joint_elasticity import _swing
from testbed.flexible import Transmission, swing
from testbed.motions import STEP

SPRING = CATALOGUE["joint_elasticity"]
SECONDS = 20.0
LOW = signal.butter(4, 20.0, fs=1.0 / STEP, output="sos")


def reaction(u, mass):
    """What of a swinging link's inertia the motor feels below 20 Hz."""
    return signal.sosfiltfilt(LOW, -mass * np.asarray(u))


@pytest.mark.parametrize("damping", [0.03, 0.05, 0.1])
@pytest.mark.parametrize("frequency", [8.3, 12.0, 14.7, 18.2])
def test_some_point_of_it_explains_a_spring_at_its_own_amplitude(frequency, damping):
    mass = float(SCALES.inertia[0])
    stiffness = mass * (2.0 * np.pi * frequency) ** 2
    rng = np.random.default_rng(1)
    slow = signal.butter(2, 10.0, fs=1.0 / STEP, output="sos")
    load = np.asarray(signal.sosfilt(slow, rng.normal(size=int(SECONDS / STEP))))
    inertia = np.full(len(load), mass)
    link = Transmission(0, stiffness, 2.0 * damping * np.sqrt(stiffness * mass))
    true = reaction(swing(load, inertia, link, np.zeros(len(load)))[2], mass)
    explained = []
    for (compliance,) in SPRING.shapes.grid(SCALES, np.array([0])):
        drag = 2.0 * 0.05 * np.sqrt(compliance * inertia)
        bend = _swing(load, compliance * inertia, drag, np.ones(len(load)), STEP)[2]
        column = reaction(compliance * np.asarray(bend), mass)
        amplitude = np.clip(column @ true / (column @ column), SPRING.prior.lowest[0], SPRING.prior.highest[0])
        explained.append(1.0 - np.mean((true - amplitude * column) ** 2) / np.mean(true**2))
    # Half a width off the resonance half the power is left.
    assert max(explained) > 0.5, explained
