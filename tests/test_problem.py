"""What imperfect laws could feign: by which laws, at which joints, over how many recordings."""

import dataclasses

import numpy as np
import pytest
from helpers_problem import ROWS, TURNS, WAVE, problem

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.problem import LEAST_SHARE, UNSURE, Problem


def explained_by_friction(level: float) -> float:
    """Half the squared torque of a Coulomb friction fitted with a prior of one."""
    w = level * ROWS / (ROWS + 1.0)
    return 0.5 * w**2 * ROWS


def unsure(of: Problem, joint: int = 0) -> float:
    """What smoothing makes late at a joint, whatever the laws there."""
    return 0.5 * UNSURE**2 * of.torque_energy[:, joint].sum()


FRICTION = ("coulomb_friction", (0,), [TURNS])
RARER = ("stribeck_friction", (0,), [TURNS * np.abs(WAVE)])
SPRING = ("gravity_spring", (0,), [WAVE])


@pytest.mark.parametrize("slug", ["torque_offset", "payload", "gravity_tilt", "rotor_inertia", "encoder_offset"])
def test_what_has_no_form_that_could_err_feigns_nothing(slug):
    own = (slug, (0,), [np.ones(ROWS)])
    y = np.atleast_2d(3.0 * np.ones(ROWS) + 2.0 * TURNS)
    there = problem([own, FRICTION, RARER, SPRING], y)
    assert np.all(there.explained((0,)) == 0.0)
    assert np.all(there.feigned((0,), 1e6) == 0.0)
    X = np.stack([np.ones(ROWS), TURNS], axis=1)
    w = np.linalg.solve(X.T @ X + np.eye(2), X.T @ y[0])
    assert there.explained((0, 1))[0] == pytest.approx(0.5 * w[1] ** 2 * ROWS)


def test_play_feigns_as_much_as_a_law_of_so_many_times_its_torque():
    ripple, play = (problem([(slug, (0,), [WAVE]), SPRING], 5.0 * WAVE[None]) for slug in ("torque_ripple", "backlash"))
    most, of_play = (there.feigned((0,), 1e6)[1] for there in (ripple, play))
    assert CATALOGUE["backlash"].coarse > 1.0 and most > 0.0
    assert of_play == pytest.approx(CATALOGUE["backlash"].coarse ** 2 * most)


def test_friction_feigns_friction_in_one_recording_and_anything_else_in_all():
    y = 5.0 * TURNS[None]
    one, three = (problem([FRICTION, RARER, SPRING], y, n) for n in (1, 3))
    feigned = explained_by_friction(5.0) * np.array([CATALOGUE[s].feigned ** 2 for s in (RARER[0], SPRING[0])])
    np.testing.assert_allclose(one.feigned((0,), 1e6)[1:], feigned, rtol=1e-9)
    np.testing.assert_allclose(three.feigned((0,), 1e6)[1:], feigned / [3.0, 1.0], rtol=1e-9)


def test_no_more_is_feigned_at_a_joint_than_comes_from_there():
    small, large = 0.1 * WAVE, WAVE  # what both joints feel of the payload
    payload, nothing = ("payload", (0, 1), [small, large]), np.zeros(ROWS)
    there = problem([("coulomb_friction", (0,), [TURNS, nothing]), payload], np.stack([50.0 * TURNS, nothing]))
    of_friction = CATALOGUE["payload"].feigned ** 2 * explained_by_friction(50.0)
    part = 0.01 / 1.01  # of its squared torque on the joint that rubs
    assert of_friction > 10.0 * part * 100.0
    assert there.feigned((0,), 100.0)[1] == pytest.approx(part * 100.0)
    assert there.feigned((0,), 1e9)[1] == pytest.approx(of_friction)
    assert there.feigned((0,), -5.0)[1] == 0.0


