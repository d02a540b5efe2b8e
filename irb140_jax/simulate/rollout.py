"""Closed loop of an arm, a controller and a disturbance along a reference: one loop, one compiled program."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from irb140_jax.control import AbstractController, Desired, Reference
from irb140_jax.dynamics.chain import Plan, plan
from irb140_jax.dynamics.scalar_arm import Scalars, acceleration, scalar_arm, stored
from irb140_jax.errors import InputError
from irb140_jax.robot import Robot
from irb140_jax.simulate.disturbance import AbstractDisturbance, no_disturbance
from irb140_jax.simulate.integrators import AbstractIntegrator, SemiImplicitEuler
from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Joints


def rollout(
    plant: Robot,
    controller: AbstractController,
    reference: Reference,
    disturbance: AbstractDisturbance | None = None,
    *,
    q0: Joints | None = None,
    qd0: Joints | None = None,
    integrator: AbstractIntegrator | None = None,
    christoffel: bool = True,
    every: int = 1,
) -> Trajectory:
    """Motion of the plant under its controller, qdd = M^-1 (tau + d - C qd - g - passive), at fixed steps.

    To run many at once, `sweep` a function of what differs (inertials, gains, starts, disturbances) with the rest
    closed over; the robot's geometry must be concrete where this function is called, or it compiles to slower code.

    Args:
        plant: The arm that moves, n joints.
        controller: What drives it; knows its own model only.
        reference: What the controller is to follow, S samples of n joints; sets the steps.
        disturbance: What acts beside the motors; default nothing.
        q0: Joint positions at the start [rad or m], shape (n,); default those of the reference.
        qd0: Joint velocities at the start [rad/s or m/s], shape (n,); default those of the reference.
        integrator: Default `SemiImplicitEuler`; a step is `integrator.span` samples of the reference.
        christoffel: Whether the plant's Coriolis matrix is formed as in the study (see `scalar_arm.acceleration`).
        every: Keep each so-manieth step only.

    Returns:
        State at the start of every step kept, accelerations there, and the torque the motors give (d not in it).

    Raises:
        InputError: Plant, model and reference have different numbers of joints, or the reference is too short.
    """
    integrator = SemiImplicitEuler() if integrator is None else integrator
    disturbance = no_disturbance(plant.n) if disturbance is None else disturbance
    if not plant.n == controller.model.n == reference.q.shape[-1]:
        raise InputError(
            f"rollout: plant, model and reference have {plant.n}, {controller.model.n} and {reference.q.shape[-1]} "
            "joints; give all three the same"
        )
    steps = (reference.t.shape[0] - 1) // integrator.span
    if every < 1 or steps < every:
        raise InputError(f"rollout: {steps} steps, every {every}th kept; give a longer reference, or 1 <= every")
    start = (reference.q[0] if q0 is None else q0, reference.qd[0] if qd0 is None else qd0)
    ahead = plan(plant), plan(controller.model)
    static = (integrator, christoffel, every, steps - steps % every)
    return _rollout(static, ahead, plant, controller, reference, disturbance, start)


@eqx.filter_jit
def _rollout(
    static: tuple[AbstractIntegrator, bool, int, int],
    ahead: tuple[Plan, Plan],
    plant: Robot,
    controller: AbstractController,
    reference: Reference,
    disturbance: AbstractDisturbance,
    start: tuple[Joints, Joints],
) -> Trajectory:
    integrator, christoffel, every, steps = static
    body, model = scalar_arm(plant, ahead[0]), controller.prepared(ahead[1])

    def law(moment, q: Scalars, qd: Scalars) -> tuple[Scalars, Scalars]:
        t, *wanted = moment
        # Stored: else XLA would compute the torques once for each acceleration.
        tau = stored(q, lambda: controller.law(model, q, qd, Desired(*(list(x) for x in wanted))))
        pushed = [a + b for a, b in zip(tau, disturbance.torque(t, tau), strict=True)]
        return acceleration(body, q, qd, pushed, christoffel), tau

    def step(state, moments):
        after, qdd, tau = integrator.step(law, moments, state, dt)
        return after, (*state, tuple(qdd), tuple(tau))

    def kept(state, moments):
        state, row = step(state, jax.tree.map(lambda x: x[0], moments))
        state, _ = jax.lax.scan(lambda s, x: (step(s, x)[0], None), state, jax.tree.map(lambda x: x[1:], moments))
        return state, row

    dt = integrator.span * (reference.t[1] - reference.t[0])
    moments = _moments(reference, integrator, steps)
    if every > 1:
        moments = jax.tree.map(lambda x: x.reshape(-1, every, *x.shape[1:]), moments)
    state = tuple(jnp.unstack(start[0])), tuple(jnp.unstack(start[1]))
    _, rows = jax.lax.scan(step if every == 1 else kept, state, moments)
    t = reference.t[: steps * integrator.span : every * integrator.span]
    return Trajectory(t, *(jnp.stack(x, axis=-1) for x in rows))


def _moments(reference: Reference, integrator: AbstractIntegrator, steps: int) -> tuple:
    """Time and wanted motion at every stage of every step; leaves of shape (steps, stages)."""

    def at_stages(x: Float[Array, " S"]) -> Float[Array, "steps stages"]:
        last = (steps - 1) * integrator.span
        return jnp.stack([x[s : last + s + 1 : integrator.span] for s in integrator.stages], axis=1)

    columns = (tuple(at_stages(c) for c in jnp.unstack(x, axis=1)) for x in (reference.q, reference.qd, reference.qdd))
    return (at_stages(reference.t), *columns)
