# pyright: reportMissingImports=false
"""Closed-loop rollouts against MuJoCo's open-loop physics and against diffrax.

90 lanes: three models of 30 seeds would be this many; three joints, Christoffel Coriolis, sliding mode, 1 ms.
"""

import timing  # noqa: I001  first: it sets the number of threads

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import mujoco.rollout
import numpy as np

from irb140_jax import control, dynamics, simulate
from irb140_jax.compiler import QUICK
from irb140_jax.dynamics.chain import plan
from irb140_jax.dynamics.scalar_arm import acceleration, scalar_arm
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.robot import Robot, first_joints, with_phi

LANES, SECONDS, DT = 90, 30.0, 0.001
ROUNDS = 5
# The peers are timed over fewer steps, which all take the same time.
SHARE = 10
# Of the closed loop in a step; the last of Tsit5's seven stages is the first of its next step.
EVALUATIONS = {"ours": 4, "euler": 1, "in_scalars": 6}
FREQUENCY = np.array([0.5, 0.8, 1.1])


def wanted(t, np=jnp):
    """Sines of each joint: positions, velocities, accelerations."""
    angle = t[..., None] * FREQUENCY + np.arange(3)
    return 0.2 * np.sin(angle), 0.2 * FREQUENCY * np.cos(angle), -0.2 * FREQUENCY**2 * np.sin(angle)


def reference(steps: int, dt: float) -> control.Reference:
    """The sines, sampled."""
    t = dt * jnp.arange(steps + 1)
    return control.Reference(t, *wanted(t))


def models(arm: Robot) -> jax.Array:
    """Inertial parameters of the controllers, a few per cent off, shape (LANES, 3, 10)."""
    return arm.phi * (1.0 + 0.03 * jnp.asarray(np.random.default_rng(0).normal(size=(LANES, 3, 10))))


def rigid(robot: Robot) -> Robot:
    """Three joints, without rotors, as the study has them."""
    arm = first_joints(robot, 3)
    return eqx.tree_at(lambda r: r.armature, arm, jnp.zeros(3))


def closed_loop(arm: Robot, integrator: simulate.AbstractIntegrator, steps: int):
    """A function of the models' parameters that rolls all lanes out."""
    motion = reference(steps * integrator.span, DT / integrator.span)

    def one(phi):
        run = simulate.rollout(arm, control.sliding_mode(with_phi(arm, phi)), motion, integrator=integrator)
        return run.q, run.qd  # what MuJoCo's rollout returns

    return jax.jit(jax.vmap(one), compiler_options=QUICK)


