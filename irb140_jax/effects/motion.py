"""What an effect may look at: a motion, the torque along it, and what the rigid body does."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from irb140_jax.types import Joints, JointSamples, Samples, Scalar


class RigidBody(eqx.Module):
    """Sensitivities of the nominal rigid body's torque along a motion.

    Attributes:
        by_gravity: Torque per unit of each component of gravity in base axes [N m s^2/m], shape (T, n, 3).
        gravity: Size of gravity [m/s^2], shape ().
        across: Two unit vectors across gravity in base axes, shape (2, 3).
        held: Torque per inertial parameter of a body held by the last link, about the tool, shape (T, n, 10).
        by_q, by_qd: Derivatives of the torque by joint positions and velocities, shape (T, n, n), torque first.
        spring: Stiffness of the model's own springs, shape (n,).
        mass: Joint-space mass matrix, links only, shape (T, n, n).
        tool: Position of the tool in the world [m], shape (T, 3).
        tool_jacobian: Velocity and angular velocity of the tool per joint speed, world axes, shape (T, n, 6).
    """

    by_gravity: Float[Array, "T n 3"]
    gravity: Float[Array, ""]
    across: Float[Array, "2 3"]
    held: Float[Array, "T n 10"]
    by_q: Float[Array, "T n n"]
    by_qd: Float[Array, "T n n"]
    spring: Joints
    mass: Float[Array, "T n n"]
    tool: Float[Array, "T 3"]
    tool_jacobian: Float[Array, "T n 6"]


class Asked(eqx.Module):
    """What position servos were asked for: by their law, whatever they gave.

    Attributes:
        torque: Kp (qdes - q) + Kd (qddes - qd) [N m or N], shape (T, n).
        error: qdes - q [rad or m], shape (T, n).
        kp: Gains [N m/rad or N/m], shape (n,).
    """

    torque: JointSamples
    error: JointSamples
    kp: Joints


class Motion(eqx.Module):
    """What an effect may look at: a motion and the torque the model transmits along it.

    Attributes:
        t: Time since the recording began [s], shape (T,).
        q, qd, qdd: Joint positions, velocities, accelerations, shape (T, n).
        load: Torque the transmissions carry: rigid body and all but friction [N m or N], shape (T, n).
        total: Torque the motors give: load and friction [N m or N], shape (T, n).
        carried: What the links alone would need on the motors' path: no rotors, stiff gears [N m or N], shape (T, n).
        scaled_rate: Time derivative of the total torque by the log's torque constants, shape (T, n).
        rigid: What the rigid body does along the motion.
        rest_speed: Speed below which the sign of qd can't be told from the encoder's noise [rad/s or m/s], shape (n,).
        direction: sign(qd), and between two signs what friction does while a joint sticks, shape (T, n).
        recording: Number of the recording, from 0; below 0 for motion that the diagnosis did not see, shape ().
        turned: Positions at which the joints turned round before the first sample, the last one last, shape (K, n).
        asked: Of servos, where their commands are known.
    """

    t: Samples
    q: JointSamples
    qd: JointSamples
    qdd: JointSamples
    load: JointSamples
    total: JointSamples
    carried: JointSamples
    scaled_rate: JointSamples
    rigid: RigidBody
    rest_speed: Joints
    direction: JointSamples
    recording: Scalar
    turned: Float[Array, "K n"] | None = None
    asked: Asked | None = None


def of_site(array: JointSamples, joints: Int[Array, " m"]) -> Float[Array, "T m"]:
    """The columns of a (T, n) array that belong to the joints of a site."""
    return jnp.take(array, joints, axis=1)
