"""Fitness of a recorded motion through one triangular factor: exact, and as cheap as a made-up function.

Torque, its rate, its power and the acceleration it causes are linear in the inertial parameters: W phi = b over all
samples.  With the QR factors [W b] = Q [R z; 0 rho], |W phi - b|^2 = |R phi - z|^2 + rho^2 for any phi.
"""

from collections.abc import Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.dynamics import inverse_dynamics_batch, mass_matrix, regressor_batch
from irb140_jax.errors import InputError
from irb140_jax.identify.parameters import checked_links, phi_of
from irb140_jax.robot import Robot
from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Scalar

# What is compared along the motion, beyond the parameters: "future research" of the study.
Quantity = Literal["torque", "torque_rate", "power", "acceleration"]
_QUANTITIES = ("torque", "torque_rate", "power", "acceleration")
_SAMPLES_AT_A_TIME = 2000


class LinearFit(eqx.Module):
    """Root mean square of W phi - b, from its triangular factor.

    Attributes:
        R: Triangular factor, shape (10 k, 10 k).
        z: Its right-hand side, shape (10 k,).
        rest: Sum of squares that no phi explains.
        rows: Number of equations.
        mass: Masses of the k links, held [kg].
    """

    R: Float[Array, "m m"]
    z: Float[Array, " m"]
    rest: Scalar
    rows: Scalar
    mass: Float[Array, " k"]

    def __call__(self, x: Float[Array, " d"], progress: Scalar) -> Scalar:
        """RMSE of the parameters `x`, see `link_parameters`, as an objective of a swarm."""
        return self._rmse(self.residual(x))

    def of_phi(self, phi: Float[Array, " m"]) -> Scalar:
        """RMSE of the inertial parameters of the k links, as in `Robot.phi`."""
        return self._rmse(self.R @ phi - self.z)

    def residual(self, x: Float[Array, " d"]) -> Float[Array, " m"]:
        """What least squares minimises: R phi - z, the masses' columns on the right, once for all candidates."""
        m = self.R.shape[0]
        R = self.R.reshape(m, -1, 10)
        unknown = R[:, :, 1:].reshape(m, -1) @ phi_of(x, self.mass)[:, 1:].ravel()
        return unknown - (self.z - R[:, :, 0] @ self.mass)

    def _rmse(self, error: Float[Array, " m"]) -> Scalar:
        return jnp.sqrt((jnp.sum(error**2) + self.rest) / self.rows)


def linear_fit(robot: Robot, links: Sequence[int], motion: Trajectory, quantity: Quantity = "torque") -> LinearFit:
    """The fitness of parameters of these links along a recorded motion; all else of the robot is taken as it is.

    Args:
        robot: Arm with n joints.
        links: Whose parameters are sought.
        motion: Recorded positions, velocities, accelerations and torques, T samples.
        quantity: "torque" [N m]; "torque_rate" between samples [N m/s], its roughness; "power" tau qd [W], whose
            integral is the energy; "acceleration" M^-1 tau [rad/s^2], what a controller's feedforward gets wrong.

    Returns:
        A function of x (see `link_parameters`), RMSE in the unit of the quantity.

    Raises:
        InputError: The quantity is unknown, or there are fewer equations than unknowns.
    """
    chosen = checked_links(robot, links)
    if quantity not in _QUANTITIES:
        raise InputError(f"quantity '{quantity}'; give one of {', '.join(_QUANTITIES)}")
    columns = np.concatenate([10 * i + np.arange(10) for i in np.asarray(chosen)])
    factor, rows = np.zeros((0, len(columns) + 1)), 0
    for part in _parts(motion):
        # What does not depend on the unknowns goes to the right-hand side; exact, as torque is linear in them.
        Y = np.array(regressor_batch(robot, part.q, part.qd, part.qdd))[:, :, columns]
        own = Y @ np.asarray(robot.phi[chosen]).ravel()
        known = np.asarray(inverse_dynamics_batch(robot, part.q, part.qd, part.qdd)) - own
        W = _transformed(robot, part, np.concatenate([Y, (np.asarray(part.tau) - known)[:, :, None]], axis=2), quantity)
        W = W.reshape(-1, W.shape[2])
        rows += len(W)
        factor = np.asarray(np.linalg.qr(np.concatenate([factor, W]), mode="r"))
    if rows <= len(columns):
        raise InputError(f"motion of {len(motion.t)} samples for {len(columns)} parameters; give a longer recording")
    return LinearFit(
        jnp.asarray(factor[:-1, :-1]), jnp.asarray(factor[:-1, -1]), jnp.asarray(factor[-1, -1] ** 2),
        jnp.asarray(float(rows)), robot.mass[chosen],
    )  # fmt: skip


def _parts(motion: Trajectory):
    """The motion in pieces which overlap by a sample, so that differences between samples are all there, once."""
    for k in range(0, len(motion.t) - 1, _SAMPLES_AT_A_TIME):
        yield jax.tree.map(lambda x, k=k: x[k : k + _SAMPLES_AT_A_TIME + 1], motion)


def _transformed(robot: Robot, part: Trajectory, W: np.ndarray, quantity: Quantity) -> np.ndarray:
    """Equations (T, n, m) of torque as equations of the quantity; the piece's last sample belongs to the next one."""
    if quantity == "torque_rate":
        return np.diff(W, axis=0) / np.diff(np.asarray(part.t))[:, None, None]
    W = W[:-1]
    if quantity == "power":
        return np.sum(W * np.asarray(part.qd)[:-1, :, None], axis=1, keepdims=True)
    if quantity == "acceleration":
        M = jax.jit(jax.vmap(mass_matrix, in_axes=(None, 0)))(robot, part.q[:-1])
        return np.linalg.solve(np.asarray(M), W)
    return W
