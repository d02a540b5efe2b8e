"""Simulation: MuJoCo's C engine in the same loop, conservation of energy, order of convergence, batches."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import random_robot, random_state, shipped_robot

from irb140_jax import control, dynamics, simulate
from irb140_jax.dynamics.chain import chain, plan
from irb140_jax.dynamics.joint_space import terms
from irb140_jax.errors import InputError
from irb140_jax.oracle.closed_loop import sliding_mode_loop
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.robot import first_joints, with_phi
from irb140_jax.trajectory import Trajectory

WHOLE, _ = shipped_robot()
ARM = first_joints(WHOLE, 3)
DT = 0.001


def wrong_model(robot, seed=0, relative=0.03):
    """The robot with inertial parameters that are a few per cent off."""
    rng = np.random.default_rng(seed)
    return with_phi(robot, robot.phi * (1.0 + relative * jnp.asarray(rng.normal(size=robot.phi.shape))))


def sway(n: int, steps: int, dt: float = DT) -> control.Reference:
    """Sines of other frequencies for every joint, exact in all derivatives."""
    t = dt * np.arange(steps + 1)
    w = np.linspace(1.0, 3.0, n)
    angle = t[:, None] * w + np.arange(n)
    shape = (0.2 * np.sin(angle), 0.2 * w * np.cos(angle), -0.2 * w**2 * np.sin(angle))
    return control.Reference(jnp.asarray(t), *(jnp.asarray(x) for x in shape))


def mujoco_rollout(plant, controller, reference, q0, push) -> tuple[np.ndarray, np.ndarray]:
    """The same loop by MuJoCo's C engine and NumPy, with a push at 2 Hz."""
    true, believed = (mujoco.MjModel.from_xml_string(mjcf(robot, DT)) for robot in (plant, controller.model))
    wanted = (np.asarray(reference.q), np.asarray(reference.qd), np.asarray(reference.qdd))
    law = (np.asarray(controller.slope), np.asarray(controller.gain), np.asarray(controller.layer))
    start = (np.asarray(q0), wanted[1][0])
    disturbance = lambda t, tau: push * np.sin(2.0 * np.pi * 2.0 * t)  # noqa: E731
    return sliding_mode_loop(true, believed, wanted, (*law, controller.switching), start, disturbance)


@pytest.mark.parametrize(("joints", "switching"), [(3, "saturation"), (3, "sign"), (6, "saturation")])
def test_closed_loop_is_that_of_mujocos_engine(joints, switching):
    plant = first_joints(WHOLE, joints)
    reference, q0 = sway(joints, 800), sway(joints, 1).q[0] + 0.05
    controller = control.sliding_mode(wrong_model(plant), switching=switching)
    push = 0.1 * np.asarray(controller.gain)
    disturbance = simulate.SinusoidalTorque(jnp.asarray(push), jnp.zeros(joints), jnp.array(2.0), jnp.array(0.0))
    ours = simulate.rollout(plant, controller, reference, disturbance, q0=q0)
    q, tau = mujoco_rollout(plant, controller, reference, q0, push)
    # The loop forgets round-off as it forgets errors; a sign may switch a step early, which the next one undoes.
    assert np.abs(ours.q - q).max() < 1e-9
    assert np.abs(ours.q - reference.q[:-1]).max() > 0.04  # and it is no standing still that is compared
    if switching != "sign":
        assert np.abs(ours.tau - tau).max() < 1e-6


@pytest.mark.parametrize("kinds", ["SHS", "HSHH"])  # worked through in one go, and in stages
def test_terms_in_scalars_are_those_in_arrays(kinds):
    robot, _ = random_robot(kinds, 2)
    q, qd = (jnp.asarray(x) for x in random_state(robot.n, 2, 2))
    M, C, g = (np.array(x, float) for x in terms(chain(robot, plan(robot)), list(q), list(qd)))
    scale = np.abs(M).max()
    assert np.allclose(M + np.diag(robot.armature), dynamics.mass_matrix(robot, q), atol=1e-13 * scale)
    assert np.allclose(C, dynamics.coriolis_matrix(robot, q, qd), atol=1e-12 * scale)
    assert np.allclose(g, dynamics.gravity_torque(robot, q), atol=1e-12 * scale)


