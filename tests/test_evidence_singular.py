"""Evidence stays finite and right where columns repeat each other, vanish, or differ by many orders of magnitude."""

import numpy as np
import pytest

from irb140_jax.mismatch.regression.gaussian import eliminated, gain_of, posterior, root

EXPONENTS = [0.0, 3.0, 6.0, 9.0]  # of ten, the sizes that columns differ by


def singular(seed: int, exponent: float, columns: int = 12, rows: int = 40) -> np.ndarray:
    """A Gram matrix of columns and y, nearly of rank 3, some the same, one zero, of very different sizes."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(rows, 3)) @ rng.normal(size=(3, columns))
    A[:, 0] += rng.normal(size=rows)
    A[:, 3], A[:, 4] = A[:, 2], 0.0
    y = A @ rng.normal(size=columns) + rng.normal(size=rows)
    A = A * 10.0 ** rng.uniform(0.0, exponent, columns)
    A = np.column_stack([A, y])
    return A.T @ A


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("seed", range(5))
def test_gains_and_amplitudes_of_singular_columns_are_finite(seed, exponent):
    H = singular(seed, exponent)
    H, cost = eliminated(H, np.arange(4))
    post = posterior(H, np.arange(4, 12), [slice(0, 3)])
    assert np.isfinite(cost) and np.isfinite(post.mean).all() and (np.diag(post.cov) >= 0.0).all()
    assert np.isfinite(gain_of(H, np.arange(4, 12)))


def test_a_column_that_repeats_another_adds_next_to_nothing():
    H = singular(1, 0.0)
    left, _ = eliminated(H, np.array([2]))
    # The prior lets the copy take half of the amplitude: at most half the log of how well that was known.
    assert abs(gain_of(left, np.array([3]))) < 0.5 * np.log(2.0) + 0.05
    assert gain_of(left, np.array([4])) == pytest.approx(0.0, abs=1e-9)  # a column of zeros


def test_the_root_of_a_matrix_that_rounding_spoiled_is_that_of_the_nearest_with_the_prior():
    vectors = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    spoiled, mended = ((vectors * np.array([1e4, 7.0, low])) @ vectors.T for low in (-1e-3, 1.0))
    L = root(spoiled)
    np.testing.assert_allclose(L @ L.T, mended, atol=1e-9)
    np.testing.assert_allclose(L, np.tril(L))