def rollouts(robot: Robot) -> dict[str, float]:
    """Semi-implicit Euler against `mujoco.rollout` of the same arm without any controller, on one thread."""
    arm = rigid(robot)
    steps, phis = round(SECONDS / DT), models(arm)
    run = closed_loop(arm, simulate.SemiImplicitEuler(), steps)
    model = mujoco.MjModel.from_xml_string(mjcf(arm, DT))
    data = mujoco.MjData(model)
    states = np.zeros((LANES, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)))
    ours = lambda: run(phis)  # noqa: E731
    theirs = lambda: mujoco.rollout.rollout(model, data, states, nstep=steps // SHARE)  # noqa: E731
    metrics = {"rollouts_compile_s": timing.compile_seconds(ours)}
    error = np.abs(np.asarray(ours()[0]) - np.asarray(reference(steps, DT).q)[:-1]).max()
    if not error < 0.02:  # [rad]
        raise AssertionError(f"rollouts: the loop does not follow, {error:.2g} rad off")
    median = timing.medians({"ours": ours, "mujoco": theirs}, ROUNDS)
    metrics["rollouts_s"] = median["ours"]
    metrics["rollouts_mujoco_physics_s"] = median["mujoco"] * SHARE
    metrics["rollouts_ratio"] = median["mujoco"] * SHARE / median["ours"]
    return metrics


def runge_kutta(robot: Robot) -> dict[str, float]:
    """Runge-Kutta of order 4 against diffrax's Tsit5 at the same fixed step, on the same equations.

    Twice: diffrax on the equations in arrays, as one writes them for it, and on our own in scalars, which shows how
    much of the ratio is theirs.  Beside it what one evaluation of the loop takes in each, and in an Euler step: as far
    as they are alike the integrators cost nothing, and the second ratio is that of the numbers of evaluations.
    """
    import diffrax

    arm = rigid(robot)
    steps, phis = round(SECONDS / DT), models(arm)
    short = steps // SHARE
    run, brief = (closed_loop(arm, simulate.RungeKutta4(), count) for count in (steps, short))
    peers = {name: solved_by_diffrax(diffrax, arm, field, short) for name, field in fields(arm).items()}
    ours = lambda: run(phis)  # noqa: E731
    euler = closed_loop(arm, simulate.SemiImplicitEuler(), steps)
    cases = {name: lambda peer=peer: peer(phis) for name, peer in peers.items()}
    metrics = {"runge_kutta_compile_s": timing.compile_seconds(ours)}
    last = np.asarray(brief(phis)[0])[:, -1]
    for name, case in cases.items():
        metrics[f"runge_kutta_{name}_compile_s"] = timing.compile_seconds(case)
        # Ours is kept at the start of each step, theirs at the end of the last: up to 0.3 rad/s for 1 ms.
        error = np.abs(last - np.asarray(case())).max()
        if not error < 2.0 * DT * 0.3:
            raise AssertionError(f"Runge-Kutta: ours and {name} end {error:.2g} rad apart")
    median = timing.medians({"ours": ours, "euler": lambda: euler(phis), **cases}, ROUNDS)
    metrics["runge_kutta_s"] = median["ours"]
    for name in cases:
        metrics[f"runge_kutta_{name}_s"] = median[name] * SHARE
        metrics[f"runge_kutta_{name}_ratio"] = median[name] * SHARE / median["ours"]
    seconds = {"ours": median["ours"], "euler": median["euler"], "in_scalars": median["diffrax_in_scalars"] * SHARE}
    for name, total in seconds.items():
        metrics[f"runge_kutta_evaluation_{name}_ns"] = 1e9 * total / (EVALUATIONS[name] * LANES * steps)
    return metrics


def fields(arm: Robot) -> dict:
    """The closed loop as a vector field of (q, qd), in arrays and in scalars."""
    ahead = plan(arm)

    def arrays(t, state, controller):
        q, qd = state
        desired, model = wanted(t), controller.model
        e, ed = desired[0] - q, desired[1] - qd
        s, qdd = ed + controller.slope * e, desired[2] + controller.slope * ed
        tau = dynamics.mass_matrix(model, q) @ qdd + dynamics.coriolis_matrix(model, q, qd) @ qd
        tau = tau + dynamics.gravity_torque(model, q) + controller.gain * jnp.clip(s / controller.layer, -1.0, 1.0)
        return qd, dynamics.forward_dynamics_christoffel(arm, q, qd, tau)

    def scalars(t, state, controller):
        q, qd = (jnp.unstack(x) for x in state)
        desired = control.Desired(*(jnp.unstack(x) for x in wanted(t)))
        tau = controller.law(controller.prepared(ahead), q, qd, desired)
        return state[1], jnp.stack(acceleration(scalar_arm(arm, ahead), q, qd, tau, True))

    return {"diffrax": arrays, "diffrax_in_scalars": scalars}


def solved_by_diffrax(diffrax, arm: Robot, field, steps: int):
    """A function of the models' parameters that gives where all lanes end, shape (LANES, 3)."""

    def one(phi):
        return diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Tsit5(), 0.0, steps * DT, DT, wanted(jnp.zeros(()))[:2],
            control.sliding_mode(with_phi(arm, phi)), saveat=diffrax.SaveAt(t1=True), max_steps=steps + 2,
            adjoint=diffrax.ForwardMode(),
        ).ys[0][-1]  # fmt: skip

    return eqx.filter_jit(jax.vmap(one), compiler_options=QUICK)  # pyright: ignore[reportCallIssue]: goes to jax.jit
