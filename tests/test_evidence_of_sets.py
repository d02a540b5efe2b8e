"""The evidence of sets with model discrepancy, against the density of the data itself."""

import dataclasses

import numpy as np
import pytest
from helpers_selection import (
    COMMON,
    GROUPS,
    INERTIALS,
    OWN,
    ROWS,
    SETTING,
    dense_posterior,
    density,
    planted,
    with_first_common,
    with_payload,
)
from scipy import integrate, signal, stats

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.regression.gram import LEVELS, ONE, JointGram, log_prior_of_sizes, own_scale
from irb140_jax.mismatch.regression.noise import correlation_time
from irb140_jax.mismatch.selection.hyperparameters import over_shapes, settled
from irb140_jax.mismatch.selection.kinds import Kinds
from irb140_jax.mismatch.selection.screening import gains
from irb140_jax.mismatch.selection.torque_scale import beside_scale
from irb140_jax.mismatch.selection.unknown_width import LOG_PRIOR, WIDTHS


@pytest.mark.parametrize("centre", [0.0, 1.3])
@pytest.mark.parametrize("chosen", [(), (0,), (1, 6), (0, 3, 5)])
def test_the_evidence_of_a_set_is_the_density_of_the_data(chosen, centre):
    space, data = planted(1, {0: 1.0, 5: 0.5})
    space = dataclasses.replace(space, centre=centre * np.linspace(-1.0, 1.0, COMMON + 1)[1:])
    hyper = (SETTING, (0, 2, 5, ONE))
    widths = [density(space, data, chosen, hyper, w) for w in WIDTHS] + LOG_PRIOR
    sizes = sum(log_prior_of_sizes()[list(own[:-1])].sum() for own in hyper)
    expected = np.logaddexp.reduce(widths) + sizes + len(chosen) * np.log(0.05)
    assert space.log_evidence(chosen, hyper) == pytest.approx(expected, abs=1e-8)
    assert space.width(chosen, hyper) == WIDTHS[np.argmax(widths)]


def test_screening_says_what_the_evidence_says_at_the_width_of_the_inertials_of_the_set_before():
    space, data = planted(2, {2: 1.0})
    space = dataclasses.replace(space, centre=np.full(COMMON, 0.8))
    hyper, which = (SETTING, SETTING), np.array([0, 1, 3, 5])
    width = space.width((2,), hyper)
    before = density(space, data, (2,), hyper, width)
    expected = [density(space, data, (2, int(i)), hyper, width) - before + np.log(0.05) for i in which]
    np.testing.assert_allclose(gains(space, (2,), hyper, which), expected, atol=1e-8)


@pytest.mark.parametrize("mass", [0.02, 6.0])
def test_a_payload_is_as_probable_as_its_data_over_all_widths_of_its_prior_with_no_mass_below_zero(mass):
    space, data = planted(2, {0: mass, 4: -0.7 * mass})
    space, hyper, chosen = with_payload(space), (SETTING, SETTING), (0, 2)
    each = np.array([[density(space, data, chosen, hyper, w, t) for t in WIDTHS] for w in WIDTHS])
    each += LOG_PRIOR[:, None] + LOG_PRIOR
    of_inertials, of_payload = (WIDTHS[k] for k in np.unravel_index(np.argmax(each), each.shape))
    prior = np.r_[np.full(INERTIALS, of_inertials), np.ones(COMMON), of_payload, of_payload, 1.0]
    np.testing.assert_array_equal(space.prior(chosen, hyper), prior)
    first = INERTIALS + COMMON
    mean, cov = dense_posterior(space, data, chosen, hyper, prior)
    above = np.log(2.0 * stats.norm.cdf(mean[first], 0.0, np.sqrt(cov[first, first])))
    constant = sum(log_prior_of_sizes()[list(own[:-1])].sum() for own in hyper)
    evidence = np.logaddexp.reduce(each, axis=None) + above + constant + 2.0 * np.log(0.05)
    assert space.log_evidence(chosen, hyper) == pytest.approx(evidence, abs=1e-8)
    if mass < 1.0:  # a large one widens its prior
        drawn = np.random.default_rng(0).multivariate_normal(mean, cov, 400_000)
        drawn = drawn[drawn[:, first] > 0.0]
        found, spread = space.posterior(chosen, hyper)
        scale = np.sqrt(np.diag(cov))
        np.testing.assert_allclose(found / scale, drawn.mean(axis=0) / scale, atol=0.01)
        np.testing.assert_allclose(spread / np.outer(scale, scale), np.cov(drawn.T) / np.outer(scale, scale), atol=0.01)


