"""What the model discrepancy can stand for, and what it leaves to the laws: on a motion of one joint."""

import dataclasses

import numpy as np
import pytest
from test_tangent import BAND, ROBOT, SMOOTH, N

from irb140_jax.effects import Scales
from irb140_jax.mismatch.columns.along import Prepared, prepared, scales_of
from irb140_jax.mismatch.regression.discrepancy import Discrepancy
from irb140_jax.mismatch.regression.discrepancy import features as features_of
from irb140_jax.mismatch.regression.nuisances import BESIDE_FRICTION, SCALED, feature_coefficients, nuisances
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.direction import direction_of

RATE = 200.0
T = np.arange(0.0, 20.0, 1.0 / RATE)
WAVES = ((0.9, 0.31, 0.2), (0.4, 0.83, 1.1), (0.2, 1.37, 2.3))  # [rad], [Hz], [rad]
Q = np.sum([a * np.sin(2 * np.pi * f * T + p) for a, f, p in WAVES], axis=0)
QD = np.sum([a * 2 * np.pi * f * np.cos(2 * np.pi * f * T + p) for a, f, p in WAVES], axis=0)
QDD = np.sum([-a * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * T + p) for a, f, p in WAVES], axis=0)
LOAD = 5.0 * np.cos(Q) + 0.3 * QDD
SIGN = np.tanh(QD / 0.01)


def features(only: slice = slice(None), slower: float = 1.0) -> np.ndarray:
    """Blocks along the motion, by default all of them, columns of RMS one, shape (T, 80).

    It may be so many times slower, beside another recording at full speed.
    """
    column = lambda x: np.asarray(x)[:, None]  # noqa: E731
    moves = np.ones((len(T), 1), bool)
    motion = Conditioned(
        "motion", T * slower, column(Q), column(QD / slower), column(QDD / slower**2), column(LOAD), moves, moves,
        np.array([0.01 / slower]), np.zeros(1), column(SIGN), np.zeros((len(T), 1)), (),
    )  # fmt: skip
    one = lambda x: np.array([x])  # noqa: E731
    scales = Scales(one(np.abs(QD).max()), one(0.01), one(np.sqrt(np.mean(LOAD**2))), one(Q.min()), one(Q.max()), 20.0,
                    one(0.3), one(0.0))  # fmt: skip
    X = np.concatenate(features_of(motion, column(LOAD), scales, 0).blocks()[only], axis=1)
    X = X[:, X.any(axis=0)]  # no commands, so nothing that a servo does late
    return X / np.sqrt(np.mean(X**2, axis=0))


def explained(y: np.ndarray, size: float, only: slice = slice(None), slower: float = 1.0) -> float:
    """Share of a torque of RMS one that the discrepancy explains, noise of 1 % beside a discrepancy of some RMS."""
    X, y = features(only, slower), y / np.sqrt(np.mean(y**2))
    X = X * size / np.sqrt(X.shape[1])
    w = np.linalg.solve(X.T @ X + 1e-4 * np.eye(X.shape[1]), X.T @ y)
    return 1.0 - float(np.mean((y - X @ w) ** 2))


@pytest.mark.parametrize("law", ["dry", "viscous", "constant", "rotor", "lag"])
def test_a_law_that_has_a_name_costs_the_discrepancy_far_more_than_what_it_stands_for(law):
    """How large its amplitudes must be, in prior standard deviations, to take a law's place at 3 % of the torque."""
    y = {"dry": SIGN, "viscous": QD, "constant": np.ones_like(Q), "rotor": QDD,
         "lag": np.gradient(LOAD, 1.0 / RATE)}[law]  # fmt: skip
    X = features() * 0.03 / np.sqrt(features().shape[1])
    w = np.linalg.lstsq(X, y / np.sqrt(np.mean(y**2)), rcond=1e-10)[0]
    assert np.linalg.norm(w) > 100.0


@pytest.mark.parametrize("travel", [1e-3, 5e-3])
def test_bristles_of_any_travel_differ_from_dry_friction_by_what_the_discrepancy_holds(travel):
    z, out = 0.0, np.empty_like(Q)
    for i, dq in enumerate(np.diff(Q, prepend=Q[0])):  # Dahl, in small steps: no exponential
        for _ in range(20):
            z += (dq - np.abs(dq) * z) / (20 * travel)
        out[i] = z
    assert explained(out - SIGN, 1.0) > 0.95


@pytest.mark.parametrize("slower", [1.0, 10.0])
def test_friction_that_turns_late_differs_by_what_the_discrepancy_holds(slower):
    """A joint that sticks in a slow reversal leaves with another acceleration than it came with."""
    late = np.interp(T - 0.007 / slower, T, SIGN)
    assert explained(late - SIGN, 1.0, slower=slower) > 0.95


