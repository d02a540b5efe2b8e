"""The evidence of explanations is that of the dense Gaussian it stands for; noise is whitened, and never underrated."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal, stats

from irb140_jax.mismatch.regression.gaussian import eliminated, gain_of, grams, posterior
from irb140_jax.mismatch.regression.noise import ORDER, Noise, noise_from_residuals
from irb140_jax.mismatch.regression.rows import Stretch

LAGS = 3  # coefficients of the whitening filter here, the row's own among them
JOINTS, NUISANCES, AMPLITUDES = 2, 4, 5
ALL = np.arange(NUISANCES + AMPLITUDES)  # columns
SETS = ([0], [1, 2], [3], [2, 4], [0, 4], [1])  # amplitudes of some candidates
WHITE = np.eye(1, ORDER + 1)[0]


def stretches(seed: int, rows: int = 70, recordings: int = 2) -> list[Stretch]:
    """Random columns and residuals; the second joint does not feel the last amplitude."""
    rng = np.random.default_rng(seed)
    out = []
    for r in range(recordings):
        X = rng.normal(size=(rows, JOINTS, NUISANCES + AMPLITUDES))
        X[:, 1, -1] = 0.0
        y = X @ rng.normal(size=X.shape[-1]) + rng.normal(size=(rows, JOINTS))
        use = np.ones((rows, JOINTS), dtype=bool)
        use[20:24, 0] = False
        zero = np.zeros((rows, JOINTS))
        t = np.arange(rows) / 50.0
        links, held, amplitudes = X[..., :NUISANCES], np.arange(AMPLITUDES), X[..., NUISANCES:]
        of_log = y, links, y, zero, zero, use, use, zero, zero, zero, zero, zero
        out.append(Stretch(r, t, 0.0, AMPLITUDES, links, held, amplitudes, *of_log))
    return out


def a_noise(seed: int, recordings: int = 2) -> Noise:
    """A short whitening filter for every joint, another level for every recording."""
    rng = np.random.default_rng(seed)
    ar = np.tile(WHITE, (JOINTS, 1))
    ar[:, 1:LAGS] = rng.uniform(-0.5, 0.5, (JOINTS, 2))
    level = rng.uniform(0.5, 2.0, (recordings, JOINTS))
    return Noise(ar, level, level, np.ones(JOINTS))


def rows_by_hand(data: list[Stretch], noise: Noise) -> tuple[np.ndarray, np.ndarray]:
    """Whitened rows of columns and residual, all joints and recordings, by an explicit sum over lags."""
    X, y = [], []
    for r, s in enumerate(data):
        for j in range(JOINTS):
            lags = noise.ar[j, :LAGS] / noise.level[r, j]
            for i in range(LAGS - 1, len(s.t)):
                if s.use[i - LAGS + 1 : i + 1, j].all():
                    X.append(lags @ s.of(ALL, j)[i - LAGS + 1 : i + 1][::-1])
                    y.append(lags @ s.y[i - LAGS + 1 : i + 1, j][::-1])
    return np.array(X), np.array(y)


def log_evidence(X: np.ndarray, y: np.ndarray, scale: np.ndarray) -> float:
    """log N(y; 0, 1 + X W W X'), written out."""
    covariance = np.eye(len(y)) + (X * scale**2) @ X.T
    density = stats.multivariate_normal(np.zeros(len(y)), covariance)  # pyright: ignore[reportArgumentType]
    return float(density.logpdf(y))


@pytest.mark.parametrize("seed", range(3))
def test_gains_are_differences_of_dense_gaussian_evidence(seed):
    data, noise = stretches(seed), a_noise(seed)
    scale = np.random.default_rng(seed).uniform(0.2, 2.0, NUISANCES + AMPLITUDES)
    G = grams(data, ALL, noise, scale, blocks=4).sum(axis=0)
    H, _ = eliminated(G, np.arange(NUISANCES))
    X, y = rows_by_hand(data, noise)
    nothing = log_evidence(X[:, :NUISANCES], y, scale[:NUISANCES])
    for amplitudes in SETS:
        columns = np.concatenate([np.arange(NUISANCES), NUISANCES + np.array(amplitudes)])
        # Rounding of determinants of some 200 rows.
        expected = log_evidence(X[:, columns], y, scale[columns]) - nothing
        assert gain_of(H, NUISANCES + np.array(amplitudes)) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_posterior_is_that_of_dense_bayesian_regression(seed):
    data, noise = stretches(seed), a_noise(seed)
    scale = np.random.default_rng(seed).uniform(0.2, 2.0, NUISANCES + AMPLITUDES)
    columns = np.array([0, 1, 2, 3, 5, 7])
    post = posterior(grams(data, ALL, noise, scale, blocks=3).sum(axis=0), columns)
    X, y = rows_by_hand(data, noise)
    X, W = X[:, columns], np.diag(scale[columns])
    S = np.eye(len(y)) + X @ W @ W @ X.T
    # Amplitudes and observations as one Gaussian, conditioned on the observations.
    gain = W @ W @ X.T @ np.linalg.inv(S)
    np.testing.assert_allclose(W @ post.mean, gain @ y, rtol=1e-9)
    np.testing.assert_allclose(W @ post.cov @ W, W @ W - gain @ X @ W @ W, atol=1e-9)


def test_a_strong_effect_keeps_what_the_inertials_could_take_and_a_weak_one_does_not():
    # Effect and inertial parameter move the torque alike; y is what `true` of the effect would make, noise-free.
    x = np.full(100, 10.0)

    def found(true):
        A = np.stack([x, x, true * x], axis=1)
        return [posterior(A.T @ A, np.arange(2), named) for named in ((), [slice(1, 2)])]

    plain, widened = found(20.0)
    np.testing.assert_allclose(plain.mean, 10.0, rtol=1e-3)
    np.testing.assert_allclose(widened.mean, [0.05, 19.95], atol=2e-3)  # a ratio of prior variances of 20^2
    assert widened.cov[1, 1] == pytest.approx(1.0, rel=0.01)  # as little as the inertial parameter is known
    plain, widened = found(0.8)
    np.testing.assert_array_equal(plain.mean, widened.mean)
    np.testing.assert_array_equal(plain.cov, widened.cov)


@given(seed=st.integers(0, 10**6), order=st.permutations(range(AMPLITUDES)))
@settings(max_examples=30, deadline=None)
def test_evidence_of_a_set_does_not_depend_on_the_order_of_its_members(seed, order):
    A = np.random.default_rng(seed).normal(size=(30, AMPLITUDES + 1))
    H = A.T @ A
    total, rest = 0.0, H
    for column in order:
        total += gain_of(rest, np.array([column]))
        rest, _ = eliminated(rest, np.array([column]))
    assert total == pytest.approx(gain_of(H, np.arange(AMPLITUDES)), abs=1e-9)


def test_eliminating_costs_the_log_determinant_and_nothing_eliminates_nothing():
    A = np.random.default_rng(0).normal(size=(20, 4))
    H = A.T @ A
    # det [[M, B], [B', D]] = det M det(D - B' M^-1 B)
    rest, logdet = eliminated(H, np.arange(2))
    np.testing.assert_allclose(logdet, np.linalg.slogdet(H[:2, :2] + np.eye(2))[1])
    np.testing.assert_allclose(np.linalg.det(rest[2:, 2:]) * np.exp(logdet),
                               np.linalg.det(H + np.diag([1, 1, 0, 0])))  # fmt: skip
    assert eliminated(H, np.zeros(0, dtype=int))[1] == 0.0


def test_blocks_add_up_and_those_of_a_recording_are_its_own():
    data, noise, scale = stretches(2), a_noise(2), np.full(NUISANCES + AMPLITUDES, 0.7)
    blocks = grams(data, ALL, noise, scale, blocks=5)
    X, y = rows_by_hand(data, noise)
    rows = np.concatenate([X * scale, y[:, None]], axis=1)
    np.testing.assert_allclose(blocks.sum(axis=0), rows.T @ rows, atol=1e-9)
    np.testing.assert_allclose(blocks[:5].sum(axis=0), grams(data[:1], ALL, noise, scale, blocks=1)[0], atol=1e-9)


def test_rows_that_do_not_count_leave_no_trace():
    data, noise, scale = stretches(3), a_noise(3), np.ones(NUISANCES + AMPLITUDES)
    spoiled = [dataclasses.replace(s, y=np.where(s.use, s.y, 1e6)) for s in data]
    clean, dirty = (grams(x, ALL, noise, scale, blocks=4).sum(axis=0) for x in (data, spoiled))
    np.testing.assert_array_equal(clean, dirty)


def a_noise_of(a: list[float], rows: int, seed: int = 0) -> np.ndarray:
    """x_t + a1 x_(t-1) + ... = e_t, (rows, 1), settled."""
    e = np.random.default_rng(seed).normal(size=rows + 500)
    return np.asarray(signal.lfilter([1.0], [1.0, *a], e))[500:, None]


@pytest.mark.parametrize("a", [[0.0], [0.6], [0.9, 0.3]], ids=["white", "rising", "rising steeply"])
def test_noise_that_rises_with_frequency_is_whitened_to_unit_variance(a):
    x = 3.0 * a_noise_of(a, 20_000)
    noise = noise_from_residuals([x], [np.ones(x.shape, dtype=bool)], np.zeros(1))
    white = noise.whitened(x[:, 0], 0, 0)[ORDER:]
    assert np.std(white) == pytest.approx(1.0, abs=0.03)  # the ridge takes a per cent or two
    white = white / np.std(white)
    correlation = [np.mean(white[lag:] * white[:-lag]) for lag in range(1, ORDER + 1)]
    # Four standard errors of 20 000 samples, and what the ridge leaves.
    assert np.max(np.abs(correlation)) < 4.0 / np.sqrt(len(white)) + 0.02


def test_whitening_learnt_from_one_stretch_whitens_another_with_its_own_level():
    quiet, loud = a_noise_of([0.6], 10_000, seed=1), 20.0 * a_noise_of([0.6], 10_000, seed=2)
    noise = noise_from_residuals([quiet, loud], [np.ones(quiet.shape, dtype=bool)] * 2, np.zeros(1))
    for r, x in enumerate((quiet, loud)):
        assert np.std(noise.whitened(x[:, 0], 0, r)[ORDER:]) == pytest.approx(1.0, abs=0.05)
        assert noise.total[r, 0] == pytest.approx(np.std(x), rel=0.02)


@pytest.mark.parametrize("pole", [0.5, 0.8, 0.9])
def test_a_mean_under_noise_that_falls_with_frequency_is_not_called_surer_than_it_is(pole):
    misses = []
    for seed in range(200):
        x = a_noise_of([-pole], 1000, seed)
        noise = noise_from_residuals([x], [np.ones(x.shape, dtype=bool)], np.zeros(1))
        one, y = (noise.whitened(v, 0, 0)[ORDER:] for v in (np.ones(len(x)), x[:, 0]))
        # So many rows as are alike count as one: the variance of the mean is that of white noise times their number.
        misses.append((one @ y) / np.sqrt(noise.alike[0] * (one @ one)))
    # In claimed standard deviations; 200 draws know theirs to 5 %, and a record of some hundred correlation times, or
    # fewer, its own number of rows alike to some 15 %.
    assert np.sqrt(np.mean(np.square(misses))) < 1.2


def test_parameters_already_fitted_make_the_noise_larger():
    x = a_noise_of([0.0], 1000)
    use = [np.ones(x.shape, dtype=bool)]
    without, with_fit = (noise_from_residuals([x], use, np.array([dof])) for dof in (0.0, 360.0))
    assert with_fit.total[0, 0] / without.total[0, 0] == pytest.approx(np.sqrt(1000 / 640))


def test_noise_is_no_smaller_than_a_slow_residual_with_gaps():
    t = np.arange(1500)
    x = (np.sin(2e-3 * t) + 1e-4 * a_noise_of([0.0], 1500)[:, 0])[:, None]
    for seed in range(20):
        use = np.repeat(np.random.default_rng(seed).random(75) < 0.5, 20)[:, None]
        noise = noise_from_residuals([x], [use], np.zeros(1))
        assert noise.level[0, 0] >= 0.99 * noise.total[0, 0]


def test_rows_that_do_not_count_do_not_enter_the_noise():
    x = a_noise_of([0.6], 5000)
    use = np.ones(x.shape, dtype=bool)
    use[1000:1200] = False
    spoiled = np.where(use, x, 1e3)
    whole, gap = (noise_from_residuals([v], [use], np.zeros(1)) for v in (x, spoiled))
    np.testing.assert_array_equal(whole.ar, gap.ar)
    np.testing.assert_array_equal(whole.level, gap.level)


def test_a_joint_that_never_counts_in_a_recording_takes_the_level_of_the_others():
    x = a_noise_of([0.0], 1000)
    never, always = np.zeros(x.shape, dtype=bool), np.ones(x.shape, dtype=bool)
    noise = noise_from_residuals([x, 3.0 * x, x], [always, always, never], np.zeros(1))
    assert noise.total[2, 0] == pytest.approx(np.median(noise.total[:2, 0]), rel=1e-3)


def test_a_few_rows_that_fit_exactly_are_no_measure_of_noise():
    x = a_noise_of([0.0], 1000)
    few, all_ = np.zeros(x.shape, dtype=bool), np.ones(x.shape, dtype=bool)
    few[:3] = True
    noise = noise_from_residuals([x, x, 0.0 * x], [all_, all_, few], np.zeros(1))
    assert noise.total[:2, 0] == pytest.approx(np.std(x), rel=1e-2)
    assert noise.total[2, 0] == pytest.approx(0.5 * np.std(x), rel=1e-2)  # as of these three and one more


def test_noise_free_residuals_leave_everything_finite():
    noise = noise_from_residuals([np.zeros((500, 1))], [np.ones((500, 1), dtype=bool)], np.zeros(1))
    assert np.isfinite(noise.ar).all() and (noise.level > 0).all() and (noise.total > 0).all()


@given(st.lists(st.booleans(), min_size=ORDER + 1, max_size=60))
@settings(max_examples=50, deadline=None)
def test_a_row_counts_when_it_and_all_its_lags_do(flags):
    use = np.array(flags)
    expected = [i >= ORDER and bool(use[i - ORDER : i + 1].all()) for i in range(len(use))]
    assert a_whitening(np.ones(ORDER)).usable(use, 0).tolist() == expected


def test_a_row_of_white_noise_counts_whatever_was_before():
    use = np.array([True, False, True, True, False])
    assert a_whitening(np.zeros(ORDER)).usable(use, 0).tolist() == use.tolist()


def a_whitening(lags):
    """The noise of one joint in one recording, whitened with these lags."""
    return Noise(np.append(1.0, lags)[None], np.ones((1, 1)), np.ones((1, 1)), np.ones(1))


def test_noise_of_few_rows_between_many_gaps_is_of_the_size_of_the_residual():
    # Per pair, such autocovariances can be those of no signal; the noise was then a thousand times too small or large.
    for seed in range(20):
        rng = np.random.default_rng(seed)
        x = np.cumsum(rng.normal(size=(480, 1)), axis=0)
        x -= x.mean()
        use = np.repeat(rng.random((120, 1)) < 0.4, 4, axis=0)
        noise = noise_from_residuals([x], [use], np.zeros(1))
        size = np.sqrt(np.mean(x[use] ** 2))
        assert 0.5 * size < noise.level[0, 0] < 10.0 * size


def test_columns_that_others_explain_to_the_last_digits_are_no_evidence_and_stop_nothing():
    rng = np.random.default_rng(1)
    nuisances = 1e8 * rng.normal(size=(200, 4))
    columns = nuisances @ rng.normal(size=(4, 6))
    rows = np.hstack([nuisances, columns, rng.normal(size=(200, 1))])
    H, _ = eliminated(rows.T @ rows, np.arange(4))
    H = H[4:, 4:]
    for k in (1, 2):
        assert all(gain_of(H, columns) < 1.0 for columns in np.arange(6).reshape(-1, k))
    assert np.abs(posterior(H, np.arange(6)).mean).max() < 1.0


def test_noise_is_told_apart_from_what_some_rows_are_unsure_by():
    rng = np.random.default_rng(0)
    unsure = np.where(rng.random((4000, 1)) < 0.1, 5.0, 0.0)
    residual = rng.normal(size=unsure.shape) + unsure * rng.normal(size=unsure.shape)
    use = [np.ones(residual.shape, dtype=bool)]
    noise, blind = (noise_from_residuals([residual], use, np.zeros(1), x) for x in ([unsure], None))
    assert noise.total[0, 0] == pytest.approx(1.0, rel=0.05) and blind.total[0, 0] > 1.7
    white = noise.whitened(residual[:, 0], 0, 0, unsure[:, 0])
    loud = unsure[:, 0] > 0.0
    assert np.std(white[loud]) == pytest.approx(np.std(white[~loud]), rel=0.1)
