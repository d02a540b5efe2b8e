"""How wrong the model's inertials may be: a Gaussian around the nominal, link by link."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.robot import Robot


def inertial_prior_factor(robot: Robot, relative_std: float) -> np.ndarray:
    """Square root L of the prior covariance of the inertial parameters, phi - phi_nominal = L theta, theta ~ N(0, 1).

    Mass, centre of mass and inertia of each link err independently: mass by `relative_std`, each coordinate of the
    centre of mass by `relative_std` of its size and of the radius of gyration, the inertia tensor by `relative_std` of
    its moments.  The radius of gyration keeps a centre of mass that happens to lie on an axis from being held for
    exact.  Linear in phi to first order, which at 5 % is what the nonlinear set is.

    Args:
        robot: n joints.
        relative_std: Relative 1-sigma of the inertial parameters.

    Returns:
        Shape (10 n, 10 n), block-diagonal.

    Source: the linearisation of the pseudo-inertia metric of Lee, Wensing and Park, IEEE T-RO 36(3), 2020.
    """
    jacobians = jax.vmap(jax.jacfwd(_phi_of_link))(_link_parameters(robot))
    m, com, inertia = np.asarray(robot.mass), np.asarray(robot.com), np.asarray(robot.inertia)
    moments = np.einsum("nii->ni", inertia)
    gyration = np.sqrt(np.clip(0.5 * moments.sum(axis=1), 0, None) / np.where(m > 0, m, 1.0) / 3.0)
    std = np.zeros((robot.n, 10))
    std[:, 0] = m
    std[:, 1:4] = np.sqrt(com**2 + gyration[:, None] ** 2)
    rows, cols = np.triu_indices(3)
    std[:, 4:] = np.sqrt(moments[:, rows] * moments[:, cols]) * np.where(rows == cols, 1.0, 0.5)
    factor = np.zeros((10 * robot.n, 10 * robot.n))
    for i in range(robot.n):
        block = np.asarray(jacobians[i]) * (relative_std * std[i])
        factor[10 * i : 10 * i + 10, 10 * i : 10 * i + 10] = block
    return factor


def _link_parameters(robot: Robot) -> Float[Array, "n 10"]:
    rows, cols = jnp.triu_indices(3)
    return jnp.concatenate([robot.mass[:, None], robot.com, robot.inertia[:, rows, cols]], axis=1)


def _phi_of_link(p: Float[Array, "10"]) -> Float[Array, "10"]:
    """Mass, centre of mass, inertia about it -> inertial parameters about the frame's origin (parallel axes)."""
    m, c = p[0], p[1:4]
    rows, cols = jnp.triu_indices(3)
    about_com = p[4:]
    steiner = m * (c @ c * jnp.eye(3) - jnp.outer(c, c))
    return jnp.concatenate([m[None], m * c, about_com + steiner[rows, cols]])
