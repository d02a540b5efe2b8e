"""Intervals of physical parameters: what the doubt about amplitudes makes of them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.validation.intervals import _variance_about_shape, _variance_of

ROWS = 80


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


def test_a_wall_that_leans_and_stands_off_is_known_as_both_free_at_once_allow():
    # The tool is at x, always behind the wall: the push is stiffness times (position - n . x), in one joint.
    stiffness, wall = 50.0, np.array([1.0, 0.0, 0.0, 3.0])
    x = np.array([2.0, 1.0, 0.0]) + np.random.default_rng(2).normal(size=(ROWS, 3)) * [0.1, 0.1, 0.0]
    push = lambda shape: shape[3] - x @ shape[:3]  # noqa: E731
    turns = 1e-4 * np.array([[0.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, -1.0]])
    shapes = wall + np.vstack([np.zeros(4), turns])
    effect, one = CATALOGUE["contact"], np.array([np.inf])
    walls = tuple(Candidate(effect, (0,), s, np.array([k]), (0,), -one, one) for k, s in enumerate(shapes))
    X = np.column_stack([*(push(s) for s in shapes), stiffness * push(wall)])
    near = lambda _, columns: (X.T @ X)[np.ix_([*columns, len(shapes)], [*columns, len(shapes)])]  # noqa: E731
    data = SimpleNamespace(candidates=walls, nuisances=0, scale=np.full(len(walls), 1.0))
    explanation = cast(Any, SimpleNamespace(near=near, data=data, others=lambda _: ()))
    found = _variance_about_shape(explanation, 0, np.array([stiffness]))
    # Least squares over stiffness, lean and position, from the derivatives written out.
    slope = np.stack([push(wall), -stiffness * x[:, 1], np.full(ROWS, stiffness)], axis=1)
    cov = np.linalg.inv(slope.T @ slope + np.diag([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(found[[0, 2, 4]], np.diag(cov), rtol=1e-3)
    alone = 1.0 / np.sum(slope**2, axis=0)
    assert np.all(found[[2, 4]] > 10.0 * alone[1:])  # moved one at a time, both seem far better known
    assert found[1] == 0.0 and found[3] == 0.0  # nothing was turned that way