def test_a_set_is_as_probable_as_its_data_over_all_widths_of_the_priors_of_inertials_delays_and_a_payload():
    space, data = planted(2, {0: 6.0, 4: -4.0})
    space, hyper, chosen = dataclasses.replace(with_payload(space), delays=COMMON), (SETTING, SETTING), (0, 2)
    each = np.zeros((len(WIDTHS),) * 3)
    for at in np.ndindex(each.shape):
        of_inertials, of_delays, of_payload = WIDTHS[list(at)]
        each[at] = density(space, data, chosen, hyper, of_inertials, of_payload, of_delays) + LOG_PRIOR[list(at)].sum()
    of_inertials, of_delays, of_payload = WIDTHS[list(np.unravel_index(np.argmax(each), each.shape))]
    prior = np.r_[np.full(INERTIALS, of_inertials), of_delays, of_payload, of_payload, 1.0]
    np.testing.assert_array_equal(space.prior(chosen, hyper), prior)
    mean, cov = dense_posterior(space, data, chosen, hyper, prior)
    mass = INERTIALS + COMMON
    above = np.log(2.0 * stats.norm.cdf(mean[mass], 0.0, np.sqrt(cov[mass, mass])))
    constant = sum(log_prior_of_sizes()[list(own[:-1])].sum() for own in hyper)
    evidence = np.logaddexp.reduce(each, axis=None) + above + constant + 2.0 * np.log(0.05)
    assert space.log_evidence(chosen, hyper) == pytest.approx(evidence, abs=1e-8)


def test_a_posterior_may_be_asked_for_with_another_width_of_the_inertials():
    space, data = planted(2, {})
    chosen, hyper = (2,), (SETTING, SETTING)
    prior = space.prior(chosen, hyper)
    prior[:INERTIALS] = 3.0
    mean, cov = dense_posterior(space, data, chosen, hyper, prior)
    found, spread = space.posterior(chosen, hyper, width=3.0)
    np.testing.assert_allclose(found, mean, atol=1e-8)
    np.testing.assert_allclose(spread, cov, atol=1e-8)
    assert not np.allclose(space.posterior(chosen, hyper)[1], cov, atol=1e-5)


def test_a_payload_whose_mass_moves_nothing_is_not_found():
    space, _ = planted(2, {4: -2.0})
    space = with_payload(space)
    space.lowest[0, 0] = np.inf
    assert space.log_evidence((0,), (SETTING, SETTING)) == -np.inf
    assert gains(space, (), (SETTING, SETTING), np.array([0])) == [-np.inf]
    space.lowest[0, 0] = 0.0
    assert np.isfinite(space.log_evidence((0,), (SETTING, SETTING)))


def test_screening_says_of_a_payload_what_the_evidence_says_at_the_width_of_the_inertials_of_the_set_before():
    space, data = planted(2, {0: 3.0, 4: -2.0})
    space, hyper = with_payload(space), (SETTING, SETTING)
    width = space.width((2,), hyper)
    each = np.array([density(space, data, (2, 0), hyper, width, t) for t in WIDTHS]) + LOG_PRIOR
    expected = np.logaddexp.reduce(each) - density(space, data, (2,), hyper, width) + np.log(0.05) + np.log(2.0)
    np.testing.assert_allclose(gains(space, (2,), hyper, np.array([0])), expected, atol=1e-6)


