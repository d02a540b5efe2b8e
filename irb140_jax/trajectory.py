"""What simulation returns, recordings hold and sensors distort."""

import equinox as eqx

from irb140_jax.types import JointSamples, Samples


class Trajectory(eqx.Module):
    """Samples of a motion and of the joint torques that went with it.

    Attributes:
        t: Time [s], shape (T,), rising.
        q: Joint positions [rad or m], shape (T, n).
        qd: Joint velocities [rad/s or m/s], shape (T, n).
        qdd: Joint accelerations [rad/s^2 or m/s^2], shape (T, n).
        tau: Joint torques [N m or N], shape (T, n).
    """

    t: Samples
    q: JointSamples
    qd: JointSamples
    qdd: JointSamples
    tau: JointSamples
