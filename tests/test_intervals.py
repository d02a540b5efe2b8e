"""Intervals of physical parameters: what the doubt about amplitudes makes of them."""

import numpy as np
import pytest

from irb140_jax.mismatch.intervals import _variance_of


def test_the_variance_of_what_is_linear_is_exact():
    rng = np.random.default_rng(0)
    slope, root, w = rng.normal(size=(2, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    variance = _variance_of(lambda w: slope @ w, w, root @ root.T, slope @ w)
    np.testing.assert_allclose(variance, np.diag(slope @ root @ root.T @ slope.T), rtol=1e-12)


@pytest.mark.parametrize("unseen", [0.003, 0.03])
def test_a_tilt_of_which_one_component_shows_is_not_known_by_its_size(unseen):
    w, std = np.array([0.015, 0.0]), np.array([0.0005, unseen])
    size = lambda w: np.hypot(w[..., 0], w[..., 1])[..., None]  # noqa: E731
    drawn = size(w + std * np.random.default_rng(1).normal(size=(20_000, 2)))
    expected = np.mean((drawn - 0.015) ** 2)
    assert _variance_of(size, w, np.diag(std**2), np.array([0.015]))[0] == pytest.approx(expected, rel=0.35)
