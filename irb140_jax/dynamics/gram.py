"""Normal equations of a whole recording without its regressor in memory."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.dynamics.chain import Plan, chain, plan
from irb140_jax.dynamics.chunks import sum_of_chunks
from irb140_jax.dynamics.regressor import regressor_blocks
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import carried, path
from irb140_jax.types import JointBatch


def regressor_gram(
    robot: Robot,
    q: JointBatch,
    qd: JointBatch,
    qdd: JointBatch,
    tau: JointBatch,
    weight: JointBatch | None = None,
) -> Float[Array, "g g"]:
    """Gram matrix W^T W of W = diag(weight) [Y, tau], stacked over all samples and joints.

    All that least squares needs: Y^T Y phi = Y^T tau, and the squared residual from the last diagonal entry.  The rows
    of joint j are zero for links it does not carry, so products are formed of the columns of those it does only.

    Args:
        robot: Arm with n joints; its inertial parameters don't matter here.
        q: Joint positions [rad or m], shape (T, n).
        qd: Joint velocities [rad/s or m/s], shape (T, n).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (T, n).
        tau: Torques to explain [N m or N], shape (T, n).
        weight: Weight of each sample's equation, shape (T, n); 1 if not given.

    Returns:
        The matrix, columns as in `robot.phi.ravel()`, then tau.

    Source: Gautier (1997), Dynamic identification of robots with power model, sec. 3 (normal equations, recursively).
    """
    weights = np.ones(tau.shape) if weight is None else weight
    given = (robot, plan(robot, regrouped=False))
    return sum_of_chunks(_gram_of_chunk, given, (q, qd, qdd, tau, weights))


def _gram_of_chunk(given: tuple[Robot, Plan], q, qd, qdd, tau, weight) -> Float[Array, "g g"]:
    n = q.shape[1]
    arm = chain(*given)
    blocks = regressor_blocks(arm, q.T, qd.T, qdd.T)
    gram = jnp.zeros((10 * n + 1, 10 * n + 1), q.dtype)
    for j in range(n):
        links, row = carried(arm.parent, j), len(path(arm.parent, j)) - 1
        own = [block[row] for block in blocks[links.start : links.stop]]
        rows = jnp.concatenate([*own, tau[None, :, j]]) * weight[None, :, j]
        if links.stop == n:
            gram = gram.at[10 * j :, 10 * j :].add(rows @ rows.T)
        else:
            at = np.append(np.arange(10 * links.start, 10 * links.stop), 10 * n)
            gram = gram.at[np.ix_(at, at)].add(rows @ rows.T)
    return gram