def test_screening_of_an_effect_that_shifts_a_channel_sums_over_delays_that_are_smaller_beside_it():
    space, data = planted(2, {0: 6.0})
    skew = dataclasses.replace(space.candidates[0], effect=CATALOGUE["channel_skew"])
    # A delay of the instrument that is far beyond what is usual.
    space = with_first_common(dataclasses.replace(space, candidates=(skew, *space.candidates[1:])), data, 8.0)
    space, hyper, chosen = dataclasses.replace(space, delays=COMMON), (SETTING, SETTING), (2,)
    of = lambda s, width: np.array([density(space, data, s, hyper, width, common=w) for w in WIDTHS])  # noqa: E731
    every = np.array([of(chosen, w) + p for w, p in zip(WIDTHS, LOG_PRIOR, strict=True)]) + LOG_PRIOR
    likely = np.logaddexp.reduce(every, axis=0) - np.logaddexp.reduce(every, axis=None)
    width = space.width(chosen, hyper)
    smaller = np.arange(len(WIDTHS)) <= np.argmax(of(chosen, width) + LOG_PRIOR)
    added = of((2, 0), width) - of(chosen, width) + likely
    expected = np.logaddexp.reduce(added[smaller]) + np.log(0.05)
    np.testing.assert_allclose(gains(space, chosen, hyper, np.array([0])), [expected], atol=1e-8)
    assert 1 < smaller.sum() < len(WIDTHS)


def test_a_row_in_which_a_candidate_says_nothing_has_a_density_of_one_over_its_range():
    bare, _ = planted(2, {2: 1.0})
    silent, span = np.zeros((2, len(bare.candidates))), 5.0  # over the noise at level 1
    silent[:, 0] = 7.0, np.log(span / np.sqrt(2.0 * np.pi))
    space = dataclasses.replace(bare, silent=silent)
    for level in (ONE - 3, ONE + 3):
        hyper = ((*SETTING[:-1], level), SETTING)
        noise = LEVELS[hyper[bare.candidates[0].joints[0]][-1]]
        # Seven rows by the normal density of an error of zero, and by that of anything within the range.
        lost = 7.0 * (np.log(1.0 / (np.sqrt(2.0 * np.pi) * noise)) - np.log(1.0 / span))
        assert space.log_evidence((0, 2), hyper) == pytest.approx(bare.log_evidence((0, 2), hyper) - lost)
        less = [gains(x, (2,), hyper, np.arange(2)) for x in (bare, space)]
        np.testing.assert_allclose(less[0] - less[1], [lost, 0.0])


def test_functions_of_shared_and_own_columns_have_the_moments_of_a_dense_regression():
    space, data = planted(5, {0: 0.4, 5: 0.3})
    hyper, chosen, rng = (SETTING, (0, 2, 5, ONE)), (0, 5), np.random.default_rng(6)
    columns = space.set_columns(chosen)
    A, y = np.zeros((2 * ROWS, len(columns) + 2 * OWN)), np.concatenate([d["y"] for d in data])
    sizes = [own_scale(GROUPS, h) for h in hyper]
    for j, (d, h) in enumerate(zip(data, hyper, strict=True)):
        wide = np.zeros((ROWS, space.size))
        wide[:, d["mine"]] = d["X"]
        rows, own = slice(j * ROWS, (j + 1) * ROWS), len(columns) + OWN * j + np.arange(OWN)
        A[rows, : len(columns)], A[rows, own] = wide[:, columns] / LEVELS[h[-1]], d["E"] / LEVELS[h[-1]]
        y[rows] /= LEVELS[h[-1]]
    # Amplitudes are planted so small that no prior is widened to their size.
    prior = np.concatenate([space.prior(chosen, hyper), *sizes])
    cov = prior[:, None] * np.linalg.inv((A * prior).T @ (A * prior) + np.eye(len(prior))) * prior
    shared, own = rng.normal(size=(3, len(columns))), rng.normal(size=(3, OWN))
    both = np.concatenate([shared, np.zeros((3, OWN)), own], axis=1)
    mean, spread = space.functions(chosen, hyper, 1, shared, own)
    np.testing.assert_allclose(mean, both @ cov @ A.T @ y, atol=1e-9)
    np.testing.assert_allclose(spread, both @ cov @ both.T, atol=1e-9)


