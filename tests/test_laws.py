"""Laws of mechanics and MuJoCo's opinion, over random chains and the IRB 140."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import KINDS, LONGEST, random_robot, random_state, shipped_robot
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import dynamics, kinematics
from irb140_jax.oracle import mujoco as oracle

# Sums of at most some hundred products in double precision, against the largest number of the result.
TOLERANCE = 1e-12

random_robots = st.builds(random_robot, st.sampled_from(KINDS[1:]), st.integers(0, 2**31))
robots = st.just(shipped_robot()) | random_robots
seeds = st.integers(0, 2**31)
laws = settings(max_examples=25, deadline=None, derandomize=True)


@jax.jit
def equations(robot, q, qd):
    """M, C, g and the passive torque."""
    return (
        dynamics.mass_matrix(robot, q),
        dynamics.coriolis_matrix(robot, q, qd),
        dynamics.gravity_torque(robot, q),
        dynamics.passive_torque(robot, q, qd),
    )


@jax.jit
def textbook(robot, q, qd):
    """M, its rate, C and g as the study writes them: sums of Jacobians, Christoffel symbols by differentiating M."""

    def mass_matrix(q):
        J = kinematics.link_jacobians(robot, q)
        inertia = J.rotation @ robot.inertia @ jnp.swapaxes(J.rotation, 1, 2)
        linear = jnp.einsum("i,ijx,ikx->jk", robot.mass, J.linear, J.linear)
        return linear + jnp.einsum("ijx,ixy,iky->jk", J.angular, inertia, J.angular) + jnp.diag(robot.armature)

    dM = jax.jacfwd(mass_matrix)(q)
    symbols = 0.5 * (dM + jnp.swapaxes(dM, 1, 2) - jnp.transpose(dM, (2, 0, 1)))
    g = -jnp.einsum("i,ijx,x->j", robot.mass, kinematics.link_jacobians(robot, q).linear, robot.gravity)
    return mass_matrix(q), dM @ qd, symbols, g


@jax.jit
def energy_balance(robot, q, qd, tau):
    """Rate of the energy along the motion that tau makes, and the power that goes in and out."""
    qdd = dynamics.forward_dynamics(robot, q, qd, tau)

    def energy(q, qd):
        return (
            dynamics.kinetic_energy(robot, q, qd)
            + dynamics.potential_energy(robot, q)
            + dynamics.spring_energy(robot, q)
        )

    _, rate = jax.jvp(energy, (q, qd), (qd, qdd))
    lost = jnp.sum(robot.damping * qd**2 + robot.frictionloss * jnp.abs(qd))
    return rate, tau @ qd - lost, jnp.sum(jnp.abs(tau * qd)) + lost


def close(a, b, tolerance=TOLERANCE):
    """Equal to the tolerance, on the scale of the larger array."""
    scale = max(1.0, float(np.max(np.abs(a))), float(np.max(np.abs(b))))
    return bool(np.max(np.abs(np.asarray(a) - np.asarray(b))) <= tolerance * scale)


def state_of(robot, seed, count=3):
    return [jnp.asarray(x) for x in random_state(robot.n, seed, count)]


@laws
@given(pair=robots, seed=seeds)
def test_mass_matrix_is_symmetric_positive_definite_and_mujocos(pair, seed):
    robot, model = pair
    q, qd, _ = state_of(robot, seed)
    M = np.asarray(equations(robot, q, qd)[0])
    assert np.array_equal(M, M.T)
    assert np.linalg.eigvalsh(M).min() > 0.0
    assert close(M, oracle.mass_matrix(model, np.asarray(q)))


def test_ten_joints_are_not_too_many():
    robot, model = random_robot(LONGEST, 8)
    q, qd, _ = state_of(robot, 8)
    M, C, g, _ = equations(robot, q, qd)
    assert close(M, oracle.mass_matrix(model, np.asarray(q)))
    assert close(C @ qd + g, oracle.bias(model, np.asarray(q), np.asarray(qd)))


@laws
@given(pair=robots, seed=seeds)
def test_m_c_and_g_are_the_studys_sums_of_jacobians_and_christoffel_symbols(pair, seed):
    robot, _ = pair
    q, qd, _ = state_of(robot, seed)
    M, C, g, _ = equations(robot, q, qd)
    M_text, _, symbols, g_text = textbook(robot, q, qd)
    assert close(M, M_text) and close(C, symbols @ qd) and close(g, g_text)


@laws
@given(pair=robots, seed=seeds)
def test_rate_of_m_less_twice_c_is_skew_symmetric(pair, seed):
    robot, _ = pair
    q, qd, _ = state_of(robot, seed)
    N = np.asarray(textbook(robot, q, qd)[1] - 2.0 * equations(robot, q, qd)[1])
    assert close(N, -N.T)


@pytest.mark.parametrize("kinds", KINDS)
def test_christoffel_symbols_are_those_of_the_differentiated_mass_matrix(kinds):
    robot, _ = random_robot(kinds, 5)
    q, qd, _ = state_of(robot, 5)
    symbols = jax.jit(dynamics.christoffel_symbols)(robot, q)
    assert close(symbols, textbook(robot, q, qd)[2])


@laws
@given(pair=robots, seed=seeds)
def test_coriolis_and_gravity_torque_are_mujocos_bias(pair, seed):
    robot, model = pair
    q, qd, _ = state_of(robot, seed)
    _, C, g, _ = equations(robot, q, qd)
    assert close(C @ qd + g, oracle.bias(model, np.asarray(q), np.asarray(qd)))


@laws
@given(pair=robots, seed=seeds)
def test_damping_and_springs_of_the_model_are_mujocos(pair, seed):
    robot, model = pair
    q, qd, _ = state_of(robot, seed)
    smooth = equations(robot, q, qd)[3] - robot.frictionloss * jnp.sign(qd)
    assert close(smooth, oracle.passive(model, np.asarray(q), np.asarray(qd)))


@laws
@given(pair=robots, seed=seeds)
def test_gravity_torque_is_the_gradient_of_the_potential_energy(pair, seed):
    robot, _ = pair
    q, qd, _ = state_of(robot, seed)
    assert close(equations(robot, q, qd)[2], potential_slope(robot, q))


potential_slope = jax.jit(jax.grad(dynamics.potential_energy, argnums=1))


@laws
@given(pair=robots, seed=seeds)
def test_energies_are_mujocos(pair, seed):
    robot, model = pair
    q, qd, _ = state_of(robot, seed)
    potential, kinetic, spring = energies(robot, q, qd)
    V, T = oracle.energies(model, np.asarray(q), np.asarray(qd))
    V0, _ = oracle.energies(model, np.asarray(robot.reference), np.zeros(robot.n))
    ours0, _, spring0 = energies(robot, robot.reference, jnp.zeros(robot.n))
    # MuJoCo counts from the world's origin, we from the base's: compare the change.
    assert close(potential + spring - ours0 - spring0, V - V0, 1e-11) and close(kinetic, T)


energies = jax.jit(
    lambda robot, q, qd: (
        dynamics.potential_energy(robot, q),
        dynamics.kinetic_energy(robot, q, qd),
        dynamics.spring_energy(robot, q),
    )
)


@laws
@given(pair=robots, seed=seeds)
def test_energy_changes_by_the_power_of_the_motors_less_what_friction_takes(pair, seed):
    robot, _ = pair
    q, qd, tau = state_of(robot, seed)
    rate, power, scale = energy_balance(robot, q, qd, tau)
    # Solving for qdd loses the condition number of M, up to 1e6 for the IRB 140's light wrist.
    assert abs(float(rate - power)) <= 1e-9 * max(1.0, float(scale))


@laws
@given(pair=robots, seed=seeds)
def test_inverse_dynamics_is_mujocos(pair, seed):
    robot, model = pair
    q, qd, qdd = state_of(robot, seed)
    tau = inverse_dynamics(robot, q, qd, qdd) - robot.frictionloss * jnp.sign(qd)
    assert close(tau, oracle.inverse_dynamics(model, np.asarray(q), np.asarray(qd), np.asarray(qdd)))


inverse_dynamics = jax.jit(dynamics.inverse_dynamics)


@laws
@given(pair=robots, seed=seeds)
def test_recursive_and_paper_style_dynamics_agree(pair, seed):
    robot, _ = pair
    q, qd, qdd = state_of(robot, seed)
    M, C, g, passive = equations(robot, q, qd)
    assert close(M @ qdd + C @ qd + g + passive, inverse_dynamics(robot, q, qd, qdd))


@pytest.mark.parametrize("kinds", KINDS)
def test_equation_16_gives_back_the_acceleration_that_the_torque_was_made_for(kinds):
    robot, _ = random_robot(kinds, 7)
    q, qd, qdd = state_of(robot, 7)
    tau = inverse_dynamics(robot, q, qd, qdd) - dynamics.passive_torque(robot, q, qd)
    # The solve loses the condition number of M, below 1e4 for these robots.
    assert close(jax.jit(dynamics.forward_dynamics_christoffel)(robot, q, qd, tau), qdd, 1e-9)


def test_mass_matrix_is_linear_in_the_inertial_parameters():
    from irb140_jax.robot import with_phi

    one, _ = random_robot("HHSHHH", 1)
    other, _ = random_robot("HHSHHH", 2)
    q, qd, _ = state_of(one, 1)
    other = eqx.tree_at(lambda r: r.armature, with_phi(one, other.phi), 0.0 * one.armature)
    both = with_phi(one, one.phi + other.phi)
    assert close(equations(both, q, qd)[0], equations(one, q, qd)[0] + equations(other, q, qd)[0])


def test_jit_changes_nothing():
    robot, _ = random_robot("SHS", 4)
    q, qd, _ = state_of(robot, 4)
    with jax.disable_jit():
        eager = dynamics.mass_matrix(robot, q), dynamics.coriolis_matrix(robot, q, qd)
    assert all(close(a, b, 1e-14) for a, b in zip(eager, equations(robot, q, qd)[:2], strict=True))


def test_vmap_is_the_loop():
    robot, _ = shipped_robot()
    samples = [state_of(robot, seed) for seed in range(5)]
    q, qd = (jnp.stack([sample[k] for sample in samples]) for k in (0, 1))
    together = jax.jit(jax.vmap(equations, in_axes=(None, 0, 0)))(robot, q, qd)
    one_by_one = [equations(robot, *sample[:2]) for sample in samples]
    for k in range(4):
        assert close(together[k], jnp.stack([result[k] for result in one_by_one]), 1e-14)


def test_robots_can_be_batched():
    pair = [random_robot("SHS", seed)[0] for seed in (1, 2)]
    q, qd, _ = state_of(pair[0], 1)
    batch = jax.tree.map(lambda *leaves: jnp.stack(leaves), *pair)
    together = jax.jit(jax.vmap(equations, in_axes=(0, None, None)))(batch, q, qd)
    assert all(close(together[1][i], equations(robot, q, qd)[1]) for i, robot in enumerate(pair))


def test_coriolis_torque_has_finite_gradients_in_every_robot_parameter():
    robot, _ = random_robot("SHS", 1)
    q, qd, _ = state_of(robot, 1)
    loss = lambda robot: jnp.sum(dynamics.coriolis_matrix(robot, q, qd) @ qd)  # noqa: E731
    slopes = jax.jit(jax.grad(loss))(robot)
    assert all(bool(jnp.all(jnp.isfinite(slope))) for slope in jax.tree.leaves(slopes))
    assert float(jnp.abs(slopes.com).max()) > 0.0


def test_results_are_double_precision():
    robot, _ = shipped_robot()
    q, qd, _ = state_of(robot, 1)
    assert all(result.dtype == jnp.float64 for result in equations(robot, q, qd))
