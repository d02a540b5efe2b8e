"""Estimates that bodies could have: the most probable ones, by another way to the same minimum."""

from functools import cache

import numpy as np
import pytest
from scipy import optimize

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.inertials.bodies import of_bodies
from irb140_jax.mismatch.inertials.consistent import pseudo_inertia
from irb140_jax.mismatch.inertials.prior import inertial_prior_factor
from irb140_jax.robot import Robot, irb140

SPREAD = 0.3  # relative, of inertials that are hardly known


@cache
def arm() -> tuple[Robot, np.ndarray, np.ndarray]:
    robot = irb140()
    return robot, np.asarray(robot.phi), inertial_prior_factor(robot, 1.0)


def known(seed: int, rows: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the inertials where some sums of them are known well."""
    rng = np.random.default_rng(seed)
    size = arm()[1].size
    told = rng.normal(size=(rows, size)) / 0.01
    cov = np.linalg.inv(np.eye(size) / SPREAD**2 + told.T @ told)
    return np.linalg.cholesky(cov) @ rng.normal(size=size), cov


def least(x: np.ndarray) -> float:
    """The smallest eigenvalue of any link's pseudo-inertia, in units of the nominal one."""
    _, phi, factor = arm()
    out = []
    for new, old in zip((phi.ravel() + factor @ x).reshape(-1, 10), phi, strict=True):
        inverse = np.linalg.inv(np.linalg.cholesky(pseudo_inertia(old)))
        out.append(np.linalg.eigvalsh(inverse @ pseudo_inertia(new) @ inverse.T)[0])
    return min(out)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_impossible_becomes_the_most_probable_body(seed):
    mean, cov = known(seed)
    _, phi, factor = arm()
    assert least(mean) < 0.0
    moved = of_bodies(mean, cov, np.eye(len(mean)), phi, factor)
    assert least(moved) >= settings.LEAST_MASS * (1.0 - 1e-5)
    precision = np.linalg.inv(cov)
    off = lambda x: float((x - mean) @ precision @ (x - mean))  # noqa: E731
    # From it, no direction that keeps bodies possible is more probable: a search without slopes finds none.
    rng = np.random.default_rng(seed)
    best = off(moved)
    for _ in range(200):
        trial = moved + 0.01 * np.linalg.cholesky(cov) @ rng.normal(size=len(mean))
        line = optimize.minimize_scalar(
            lambda a, trial=trial: off(moved + a * (trial - moved)), bounds=(0.0, 1.0), method="bounded"
        )
        point = moved + line.x * (trial - moved)
        assert least(point) < settings.LEAST_MASS or off(point) > best * (1.0 - 1e-3)


def test_possible_bodies_stay_as_they_are():
    mean, cov = known(4)
    small = 0.05 * mean
    assert least(small) > 0.0
    np.testing.assert_array_equal(of_bodies(small, cov, np.eye(len(mean)), *arm()[1:]), small)


def test_what_is_correlated_with_the_inertials_moves_along():
    """As it would if the inertials were known to be where they have moved to."""
    mean, cov = known(5)
    size, slope = len(mean), np.random.default_rng(6).normal(size=len(mean))
    wide = np.block([[cov, (cov @ slope)[:, None]], [(slope @ cov)[None], np.array([[slope @ cov @ slope + 1.0]])]])
    into = np.eye(size, size + 1)
    moved = of_bodies(np.append(mean, 2.0), wide, into, *arm()[1:])
    np.testing.assert_allclose(moved[-1] - 2.0, slope @ (moved[:-1] - mean), rtol=1e-6)


def test_the_search_does_not_stay_where_an_impossible_estimate_meets_the_bounds():
    _, phi, factor = arm()
    wrist, of_wrist = phi[-1:], factor[-10:, -10:]
    for seed in range(30):  # of which some would stay at a tenth of the nominal body's distance
        rng = np.random.default_rng(seed)
        told = rng.normal(size=(3, 10)) / 1e-3  # three sums of the inertials, three times what they are nominally
        precision = np.eye(10) + told.T @ told
        cov = np.linalg.inv(precision)
        mean = cov @ told.T @ (3.0 * rng.normal(size=3) / 1e-3)
        off = lambda x, mean=mean, precision=precision: float((x - mean) @ precision @ (x - mean))  # noqa: E731
        assert off(of_bodies(mean, cov, np.eye(10), wrist, of_wrist)) < 1e-4 * off(np.zeros(10))
