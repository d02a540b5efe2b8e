"""Sentences on inertials speak of torque, which the data see, and never of a mass that they don't."""

from types import SimpleNamespace
from typing import Any

import helpers_recordings as made
import numpy as np

from irb140_jax.mismatch.output.inertials import _masses_known, _torque_change


def explanation(seed: int = 0) -> Any:
    """Rows of a rigid body of three links, the inertial prior its own unit."""
    rng = np.random.default_rng(seed)
    rigid = rng.normal(size=(400, 3, 30))
    rigid[:, 2] *= 1e-3  # the wrist hardly feels anything
    stretch = SimpleNamespace(rigid=rigid, use=np.ones((400, 3), dtype=bool))
    data = SimpleNamespace(stretches=[stretch], scale=np.full(30, 0.05), nuisances=30)
    return SimpleNamespace(data=data, factor=np.eye(30))


def test_wrong_inertials_are_said_by_the_torque_that_they_change():
    ex, dphi = explanation(), np.zeros(30)
    dphi[[3, 10]] = 5.0, -2.0  # a link before the one in question, and that one's mass
    change = 2.0 * np.sqrt(np.mean(ex.data.stretches[0].rigid[..., 10] ** 2, axis=0))
    said = _torque_change(made.robot(), ex, dphi, 1)
    assert "kg" not in said and "wrist" not in said
    assert f"shoulder by {change[0]:.3g} N m RMS" in said and f"elbow by {change[1]:.3g} N m RMS" in said


def test_a_mass_is_known_where_the_data_know_it_better_than_the_model_states_it():
    cov = np.eye(30)
    cov[0, 0], cov[10, 10] = 0.01, 0.9
    assert _masses_known(explanation(), cov).tolist() == [True, False, False]