def test_a_thousandth_of_the_torque_is_feigned_for_what_is_late_and_for_nothing_else():
    members = [("actuator_lag", (0,), [TURNS]), ("torque_ripple", (0,), [TURNS])]
    there = problem(members, 1e4 * WAVE[None])
    np.testing.assert_allclose(there.feigned((), 1e9), [unsure(there), 0.0], rtol=1e-12)
    assert unsure(there) == pytest.approx(0.5 * np.sum((10.0 * WAVE) ** 2))


def test_what_is_late_at_all_joints_must_come_from_more_than_a_thousandth_of_the_torque_of_each():
    delay = ("time_delay", (0, 1), [WAVE, WAVE])
    there = problem([delay], 1e4 * np.stack([WAVE, 3.0 * WAVE]))
    one, other = unsure(there, 0), unsure(there, 1)
    assert there.feigned((), 1e9)[0] == pytest.approx(one + other)
    assert there.feigned((), 0.1 * one)[0] == pytest.approx(0.1 * one)  # no more than it says


def test_a_thousandth_of_the_torque_moves_what_is_late_as_much_of_its_own_column_does():
    both, share = problem([("actuator_lag", (0,), [WAVE]), SPRING], 7.0 * WAVE[None]), UNSURE * 7.0
    std = 1.0 / np.sqrt(WAVE @ WAVE)  # of its amplitude, by white noise
    np.testing.assert_allclose(both.imitated * std, [share / np.sqrt(3.0), 0.0], rtol=1e-12)  # evenly up to it


def test_a_push_must_be_more_than_a_thousandth_of_the_torque_of_its_own_recording():
    """Another may have far less noise, under which a thousandth of its torque is worth more than all of the push."""
    there = problem([("external_wrench", (0,), [TURNS])], 1e4 * WAVE[None], recordings=2)
    there = dataclasses.replace(there, torque_energy=np.array([[1e8], [9e8]]))  # it is in the first
    assert there.feigned((), 1e9)[0] == pytest.approx(0.5 * UNSURE**2 * 1e8)


def test_what_has_no_name_must_be_more_than_a_small_share_and_what_has_one_need_not():
    members = [("soft_friction", (0,), [TURNS]), ("torque_ripple", (0,), [TURNS]), ("external_wrench", (0,), [TURNS])]
    small, large = (problem(members, 1e4 * (WAVE + k * LEAST_SHARE * TURNS)[None]).scores(()) for k in (0.5, 2.0))
    assert np.isfinite(small).tolist() == [False, True, True] and np.isfinite(large).all()


@pytest.mark.parametrize("joints", [None, {0}, {1}])
def test_the_score_of_a_candidate_is_the_odds_of_adding_it(joints):
    rng = np.random.default_rng(3)
    nothing = np.zeros(ROWS)
    torques = [[rng.normal(size=ROWS), nothing], [nothing, rng.normal(size=ROWS)], *rng.normal(size=(3, 2, ROWS))]
    slugs = [("coulomb_friction", (0,)), ("stribeck_friction", (1,)), *[("payload", (0, 1))] * 3]
    one_by_one = problem([(*at, X) for at, X in zip(slugs, torques, strict=True)], rng.normal(size=(2, ROWS)))
    # The last three columns are one law of three amplitudes.
    free = np.full((3, 3), np.inf)
    whole = dataclasses.replace(one_by_one.candidates[2], columns=np.array([2, 3, 4]), variant=(0, 1, 2))
    there = dataclasses.replace(
        one_by_one, candidates=(*one_by_one.candidates[:2], whole), log_prior=np.array([-1.0, -2.0, -3.0]),
        entry=np.zeros(3), lowest=-free, highest=free, summed=np.zeros((3, 3)), least=-free[:, 0],
    )  # fmt: skip
    for chosen in ((), (0,), (1,), (2,), (0, 1), (1, 2), (2, 0)):
        scores = there.scores(chosen, joints)
        for i in {0, 1, 2} - set(chosen):
            near = joints is None or joints & set(there.candidates[i].joints)
            assert scores[i] == (pytest.approx(there.odds(chosen, (i,)), rel=1e-9) if near else -np.inf)
