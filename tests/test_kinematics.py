"""Where the arm is and how it moves: DH against the chain, the chain against MuJoCo, Jacobians against derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import KINDS, random_robot, random_state, shipped_robot
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import kinematics
from irb140_jax.oracle import mujoco as oracle

# Lengths of at most a few metres through at most 12 rotations in double precision: 1e-15 times a few tens.
TOLERANCE = 1e-13

kinds = st.sampled_from(KINDS)
seeds = st.integers(0, 2**31)

forward_kinematics = jax.jit(kinematics.forward_kinematics)
jacobian = jax.jit(kinematics.jacobian)
pose_and_slope = jax.jit(
    lambda robot, q: (
        kinematics.forward_kinematics(robot, q),
        jax.jacfwd(lambda q: kinematics.forward_kinematics(robot, q))(q),
    )
)


def test_dh_table_gives_the_pose_of_the_makers_simulator():
    q = jnp.radians(jnp.array([52.8, -2.0, 10.0, 13.0, 56.0, 28.0]))
    end = kinematics.dh_forward(kinematics.IRB140_DH, q)[:3, 3]
    # RobotStudio's TCP in mm, printed to 1e-5.
    assert np.allclose(1e3 * end, [269.92581, 375.66383, 601.84100], atol=2e-5)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=seeds)
def test_closed_form_of_the_end_point_equals_the_product_of_dh_transforms(seed):
    q = jnp.asarray(random_state(6, seed)[0])
    assert np.allclose(
        kinematics.irb140_end_point(q), kinematics.dh_forward(kinematics.IRB140_DH, q)[:3, 3], atol=TOLERANCE
    )


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=seeds)
def test_dh_table_and_model_file_describe_the_same_arm(seed):
    robot, _ = shipped_robot()
    q = jnp.asarray(random_state(6, seed)[0])
    T_dh, T = kinematics.dh_forward(kinematics.IRB140_DH, q), forward_kinematics(robot, q)
    # The last DH frame has z along the approach, the model's x: a constant rotation apart.
    T_tool_dh = np.eye(4)
    T_tool_dh[:3, :3] = [[0, 0, 1], [0, -1, 0], [1, 0, 0]]
    assert np.allclose(T @ T_tool_dh, T_dh, atol=TOLERANCE)


def test_shipped_robot_stands_where_its_data_sheet_says():
    robot, _ = shipped_robot()
    T = forward_kinematics(robot, jnp.zeros(6))
    # Flange in front of the arm: 70 + 380 + 65 mm out, 352 + 360 mm up, axes parallel to the base's.
    assert np.allclose(T, [[1, 0, 0, 0.515], [0, 1, 0, 0], [0, 0, 1, 0.712], [0, 0, 0, 1]], atol=TOLERANCE)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(kinds=kinds, seed=seeds)
def test_tool_pose_of_any_chain_equals_mujocos(kinds, seed):
    robot, model = random_robot(kinds, seed)
    q, *_ = random_state(robot.n, seed)
    T = forward_kinematics(robot, jnp.asarray(q))
    assert np.allclose(T, oracle.forward_kinematics(model, q), atol=10 * TOLERANCE)


def test_last_link_pose_and_tool_make_the_tool_pose():
    robot, _ = random_robot("HHSHHH", 1)
    q = jnp.asarray(random_state(6, 1)[0])
    T = kinematics.link_poses(robot, q)[-1] @ kinematics.pose(robot.tool_rotation, robot.tool_position)
    assert np.allclose(T, forward_kinematics(robot, q), atol=TOLERANCE)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(kinds=kinds, seed=seeds)
def test_jacobian_of_any_chain_equals_mujocos(kinds, seed):
    robot, model = random_robot(kinds, seed)
    q, *_ = random_state(robot.n, seed)
    assert np.allclose(jacobian(robot, jnp.asarray(q)), oracle.jacobian(model, q), atol=10 * TOLERANCE)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(kinds=kinds, seed=seeds)
def test_jacobian_is_the_derivative_of_the_tool_pose(kinds, seed):
    robot, _ = random_robot(kinds, seed)
    q = jnp.asarray(random_state(robot.n, seed)[0])
    T, dT = pose_and_slope(robot, q)
    # Rd R^T = S(w): its three entries below and above the diagonal are the angular velocity.
    S = np.einsum("ijn,kj->nik", dT[:3, :3], T[:3, :3])
    angular = np.stack([S[:, 2, 1], S[:, 0, 2], S[:, 1, 0]])
    assert np.allclose(jacobian(robot, q), np.concatenate([dT[:3, 3], angular]), atol=10 * TOLERANCE)


@pytest.mark.parametrize("kinds", KINDS)
def test_link_jacobians_move_the_centres_of_mass(kinds):
    robot, _ = random_robot(kinds, 3)
    q = jnp.asarray(random_state(robot.n, 3)[0])
    slopes = jax.jit(jax.jacfwd(lambda q: kinematics.link_jacobians(robot, q).centre))(q)
    J = kinematics.link_jacobians(robot, q)
    assert np.allclose(jnp.swapaxes(J.linear, 1, 2), slopes, atol=10 * TOLERANCE)


def test_joint_velocities_move_the_tool_as_asked():
    robot, _ = shipped_robot()
    q = jnp.array([0.3, 0.4, -0.2, 0.7, 0.9, -0.5])
    twist = jnp.array([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
    qd = kinematics.joint_velocities(robot, q, twist)
    # The solution loses the condition number, some tens here, of the digits.
    assert np.allclose(jacobian(robot, q) @ qd, twist, atol=1e-12)


def test_joint_velocities_of_a_short_arm_come_as_near_as_it_can():
    robot, _ = random_robot("SHS", 2)
    q = jnp.asarray(random_state(3, 2)[0])
    J, twist = jacobian(robot, q), jnp.ones(6)
    # Least squares: what is left over is orthogonal to everything the arm can do.
    assert np.allclose(J.T @ (J @ kinematics.joint_velocities(robot, q, twist) - twist), 0.0, atol=1e-12)


def test_condition_number_is_the_product_of_norms_of_the_jacobian_and_its_inverse():
    robot, _ = shipped_robot()
    q = jnp.array([0.3, 0.4, -0.2, 0.7, 0.9, -0.5])
    J = np.asarray(jacobian(robot, q))
    kappa = np.linalg.norm(J, 2) * np.linalg.norm(np.linalg.inv(J), 2)
    assert np.isclose(kinematics.condition_number(robot, q), kappa, rtol=1e-10)


def test_condition_number_blows_up_where_wrist_axes_align():
    robot, _ = shipped_robot()
    stretched = jnp.array([0.3, 0.4, -0.2, 0.7, 0.0, -0.5])
    assert kinematics.condition_number(robot, stretched) > 1e12
