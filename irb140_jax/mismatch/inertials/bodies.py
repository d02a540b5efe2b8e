"""Estimates that bodies could have: the most probable ones among those with a mass along every direction."""

import dataclasses

import numpy as np
from scipy import linalg, optimize

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.inertials.consistent import parameters, pseudo_inertia

TRIALS = 300  # evaluations of the search; thirty are usual, and more where many bounds are met


def of_bodies(
    mean: np.ndarray, cov: np.ndarray, into: np.ndarray, phi: np.ndarray, factor: np.ndarray
) -> np.ndarray:
    """The mean of a Gaussian moved to the most probable inertials that bodies can have.

    Each link's pseudo-inertia is kept at or above `LEAST_MASS` times its nominal one; a link without nominal mass is
    left alone.  All else moves along as it is correlated with the inertials.

    Args:
        mean, cov: Of K unknowns, shape (K,) and (K, K).
        into: From those to the inertials' relative errors, shape (10 n, K).
        phi: Nominal inertial parameters, shape (n, 10).
        factor: From relative errors to inertial parameters, shape (10 n, 10 n).

    Returns:
        Shape (K,); the mean itself where it is possible.

    Source: Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial parameter
        identification, IEEE RA-L 3(1), 2018.
    """
    errors = into @ mean
    links = [_Link.of(i, p, factor) for i, p in enumerate(phi)]
    free = [link for link in links if link is not None]
    if not any(link.impossible(errors[link.rows]) for link in free):
        return mean
    rows = np.concatenate([link.rows for link in free])
    spread = (into @ cov @ into.T)[np.ix_(rows, rows)]
    spread = spread + 1e-12 * np.mean(np.diag(spread)) * np.eye(len(rows))
    whiten = linalg.solve_triangular(np.linalg.cholesky(spread), np.eye(len(rows)), lower=True)
    each = lambda x: zip(free, x.reshape(-1, 10), strict=True)  # noqa: E731
    off = lambda x: np.concatenate([link.errors(v) for link, v in each(x)]) - errors[rows]  # noqa: E731
    slope = lambda x: whiten @ linalg.block_diag(*(link.slopes(v) for link, v in each(x)))  # noqa: E731
    # From the nominal bodies: from the bounds of the impossible mean the search may stay far from the best.
    start = np.tile(np.sqrt(1.0 - settings.LEAST_MASS) * np.eye(4)[LOWER], len(free))
    best = optimize.least_squares(
        lambda x: whiten @ off(x), start, slope, method="lm", max_nfev=TRIALS  # pyright: ignore[reportArgumentType]
    ).x
    return mean + (cov @ into.T)[:, rows] @ np.linalg.solve(spread, off(best))


@dataclasses.dataclass(frozen=True)
class _Link:
    """A link's pseudo-inertia as its least one and a square, J = LEAST_MASS J_nominal + L (U U') L', J_nominal = L L'.

    Attributes:
        rows: Of its inertials among all.
        root: L, shape (4, 4).
        phi: Nominal inertial parameters, shape (10,).
        inverse: From inertial parameters to relative errors, shape (10, 10).
    """

    rows: np.ndarray
    root: np.ndarray
    phi: np.ndarray
    inverse: np.ndarray

    @staticmethod
    def of(index: int, phi: np.ndarray, factor: np.ndarray) -> "_Link | None":
        rows = 10 * index + np.arange(10)
        try:
            root = np.linalg.cholesky(pseudo_inertia(phi))
            return _Link(rows, root, phi, np.linalg.inv(factor[np.ix_(rows, rows)]))
        except np.linalg.LinAlgError:
            return None

    def _relative(self, errors: np.ndarray) -> np.ndarray:
        """Pseudo-inertia in axes in which the nominal one is the unit matrix."""
        J = pseudo_inertia(self.phi + np.linalg.solve(self.inverse, errors))
        return linalg.solve_triangular(self.root, linalg.solve_triangular(self.root, J, lower=True).T, lower=True)

    def impossible(self, errors: np.ndarray) -> bool:
        return bool(np.linalg.eigvalsh(self._relative(errors))[0] < settings.LEAST_MASS * (1.0 - 1e-6))

    def errors(self, x: np.ndarray) -> np.ndarray:
        U = np.zeros((4, 4))
        U[LOWER] = x
        J = self.root @ (settings.LEAST_MASS * np.eye(4) + U @ U.T) @ self.root.T
        return self.inverse @ (parameters(J) - self.phi)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        U = np.zeros((4, 4))
        U[LOWER] = x
        half = STEPS @ U.T
        turned = self.root @ (half + np.swapaxes(half, 1, 2)) @ self.root.T
        return self.inverse @ parameters(turned).T


LOWER = np.tril_indices(4)
STEPS = np.eye(16).reshape(4, 4, 4, 4)[LOWER]  # unit steps of each element of a lower triangle
