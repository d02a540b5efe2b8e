"""Estimates that bodies could have: the most probable ones among those with a mass along every direction."""

import dataclasses

import numpy as np
from scipy import linalg, optimize

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.inertials.consistent import is_body, parameters, pseudo_inertia

TRIALS = 300  # evaluations of the search; thirty are usual, and more where many bounds are met


def of_bodies(
    mean: np.ndarray, cov: np.ndarray, into: np.ndarray, phi: np.ndarray, factor: np.ndarray
) -> np.ndarray:
    """The mean of a Gaussian moved to the most probable inertials that bodies can have.

    Each link's pseudo-inertia is kept at or above `LEAST_MASS` times its nominal one; a link whose nominal inertials
    are those of no body is left alone.  All else moves along as it is correlated with the inertials.

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
    links = _Links.of(phi, factor)
    rows = links.rows.ravel()
    if not links.impossible(errors[links.rows]):
        return mean
    spread = (into @ cov @ into.T)[np.ix_(rows, rows)]
    spread = spread + 1e-12 * np.mean(np.diag(spread)) * np.eye(len(rows))
    whiten = linalg.solve_triangular(np.linalg.cholesky(spread), np.eye(len(rows)), lower=True)
    blocks = whiten.reshape(len(rows), -1, 10).swapaxes(0, 1)  # of each link's rows
    off = lambda x: links.errors(x).ravel() - errors[rows]  # noqa: E731
    # From the nominal bodies: from the bounds of the impossible mean the search may stay far from the best.
    start = np.tile(np.sqrt(1.0 - settings.LEAST_MASS) * np.eye(4)[LOWER], len(links.rows))
    best = optimize.least_squares(
        lambda x: whiten @ off(x), start,
        lambda x: np.concatenate([*(blocks @ links.slopes(x))], axis=1),  # pyright: ignore[reportArgumentType]
        method="lm", max_nfev=TRIALS,
    ).x  # fmt: skip
    return mean + (cov @ into.T)[:, rows] @ np.linalg.solve(spread, off(best))


@dataclasses.dataclass(frozen=True)
class _Links:
    """Links' pseudo-inertias as their least ones and squares, J = LEAST_MASS J_nominal + L (U U') L', J_nominal = L L'.

    Of l links; those whose nominal inertials are those of no body are not among them.

    Attributes:
        rows: Of their inertials among all, shape (l, 10).
        root: L, shape (l, 4, 4).
        phi: Nominal inertial parameters, shape (l, 10).
        factor, inverse: From relative errors to inertial parameters and back, shape (l, 10, 10).
    """

    rows: np.ndarray
    root: np.ndarray
    phi: np.ndarray
    factor: np.ndarray
    inverse: np.ndarray

    @staticmethod
    def of(phi: np.ndarray, factor: np.ndarray) -> "_Links":
        bodies = [i for i, p in enumerate(phi) if is_body(p)]
        rows = 10 * np.array(bodies, dtype=int)[:, None] + np.arange(10)
        own = factor[rows[:, :, None], rows[:, None, :]]
        return _Links(rows, np.linalg.cholesky(pseudo_inertia(phi[bodies])), phi[bodies], own, np.linalg.inv(own))

    def impossible(self, errors: np.ndarray) -> bool:
        """Whether some link is below its least; `errors` are relative, shape (l, 10)."""
        J = pseudo_inertia(self.phi + np.einsum("lij,lj->li", self.factor, errors))
        inverse = np.linalg.inv(self.root)
        relative = inverse @ J @ inverse.swapaxes(1, 2)  # in axes in which the nominal one is the unit matrix
        return bool(np.any(np.linalg.eigvalsh(relative)[:, 0] < settings.LEAST_MASS * (1.0 - 1e-6)))

    def _squares(self, x: np.ndarray) -> np.ndarray:
        U = np.zeros((len(self.rows), 4, 4))
        U[:, *LOWER] = x.reshape(-1, 10)
        return U

    def errors(self, x: np.ndarray) -> np.ndarray:
        """Relative errors, shape (l, 10), at the lower triangles U, shape (10 l,)."""
        U = self._squares(x)
        J = self.root @ (settings.LEAST_MASS * np.eye(4) + U @ U.swapaxes(1, 2)) @ self.root.swapaxes(1, 2)
        return np.einsum("lij,lj->li", self.inverse, parameters(J) - self.phi)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Slopes of the errors over the elements of U, shape (l, 10 errors, 10 elements)."""
        half = STEPS @ self._squares(x)[:, None].swapaxes(2, 3)
        root = self.root[:, None]
        turned = parameters(root @ (half + half.swapaxes(2, 3)) @ root.swapaxes(2, 3))
        return self.inverse @ turned.swapaxes(1, 2)


LOWER = np.tril_indices(4)
STEPS = np.eye(16).reshape(4, 4, 4, 4)[LOWER]  # unit steps of each element of a lower triangle