def test_energy_of_an_arm_left_alone_is_conserved():
    still = control.Reference(0.0005 * jnp.arange(4001), *(jnp.zeros((4001, 3)),) * 3)
    run = simulate.rollout(
        ARM, control.Unactuated(ARM), still, q0=jnp.array([0.1, 0.6, -0.4]), qd0=jnp.array([1.0, 0.0, 0.0]),
        integrator=simulate.RungeKutta4(), every=20,
    )  # fmt: skip
    energy = jax.vmap(lambda q, qd: dynamics.kinetic_energy(ARM, q, qd) + dynamics.potential_energy(ARM, q))
    values = np.asarray(energy(run.q, run.qd))
    moved = np.ptp(np.asarray(jax.vmap(dynamics.potential_energy, in_axes=(None, 0))(ARM, run.q)))
    # Two seconds of free fall exchange some 100 J; the method's own error is of the order of dt^4.
    assert moved > 50.0 and np.ptp(values) < 1e-7 * moved


def test_work_of_the_motors_is_the_gain_of_energy():
    reference = sway(3, 2000, 0.0005)
    run = simulate.rollout(ARM, control.sliding_mode(ARM), reference, integrator=simulate.RungeKutta4())
    energy = jax.vmap(lambda q, qd: dynamics.kinetic_energy(ARM, q, qd) + dynamics.potential_energy(ARM, q))
    values, power = np.asarray(energy(run.q, run.qd)), np.sum(run.tau * run.qd, axis=1)
    work = np.cumsum(0.5 * DT * (power[1:] + power[:-1]))
    # The trapezoidal rule: dt^2 / 12 times a few hundred W/s^2.
    assert np.allclose(values[1:] - values[0], work, atol=1e-4)


@pytest.mark.parametrize(("kind", "order"), [(simulate.SemiImplicitEuler, 1), (simulate.RungeKutta4, 4)])
def test_integrators_converge_at_their_order(kind, order):
    controller = control.sliding_mode(wrong_model(ARM), switching="tanh", layer=2.0)
    ends = []
    for halvings in range(3):
        steps = 40 * 2**halvings
        reference = sway(3, steps * kind.span + kind.span, 0.4 / steps / kind.span)
        run = simulate.rollout(ARM, controller, reference, q0=reference.q[0] + 0.1, integrator=kind())
        ends.append(np.asarray(run.q[steps]))
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    # Halving the step divides the error by 2^order, give or take the next order's share.
    assert np.isclose(np.log2(ratio), order, atol=0.35)


@pytest.fixture(scope="module")
def batch():
    """Four wrong models, with and without disturbance, as one batch."""
    phis = jnp.stack([wrong_model(ARM, seed).phi for seed in range(4)])
    pushes = jnp.stack([jnp.zeros(3), jnp.full(3, 20.0)])
    reference = sway(3, 100)

    def one(phi, push):
        disturbance = simulate.SinusoidalTorque(push, 0.01 * push, jnp.array(3.0), jnp.array(0.5))
        return simulate.rollout(ARM, control.sliding_mode(with_phi(ARM, phi)), reference, disturbance)

    conditions = jax.vmap(one, in_axes=(None, 0))
    return phis, pushes, one, jax.vmap(conditions, in_axes=(0, None))(phis, pushes)


def test_a_batch_is_its_members_one_by_one(batch):
    phis, pushes, one, together = batch
    assert together.q.shape == (4, 2, 100, 3)
    for i, j in ((0, 0), (1, 1), (3, 0)):
        alone = one(phis[i], pushes[j])
        for name in ("q", "qd", "qdd", "tau"):
            assert np.allclose(getattr(together, name)[i, j], getattr(alone, name), atol=1e-9, rtol=1e-11)


def test_members_of_a_batch_differ_by_model_and_by_condition(batch):
    *_, together = batch
    assert np.abs(together.q[0] - together.q[1]).max() > 1e-6
    assert np.abs(together.q[:, 0] - together.q[:, 1]).max() > 1e-6


def test_motion_answers_to_motor_torque_and_disturbance(batch):
    *_, together = batch
    q, qd, qdd, tau = (np.asarray(getattr(together, name)[2, 1]) for name in ("q", "qd", "qdd", "tau"))
    acted = dynamics.inverse_dynamics_batch(ARM, jnp.asarray(q), jnp.asarray(qd), jnp.asarray(qdd))
    sine = np.sin(2.0 * np.pi * 3.0 * DT * np.arange(100) + 0.5)[:, None]
    # 20 N m and a fifth of the motor's torque, at 3 Hz; round-off of torques of some 100 N m.
    assert np.allclose(acted - tau, (20.0 + 0.2 * tau) * sine, atol=1e-10)


