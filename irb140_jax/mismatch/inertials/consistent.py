"""Inertial parameters that some body could have, nearest to those of a fit."""

import numpy as np

from irb140_jax.mismatch import settings

ROUNDING = 1e-9  # of a pseudo-inertia's largest eigenvalue


def consistent(phi: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """The parameters, with mass taken from where a fit made it negative to where there is none.

    Each link's pseudo-inertia is written in axes in which the nominal one is the unit matrix; eigenvalues below
    `LEAST_MASS` are raised to it.  What is possible already stays as it is; a link without nominal mass keeps none.

    Args:
        phi: Inertial parameters, shape (n, 10).
        nominal: Those of the model as given, shape (n, 10).

    Source: Wensing, Kim, Slotine, Linear matrix inequalities for physically consistent inertial parameter
        identification, IEEE RA-L 3(1), 2018.
    """
    out = np.array(phi, dtype=float)
    for i, (new, old) in enumerate(zip(phi, nominal, strict=True)):
        try:
            L = np.linalg.cholesky(pseudo_inertia(old))
        except np.linalg.LinAlgError:
            out[i] = old
            continue
        inverse = np.linalg.inv(L)
        values, vectors = np.linalg.eigh(inverse @ pseudo_inertia(new) @ inverse.T)
        if values.min() < settings.LEAST_MASS:
            root = L @ vectors
            out[i] = parameters(root @ np.diag(np.maximum(values, settings.LEAST_MASS)) @ root.T)
    return out


def of_bodies_or_nominal(phi: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """`consistent` parameters; a link whose nominal inertials are those of no body, as a point mass's, keeps those.

    Args:
        phi: Inertial parameters, shape (n, 10).
        nominal: Those of the model as given, shape (n, 10).
    """
    possible = np.array([is_body(p) for p in nominal])
    return np.where(possible[:, None], consistent(phi, nominal), nominal)


def is_body(phi: np.ndarray) -> bool:
    """Whether inertial parameters (10,) are those of a body with mass along every direction, beyond rounding."""
    values = np.linalg.eigvalsh(pseudo_inertia(phi))
    return bool(values[0] > ROUNDING * values[-1])


def pseudo_inertia(phi: np.ndarray) -> np.ndarray:
    """[[Sigma, h], [h', m]] with Sigma = tr(I)/2 - I, of one link or more about its frame, shape (..., 4, 4)."""
    return np.tensordot(phi, _OF_PARAMETERS, 1)


def parameters(J: np.ndarray) -> np.ndarray:
    """The inverse of `pseudo_inertia`, shape (..., 10)."""
    return J.reshape(*J.shape[:-2], 16) @ _TO_PARAMETERS


def _unit_pseudo_inertias() -> np.ndarray:
    """Pseudo-inertia of every inertial parameter alone, shape (10, 4, 4)."""
    unit = np.zeros((10, 4, 4))
    unit[0, 3, 3] = 1.0
    for k in range(3):
        unit[1 + k, k, 3] = unit[1 + k, 3, k] = 1.0
    for k, (i, j) in enumerate(zip(*np.triu_indices(3), strict=True)):
        inertia = np.zeros((3, 3))
        inertia[i, j] = inertia[j, i] = 1.0
        unit[4 + k, :3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return unit


_OF_PARAMETERS = _unit_pseudo_inertias()
_TO_PARAMETERS = np.linalg.pinv(_OF_PARAMETERS.reshape(10, 16))
