"""What is read off a motion under control: response, tracking, energy, smoothness."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Joints, JointSamples, Samples, Scalar

# A response has settled when it stays within this share of the error at the start.
BAND = 0.02


class Response(NamedTuple):
    """How an error at the start dies out.

    Attributes:
        rise: Time from 10 % to 90 % of the way [s]; infinite if it never gets there.
        settling: Time after which the error stays within `BAND` of the first [s]; infinite if it never does.
        overshoot: How far it goes beyond the goal, of the error at the start [%].
        steady: Root mean square of the error over the last third [rad or m].
    """

    rise: Scalar
    settling: Scalar
    overshoot: Scalar
    steady: Scalar


def response(t: Samples, error: Samples) -> Response:
    """Rise, settling, overshoot and steady-state error of one joint.

    Args:
        t: Time [s], shape (T,).
        error: Wanted less actual position [rad or m], shape (T,); not zero at the start.

    Source: Ogata, Modern Control Engineering (2010), section 5.3.
    """
    covered = 1.0 - error / error[0]

    def first(reached) -> Scalar:
        return jnp.where(jnp.any(reached), t[jnp.argmax(reached)], jnp.inf)

    outside = jnp.abs(error) > BAND * jnp.abs(error[0])
    last = t.shape[0] - 1 - jnp.argmax(outside[::-1])
    settling = jnp.where(outside[-1], jnp.inf, t[jnp.minimum(last + 1, t.shape[0] - 1)] - t[0])
    return Response(
        rise=first(covered >= 0.9) - first(covered >= 0.1),
        settling=settling,
        overshoot=100.0 * jnp.maximum(jnp.max(covered) - 1.0, 0.0),
        steady=jnp.sqrt(jnp.mean(error[2 * t.shape[0] // 3 :] ** 2)),
    )


def energies(motion: Trajectory) -> tuple[JointSamples, JointSamples]:
    """Work of each motor up to each sample, E_i(t) = int |tau_i qd_i| dt, and the same with its sign [J], shape (T, n).

    Args:
        motion: Samples at even spacing.

    Source: equation 29 of the study, whose curves rise for all models, as the absolute value does.
    """
    power = motion.tau * motion.qd
    dt = motion.t[1] - motion.t[0]
    return dt * jnp.cumsum(jnp.abs(power), axis=0), dt * jnp.cumsum(power, axis=0)


def roughness(motion: Trajectory, since: float = 0.0) -> Joints:
    """Root mean square of the rate of each motor's torque, rms(dtau/dt) [N m/s or N/s], shape (n,).

    Args:
        motion: Samples at even spacing.
        since: Leave out what comes before [s]: the start's own jolt.
    """
    rate = jnp.diff(motion.tau, axis=0) / (motion.t[1] - motion.t[0])
    counts = (motion.t[1:] >= since)[:, None]
    return jnp.sqrt(jnp.sum(jnp.where(counts, rate, 0.0) ** 2, axis=0) / jnp.sum(counts))


def tracking_error(motion: Trajectory, wanted: Float[Array, "T n"], since: float = 0.0) -> Joints:
    """Root mean square of wanted less actual joint positions [rad or m], shape (n,).

    Args:
        motion: T samples.
        wanted: Joint positions wanted at the same times [rad or m], shape (T, n).
        since: Leave out what comes before [s].
    """
    counts = (motion.t >= since)[:, None]
    return jnp.sqrt(jnp.sum(jnp.where(counts, wanted - motion.q, 0.0) ** 2, axis=0) / jnp.sum(counts))