@pytest.mark.parametrize("common", [0.0, 30.0])
def test_a_set_counts_with_a_scale_of_all_torques_and_without_any(common):
    space, data = planted(2, {2: 1.0})
    space, hyper, chosen = with_first_common(space, data, common), (SETTING, SETTING), (0, 2)
    values = {frozenset(chosen): (space.log_evidence(chosen, hyper), hyper)}
    each = np.array([[density(space, data, chosen, hyper, w, common=c) for w in WIDTHS] for c in (0.0, 1.0)])
    without, scaled = np.logaddexp.reduce(each + LOG_PRIOR, axis=1)
    counted = beside_scale(space, values)
    assert counted.keys() == {frozenset(chosen), frozenset({*chosen, len(space.candidates)})}
    odds = counted[frozenset({*chosen, len(space.candidates)})] - counted[frozenset(chosen)]
    assert odds == pytest.approx(scaled - without + np.log(settings.RARE))
    assert odds > 10.0 if common else odds < 0.0
    assert counted[frozenset(chosen)] - values[frozenset(chosen)][0] == pytest.approx(without - scaled)


def test_copies_of_a_delay_are_one_shape():
    space, _ = planted(1, {})
    skew = [dataclasses.replace(c, effect=CATALOGUE["channel_skew"], joints=(0,), shape=np.array([half]))
            for c, half in zip(space.candidates[:4], (0.002, 0.003, 0.002, 0.002), strict=True)]  # fmt: skip
    alike = dataclasses.replace(space, candidates=(*skew, *space.candidates[4:])).alike
    assert [sorted(group) for group in alike[:4]] == [[0, 1], [0, 1], [1, 2], [1, 3]]


def test_the_prior_of_the_widths_is_a_probability():
    assert np.exp(LOG_PRIOR).sum() == pytest.approx(1.0)


@pytest.mark.parametrize("chosen", [(), (0,), (0, 2), (0, 1, 2, 3)])
def test_sites_of_a_kind_have_it_as_often_as_a_share_of_sites_that_is_the_robots_own(chosen):
    """Integrated over that share, with a Beta distribution, instead of by Beta functions."""
    kinds = Kinds(np.array([0, 0, 0, 1]), np.array([3, 1]), 0.05)

    def log_of(n: int, there: int) -> float:
        """Of u = share^0.1: the density of the share has no bound at zero, and that of u is even there."""

        def integrand(u: float) -> float:
            share = u**10.0
            return share**there * (1.0 - share) ** (n - there) * (1.0 - share) ** n

        return float(np.log(integrate.quad(integrand, 0.0, 1.0)[0]))

    count = [sum(kinds.of[c] == k for c in chosen) for k in (0, 1)]
    expected = sum(log_of(n, m) - log_of(n, 0) for n, m in zip(kinds.number, count, strict=True))
    assert kinds.log_prior(chosen) == pytest.approx(expected, abs=1e-6)
    for c in set(range(4)) - set(chosen):
        more = kinds.log_prior((*chosen, c)) - kinds.log_prior(chosen)
        assert kinds.one_more(chosen)[c] == pytest.approx(more)


def test_the_posterior_is_that_of_the_data():
    space, data = planted(3, {1: 1.0})
    hyper, chosen = (SETTING, (2, 0, 0, ONE + 3)), (1, 4)
    mean, cov = space.posterior(chosen, hyper)
    width = np.where(np.arange(INERTIALS + COMMON + 2) < INERTIALS, space.width(chosen, hyper), 1.0)
    expected, spread = dense_posterior(space, data, chosen, hyper, width)
    np.testing.assert_allclose(cov, spread, atol=1e-10)
    np.testing.assert_allclose(mean, expected, atol=1e-10)


@pytest.mark.parametrize("silent", [0.0, 60.0])
def test_settings_that_are_settled_have_no_better_neighbour_one_step_away(silent):
    space, _ = planted(4, {0: 2.0})
    space = dataclasses.replace(space, silent=silent * np.eye(1, len(space.candidates)) * [[1.0], [0.1]])
    value, hyper = settled(space, (0,), (SETTING, SETTING))
    assert value == pytest.approx(space.log_evidence((0,), hyper))
    for j in range(2):
        for axis in range(len(SETTING)):
            for step in (-1, 1):
                trial = list(hyper[j])
                trial[axis] += step
                low, high = (ONE, len(LEVELS)) if axis == len(SETTING) - 1 else (0, len(settings.DISCREPANCY_SIZES))
                if low <= trial[axis] < high:
                    other = tuple(tuple(trial) if i == j else s for i, s in enumerate(hyper))
                    assert space.log_evidence((0,), other) <= value + 2e-3


