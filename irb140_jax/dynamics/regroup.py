"""Moving inertial parameters from a link to its parent where no joint torque can tell the difference.

Torques stay the same, but a third of the parameters becomes zero, and with them much of the arithmetic.
"""

import numpy as np
from jaxtyping import Float

from irb140_jax.robot.tree import Parents

ROWS, COLS = np.triu_indices(3)


def regrouping(
    rotation: Float[np.ndarray, "n 3 3"],
    position: Float[np.ndarray, "n 3"],
    axis: Float[np.ndarray, "n 3"],
    is_slide: tuple[bool, ...],
    parent: Parents,
) -> tuple[Float[np.ndarray, "k k"], np.ndarray]:
    """Linear map of `Robot.phi` (raveled) onto parameters of the same torques, and which of them are zero always.

    A hinge with axis a does not move a body of mass m at a point of a, with inertia J (1 - a a^T): its momentum is the
    same whether it belongs to the link or to the parent.  A slide does not turn, so the whole inertia tensor can move.
    What would move to the base is dropped.

    Args:
        rotation, position, axis, is_slide, parent: As in `Robot`.

    Returns:
        The map, and a mask of shape (n, 10), true where its result is zero.

    Source: Gautier, Khalil (1990), Direct calculation of minimum set of inertial parameters of serial robots.
    """
    n = len(is_slide)
    rows = np.eye(10 * n).reshape(n, 10, 10 * n)
    gone = np.zeros((n, 10), bool)
    for i in reversed(range(n)):
        moves = _free_of_slide() if is_slide[i] else _free_of_hinge(axis[i])
        if parent[i] >= 0:
            rows[parent[i]] += _to_parent(rotation[i], position[i]) @ moves @ rows[i]
        stays = np.eye(10) - moves
        # Rows that vanish up to the round-off of a unit axis.
        gone[i] = ~np.any(np.abs(stays) > 1e-15, axis=1)
        stays[gone[i]] = 0.0
        rows[i] = stays @ rows[i]
    return rows.reshape(10 * n, 10 * n), gone


def _free_of_slide() -> Float[np.ndarray, "10 10"]:
    """Part of a link's parameters that a slide can hand to its parent."""
    return np.diag([0.0] * 4 + [1.0] * 6)


def _free_of_hinge(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "10 10"]:
    """Part of a link's parameters that a hinge can hand to its parent."""
    free = np.zeros((10, 10))
    free[0, 0] = 1.0
    free[1:4, 1:4] = np.outer(axis, axis)
    flat = np.eye(3) - np.outer(axis, axis)
    k = int(np.argmin(np.abs(axis)))
    diagonal = 4 + int(np.flatnonzero((ROWS == k) & (COLS == k))[0])
    free[4:, diagonal] = flat[ROWS, COLS] / flat[k, k]
    return free


def _to_parent(R: Float[np.ndarray, "3 3"], p: Float[np.ndarray, "3"]) -> Float[np.ndarray, "10 10"]:
    """Parameters about the link's frame -> the same body's about the parent's frame."""
    result = np.zeros((10, 10))
    for k in range(10):
        phi = np.eye(10)[k]
        m, h = phi[0], R @ phi[1:4]
        tensor = np.zeros((3, 3))
        tensor[ROWS, COLS] = phi[4:]
        tensor = R @ (tensor + np.triu(tensor, 1).T) @ R.T
        outer = np.outer(h, p) + np.outer(p, h) + m * np.outer(p, p)
        tensor += np.trace(outer) * np.eye(3) - outer
        result[:, k] = [m, *(h + m * p), *tensor[ROWS, COLS]]
    return result
