"""Robots that branch: every function of the rigid body against MuJoCo's C engine, over random trees."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import random_state
from helpers_trees import random_parents, tree_xml
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import dynamics, kinematics
from irb140_jax.errors import RobotError
from irb140_jax.oracle import mujoco as oracle
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.robot import Robot, first_joints, load_robot, robot_from_model, subset
from irb140_jax.robot.tree import carried, is_depth_first, moves, path

# Two arms on a torso; branches that part at the base.
TREES = {"torso": (-1, 0, 1, 0, 3), "base": (-1, -1, 1)}
# Two recursions of some thousand operations agree to a few thousand ulp of the largest term.
ROUND_OFF = 1e-10


def robot_and_oracle(tree: str) -> tuple[Robot, mujoco.MjModel]:
    model = mujoco.MjModel.from_xml_string(tree_xml(TREES[tree], 7))
    return robot_from_model(model), oracle.oracle_model(model)


@pytest.fixture(params=list(TREES), scope="module")
def case(request) -> tuple[Robot, mujoco.MjModel]:
    return robot_and_oracle(request.param)


@pytest.fixture(scope="module")
def small() -> tuple[Robot, mujoco.MjModel]:
    """For what takes long to compile."""
    return robot_and_oracle("base")


def close(ours, theirs) -> None:
    theirs = np.asarray(theirs)
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=ROUND_OFF * max(1.0, float(np.abs(theirs).max())))


# ---------------------------------------------------------------- the order of links


@given(st.integers(1, 40), st.integers(0, 10**6))
def test_links_that_a_joint_carries_are_those_it_moves(n, seed):
    parents = random_parents(np.random.default_rng(seed), n)
    assert is_depth_first(parents)
    mask = moves(parents)
    for j in range(n):
        assert list(carried(parents, j)) == list(np.flatnonzero(mask[:, j]))
        assert list(path(parents, j)) == list(np.flatnonzero(mask[j]))


@pytest.mark.parametrize("parents", [(0,), (-1, 0, -1, 0), (1, -1), (-1, 5)])
def test_links_in_another_order_are_refused(parents):
    assert not is_depth_first(parents)


def test_a_robot_with_links_in_another_order_says_so(case):
    robot, _ = case
    fields = {name: getattr(robot, name) for name in robot.__dataclass_fields__}
    with pytest.raises(RobotError, match="depth-first"):
        Robot(**{**fields, "parent": (0,) * robot.n})


# ---------------------------------------------------------------- the rigid body


def test_inverse_dynamics_of_a_tree_agree_with_mujoco(case):
    robot, model = case
    q, qd, qdd = random_state(robot.n, 1)
    close(dynamics.inverse_dynamics(robot, *map(jnp.asarray, (q, qd, qdd))), oracle.inverse_dynamics(model, q, qd, qdd))


def test_many_samples_of_a_tree_are_as_one_by_one(case):
    robot, _ = case
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, (3, 5, robot.n))
    ours = dynamics.inverse_dynamics_batch(robot, *map(jnp.asarray, (q, qd, qdd)))
    close(ours, [dynamics.inverse_dynamics(robot, *map(jnp.asarray, x)) for x in zip(q, qd, qdd, strict=True)])


def test_mass_matrix_bias_and_forward_dynamics_of_a_tree_agree_with_mujoco(case):
    robot, model = case
    q, qd, tau = random_state(robot.n, 2)
    x, v, torque = (jnp.asarray(y) for y in (q, qd, tau))
    close(dynamics.mass_matrix(robot, x), oracle.mass_matrix(model, q))
    close(dynamics.coriolis_matrix(robot, x, v) @ v + dynamics.gravity_torque(robot, x), oracle.bias(model, q, qd))
    close(dynamics.forward_dynamics(robot, x, v, torque), oracle.forward_dynamics(model, q, qd, tau))


def test_energies_of_a_tree_agree_with_mujoco(case):
    robot, model = case
    q, qd, _ = random_state(robot.n, 3)
    x, v = jnp.asarray(q), jnp.asarray(qd)
    potential, kinetic = oracle.energies(model, q, qd)
    close(dynamics.kinetic_energy(robot, x, v), kinetic)
    # Ours is zero at the base's origin, MuJoCo's at the world's: changes are compared.
    at_zero = jnp.zeros(robot.n)
    ours = lambda y: dynamics.potential_energy(robot, y) + dynamics.spring_energy(robot, y)  # noqa: E731
    close(ours(x) - ours(at_zero), potential - oracle.energies(model, np.zeros(robot.n), qd)[0])


def test_tool_and_jacobian_of_a_tree_agree_with_mujoco(case):
    robot, model = case
    q = random_state(robot.n, 4)[0]
    close(kinematics.forward_kinematics(robot, jnp.asarray(q)), oracle.forward_kinematics(model, q))
    close(kinematics.jacobian(robot, jnp.asarray(q)), oracle.jacobian(model, q))


def test_regressor_of_a_tree_gives_its_torque(case):
    robot, model = case
    q, qd, qdd = random_state(robot.n, 5)
    x = [jnp.asarray(y) for y in (q, qd, qdd)]
    rest = robot.armature * x[2] + robot.damping * x[1] + robot.stiffness * (x[0] - robot.springref)
    close(dynamics.regressor(robot, *x) @ robot.phi.ravel() + rest, oracle.inverse_dynamics(model, q, qd, qdd))


def test_regressor_of_a_tree_is_zero_where_a_joint_does_not_move_the_link(case):
    robot, _ = case
    Y = dynamics.regressor(robot, *map(jnp.asarray, random_state(robot.n, 6))).reshape(robot.n, robot.n, 10)
    still = ~moves(robot.parent).T
    assert still.any() and not np.any(np.asarray(Y)[still])


def test_gram_matrix_of_a_tree_is_that_of_its_regressor(small):
    robot, _ = small
    q, qd, qdd, tau = np.random.default_rng(1).normal(size=(4, 6, robot.n))
    gram = dynamics.regressor_gram(robot, *map(jnp.asarray, (q, qd, qdd, tau)))
    Y = dynamics.regressor_batch(robot, *map(jnp.asarray, (q, qd, qdd)))
    W = np.concatenate([np.asarray(Y).reshape(-1, 10 * robot.n), tau.reshape(-1, 1)], axis=1)
    close(gram, W.T @ W)


def test_base_parameters_of_a_tree_give_all_torques(small):
    robot, _ = small
    base = dynamics.base_parameters(robot)
    Y = dynamics.regressor(robot, *map(jnp.asarray, random_state(robot.n, 7)))
    close(np.asarray(Y)[:, base.columns] @ base.grouping, Y)


def test_terms_of_a_simulated_tree_agree_with_its_matrices(small):
    from irb140_jax.dynamics.chain import chain, plan
    from irb140_jax.dynamics.joint_space import terms

    robot, _ = small
    q, qd, _ = (jnp.asarray(x) for x in random_state(robot.n, 8))
    ahead = plan(robot)

    @jax.jit
    def matrices(q, qd):
        M, C, g = terms(chain(robot, ahead), list(q), list(qd))
        return jnp.array(M), jnp.array(C), jnp.array(g)

    M, C, g = matrices(q, qd)
    close(M + np.diag(robot.armature), dynamics.mass_matrix(robot, q))
    close(C, dynamics.coriolis_matrix(robot, q, qd))
    close(g, dynamics.gravity_torque(robot, q))


@settings(max_examples=3, deadline=None)
@given(st.integers(2, 5), st.integers(0, 10**6))
def test_dynamics_of_any_tree_agree_with_mujoco(n, seed):
    model = oracle.oracle_model(tree_xml(random_parents(np.random.default_rng(seed), n), seed))
    robot = robot_from_model(model)
    given = random_state(n, seed)
    q, qd, qdd = (jnp.asarray(x) for x in given)
    tau = oracle.inverse_dynamics(model, *given)
    with jax.disable_jit():  # each tree would be compiled anew
        close(dynamics.mass_matrix(robot, q), oracle.mass_matrix(model, given[0]))
        bias = dynamics.coriolis_matrix(robot, q, qd) @ qd + dynamics.gravity_torque(robot, q)
        close(bias, oracle.bias(model, *given[:2]))
        close(dynamics.inverse_dynamics(robot, q, qd, qdd), tau)
        rest = robot.armature * qdd + robot.damping * qd + robot.stiffness * (q - robot.springref)
        close(dynamics.regressor(robot, q, qd, qdd) @ robot.phi.ravel() + rest, tau)


# ---------------------------------------------------------------- written, cut, stored


def test_a_tree_written_as_mjcf_is_read_as_it_was(case, tmp_path):
    robot, _ = case
    (tmp_path / "tree.xml").write_text(mjcf(robot))
    again = load_robot(tmp_path / "tree.xml")
    assert again.joint_names == robot.joint_names and again.parent == robot.parent
    for field in ("rotation", "position", "axis", "mass", "com", "inertia", "gravity", "tool_position"):
        close(getattr(again, field), getattr(robot, field))


def test_first_joints_of_a_tree_carry_the_rest_as_mujoco_says(case):
    robot, model = case
    count = robot.n - 2
    cut = first_joints(robot, count)
    q, qd, qdd = random_state(robot.n, 9)
    q[count:], qd[count:], qdd[count:] = model.qpos0[count:], 0.0, 0.0
    ours = dynamics.inverse_dynamics(cut, *(jnp.asarray(x[:count]) for x in (q, qd, qdd)))
    close(ours, oracle.inverse_dynamics(model, q, qd, qdd)[:count])


def test_any_choice_of_a_trees_joints_moves_as_mujoco_says_with_the_others_held(case):
    robot, model = case
    keep = np.arange(1, robot.n, 2)
    q, qd, qdd = random_state(robot.n, 4)
    still = np.delete(np.arange(robot.n), keep)
    qd[still], qdd[still] = 0.0, 0.0
    cut = subset(robot, keep.tolist(), jnp.asarray(q))
    ours = dynamics.inverse_dynamics(cut, *(jnp.asarray(x[keep]) for x in (q, qd, qdd)))
    close(ours, oracle.inverse_dynamics(model, q, qd, qdd)[keep])


def test_denavit_hartenberg_table_is_of_a_chain_only(case):
    with pytest.raises(RobotError, match="branches"):
        kinematics.dh_of(case[0])
