"""How often the loop goes round: until the shape of what is found is as fine as it is known."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from helpers_recordings import motion, recording, robot

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.effects.grids import Scales, nearest_in_each_direction
from irb140_jax.effects.position_dependent_friction import _finer
from irb140_jax.mismatch.regression.gram import START
from irb140_jax.mismatch.selection import explain as loop
from irb140_jax.mismatch.selection.explain import explain
from irb140_jax.mismatch.selection.explanation import Explanation, fitted
from irb140_jax.mismatch.selection.hyperparameters import settled
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import conditioned
from irb140_jax.recordings.recording import Recording

FRICTION = tuple(CATALOGUE[slug] for slug in ("coulomb_friction", "position_dependent_friction"))
CENTRE, WIDTH = 0.137, 0.291  # rad
FEWEST = 3  # rounds: a search of everything, one that settles what it found, and the search again


def rubbing(seed: int, height: float, width: float) -> Recording:
    """The shoulder of a quiet arm rubs by so much more [N m] in a stretch of its range."""
    smooth = recording(seed=seed, friction=0.0, noise=0.002, duration=16.0)
    _, q, qd, _ = motion(3, seed=seed, duration=16.0)
    tau = smooth.tau.copy()
    tau[:, 0] += height * (0.5 + np.exp(-(((q[:, 0] - CENTRE) / width) ** 2))) * np.sign(qd[:, 0])
    return dataclasses.replace(smooth, tau=tau)


@cache
def explained(height: float, width: float = WIDTH) -> tuple[Explanation, list[int]]:
    """The explanation of two recordings, and how many candidates each round searched."""
    logs, arm, told = [rubbing(seed, height, width) for seed in (4, 5)], robot(), []
    band = choose_band(logs, arm)
    sensors = np.full(3, 0.002)
    ex = explain(arm, conditioned(logs, band), band, FRICTION, 0.05, sensors, told.append)
    return ex, [int(message.split()[2]) for message in told if message.startswith("columns of")]


def off(ex: Explanation, width: float = WIDTH) -> np.ndarray:
    """How far the stretch that was found is from where it is, as a share of its width, and its width off, too."""
    (found,) = [m.shape for m in ex.members if m.slug == "position_dependent_friction"]
    return np.abs(found - [CENTRE, width]) / width


def test_a_shape_that_is_known_well_is_made_finer_and_the_name_outlasts_its_law():
    ex, rounds = explained(6.0)
    assert len(rounds) > FEWEST
    # It moves the friction by less than one per cent of its height: laws are taken to be wrong by more.
    assert np.all(off(ex) < 0.01)
    assert [m.slug for m in ex.members] == ["position_dependent_friction"]


def test_without_those_rounds_the_shape_would_be_further_off(monkeypatch):
    better, _ = explained(6.0)
    monkeypatch.setattr(loop, "MOST_ROUNDS", FEWEST)
    coarse, rounds = explained.__wrapped__(6.0)
    assert len(rounds) == FEWEST
    assert off(coarse).max() > 5.0 * off(better).max()


@pytest.mark.parametrize("width", [0.08, 0.64])
def test_stretches_narrow_and_wide_are_found_where_they_are(width):
    # A tenth of that leaves no more than laws are usually wrong by, and no name.
    ex, _ = explained(0.6, width)
    assert np.all(off(ex, width) < 0.2)


@pytest.mark.parametrize("height", [0.0, 0.02])
def test_what_is_hardly_seen_takes_no_more_rounds(height):
    assert len(explained(height)[1]) == FEWEST


def test_rounds_between_look_only_at_what_is_named():
    ex, rounds = explained(0.0)
    everything = len(ex.lib.candidates)
    ordinary = sum(c.effect.prior.ordinary for c in ex.lib.candidates)
    assert rounds == [everything, ordinary, everything] and ordinary < everything


def test_what_the_last_search_adds_is_settled_too(monkeypatch):
    """A stretch that only the second search of everything finds gets rounds of its own, and one more such search."""
    real, searches = loop.selected, []

    def blind_at_first(space, chosen=(), *, every_move=True):
        searches.append(every_move)
        if len(searches) > 1:
            return real(space, chosen, every_move=every_move)
        ordinary = tuple(i for i, c in enumerate(space.candidates) if c.effect.prior.ordinary)
        value, hyper = settled(space, ordinary, (START,) * len(space.joints))
        return ordinary, hyper, {frozenset(ordinary): (value, hyper)}

    monkeypatch.setattr(loop, "selected", blind_at_first)
    ex, _ = explained.__wrapped__(6.0)
    assert searches[:3] == [True, False, True] and not searches[3] and searches[-1]
    assert np.all(off(ex) < 0.01)


def test_a_shape_that_is_dropped_twice_when_refined_is_not_searched_again_but_ordinary_friction_is(monkeypatch):
    """Without a limit it would be named by every search of everything, and dropped by every round after it."""
    real, named = loop.selected, []

    def drops_all(space, chosen=(), *, every_move=True):
        best, hyper, visited = real(space, chosen, every_move=every_move)
        stretch = {i for i in best if space.candidates[i].slug == "position_dependent_friction"}
        if every_move:
            named.append(bool(stretch))
            return best, hyper, visited
        value, hyper = settled(space, (), (START,) * len(space.joints))
        return (), hyper, {frozenset(): (value, hyper)}

    monkeypatch.setattr(loop, "selected", drops_all)
    ex, _ = explained.__wrapped__(6.0)
    assert named[:2] == [True, True] and not named[-1]
    assert {m.slug for m in ex.members} == {"coulomb_friction"}


def test_what_is_not_proved_is_not_named_and_the_search_goes_on_without_it():
    logs, arm = [rubbing(seed, 6.0, WIDTH) for seed in (4, 5)], robot()
    band, stretch = choose_band(logs, arm), ("position_dependent_friction", (0,))
    asked = []

    def unproved(ex):
        asked.append({(m.slug, m.joints) for m in ex.members})
        return [stretch] if stretch in asked[-1] else []

    sensors = np.full(3, 0.002)
    ex = explain(arm, conditioned(logs, band), band, FRICTION, 0.05, sensors, unproved=unproved)
    assert len(asked) == 2 and stretch in asked[0] and asked[1] == {("coulomb_friction", (0,))}
    assert ex.unproved == (stretch,) and {m.slug for m in ex.members} == {"coulomb_friction"}


def test_a_delay_that_was_found_may_be_any_in_the_next_round(monkeypatch):
    """Its shape follows from it; bound to within a step of its shape, one that moves further would be dropped."""
    real, bounds = loop.space_of, []

    def seen(joints, data, *args, **kwargs):
        space = real(joints, data, *args, **kwargs)
        mine = [i for i, c in enumerate(data.candidates) if c.slug == "time_delay"]
        bounds.append(np.isfinite([space.lowest[mine, 0], space.highest[mine, 0]]).all(axis=0))
        return space

    monkeypatch.setattr(loop, "space_of", seen)
    logs, arm = [rubbing(seed, 0.0, WIDTH) for seed in (4, 5)], robot()
    late = [dataclasses.replace(r, tau=np.roll(r.tau, -5, axis=0)) for r in logs]
    band = choose_band(late, arm)
    effects = (CATALOGUE["coulomb_friction"], CATALOGUE["time_delay"])
    ex = explain(arm, conditioned(late, band), band, effects, 0.05, np.full(3, 0.002))
    step = float(np.median(np.diff(late[0].t)))
    (index,) = [i for i, m in zip(ex.chosen, ex.members, strict=True) if m.slug == "time_delay"]
    assert ex.data.candidates[index].shape[0] == pytest.approx(2.5 * step, rel=0.05)
    assert len(bounds) >= FEWEST and bounds[0].all() and not np.any(bounds[1:])


def test_what_slopes_rest_on_is_held_where_it_is_chosen_without_them_too(monkeypatch):
    """At a point that has the delay, five skewed channels may look better: slopes there say nothing of them."""
    logs, arm = [rubbing(seed, 0.0, WIDTH) for seed in (4, 5)], robot()
    late = [dataclasses.replace(r, tau=np.roll(r.tau, -5, axis=0)) for r in logs]
    band = choose_band(late, arm)
    effects = (CATALOGUE["coulomb_friction"], CATALOGUE["time_delay"])
    found = lambda: explain(arm, conditioned(late, band), band, effects, 0.05, np.full(3, 0.002))  # noqa: E731
    delay = lambda ex: float(fitted(ex.data, ex.posterior(), ex.chosen, ex.factor)[2][-1][0])  # noqa: E731
    usual, real, asked = found(), loop.selected, []

    def once_without_it(space, chosen, **kwargs):
        best, hyper, sets = real(space, chosen, **kwargs)
        losing = chosen and kwargs["every_move"] and "lost" not in asked
        asked.append("lost" if losing else kwargs.get("held", "free"))
        return tuple(i for i in best if not losing or space.candidates[i].slug != "time_delay"), hyper, sets

    monkeypatch.setattr(loop, "selected", once_without_it)
    ex = found()
    assert asked[-3:] == ["lost", "free", {("time_delay", (0, 1, 2))}]
    assert [m.slug for m in ex.members] == [m.slug for m in usual.members] and usual.members[-1].slug == "time_delay"
    assert delay(ex) == pytest.approx(delay(usual), rel=1e-3)


def grid_of_stretches() -> np.ndarray:
    one = np.ones(1)
    return FRICTION[1].shapes.grid(Scales(one, one, one, -one, one, 10.0, one, one), np.array([0]))


@pytest.mark.parametrize("step", [(0.3, 0.2), (-0.4, 0.1), (0.0, -0.45)])
def test_between_three_points_a_shape_is_where_their_parabola_is_highest(step):
    grid = grid_of_stretches()
    axes = np.column_stack([grid[:, 0] / np.diff(np.unique(grid[:, 0]))[0], np.log(grid[:, 1]) / np.log(5.0) * 2.0])
    best = int(np.argmin(np.abs(axes - np.median(axes, axis=0)).sum(axis=1)))
    odds = -np.sum(([3.0, 7.0]) * (axes - axes[best] - step) ** 2, axis=1)
    assert best == np.argmax(odds)
    top = FRICTION[1].shapes.peak(grid, grid[best], odds)
    spacing = np.diff(np.unique(grid[:, 0]))[0], np.sqrt(5.0)
    np.testing.assert_allclose(top, grid[best] * [1.0, spacing[1] ** step[1]] + [spacing[0] * step[0], 0.0])
    finer = _finer(grid, top)
    assert finer.shape == grid.shape and np.any(np.all(np.isclose(finer, top), axis=1))
    assert np.ptp(finer[:, 0]) < 0.3 * np.ptp(grid[:, 0])
    assert np.ptp(np.log(finer[:, 1])) == pytest.approx(0.5 * np.log(5.0))


def test_where_a_neighbour_is_inadmissible_the_best_point_stays():
    grid = grid_of_stretches()
    odds = np.full(len(grid), -np.inf)
    odds[10] = 1.0
    np.testing.assert_allclose(FRICTION[1].shapes.peak(grid, grid[10], odds), grid[10])


def test_a_grid_has_two_neighbours_in_each_of_its_directions():
    grid = grid_of_stretches()
    inside = grid[3 * 3 + 1]
    beside = nearest_in_each_direction(grid, inside)
    assert len(beside) == 2
    for points in beside:
        moved = grid[points] - inside
        assert np.all(np.isclose(moved, 0.0).any(axis=1)) and not np.isclose(moved, 0.0).all(axis=1).any()
        assert {-1.0, 1.0} <= set(np.sign(moved[np.abs(moved) > 1e-12]))
    assert nearest_in_each_direction(grid[:1], grid[0]) == []
