"""The regressor: rigid-body torques are linear in the inertial parameters, tau = Y(q, qd, qdd) phi."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.dynamics.chain import Chain, Plan, chain, plan
from irb140_jax.dynamics.chunks import in_chunks
from irb140_jax.dynamics.newton_euler import Motion, Placement, outward
from irb140_jax.dynamics.scalars import ZERO, Number, Vector, add, cross, dot, is_known, minus, mul, plus
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.robot import Robot
from irb140_jax.robot.tree import path
from irb140_jax.shapes import shape_checked
from irb140_jax.types import JointBatch, Joints, JointSamples

# Unit motions of joints: angular, and linear at a frame's origin.
Screw = tuple[Vector, Vector]


@shape_checked
def regressor(robot: Robot, q: Joints, qd: Joints, qdd: Joints) -> Float[Array, "n k"]:
    """Matrix Y of the rigid bodies' torques, Y phi + armature qdd + passive = inverse dynamics.

    Args:
        robot: Arm with n joints; its inertial parameters don't matter here.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        qdd: Joint accelerations [rad/s^2 or m/s^2].

    Returns:
        Y, columns as in `robot.phi.ravel()`: torque per kg, per kg m and per kg m^2.  Row j is zero for links that
        joint j does not move.

    Source: Atkeson, An, Hollerbach (1986), Estimation of inertial parameters of manipulator loads and links.
    """
    return _regressor(robot, plan(robot, regrouped=False), q, qd, qdd)


@shape_checked
def regressor_batch(robot: Robot, q: JointBatch, qd: JointBatch, qdd: JointBatch) -> Float[Array, "T n k"]:
    """`regressor` of T samples, arrays of shape (T, n) -> (T, n, 10 n)."""
    return in_chunks(_regressor_of_chunk, (robot, plan(robot, regrouped=False)), (q, qd, qdd))


def _regressor_of_chunk(given: tuple[Robot, Plan], q: JointSamples, qd: JointSamples, qdd: JointSamples):
    return jnp.moveaxis(_regressor(*given, q.T, qd.T, qdd.T), -1, 0)


@jax.jit
def _regressor(
    robot: Robot, ahead: Plan, q: Float[Array, "n *T"], qd: Float[Array, "n *T"], qdd: Float[Array, "n *T"]
) -> Float[Array, "n k *T"]:
    columns = []
    for i, block in enumerate(regressor_blocks(chain(robot, ahead), q, qd, qdd)):
        columns.append(all_rows(block, path(robot.parent, i), robot.n))  # (n, 10, *T)
    return jnp.concatenate(columns, axis=1)


def all_rows(block: Float[Array, "j *k"], joints: tuple[int, ...], n: int) -> Float[Array, "n *k"]:
    """The rows of some joints, rising, among those of all n joints; the others are zero."""
    none = [(0, 0)] * (block.ndim - 1)
    if joints == tuple(range(len(joints))):
        return jnp.pad(block, [(0, n - len(joints)), *none])
    places = np.split(np.arange(len(joints)), np.flatnonzero(np.diff(joints) != 1) + 1)
    pieces, done = [], 0
    for run in places:  # joints that follow each other
        start, end = joints[run[0]], joints[run[-1]] + 1
        pieces.append(jnp.pad(block[run[0] : run[-1] + 1], [(start - done, 0), *none]))
        done = end
    return jnp.pad(jnp.concatenate(pieces), [(0, n - done), *none])


def regressor_blocks(
    arm: Chain, q: Float[Array, "n *T"], qd: Float[Array, "n *T"], qdd: Float[Array, "n *T"]
) -> list[Float[Array, "j 10 *T"]]:
    """For each link the regressor's columns of its ten parameters, rows of the joints that move it only.

    All joints are done at once, along the first axis; so that scalars of a sample meet it, they have an axis of one.
    """
    predicate = always(q, qd)
    scalars = lambda x: [x[i : i + 1] for i in range(len(arm.links))]  # noqa: E731
    places, motions = outward(arm, scalars(q), scalars(qd), scalars(qdd), predicate)
    screws: list[Screw] = [(ZERO, ZERO)]  # seen from the base, then the links
    blocks = []
    for i, (place, motion) in enumerate(zip(places, motions, strict=True)):
        before, depth = arm.parent[i], len(path(arm.parent, i))
        screws.append(staged(predicate, partial(_next_screws, place, screws[before + 1], q[: depth - 1])))
        block = staged(predicate, partial(_block, screws[-1], motion))
        filled = [jnp.broadcast_to(jnp.asarray(x, q.dtype), (depth, *q.shape[1:])) for x in block]
        blocks.append(jnp.stack(filled, axis=1))
    return blocks


def _next_screws(place: Placement, screws: Screw, like: Float[Array, "j *T"]) -> Screw:
    """Unit motions of all joints that move the link, seen from the link, out of those seen from its parent."""
    angular, linear = screws
    carried = place.to_link(angular), place.to_link(plus(linear, cross(angular, place.position)))
    own = (ZERO, place.link.axis) if place.link.is_slide else (place.link.axis, ZERO)
    return _joined(carried[0], own[0], like), _joined(carried[1], own[1], like)


def _joined(u: Vector, own: Vector, like: Float[Array, "j *T"]) -> Vector:
    """The vectors of j joints and one more, shape (j + 1, *T)."""
    filled = lambda x, rows: jnp.broadcast_to(jnp.asarray(x, like.dtype), (rows, *like.shape[1:]))  # noqa: E731
    join = lambda x, y: jnp.concatenate([filled(x, like.shape[0]), filled(y, 1)])  # noqa: E731
    x, y, z = (0.0 if is_known(a, 0.0) and is_known(b, 0.0) else join(a, b) for a, b in zip(u, own, strict=True))
    return (x, y, z)


def _block(screws: Screw, motion: Motion) -> list[Number]:
    """Power of a link's wrench (see `link_wrench`) on the joints' unit motions (u, v), per inertial parameter.

    m: v.a;  h: alpha and w terms turned around, v x alpha + (v x w) x w + a x u;
    I: I_kl of u alpha^T + (u x w) w^T, made symmetric.
    """
    u, v = screws
    w, alpha, a = motion
    first = plus(minus(cross(v, alpha), cross(w, cross(v, w))), cross(a, u))
    uw = cross(u, w)
    pair = lambda k, m: add(mul(u[k], alpha[m]), mul(uw[k], w[m]))  # noqa: E731
    mixed = lambda k, m: add(pair(k, m), pair(m, k))  # noqa: E731
    return [dot(v, a), *first, pair(0, 0), mixed(0, 1), mixed(0, 2), pair(1, 1), mixed(1, 2), pair(2, 2)]
