"""How wrong the model's inertials may be: a Gaussian around the nominal, link by link."""

import numpy as np

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
    m, com, inertia = np.asarray(robot.mass), np.asarray(robot.com), np.asarray(robot.inertia)
    moments = np.einsum("nii->ni", inertia)
    gyration = np.sqrt(np.clip(0.5 * moments.sum(axis=1), 0, None) / np.where(m > 0, m, 1.0) / 3.0)
    std = np.zeros((robot.n, 10))
    std[:, 0] = m
    std[:, 1:4] = np.sqrt(com**2 + gyration[:, None] ** 2)
    rows, cols = np.triu_indices(3)
    std[:, 4:] = np.sqrt(moments[:, rows] * moments[:, cols]) * np.where(rows == cols, 1.0, 0.5)
    link = np.concatenate([m[:, None], com, inertia[:, rows, cols]], axis=1)
    factor = np.zeros((10 * robot.n, 10 * robot.n))
    for i in range(robot.n):
        # phi is at most quadratic in each parameter of a link, so central differences are exact.
        for k, step in enumerate(relative_std * std[i]):
            ahead, behind = link[i].copy(), link[i].copy()
            ahead[k] += step
            behind[k] -= step
            factor[10 * i : 10 * i + 10, 10 * i + k] = 0.5 * (_phi_of_link(ahead) - _phi_of_link(behind))
    return factor


def _phi_of_link(p: np.ndarray) -> np.ndarray:
    """Mass, centre of mass, inertia about it -> inertial parameters about the frame's origin (parallel axes)."""
    m, c = p[0], p[1:4]
    rows, cols = np.triu_indices(3)
    steiner = m * (c @ c * np.eye(3) - np.outer(c, c))
    return np.concatenate([[m], m * c, p[4:] + steiner[rows, cols]])
