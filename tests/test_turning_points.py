"""What hysteresis remembers of a path."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from helpers_effects import KINDS, motion
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.recordings.turning_points import LEAST, turned_before, turning_points


def bristles(q: np.ndarray, travel: float, z: float = 0.0) -> np.ndarray:
    """Dahl's law along a path, step by step."""
    out = np.empty(len(q))
    for i, d in enumerate(np.diff(q, prepend=q[0])):
        keep = np.exp(-abs(d) / travel)
        z = keep * z + (1.0 - keep) * np.sign(d)
        out[i] = z
    return out


def test_a_path_turns_at_its_extremes_and_not_where_noise_shakes_it():
    t = np.linspace(0.0, 3.0, 3001)
    q = np.sin(2.0 * np.pi * t) + 0.2 * LEAST * np.random.default_rng(0).uniform(-1.0, 1.0, len(t))
    at = t[turning_points(q)]
    assert len(at) == 6 and np.abs(at - (0.25 + 0.5 * np.arange(6))).max() < 0.01


def test_a_joint_that_does_not_move_or_moves_one_way_never_turns():
    assert len(turning_points(np.zeros(50))) == 0
    assert len(turning_points(np.linspace(0.0, 1.0, 50))) == 0


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), start=st.integers(1, 1999), travel=st.floats(2e-3, 0.1))
def test_turning_points_hold_what_bristles_remember(seed, start, travel):
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 10.0, 2000)
    q = sum(a * np.sin(w * t + p) for a, w, p in rng.uniform(0.1, 3.0, (4, 3)))
    q = q / np.ptp(q)
    past = turned_before(q[:, None], [turning_points(q)], start, 32)[:, 0]
    whole, pieced = bristles(q, travel), bristles(np.concatenate([past, q[start:]]), travel)[32:]
    assert np.abs(pieced - whole[start:]).max() < 5.0 * LEAST / travel + 1e-6


def test_columns_of_presliding_friction_go_on_over_the_seams_of_a_long_recording():
    law, seam, site = CATALOGUE["presliding_hysteresis"].law, 250, jnp.array([0])
    q = np.tile(0.1 * np.sin(0.07 * np.arange(400))[:, None], len(KINDS))
    whole = dataclasses.replace(motion(samples=400), q=jnp.asarray(q))
    turned = turned_before(q, [turning_points(x) for x in q.T], seam, 8)
    late = dataclasses.replace(motion(samples=400 - seam), q=jnp.asarray(q[seam:]), turned=jnp.asarray(turned))
    columns = [np.asarray(law.columns(m, site, jnp.array([0.05])))[:, 0, 0] for m in (whole, late)]
    np.testing.assert_allclose(columns[0], bristles(q[:, 0], 0.05), atol=1e-9)
    np.testing.assert_allclose(columns[1], columns[0][seam:], atol=2e-3)
