"""Columns are slopes of the corrected model's torque at the last explanation, whatever multiplies what."""

import equinox as eqx
import numpy as np
import pytest

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.along import columns_along, prepared, seen_by, unbounded, without
from irb140_jax.mismatch.columns.torques import Named, better_known, composed, library_of
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.regression.rows import Stretch, stretch
from irb140_jax.mismatch.regression.tangent import delayed, logged, point
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import condition
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import first_joints, irb140

ROBOT = first_joints(irb140(), 3)
N = ROBOT.n
FOUND = (
    ("coulomb_friction", (0,), [3.0], []),
    ("gravity_tilt", (0, 1, 2), [0.03, -0.02], []),
    ("torque_gain", (1,), [0.15], []),
    ("actuator_lag", (0,), [0.04], []),
    ("actuator_lag", (1,), [0.02], []),
    ("channel_skew", (2,), [0.008], [0.004]),
)


def recording() -> Recording:
    """A smooth motion of 6 s; what torque was logged does not matter."""
    t = np.arange(0.0, 6.0, 0.002)
    wave = lambda rate, phase: np.sin(2.0 * np.pi * rate * t + phase)  # noqa: E731
    q = np.stack([0.5 * wave(0.4 + 0.1 * j, j) + 0.2 * wave(1.1, 2.0 * j) for j in range(N)], axis=1)
    return Recording(t, q, 10.0 * q, ROBOT.joint_names, source="tangent")


LOG = recording()
BAND = choose_band([LOG], ROBOT)
SMOOTH = condition(LOG, BAND)


def found_model(dphi: np.ndarray, amplitudes: list[np.ndarray]) -> CorrectedModel:
    """What was found, with these numbers."""
    effects = tuple(
        Named(CATALOGUE[slug], joints, tuple(range(len(w))), np.array(w, dtype=float), np.array(shape))
        for (slug, joints, _, shape), w in zip(FOUND, amplitudes, strict=True)
    )
    phi = np.asarray(ROBOT.phi)
    return CorrectedModel(ROBOT, phi, phi + dphi.reshape(N, 10), effects, BAND, SMOOTH.rest_speed)


def settled(model: CorrectedModel):
    """Library, recording and torques of a model, its loads those that it makes itself."""
    lib, dphi = library_of(model.robot, model.named), (model.phi_corrected - np.asarray(ROBOT.phi)).ravel()
    along = seen_by(better_known(ROBOT, model.phi_corrected, model.named), prepared(ROBOT, SMOOTH))
    loads = None
    for _ in range(6):  # a gain, and a lag or a delay after it
        torques = composed(lib, along, columns_along(lib, along, loads), amplitudes_of(model), dphi, dphi)
        loads = torques.loads
    return lib, along, torques


def amplitudes_of(model: CorrectedModel) -> list[np.ndarray]:
    return [n.amplitudes for n in model.named]


def explained_by(there):
    """A model with inertials off and these of the effects, its settled torques, and the rows taken at it."""
    dphi = 0.05 * np.abs(np.asarray(ROBOT.phi)).ravel() * np.random.default_rng(0).normal(size=10 * N)
    model = found_model(dphi, [there(k) * np.array(w) for k, (_, _, w, _) in enumerate(FOUND)])
    lib, along, torques = settled(model)
    at = point(ROBOT, dphi, model.named)
    return model, dphi, torques, stretch(lib, along, 0, BAND, np.eye(10 * N), torques.loads, at)


@pytest.fixture(scope="module")
def explained():
    """With all of them."""
    return explained_by(lambda _: True)


def every_column(rows: Stretch) -> np.ndarray:
    """Inertials, amplitudes, loose inertials."""
    return rows.of(np.arange(20 * N + rows.size))


