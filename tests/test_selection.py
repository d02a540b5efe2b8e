"""The evidence of sets with model discrepancy, against the density of the data itself; the search on planted sets."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import integrate, signal, stats

from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.gram import LEVELS, ONE, JointGram, log_prior_of_sizes, own_scale
from irb140_jax.mismatch.regression.noise import correlation_time
from irb140_jax.mismatch.selection.averages import probabilities
from irb140_jax.mismatch.selection.evidence import Space
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.selection.hyperparameters import over_shapes, settled
from irb140_jax.mismatch.selection.kinds import Kinds
from irb140_jax.mismatch.selection.screening import gains, reshaped
from irb140_jax.mismatch.selection.search import Search
from irb140_jax.mismatch.selection.selected import named, selected
from irb140_jax.mismatch.selection.unknown_width import LOG_PRIOR, WIDTHS

ROWS, INERTIALS, COMMON, OWN = 60, 3, 1, 5
SLUGS = ("coulomb_friction", "viscous_friction", "torque_offset", "rotor_inertia")
GROUPS = np.array([-1, 0, 0, 1, 2])
SETTING = (3, 4, 2, ONE + 1)


def planted(seed: int, amplitudes: dict[int, float]) -> tuple[Space, list[dict[str, np.ndarray]]]:
    """Two joints with four candidates each, of one column; what is planted is their sum and unit noise.

    Returns:
        The space, and each joint's own columns E, shared columns X and torque y.
    """
    rng = np.random.default_rng(seed)
    size = INERTIALS + COMMON + 2 * len(SLUGS)
    candidates, joints, data = [], [], []
    for j in range(2):
        for k, slug in enumerate(SLUGS):
            columns = np.array([len(SLUGS) * j + k])
            free = np.array([np.inf])
            candidates.append(Candidate(CATALOGUE[slug], (j,), np.zeros(0), columns, (0,), -free, free))
        mine = [*range(INERTIALS + COMMON), *(INERTIALS + COMMON + len(SLUGS) * j + k for k in range(len(SLUGS)))]
        E, X = rng.normal(size=(ROWS, OWN)), rng.normal(size=(ROWS, len(mine)))
        y = rng.normal(size=ROWS)
        for c, w in amplitudes.items():
            if c // len(SLUGS) == j:
                y = y + w * X[:, INERTIALS + COMMON + c % len(SLUGS)]
        A = np.column_stack([E, X, y])
        joints.append(JointGram(np.array([*mine, size]), (A.T @ A)[None], GROUPS, np.array([ROWS])))
        data.append({"E": E, "X": X, "y": y, "mine": np.array(mine)})
    prior = np.full(len(candidates), np.log(0.05))
    free = np.full((len(candidates), 1), np.inf)
    nothing = np.zeros((len(candidates), 1)), -free[:, 0]
    kinds = Kinds(np.full(len(candidates), -1), np.zeros(0), 0.05)
    space = Space(
        tuple(joints), tuple(candidates), INERTIALS, INERTIALS + COMMON, size, prior, kinds, -free, free, *nothing,
        np.zeros((2, len(candidates))), np.zeros(COMMON),
    )  # fmt: skip
    return space, data


def with_payload(space: Space) -> Space:
    """The same space, whose first candidate is a payload that moves both joints."""
    payload = Candidate(CATALOGUE["payload"], (0, 1), np.zeros(0), np.array([0, 4]), (0, 1), np.zeros(2), np.ones(2))
    free = np.full((len(space.candidates), 2), np.inf)
    return dataclasses.replace(
        space, candidates=(payload, *space.candidates[1:]), lowest=-free, highest=free, weights=np.zeros_like(free)
    )


def density(
    space: Space, data: list[dict[str, np.ndarray]], chosen: tuple[int, ...], hyper, width: float, tied: float = 1.0,
    common: float = 1.0,
) -> float:  # fmt: skip
    """Log density of both joints' torque with every unknown integrated out by its covariance: no Gram matrices.

    The inertials' prior is as many times as wide as stated as `width` says, a payload's as `tied` does, that of common
    nuisances as `common` does.
    """
    columns = space.set_columns(chosen)
    shared, blocks = [], []
    for d, of_joint in zip(data, hyper, strict=True):
        wide = np.zeros((ROWS, space.size))
        wide[:, d["mine"]] = d["X"]
        wide[:, :INERTIALS] *= width
        wide[:, INERTIALS : INERTIALS + COMMON] *= common
        for c in (space.candidates[i] for i in chosen if space.candidates[i].slug == "payload"):
            wide[:, c.columns + space.offset] *= tied
        shared.append(wide[:, columns])
        E = d["E"] * own_scale(GROUPS, of_joint)
        blocks.append(E @ E.T + LEVELS[of_joint[-1]] ** 2 * np.eye(ROWS))
    Z = np.concatenate(shared)
    cov = Z @ Z.T
    cov[:ROWS, :ROWS] += blocks[0]
    cov[ROWS:, ROWS:] += blocks[1]
    y = np.concatenate([d["y"] for d in data])
    mean = Z[:, INERTIALS : INERTIALS + COMMON] @ space.centre
    density = stats.multivariate_normal(mean, cov)  # pyright: ignore[reportArgumentType]: stubs want a number
    return float(density.logpdf(y)) + 0.5 * len(y) * np.log(2.0 * np.pi)


def dense_posterior(space: Space, data, chosen: tuple[int, ...], hyper, prior: np.ndarray):
    """Mean and covariance of a set's columns under these prior standard deviations, without Gram matrices."""
    columns, precision, moment = space.set_columns(chosen), np.diag(1.0 / prior**2), 0.0
    for d, of_joint in zip(data, hyper, strict=True):
        wide = np.zeros((ROWS, space.size))
        wide[:, d["mine"]] = d["X"]
        E = d["E"] * own_scale(GROUPS, of_joint)
        inverse = np.linalg.inv(E @ E.T + LEVELS[of_joint[-1]] ** 2 * np.eye(ROWS))
        precision = precision + wide[:, columns].T @ inverse @ wide[:, columns]
        moment = moment + wide[:, columns].T @ inverse @ d["y"]
    return np.linalg.solve(precision, moment), np.linalg.inv(precision)


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


def test_odds_of_a_finding_without_which_others_are_inadmissible_are_those_against_the_best_set_visited():
    space, _ = planted(1, {})
    sets = {frozenset({0, 1}): -3.0, frozenset({1}): -np.inf, frozenset({2}): -9.0, frozenset(): -12.0}
    data = SimpleNamespace(candidates=space.candidates)
    ex = SimpleNamespace(
        falls={}, _late={}.get, data=data, space=space, chosen=(0, 1), sets=sets,
        members=[space.candidates[i] for i in (0, 1)],
        others=lambda index: tuple(i for i in (0, 1) if i != index),
        log_posterior=lambda chosen, joints: sets[frozenset(chosen)],
    )  # fmt: skip
    assert Explanation.log_odds(ex, 0) == pytest.approx(6.0)  # pyright: ignore[reportArgumentType]


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
    hyper = (SETTING,) * 2
    stated = lambda best, other: named(space, best, hyper, {frozenset(best): 0.0, frozenset(other): -1.9})[0]  # noqa: E731
    assert stated(friction, offset) == friction and stated(offset, friction) == friction
    assert stated(rotor, offset) == offset and stated(offset, rotor) == offset  # one rare effect each


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
