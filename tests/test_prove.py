"""What counts as proof on unseen data, where some of the data are the only ones to tell of something."""

import dataclasses

import numpy as np
import pytest
from helpers_recordings import recording, robot

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.effects.left_over import LeftOver
from irb140_jax.mismatch import prove
from irb140_jax.mismatch.explain import explain
from irb140_jax.mismatch.explanation import Explanation, explained_by, full_posterior, parts
from irb140_jax.mismatch.prove import folds, held_out, lasting, refitted, scatter
from irb140_jax.recordings.condition import choose_band, condition

FRICTION = tuple(CATALOGUE[slug] for slug in ("coulomb_friction", "viscous_friction"))


def explained(*sizes: float) -> Explanation:
    """Of recordings in which the joints move by so much."""
    logs, arm = [recording(seed=4 + k, size=size, noise=0.2) for k, size in enumerate(sizes)], robot()
    band = choose_band(logs, arm)
    return explain(arm, [condition(log, band) for log in logs], band, FRICTION, 0.05)


@pytest.fixture(scope="module")
def alike() -> Explanation:
    return explained(0.9, 0.9, 0.9)


@pytest.fixture(scope="module")
def one_alone() -> Explanation:
    """The second and third hardly move, and so hardly tell of viscous friction."""
    return explained(0.9, 0.02, 0.02)


def test_recordings_that_tell_alike_are_left_out_whole(alike):
    assert [fold.sum() for fold in folds(alike)] == [5, 5, 5]


def test_a_recording_that_alone_holds_a_finding_is_left_out_block_by_block(one_alone):
    assert [fold.sum() for fold in folds(one_alone)] == [1, 1, 1, 1, 1, 5, 5]


def test_what_one_recording_alone_holds_is_proved_within_it(one_alone):
    viscous = [c.joints[0] for c in one_alone.members if c.slug == "viscous_friction"]
    assert viscous
    proof = held_out(one_alone, refitted(one_alone))
    # As good as on data that the fit saw; with that recording left out whole, the friction is a guess: 1.4 times it.
    assert np.all(proof.rmse(proof.corrected)[viscous] < 1.1 * proof.floor[viscous])


def test_an_amplitude_must_exceed_what_it_scatters_by(alike, monkeypatch):
    least = min(alike.chosen, key=lambda i: alike.problem.odds(tuple(c for c in alike.chosen if c != i), (i,)))
    deviations = np.sqrt(2.0 * alike.problem.odds(tuple(c for c in alike.chosen if c != least), (least,)))

    def overwhelming(ex: Explanation, _) -> np.ndarray:
        """Scatter by which the least certain finding is a fifth of a standard deviation off nothing."""
        wide = [5.0 * deviations if i == least else 1.0 for i in ex.chosen]
        return np.concatenate([np.ones(ex.data.nuisances), wide])

    monkeypatch.setattr(prove, "scatter", overwhelming)
    assert lasting(alike).chosen == tuple(i for i in alike.chosen if i != least)


def deviations(ex: Explanation, one: int) -> float:
    """Of white noise, by which a finding of one amplitude is off nothing."""
    post = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)
    at = parts(ex.data, ex.chosen)[ex.chosen.index(one)].start
    return float(abs(post.mean[at]) / np.sqrt(post.cov[at, at]))


@pytest.mark.parametrize("beyond", [True, False])
def test_of_what_is_late_only_what_is_beyond_the_bound_counts(alike, beyond):
    one = next(i for i in alike.chosen if alike.data.candidates[i].slug == "viscous_friction")
    widest = deviations(alike, one) / np.sqrt(3.0)  # a bound that anything up to is equally likely
    bounds = np.zeros(len(alike.data.candidates))
    bounds[one] = widest * (0.2 if beyond else 0.9)
    late = dataclasses.replace(alike.problem)
    vars(late)["imitated"] = bounds
    assert (one in lasting(dataclasses.replace(alike, problem=late)).chosen) == beyond


def test_the_only_block_that_tells_of_something_is_no_sample_of_its_scatter(alike):
    one, told = max(alike.chosen, key=lambda i: deviations(alike, i)), 7
    column, blocks = alike.problem.columns((one,)), alike.grams.blocks.copy()
    silent = np.arange(len(blocks)) != told
    blocks[np.ix_(silent, column, np.arange(blocks.shape[2]))] = 0.0
    blocks[np.ix_(silent, np.arange(blocks.shape[1]), column)] = 0.0
    touched_once = dataclasses.replace(alike, grams=dataclasses.replace(alike.grams, blocks=blocks))
    part = parts(alike.data, alike.chosen)[alike.chosen.index(one)]
    spared, counted = (scatter(touched_once, [yes] * len(alike.chosen))[part].max() for yes in (True, False))
    # Left out with its block, the amplitude falls to nothing: that is what is not known then, and no contradiction.
    assert spared < 2.0
    assert counted > 0.5 * deviations(touched_once, one) > spared


def test_where_nothing_is_named_what_is_corrected_is_the_refit(alike):
    bare = explained_by(alike, ())
    assert bare.noise_of == () and np.all(bare.noise.total > alike.noise.total)
    proof = held_out(bare, refitted(bare))
    for refit, corrected in zip(proof.refit, proof.corrected, strict=True):
        np.testing.assert_allclose(corrected, refit, rtol=1e-9, atol=1e-12)


def test_a_set_is_weighted_by_the_noise_that_it_leaves(alike):
    least = min(alike.chosen, key=lambda i: deviations(alike, i))
    lost, fewer = alike.data.candidates[least].joints[0], tuple(i for i in alike.chosen if i != least)
    louder = explained_by(alike, fewer)
    assert louder.noise_of == fewer
    mean = lambda ex: np.sqrt(np.mean(ex.noise.total**2, axis=0))  # noqa: E731
    assert mean(louder)[lost] > 1.1 * mean(alike)[lost]
    again = explained_by(louder, alike.chosen)
    assert again.noise_of == alike.chosen
    np.testing.assert_allclose(again.noise.total, alike.noise.total, rtol=0.03)


def test_sums_over_windows_gain_what_the_windows_themselves_gain():
    rng = np.random.default_rng(0)
    rows, n, known = 200, 3, 20
    left = LeftOver(
        np.repeat([0, 1], rows // 2), np.tile(np.arange(rows // 2) * 0.1, 2), rng.normal(size=(rows, n)),
        rng.normal(size=(rows, 3)), rng.normal(size=(rows, n, 3)), rng.uniform(1.0, 2.0, (rows, n)),
        rng.normal(size=(rows, n)), rng.normal(size=(rows, n, known)),
    )  # fmt: skip
    mine, columns = left.recording == 1, rng.normal(size=(rows // 2, n, 3))
    first, last = np.array([0, 10, 50]), np.array([30, 90, 100])
    inside = (np.arange(rows // 2) >= first[:, None]) & (np.arange(rows // 2) < last[:, None])
    windows = np.where(inside[..., None, None], columns, 0.0)
    np.testing.assert_allclose(
        left.gains_within(columns, first, last, mine), left.gains(windows, mine)[0], rtol=1e-9
    )
