"""Friction that certainly falls as the speed rises: the curve decides, not the form of a law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.selection.falling_friction import Curve, has_own_viscous_friction

SPEED = np.geomspace(0.01, 1.0, 16)
RISING = 1.0 + 0.5 * SPEED
FALLING = RISING + 0.8 / (1.0 + (SPEED / 0.05) ** 2)


def curve(mean: np.ndarray, std: float = 0.02) -> Curve:
    """A curve whose points are known independently, of friction that was expected to be about one."""
    n = len(SPEED)
    return Curve(SPEED, mean, std**2 * np.eye(n), np.eye(n))


def test_a_fall_that_is_many_times_its_deviation_is_certain_and_the_same_in_noise_is_not():
    assert curve(FALLING).log_odds_of_fall() > 10.0
    assert curve(FALLING, std=1.0).log_odds_of_fall() < 0.0


@pytest.mark.parametrize(
    "friction",
    [
        RISING,
        RISING - 0.8 * np.exp(-SPEED / 0.02),  # less at low speed, as where a joint turns round
        2.0 - SPEED,  # falls at any speed: a drive that helps the motion
        np.sqrt(SPEED),
        2.0 - SPEED**2,  # falls the more, the faster it moves
    ],
)
def test_what_rises_or_falls_at_all_speeds_is_no_fall(friction):
    assert curve(friction).log_odds_of_fall() < 0.0


@given(size=st.floats(1e-3, 1e3), viscous=st.floats(-0.2, 3.0))
def test_units_of_torque_do_not_matter(size, viscous):
    plain = curve(FALLING + viscous * SPEED)
    scaled = Curve(SPEED, size * plain.mean, size**2 * plain.cov, size**2 * plain.prior)
    assert scaled.log_odds_of_fall() == pytest.approx(plain.log_odds_of_fall(), rel=1e-6)


def test_what_all_speeds_share_does_not_hide_a_fall():
    n = len(SPEED)
    unknown_level = Curve(SPEED, FALLING, 0.02**2 * np.eye(n) + 10.0 * np.ones((n, n)), np.eye(n))
    assert unknown_level.log_odds_of_fall() == pytest.approx(curve(FALLING).log_odds_of_fall(), rel=1e-3)


def test_a_joint_without_viscous_friction_or_discrepancy_has_no_fall():
    n = len(SPEED)
    rounding = np.linspace(1.0, 1.0 - 1e-15, n)
    assert Curve(SPEED, rounding, np.ones((n, n)) + 1e-20 * np.eye(n), np.ones((n, n))).log_odds_of_fall() == -np.inf


def test_friction_known_at_one_speed_alone_is_no_curve():
    same = np.full(16, 0.3)
    assert Curve(same, np.ones(16), 1e-4 * np.eye(16), np.eye(16)).log_odds_of_fall() == -np.inf


def test_friction_whose_curve_is_not_dry_and_viscous_friction_alone_is_known():
    assert {slug for slug, effect in CATALOGUE.items() if has_own_viscous_friction(effect)} == {
        "nonlinear_viscous_friction", "thermal_friction_drift"
    }  # fmt: skip
