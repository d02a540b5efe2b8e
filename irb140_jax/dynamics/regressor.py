"""The regressor: rigid-body torques are linear in the inertial parameters, tau = Y(q, qd, qdd) phi."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.dynamics.chain import Chain, Plan, chain, plan
from irb140_jax.dynamics.chunks import in_chunks
from irb140_jax.dynamics.newton_euler import Motion, Placement, outward
from irb140_jax.dynamics.scalars import ZERO, Number, Vector, add, cross, dot, minus, mul, plus
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.robot import Robot
from irb140_jax.types import Joints, JointSamples

Blocks = dict[tuple[int, int], list[Number]]


def regressor(robot: Robot, q: Joints, qd: Joints, qdd: Joints) -> Float[Array, "n 10*n"]:
    """Matrix Y of the rigid bodies' torques, Y phi + armature qdd + passive = inverse dynamics.

    Args:
        robot: Arm with n joints; its inertial parameters don't matter here.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        qdd: Joint accelerations [rad/s^2 or m/s^2].

    Returns:
        Y, columns as in `robot.phi.ravel()`: torque per kg, per kg m and per kg m^2.  Row j is zero for links before j.

    Source: Atkeson, An, Hollerbach (1986), Estimation of inertial parameters of manipulator loads and links.
    """
    return _regressor(robot, plan(robot, regrouped=False), q, qd, qdd)


def regressor_batch(robot: Robot, q: JointSamples, qd: JointSamples, qdd: JointSamples) -> Float[Array, "T n 10*n"]:
    """`regressor` of T samples, arrays of shape (T, n) -> (T, n, 10 n)."""
    return in_chunks(_regressor_of_chunk, (robot, plan(robot, regrouped=False)), (q, qd, qdd))


def _regressor_of_chunk(given: tuple[Robot, Plan], q: JointSamples, qd: JointSamples, qdd: JointSamples):
    return jnp.moveaxis(_regressor(*given, q.T, qd.T, qdd.T), -1, 0)


@jax.jit
def _regressor(robot: Robot, ahead: Plan, q, qd, qdd):
    blocks = regressor_blocks(chain(robot, ahead), q, qd, qdd)
    none: list[Number] = [0.0] * 10
    filled = lambda x: jnp.broadcast_to(jnp.asarray(x, q.dtype), q.shape[1:])  # noqa: E731
    rows = [[filled(x) for i in range(robot.n) for x in blocks.get((j, i), none)] for j in range(robot.n)]
    return jnp.stack([jnp.stack(row) for row in rows])


def regressor_blocks(
    arm: Chain, q: Float[Array, "n *T"], qd: Float[Array, "n *T"], qdd: Float[Array, "n *T"]
) -> Blocks:
    """Ten scalars Y[j, i] for every joint j and every link i >= j that it carries; shapes (n,) or (n, T)."""
    predicate = always(q, qd)
    places, motions = outward(arm, list(q), list(qd), list(qdd), predicate)
    blocks: Blocks = {}
    screws: list[tuple[Vector, Vector]] = []
    for i, (place, motion) in enumerate(zip(places, motions, strict=True)):
        screws = staged(predicate, lambda place=place, screws=screws: [_carried(place, x) for x in screws])
        screws.append((ZERO, place.link.axis) if place.link.is_slide else (place.link.axis, ZERO))
        rows = staged(predicate, lambda motion=motion, screws=screws: [_block(x, motion) for x in screws])
        blocks |= {(j, i): row for j, row in enumerate(rows)}
    return blocks


def _carried(place: Placement, screw: tuple[Vector, Vector]) -> tuple[Vector, Vector]:
    """A joint's unit motion (angular, linear at the origin), from the parent's frame to the link's."""
    angular, linear = screw
    return place.to_link(angular), place.to_link(plus(linear, cross(angular, place.position)))


def _block(screw: tuple[Vector, Vector], motion: Motion) -> list[Number]:
    """Power of a link's wrench (see `link_wrench`) on a joint's unit motion (u, v), per inertial parameter.

    m: v.a;  h: alpha and w terms turned around, v x alpha + (v x w) x w + a x u;
    I: I_kl of u alpha^T + (u x w) w^T, made symmetric.
    """
    u, v = screw
    w, alpha, a = motion
    first = plus(minus(cross(v, alpha), cross(w, cross(v, w))), cross(a, u))
    uw = cross(u, w)
    pair = lambda k, m: add(mul(u[k], alpha[m]), mul(uw[k], w[m]))  # noqa: E731
    mixed = lambda k, m: add(pair(k, m), pair(m, k))  # noqa: E731
    return [dot(v, a), *first, pair(0, 0), mixed(0, 1), mixed(0, 2), pair(1, 1), mixed(1, 2), pair(2, 2)]
