"""Whether parameters can belong to a body: density nowhere negative."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from irb140_jax.identify.parameters import elements, tensors


class Consistency(NamedTuple):
    """What holds of all links of an estimate.

    Attributes:
        positive: Every inertia tensor is positive definite.
        triangle: No principal moment exceeds the sum of the other two.
        pseudo_inertia: The 4 x 4 pseudo-inertia is positive definite: both, strictly; the full condition.
    """

    positive: Bool[Array, ""]
    triangle: Bool[Array, ""]
    pseudo_inertia: Bool[Array, ""]


def consistency(x: Float[Array, " d"], mass: Float[Array, " k"]) -> Consistency:
    """Physical consistency of centres of mass and inertias.

    Args:
        x: See `link_parameters`.
        mass: Masses of the links [kg], shape (k,).

    Source: Traversaro et al. (2016), Identification of fully physically consistent inertial parameters.
    """
    moments = jnp.linalg.eigvalsh(tensors(x))
    positive = jnp.all(moments > 0)
    second = 0.5 * jnp.sum(moments, axis=1, keepdims=True) - moments  # eigenvalues of the second moment of mass
    return Consistency(positive, jnp.all(second >= 0), jnp.all(second > 0) & jnp.all(mass > 0))


def consistent_parameters(theta: Float[Array, " d"], mass: Float[Array, " k"]) -> Float[Array, " d"]:
    """Parameters of possible bodies out of any numbers: the log-Cholesky parametrisation with the masses held.

    The second moment of mass about the centre is S = m U U^T, U upper triangular with diagonal exp(d); I = tr(S) 1 - S.

    Args:
        theta: Per link, centres of mass first as in `link_parameters`, then d_1, u_12, u_13, d_2, u_23, d_3, in m.
        mass: Masses of the links [kg], shape (k,).

    Returns:
        x, see `link_parameters`.

    Source: Rucker and Wensing (2022), Smooth parameterization of rigid-body inertia.
    """
    k = mass.shape[0]
    d1, u12, u13, d2, u23, d3 = theta[3 * k :].reshape(k, 6).T
    zero = jnp.zeros(k)
    rows = [[jnp.exp(d1), u12, u13], [zero, jnp.exp(d2), u23], [zero, zero, jnp.exp(d3)]]
    U = jnp.moveaxis(jnp.array(rows), -1, 0)
    S = mass[:, None, None] * U @ jnp.swapaxes(U, 1, 2)
    inertia = jnp.trace(S, axis1=1, axis2=2)[:, None, None] * jnp.eye(3) - S
    return jnp.concatenate([theta[: 3 * k], elements(inertia).ravel()])


def log_cholesky(x: Float[Array, " d"], mass: Float[Array, " k"]) -> Float[Array, " d"]:
    """The numbers that `consistent_parameters` turns into x; NaN if x is not consistent."""
    k = mass.shape[0]
    inertia = tensors(x)
    S = 0.5 * jnp.trace(inertia, axis1=1, axis2=2)[:, None, None] * jnp.eye(3) - inertia
    # Upper triangular factor: the lower one of the matrix with both axes turned round, turned round.
    U = jnp.linalg.cholesky((S / mass[:, None, None])[:, ::-1, ::-1])[:, ::-1, ::-1]
    d = jnp.log(jnp.diagonal(U, axis1=1, axis2=2))
    theta = jnp.stack([d[:, 0], U[:, 0, 1], U[:, 0, 2], d[:, 1], U[:, 1, 2], d[:, 2]], axis=1)
    return jnp.concatenate([x[: 3 * k], theta.ravel()])