def test_thinned_rows_are_rows_of_the_whole():
    reference, controller = sway(3, 103), control.sliding_mode(ARM)
    whole = simulate.rollout(ARM, controller, reference, q0=reference.q[0] + 0.1)
    thin = simulate.rollout(ARM, controller, reference, q0=reference.q[0] + 0.1, every=10)
    assert thin.q.shape == (10, 3)
    for name in ("t", "q", "qd", "qdd", "tau"):
        assert np.allclose(getattr(thin, name), getattr(whole, name)[:100:10], atol=1e-9, rtol=1e-11)


def test_recursion_and_christoffel_symbols_move_the_arm_alike():
    reference, controller = sway(3, 100), control.sliding_mode(wrong_model(ARM))
    runs = [simulate.rollout(ARM, controller, reference, christoffel=c) for c in (True, False)]
    assert np.allclose(runs[0].q, runs[1].q, atol=1e-12)


def test_friction_of_the_plant_resists_its_motion():
    rough = first_joints(WHOLE, 3)
    rough = type(rough)(**{**vars(rough), "frictionloss": jnp.full(3, 5.0), "damping": jnp.full(3, 2.0)})
    reference, controller = sway(3, 100), control.sliding_mode(ARM)
    run = simulate.rollout(rough, controller, reference)
    smooth = dynamics.inverse_dynamics_batch(ARM, run.q, run.qd, run.qdd)
    assert np.allclose(run.tau - smooth, 5.0 * np.sign(run.qd) + 2.0 * run.qd, atol=1e-10)


def test_passivity_form_follows_as_well_as_computed_torque():
    reference = sway(3, 100)
    run = simulate.rollout(ARM, control.sliding_mode(ARM, form="passivity"), reference)
    assert np.abs(run.q - reference.q[:-1]).max() < 1e-3


def test_robots_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="joints"):
        simulate.rollout(WHOLE, control.sliding_mode(ARM), sway(3, 10))
    with pytest.raises(InputError, match="steps"):
        simulate.rollout(ARM, control.sliding_mode(ARM), sway(3, 10), every=11)


def test_response_of_a_known_second_order_error_is_told_right():
    t = jnp.arange(0.0, 10.0, 0.001)
    damping, rate = 0.5, 4.0
    fast = rate * np.sqrt(1.0 - damping**2)
    error = jnp.exp(-damping * rate * t) * (jnp.cos(fast * t) + damping * rate / fast * jnp.sin(fast * t))
    told = simulate.response(t, -0.3 * error)
    # Textbook figures of a damping of 0.5: overshoot exp(-pi 0.5 / sqrt(0.75)) = 16.3 %, rise 1.64 / 4 s.
    assert np.isclose(told.overshoot, 100.0 * np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2)), atol=1e-3)
    assert np.isclose(told.rise, 1.64 / rate, atol=0.01)
    late = np.asarray(t)[np.abs(np.asarray(error)) > 0.02]
    assert np.isclose(told.settling, late[-1], atol=0.0011)
    assert told.steady < 1e-5


def test_a_response_that_never_settles_says_so():
    t = jnp.arange(0.0, 10.0, 0.01)
    told = simulate.response(t, 0.1 * jnp.cos(5.0 * t))
    assert told.settling == jnp.inf and np.isclose(told.overshoot, 100.0, atol=1.0)


def test_energy_and_roughness_of_a_known_motion():
    t = jnp.arange(0.0, 2.0 * np.pi, 1e-3)[:, None] * jnp.ones(2)
    motion = Trajectory(t[:, 0], -jnp.cos(t), jnp.sin(t), jnp.cos(t), 3.0 * jnp.sin(t + 0.5))
    absolute, signed = simulate.energies(motion)
    # 3 times the integral of sin(t) sin(t + 0.5): pi cos(0.5) with its sign; with steps of 1e-3 good to 1e-3.
    assert np.allclose(signed[-1], 3.0 * np.pi * np.cos(0.5), atol=1e-2)
    assert np.all(np.diff(absolute, axis=0) >= 0.0) and np.all(absolute[-1] > signed[-1])
    assert np.allclose(simulate.roughness(motion), 3.0 / np.sqrt(2.0), atol=1e-2)