def test_friction_that_turns_at_once_however_slow_the_joint_is_held_by_the_block_of_reversals():
    """A joint that comes to rest, creeps back for some 60 ms and goes on: too slow to tell by the direction alone."""
    dips = np.sin(np.pi * 0.53 * T) ** 2 - 0.0015
    q, qd, qdd = 1.2 * np.cumsum(dips) / RATE, 1.2 * dips, 1.2 * np.gradient(dips, T)
    rest_speed = np.array([0.003 * np.abs(qd).max()])
    column = lambda x: np.asarray(x)[:, None]  # noqa: E731
    direction = direction_of(column(qd), column(qdd), np.array([1e-5]), rest_speed, RATE)
    moves = np.ones((len(T), 1), bool)
    motion = Conditioned(
        "dips", T, column(q), column(qd), column(qdd), column(LOAD), moves, moves, rest_speed, np.zeros(1), direction,
        np.zeros((len(T), 1)), (),
    )  # fmt: skip
    one = lambda x: np.array([x])  # noqa: E731
    scales = Scales(one(qd.max()), rest_speed, one(1.0), one(q.min()), one(q.max()), 20.0, one(0.3), one(0.0))
    X = features_of(motion, column(LOAD), scales, 0).blocks()[-1]
    X, turned = X[:, X.any(axis=0)], np.sign(qd) - direction[:, 0]
    w = np.linalg.lstsq(X / np.sqrt(np.mean(X**2, axis=0)), turned, rcond=1e-9)[0]
    left = turned - X / np.sqrt(np.mean(X**2, axis=0)) @ w
    assert np.ptp(turned) > 0.5 and np.sum(left**2) < 0.1 * np.sum(turned**2)


def test_friction_along_the_range_is_held_by_the_smooth_block():
    assert explained(SIGN * np.exp(-(((Q - 0.2) / 0.6) ** 2)) - 0.5 * SIGN, 1.0) > 0.6


def test_a_spring_that_hardens_differs_from_a_linear_one_by_what_the_block_of_position_holds():
    linear = np.linalg.qr(np.stack([np.ones_like(Q), Q], axis=1))[0]
    beside = lambda x: x - linear @ (linear.T @ x)  # noqa: E731
    X, bend = beside(features(slice(0, 1))), beside(np.sinh(2.0 * Q))
    left = bend - X @ np.linalg.lstsq(X, bend, rcond=None)[0]
    assert np.sum(left**2) < 1e-3 * np.sum(bend**2)


@pytest.mark.parametrize("still", [0.003, 0.03])
def test_friction_that_nears_its_level_slowly_differs_from_dry_friction_by_what_the_block_of_speed_holds(still):
    slow = 2.0 / np.pi * np.arctan(QD / (still * np.abs(QD).max()))
    assert explained(slow - SIGN, 1.0, slice(1, 2)) > 0.95


def two_recordings() -> list[Prepared]:
    """A motion, and another of a tenth of its size in which the first joint rests."""
    small, rests = 0.1 * np.ones(N), np.arange(N) == 0
    small[rests] = 0.0
    middle = SMOOTH.q.mean(axis=0)
    other = dataclasses.replace(
        SMOOTH, q=middle + small * (SMOOTH.q - middle), qd=small * SMOOTH.qd, qdd=small * SMOOTH.qdd,
        direction=np.where(rests, 0.0, SMOOTH.direction),
    )  # fmt: skip
    return [prepared(ROBOT, SMOOTH), prepared(ROBOT, other)]


def test_what_depends_on_several_things_and_what_recordings_differ_by_hold_no_dry_friction():
    along = two_recordings()
    scales = scales_of(along)
    extra = nuisances(ROBOT, along, [(a.nominal, a.nominal) for a in along], BAND, scales)
    for j in range(N):
        dry = np.concatenate([BAND.apply(a.recording.direction)[:, j] for a in along])
        groups = np.isin(extra[0].groups[j], [SCALED.index(name) for name in BESIDE_FRICTION])
        beside = np.concatenate([e.own[j][:, groups] for e in extra])
        size = np.linalg.norm(dry) * np.linalg.norm(beside, axis=0).max()
        assert size > 0.0 and np.abs(dry @ beside).max() < 1e-9 * size


def test_what_is_carried_along_a_motion_is_what_was_fitted_there():
    along = two_recordings()
    scales = scales_of(along)
    extra = nuisances(ROBOT, along, [(a.nominal, a.nominal) for a in along], BAND, scales)
    rng = np.random.default_rng(0)
    own = [np.where((g >= 0) & (g < SCALED.index("slope")), rng.normal(size=len(g)), 0.0) for g in extra[0].groups]
    carried = Discrepancy(scales, feature_coefficients(extra[0], own, np.arange(N) > 0))
    for a, e in zip(along, extra, strict=True):
        fitted = np.stack([x @ w for x, w in zip(e.own, own, strict=True)], axis=1)
        made = BAND.apply(carried.along(a.recording, a.nominal))
        np.testing.assert_allclose(made[:, 1:], fitted[:, 1:], atol=1e-9 * np.abs(fitted).max())
        assert not made[:, 0].any()
