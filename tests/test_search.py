"""The search over sets of effects, on planted ones, and what is stated of the sets it visited."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_selection import SETTING, planted

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.regression.gram import LEVELS, ONE
from irb140_jax.mismatch.selection.averages import in_its_place, probabilities
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.selection.hyperparameters import possible
from irb140_jax.mismatch.selection.screening import gains, reshaped
from irb140_jax.mismatch.selection.search import Search
from irb140_jax.mismatch.selection.selected import named, selected
from irb140_jax.mismatch.selection.torque_scale import scale_of


@pytest.mark.parametrize("true", [(), (0,), (1, 6), (0, 2, 5)])
def test_the_search_finds_what_was_planted_and_is_sure_of_it(true):
    space, _ = planted(5, dict.fromkeys(true, 2.0))
    search = Search(space, ((0, 0, 0, ONE),) * 2)
    assert search.run() == true
    sure = probabilities(space.candidates, {s: v for s, (v, _) in search.visited.items()})
    for c, candidate in enumerate(space.candidates):
        p = sure.get((candidate.slug, candidate.joints), 0.0)
        assert p > 0.99 if c in true else p < 0.3, (candidate.slug, candidate.joints, p)


def test_a_member_that_moves_nothing_is_removed_though_the_set_without_it_was_judged_by_worse_sizes():
    space, _ = planted(5, {2: 2.0})
    worse = ((6, 6, 6, len(LEVELS) - 1),) * 2
    search = Search(space, ((0, 0, 0, ONE),) * 2)
    search.visited[frozenset({2})] = space.log_evidence((2,), worse), worse
    assert search.visited[frozenset({2})][0] < search.judged((1, 2), search.start) - 1.0
    assert search.run((1, 2)) == (2,)


def test_an_effect_of_the_whole_arm_is_judged_though_others_look_better_before_the_noise_is_fitted_anew(monkeypatch):
    space, _ = planted(0, {2: 5.0})
    slugs = ("gravity_tilt", "payload", "external_wrench", "contact")
    whole = [dataclasses.replace(c, effect=CATALOGUE[s], joints=(0, 1))
             for c, s in zip(space.candidates, slugs, strict=False)]  # fmt: skip
    space = dataclasses.replace(space, candidates=(*whole, *space.candidates[len(whole) :]))
    search = Search(space, (SETTING, SETTING))
    monkeypatch.setattr(search, "_scored", lambda _, joint: [(0.0, i) for i in (0, 1, 3, 2)] if joint == 2 else [])
    assert 2 in search.run((4,))


def test_an_effect_of_the_whole_arm_is_added_with_another_where_neither_is_worth_it_alone(monkeypatch):
    """A push beside which a rotor drowns: 2 is the push, 3 and 7 are rotors."""
    space, _ = planted(0, {})
    search = Search(space, (SETTING, SETTING))
    worth = {frozenset({4}): 0.0, frozenset({4, 2, 3}): 5.0}

    def judged(chosen, hyper, joints=None):
        search.visited.setdefault(frozenset(chosen), (worth.get(frozenset(chosen), -1.0), hyper))
        return search.visited[frozenset(chosen)][0]

    monkeypatch.setattr(search, "judged", judged)
    monkeypatch.setattr(search, "_scored", lambda _, joint: [(0.0, [3, 7, 2][joint])])
    judged((4,), search.start)
    assert search._added(frozenset({4})) == {4, 2, 3}


def test_two_are_exchanged_together_at_a_common_joint_or_where_both_are_wrong_zeros():
    space, _ = planted(0, {})
    zeros = [dataclasses.replace(space.candidates[i], effect=CATALOGUE["encoder_offset"]) for i in (3, 7)]
    space = dataclasses.replace(space, candidates=(*space.candidates[:3], zeros[0], *space.candidates[4:7], zeros[1]))
    search = Search(space, (SETTING, SETTING))
    assert search._pairs(frozenset({0, 3, 4, 7})) == [(0, 3), (3, 7), (4, 7)]


def test_what_a_search_holds_is_in_every_set_it_returns():
    """Two laws that are not there, one of which is held; what is there is found beside it."""
    space, _ = planted(5, {2: 2.0})
    held = frozenset({(space.candidates[0].slug, (0,))})
    free, _, every = selected(space, (0, 1))
    best, _, sets = selected(space, (0, 1), held=held)
    assert free == (2,) and best == (0, 2)
    assert all(0 in chosen for chosen in sets) and frozenset(best) in sets and not all(0 in chosen for chosen in every)


def test_ordinary_friction_is_stated_where_one_rare_effect_explains_nearly_as_much():
    """A wrong torque constant and a discrepancy like friction may be nearly as probable as friction itself."""
    space, _ = planted(2, {})
    friction, offset, rotor = (0, 1), (2,), (0, 3)
    stated = lambda best, other, by=1.9: named(space.candidates, {frozenset(best): by, frozenset(other): 0.0})  # noqa: E731
    assert stated(friction, offset) == friction and stated(offset, friction) == friction
    # One rare effect each: that with fewer members, unless the other is three times as probable.
    assert stated(rotor, offset, 0.9) == offset and stated(offset, rotor) == offset
    assert stated(rotor, offset) == rotor


def test_a_scale_of_all_torques_counts_as_a_member_that_few_robots_have():
    space, _ = planted(2, {})
    every, scale = (*space.candidates, scale_of(space)), len(space.candidates)
    rotor, bare = frozenset({0, 3}), frozenset({0})
    assert named(every, {rotor: 0.0, bare | {scale}: -5.0}) == (0, 3)
    assert named(every, {rotor: -5.0, bare | {scale}: 0.0}) == (0, scale)
    # Where they can't be told apart, one is stated with the other in its place.
    in_doubt = {rotor: -1.0, bare | {scale}: 0.0}
    assert named(every, in_doubt) == (0, scale)
    assert in_its_place(every, in_doubt, (0, scale), scale)[0].keys() == {(every[3].slug, every[3].joints)}


def test_amplitudes_that_are_not_admissible_make_a_set_impossible():
    space, _ = planted(6, {0: 2.0})
    lowest = space.lowest.copy()
    lowest[0] = 10.0
    bounded = dataclasses.replace(space, lowest=lowest)
    assert bounded.log_evidence((0,), (SETTING, SETTING)) == -np.inf
    assert gains(bounded, (), (SETTING, SETTING), np.array([0]))[0] == -np.inf
    assert 0 not in Search(bounded, (SETTING, SETTING)).run()


def test_without_a_member_that_held_another_ones_shape_in_place_that_one_takes_another_shape():
    """Columns 4 and 5 are shapes of one law, at which its amplitude must be large, or may be anything."""
    space, _ = planted(6, {0: 2.0, 4: 2.0})
    candidates, lowest = list(space.candidates), space.lowest.copy()
    for k in (4, 5):
        candidates[k] = dataclasses.replace(candidates[4], shape=np.array([float(k)]), columns=np.array([k]))
    lowest[4] = 10.0
    space = dataclasses.replace(space, candidates=tuple(candidates), lowest=lowest)
    hyper = (SETTING, SETTING)
    assert space.log_evidence((0, 4), hyper) == -np.inf
    assert reshaped(space, (0, 4), hyper) == (0, 5) and reshaped(space, (0, 5), hyper) == (0, 5)
    assert 4 not in Search(space, hyper).run((0, 4))


def test_a_shape_is_given_up_only_after_all_others_at_which_a_screening_would_have_it(monkeypatch):
    """Columns 4 to 6 are shapes of one law; of the whole set only the last may be, and a screening allows all."""
    space, _ = planted(6, {0: 2.0, 4: 2.0})
    candidates = list(space.candidates)
    for k in (4, 5, 6):
        candidates[k] = dataclasses.replace(candidates[4], shape=np.array([float(k)]), columns=np.array([k]))
    space, hyper = dataclasses.replace(space, candidates=tuple(candidates)), (SETTING, SETTING)
    cannot_be = lambda chosen, _: [c for c in chosen if c in (4, 5)]  # noqa: E731
    monkeypatch.setattr(type(space), "inadmissible", lambda _, *args: cannot_be(*args))
    judge = lambda chosen: (-np.inf if cannot_be(chosen, hyper) else 0.0, hyper)  # noqa: E731
    for start in (4, 5):
        assert possible(space, (0, start), judge, fewer=True) == (0, 6)
    never = lambda _: (-np.inf, hyper)  # noqa: E731
    monkeypatch.setattr(type(space), "inadmissible", lambda _, chosen, hyper: [c for c in chosen if c in (4, 5, 6)])
    assert possible(space, (0, 4), never, fewer=True) == (0,)


def test_odds_of_a_finding_are_those_against_sets_that_say_something_of_it():
    """Where others are inadmissible without it, and where slopes at an explanation that rests on it say nothing."""
    space, _ = planted(1, {})
    sets = {frozenset({0, 1}): -3.0, frozenset({1}): -np.inf, frozenset({2}): -9.0, frozenset(): -12.0}
    data = SimpleNamespace(candidates=space.candidates)
    ex = SimpleNamespace(
        falls={}, _late={}.get, data=data, space=space, chosen=(0, 1), sets=sets,
        members=[space.candidates[i] for i in (0, 1)],
        others=lambda index: tuple(i for i in (0, 1) if i != index),
        log_posterior=lambda chosen, joints: sets[frozenset(chosen)],
    )  # fmt: skip
    ex.judged_by = lambda _: ex
    assert Explanation.log_odds(ex, 0) == pytest.approx(6.0)  # pyright: ignore[reportArgumentType]
    nominal = SimpleNamespace(sets={frozenset({0}): -1.0, frozenset(): -3.0})
    ex.judged_by = lambda _: nominal
    assert Explanation.log_odds(ex, 0) == pytest.approx(2.0)  # pyright: ignore[reportArgumentType]
