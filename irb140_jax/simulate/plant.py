"""Arms that may remember what was before: what moves where a rigid body with friction is not enough."""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from irb140_jax.control import AbstractController, Reference
from irb140_jax.errors import InputError
from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Joints, Scalar


class AbstractPlant(eqx.Module):
    """An arm, with whatever state it has beside q and qd."""

    @property
    @abstractmethod
    def n(self) -> int:
        """Number of joints."""

    @abstractmethod
    def at_rest(self, q: Joints) -> Any:
        """The memory of the plant after standing still at q, a pytree of arrays."""

    @abstractmethod
    def respond(self, memory: Any, t: Scalar, q: Joints, qd: Joints, tau: Joints, dt: Scalar) -> tuple[Joints, Any]:
        """Acceleration at the start of a step, and the memory after it.

        Args:
            memory: Of the plant.
            t: Time since the motion began [s].
            q: Joint positions [rad or m], shape (n,).
            qd: Joint velocities [rad/s or m/s], shape (n,).
            tau: Torque that the controller asks for [N m or N], shape (n,).
            dt: Length of the step [s].
        """


@eqx.filter_jit
def play(
    plant: AbstractPlant, controller: AbstractController, reference: Reference, *, q0: Joints | None = None,
    qd0: Joints | None = None,
) -> Trajectory:
    """Motion of a plant under its controller by semi-implicit Euler, qd' = qd + dt qdd, q' = q + dt qd'.

    Args:
        plant: What moves.
        controller: What drives it; knows its own model only.
        reference: What the controller is to follow; its sampling is the step.
        q0: Joint positions at the start [rad or m], shape (n,); default those of the reference.
        qd0: Joint velocities at the start [rad/s or m/s], shape (n,); default those of the reference.

    Returns:
        State, acceleration and torque asked for at the start of every step, as many as the reference has samples.

    Raises:
        InputError: Plant, model and reference have different numbers of joints.
    """
    if not plant.n == controller.model.n == reference.q.shape[-1]:
        raise InputError(
            f"play: plant, model and reference have {plant.n}, {controller.model.n} and {reference.q.shape[-1]} joints;"
            " give all three the same"
        )
    dt = reference.t[1] - reference.t[0]

    def step(state, wanted):
        q, qd, memory = state
        t, *desired = wanted
        tau = controller.torque(q, qd, tuple(desired))
        qdd, memory = plant.respond(memory, t - reference.t[0], q, qd, tau, dt)
        after = qd + dt * qdd
        return (q + dt * after, after, memory), (q, qd, qdd, tau)

    q = reference.q[0] if q0 is None else jnp.asarray(q0, float)
    qd = reference.qd[0] if qd0 is None else jnp.asarray(qd0, float)
    samples = (reference.t, reference.q, reference.qd, reference.qdd)
    _, rows = jax.lax.scan(step, (q, qd, plant.at_rest(q)), samples)
    return Trajectory(reference.t, *rows)