def coefficients(dphi: np.ndarray, amplitudes: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([dphi, *amplitudes, np.zeros(10 * N)])


def test_at_its_own_point_the_rows_leave_what_the_model_leaves(explained):
    model, dphi, torques, rows = explained
    left = rows.y - every_column(rows) @ coefficients(dphi, amplitudes_of(model))
    np.testing.assert_allclose(left, BAND.apply(SMOOTH.tau - torques.corrected), atol=1e-6)


@pytest.mark.parametrize("which", ["inertials", *range(len(FOUND))])
def test_columns_are_slopes_of_the_torque(explained, which):
    model, dphi, torques, rows = explained
    if which != "inertials" and CATALOGUE[FOUND[which][0]].place.at.in_log:
        model, dphi, torques, rows = explained_by(lambda k: k == which or not CATALOGUE[FOUND[k][0]].place.at.in_log)
    amplitudes = [a.copy() for a in amplitudes_of(model)]
    moved = dphi.copy()
    if which == "inertials":
        moved += 1e-4 * np.abs(np.asarray(ROBOT.phi)).ravel()
    else:
        amplitudes[which] *= 1.0 + 1e-4
    change = settled(found_model(moved, amplitudes))[2].corrected - torques.corrected
    step = coefficients(moved, amplitudes) - coefficients(dphi, amplitudes_of(model))
    scale = np.abs(BAND.apply(change)).max()
    np.testing.assert_allclose(every_column(rows) @ step / scale, BAND.apply(change) / scale, atol=2e-3)


def test_slopes_rest_on_what_leans_gravity_and_on_laws_of_the_log():
    model = found_model(np.zeros(10 * N), [np.array(w) for _, _, w, _ in FOUND])
    every = {(slug, joints) for slug, joints, *_ in FOUND}
    assert point(ROBOT, np.zeros(10 * N), model.named).rests_on == every - {("coulomb_friction", (0,))}


def test_a_little_more_delay_is_what_moves_the_log_by_a_little(explained):
    model, _, torques, _ = explained
    dt, x = float(np.mean(np.diff(SMOOTH.t))), torques.loads.scaled
    late = point(ROBOT, np.zeros(10 * N), [n for n in model.named if n.effect.slug == "channel_skew"])
    more = delayed(late, x, dt)
    np.testing.assert_allclose(more[:, :2], np.gradient(x[:, :2], dt, axis=0))
    delay = FOUND[-1][2][0]
    np.testing.assert_allclose(x[:, 2] + delay * more[:, 2], logged(late, x, np.arange(N), dt)[:, 2])
    later = np.interp(SMOOTH.t + delay, SMOOTH.t, x[:, 2])
    np.testing.assert_allclose(later[9:-9], (x[:, 2] + delay * more[:, 2])[9:-9], atol=1e-2 * float(np.std(x[:, 2])))
    np.testing.assert_array_equal(delayed(None, x, dt), np.gradient(x, dt, axis=0))


def test_inertials_alone_are_refitted_to_the_plain_log(explained):
    *_, rows = explained
    lib, along, _ = settled(found_model(np.zeros(10 * N), [0.0 * np.array(w) for _, _, w, _ in FOUND]))
    plain = stretch(lib, along, 0, BAND, np.eye(10 * N))
    columns = np.concatenate([np.arange(10 * N), 10 * N + plain.size + np.arange(10, 20)])
    bare = rows.of_rigid_body()
    np.testing.assert_allclose(bare.of(columns), plain.of(columns))
    np.testing.assert_allclose(bare.y, plain.y)
    assert not np.allclose(rows.of(columns), plain.of(columns))


def test_a_spring_that_buckles_under_the_weight_is_no_law_of_this_motion():
    def moved_by(compliance: float, robot) -> np.ndarray:
        spring = Named(CATALOGUE["joint_elasticity"], (1,), (0,), np.ones(1), np.array([compliance]))
        model = CorrectedModel(robot, np.asarray(robot.phi), np.asarray(robot.phi), (spring,), BAND, SMOOTH.rest_speed)
        lib = library_of(model.robot, model.named)
        columns = columns_along(lib, prepared(robot, SMOOTH))
        return without(lib.entries[1], columns, unbounded(lib.entries[1], columns))

    heavy = eqx.tree_at(lambda r: r.gravity, ROBOT, 20.0 * ROBOT.gravity)
    assert moved_by(1e-5, heavy).any()
    assert not moved_by(10.0, heavy).any()


def test_what_effects_see_are_bodies_that_can_be():
    wild = np.asarray(ROBOT.phi) * np.array([-1.0, 1.2, 1.0])[:, None]
    seen = better_known(ROBOT, wild, [])
    assert (np.asarray(seen.mass) > 0.0).all()
    assert (np.linalg.eigvalsh(np.asarray(seen.inertia)) > 0.0).all()