def test_the_prior_of_the_sizes_is_a_half_cauchy_distribution():
    prior = np.exp(log_prior_of_sizes())
    assert prior.sum() == pytest.approx(1.0) and len(prior) == len(settings.DISCREPANCY_SIZES)
    # Half of it lies below the usual misfit, which is on the grid: within its own cell.
    usual = settings.DISCREPANCY_SIZES.index(settings.USUAL_MISFIT)
    assert prior[:usual].sum() < 0.5 < prior[: usual + 1].sum()


@pytest.mark.parametrize("misfit", [0.0, 0.5, 0.9])
def test_a_motion_played_again_is_worth_what_averaging_its_rows_would_make_of_it(misfit):
    """Sensor noise differs from run to run; what a model errs by is the same: their mean is the sufficient number."""
    rng, times = np.random.default_rng(7), 3
    x = rng.normal(size=ROWS)
    runs = [x * 0.7 + rng.normal(size=ROWS) for _ in range(times)]
    grams = np.array([np.stack([x, y]) @ np.stack([x, y]).T for y in runs])
    gram = JointGram(np.array([0, 1]), grams, np.zeros(0, int), np.full(times, ROWS), np.full(times, times), misfit)
    (precision, moment), _ = gram.weighted(1.0)[0]
    variance = (1.0 - misfit) / times + misfit
    assert precision == pytest.approx(x @ x / variance)
    assert moment == pytest.approx(x @ np.mean(runs, axis=0) / variance)


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9])
def test_rows_that_are_alike_count_as_the_mean_of_a_process_is_known(pole):
    rng = np.random.default_rng(8)
    series = [np.asarray(signal.lfilter([1.0], [1.0, -pole], rng.normal(size=20_000))) for _ in range(2)]
    assert correlation_time(series) == pytest.approx((1.0 + pole) / (1.0 - pole), rel=0.15)


def test_a_sets_shapes_are_summed_over_one_member_at_a_time():
    """Columns 1 to 3 and 5 to 6 are shapes of one law each: the sum over the sets that differ from this one in it."""
    space, data = planted(10, {1: 1.0, 6: 1.0})
    shapes = {1: (1, 2, 3), 5: (5, 6)}
    candidates = list(space.candidates)
    for first, points in shapes.items():
        for k in points:
            candidates[k] = dataclasses.replace(candidates[first], shape=np.array([float(k)]), columns=np.array([k]))
    space = dataclasses.replace(space, candidates=tuple(candidates))
    hyper, chosen = (SETTING, SETTING), (0, 1, 6)
    expected = 0.0
    for member, points in ((1, shapes[1]), (6, shapes[5])):
        rest = tuple(c for c in chosen if c != member)
        sets = [tuple(sorted((*rest, k))) for k in points]
        width = space.width(rest, hyper)
        values = [density(space, data, s, hyper, width) for s in (*sets, chosen)]
        expected += np.logaddexp.reduce(values[:-1]) - values[-1]
    assert expected > 0.0
    assert over_shapes(space, chosen, hyper) == pytest.approx(expected, abs=1e-8)
    assert over_shapes(space, (0,), hyper) == 0.0


def test_blocks_left_out_are_as_if_they_had_not_been_recorded():
    space, _ = planted(9, {0: 1.0})
    twice = [JointGram(g.index, np.concatenate([g.blocks, 3.0 * g.blocks]), g.groups, np.repeat(g.rows, 2))
             for g in space.joints]  # fmt: skip
    both = dataclasses.replace(space, joints=tuple(twice))
    left = both.without(np.array([False, True]))
    for one, other in zip(left.posterior((0,), (SETTING,) * 2), space.posterior((0,), (SETTING,) * 2), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
