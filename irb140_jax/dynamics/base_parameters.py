"""Base parameters: the combinations of inertial parameters that joint torques can identify."""

from typing import NamedTuple

import jax
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float, Int

from irb140_jax.dynamics.regressor import regressor_batch
from irb140_jax.robot import Robot

PARTS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
# Columns of the regressor whose part outside the span of those before is below this share of the largest are dependent.
RANK_TOLERANCE = 1e-9
# Coefficients below this are round-off: they are lengths of the arm [m], their squares, and ones.
ROUND_OFF = 1e-8
# Fewest motions: n equations each, for the 10 n columns, twice over.
FEWEST = 20


class BaseParameters(NamedTuple):
    """What can be identified, base = grouping @ phi.ravel().

    Attributes:
        columns: Indices into `robot.phi.ravel()` of independent columns of the regressor, rising, shape (b,).
        grouping: The combinations, so that Y[:, columns] @ grouping = Y for any motion, shape (b, 10 n).
        names: The combinations in words, as in "joint2.Ixx + 0.1296 joint3.m"; the joint that moves the link names it.
    """

    columns: Int[np.ndarray, " b"]
    grouping: Float[np.ndarray, "b k"]
    names: tuple[str, ...]


def base_parameters(robot: Robot, samples: int = 50, *, key: Array | None = None) -> BaseParameters:
    """Identifiable combinations of the inertial parameters, by QR with pivoting of a regressor at random motions.

    With Y P = Q [R1 R2] the dependent columns are Y2 = Y1 R1^-1 R2, so phi1 + R1^-1 R2 phi2 is all that torques show.
    Armature is not among the parameters: it is a joint's own column, not a link's.

    Args:
        robot: Arm with n joints; its inertial parameters don't matter here.
        samples: Number of random motions, 20 at least.
        key: Random motions' key; they only have to be general, so a fixed one serves if none is given.

    Returns:
        Independent columns, grouping matrix and names.

    Source: Gautier (1991), Numerical calculation of the base inertial parameters of robots, J. Robotic Systems 8(4).
    """
    n = robot.n
    key = jax.random.key(0) if key is None else key
    q, qd, qdd = jax.random.uniform(key, (3, max(samples, FEWEST), n), minval=-3.0, maxval=3.0)
    Y = np.asarray(regressor_batch(robot, q, qd, qdd)).reshape(-1, 10 * n)
    R, pivots = (np.asarray(x) for x in scipy.linalg.qr(Y, mode="r", pivoting=True))
    diagonal = np.abs(np.diag(R))
    rank = int(np.sum(diagonal > RANK_TOLERANCE * diagonal[0]))
    grouping = np.zeros((rank, 10 * n))
    grouping[:, pivots[:rank]] = np.eye(rank)
    grouping[:, pivots[rank:]] = scipy.linalg.solve_triangular(R[:rank, :rank], R[:rank, rank:])
    grouping[np.abs(grouping) < ROUND_OFF] = 0.0
    order = np.argsort(pivots[:rank])
    columns, grouping = pivots[:rank][order], grouping[order]
    names = tuple(_name(k, row, robot) for k, row in zip(columns, grouping, strict=True))
    return BaseParameters(columns, grouping, names)


def _name(first: int | np.integer, row: Float[np.ndarray, " k"], robot: Robot) -> str:
    """The combination in words, its own independent parameter first."""
    word = lambda k: f"{robot.joint_names[k // 10]}.{PARTS[k % 10]}"  # noqa: E731
    others = [k for k in np.flatnonzero(row) if k != first]
    terms = [f" {'-' if row[k] < 0 else '+'} {_factor(abs(row[k]))}{word(k)}" for k in others]
    return word(first) + "".join(terms)


def _factor(x: float) -> str:
    return "" if abs(x - 1.0) < ROUND_OFF else f"{x:.6g} "
