"""Denavit-Hartenberg kinematics (equations 1 to 3), and the IRB 140's table and closed form."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from irb140_jax.types import Joints, Pose, Scalar, Vec3

Number = Scalar | np.ndarray | float


class DHTable(eqx.Module):
    """Standard (distal) Denavit-Hartenberg parameters of n hinges and slides.

    Attributes:
        offset: theta at joint position zero [rad], shape (n,); a hinge adds its position.
        d: Shift along the joint's axis at joint position zero [m], shape (n,); a slide adds its position.
        a: Shift along the common normal [m], shape (n,).
        alpha: Twist about the common normal [rad], shape (n,).
        slide: 1 for a slide, 0 for a hinge, shape (n,); default all hinges.
    """

    offset: Float[Array | np.ndarray, " n"]
    d: Float[Array | np.ndarray, " n"]
    a: Float[Array | np.ndarray, " n"]
    alpha: Float[Array | np.ndarray, " n"]
    slide: Float[Array | np.ndarray, " n"] | None = None


# ABB IRB 140, maker's joint signs: at zero the upper arm is upright (theta2* = theta2 - 90 deg), the forearm level.
IRB140_DH = DHTable(
    offset=np.radians(np.array([0.0, -90.0, 0.0, 0.0, 0.0, 0.0])),
    d=np.array([0.352, 0.0, 0.0, 0.380, 0.0, 0.065]),
    a=np.array([0.070, 0.360, 0.0, 0.0, 0.0, 0.0]),
    alpha=np.radians(np.array([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0])),
)


def dh_transform(theta: Number, d: Number, a: Number, alpha: Number) -> Pose:
    """Pose of frame i in frame i-1, T = Rot(z, theta) Trans(0, 0, d) Trans(a, 0, 0) Rot(x, alpha).

    Args:
        theta: Angle about the joint's axis [rad], shape ().
        d: Shift along the joint's axis [m], shape ().
        a: Shift along the common normal [m], shape ().
        alpha: Twist about the common normal [rad], shape ().

    Returns:
        The pose, shape (4, 4).

    Source: equations 1 and 2 of the study; Denavit and Hartenberg, J. Appl. Mech. 22 (1955).
    """
    ct, st, ca, sa = jnp.cos(theta), jnp.sin(theta), jnp.cos(alpha), jnp.sin(alpha)
    zero, one = jnp.zeros_like(ct), jnp.ones_like(ct)
    rows = [
        [ct, -st * ca, st * sa, a * ct],
        [st, ct * ca, -ct * sa, a * st],
        [zero, sa, ca, d * one],
        [zero, zero, zero, one],
    ]
    return jnp.stack([jnp.stack(row) for row in rows])


def dh_forward(table: DHTable, q: Joints) -> Pose:
    """Pose of the last frame in the base, T = T_1(q_1) T_2(q_2) ... T_n(q_n).

    Args:
        table: The arm's parameters.
        q: Joint positions [rad or m], shape (n,).

    Returns:
        The pose, shape (4, 4).

    Source: equation 2 of the study, multiplied out along the chain.
    """
    T = jnp.eye(4)
    slide = np.zeros(q.shape[0]) if table.slide is None else table.slide
    for i in range(q.shape[0]):
        turned, pushed = (1.0 - slide[i]) * q[i], slide[i] * q[i]
        T = T @ dh_transform(table.offset[i] + turned, table.d[i] + pushed, table.a[i], table.alpha[i])
    return T


def irb140_end_point(q: Float[Array, " 6"]) -> Vec3:
    """Closed form of the IRB 140's flange centre in its base, X, Y, Z with theta2* = theta2 - 90 deg.

    Args:
        q: Joint positions [rad], shape (6,).

    Returns:
        The point [m], shape (3,).

    Source: equation 3 of the study, with the published lengths.
    """
    d1, d4, d6, a1, a2 = 0.352, 0.380, 0.065, 0.070, 0.360  # [m], as in IRB140_DH
    s, c = jnp.sin(q), jnp.cos(q)
    s23, c23 = jnp.sin(q[1] + q[2]), jnp.cos(q[1] + q[2])
    reach = a1 + a2 * s[1] + d4 * c23
    wrist = jnp.stack([reach * c[0], reach * s[0], d1 + a2 * c[1] - d4 * s23])
    forearm = jnp.stack([c[0] * c23, s[0] * c23, -s23])
    side = jnp.stack([-s[0], c[0], jnp.zeros_like(s23)])
    up = jnp.stack([c[0] * s23, s[0] * s23, c23])
    return wrist + d6 * (c[4] * forearm + s[4] * (s[3] * side - c[3] * up))
