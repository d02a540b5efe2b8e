"""Moves of the search for names: what stands in the place of what, and what it has to overcome."""

import numpy as np
import pytest
from helpers_problem import ROWS, TURNS, WAVE, problem

from irb140_jax.mismatch import name
from irb140_jax.mismatch.name import PREFER, _exchange

NEAR = WAVE + 0.6 * np.random.default_rng(7).normal(size=ROWS)  # explains most of what WAVE explains
FRICTION = ("coulomb_friction", (0,), [TURNS])
SPRING, GAIN = ("gravity_spring", (0,), [WAVE]), ("torque_gain", (0,), [NEAR])


def exchanged(other, size: float):
    """Whether `other`, with a parameter more, takes the place of a gain beside strong friction; odds and hurdle."""
    y = (50.0 * TURNS + size * WAVE)[None]
    there = problem([FRICTION, GAIN, other], y, shapes=(2,))
    more = there.odds((0,), (2,)) - there.odds((0,), (1,))
    hurdle = there.feigned((0, 1), more)[2]
    return _exchange(there, (0, 1), (0, 1), frozenset()) == (0, 2), more, hurdle


def test_a_law_takes_the_place_of_another_that_had_the_same_to_overcome():
    done, more, hurdle = exchanged(SPRING, 1.5)
    assert PREFER < more < hurdle  # of friction that both of them could stand for
    assert done


@pytest.mark.parametrize("size", [0.05, 0.1])
def test_more_parameters_must_be_clearly_better(size):
    done, more, _ = exchanged(SPRING, size)
    assert more < PREFER and not done


def test_friction_has_all_of_it_to_overcome():
    done, more, hurdle = exchanged(("stribeck_friction", (0,), [WAVE]), 1.5)
    assert PREFER < more < hurdle and not done


def test_physics_takes_the_place_of_soft_friction_at_even_odds():
    soft, delay = ("soft_friction", (0,), [NEAR]), ("time_delay", (0,), [WAVE])
    there = problem([FRICTION, soft, delay], (50.0 * TURNS + 0.6 * WAVE)[None], shapes=(2,))
    more = there.odds((0,), (2,)) - there.odds((0,), (1,))
    assert 0.0 < more < PREFER
    assert _exchange(there, (0, 1), (0, 1), frozenset()) == (0, 2)


def test_soft_friction_stands_beside_dry_friction_or_not_at_all():
    there = problem([FRICTION, ("soft_friction", (0,), [WAVE]), ("stribeck_friction", (0,), [NEAR])], WAVE[None])
    assert [bool(there.beside.conflicts(chosen)[1]) for chosen in ((), (0,), (2,))] == [True, False, False]


@pytest.mark.parametrize("bend, left", [(0.02, {0, 2}), (1.0, {0, 1})])
def test_ordinary_friction_takes_the_place_of_a_law_that_is_not_clearly_better(bend, left):
    bent = TURNS + bend * WAVE
    laws = [("viscous_friction", (0,), [NEAR]), ("nonlinear_viscous_friction", (0,), [bent]), FRICTION]
    there = problem(laws, (10.0 * bent + NEAR)[None], shapes=(1,))
    assert there.odds((0,), (1,)) > there.odds((0,), (2,))
    assert set(name._settled(there, (0, 1))) == left


def test_a_step_that_settling_undoes_does_not_end_the_growth(monkeypatch):
    monkeypatch.setattr(name, "_settled", lambda _, chosen, *__: tuple(c for c in chosen if c != 0))
    assert name._grown(problem([SPRING, FRICTION], (9.0 * WAVE + 5.0 * TURNS)[None]), ()) == (1,)


def test_rules_that_undo_each_other_end_at_once(monkeypatch):
    asked = []

    def swaps(*_):
        asked.append(None)
        return (1,) if len(asked) % 2 else (0,)

    monkeypatch.setattr(name, "_exchange", swaps)
    assert name._settled(problem([SPRING, GAIN], WAVE[None]), (0,)) == (0,)
    assert len(asked) == 2


@pytest.mark.parametrize("lean, left", [(1.0, {2, 3, 4}), (-1.0, {0, 1})])
def test_a_lean_of_the_base_takes_from_friction_on_each_joint_what_it_feigns(lean, left):
    rng, none = np.random.default_rng(3), np.zeros(ROWS)
    off = 0.05 * rng.normal(size=(2, ROWS))  # the laws are not quite what the lean is
    bent = [TURNS + 0.2 * WAVE, TURNS + 0.2 * lean * WAVE]
    torques = [bent[0] + off[0], none], [none, bent[1] + off[1]]
    laws = [("stribeck_friction", (j,), torque) for j, torque in enumerate(torques)]
    coulomb = [("coulomb_friction", (0,), [TURNS, none]), ("coulomb_friction", (1,), [none, TURNS])]
    there = problem([*laws, *coulomb, ("gravity_tilt", (0, 1), [WAVE, WAVE])], 50.0 * np.stack(bent), shapes=(0, 1))
    assert set(name._joined(there, (0, 1))) == left


def test_a_thousandth_of_the_torque_is_no_push():
    y, slugs = (1e4 * TURNS + 5.0 * WAVE)[None], ("payload", "external_wrench", "gravity_spring")
    there = problem([(slug, (0,), [x]) for slug, x in zip(slugs, (TURNS, WAVE, WAVE), strict=True)], y)
    odds = there.scores((0,))[1]
    assert odds > 100.0 * name.ACCEPT  # white noise is far smaller
    assert there.feigned((0,), odds)[1] > odds > there.feigned((0,), odds)[2]
