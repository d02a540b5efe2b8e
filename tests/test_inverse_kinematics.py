"""Back from the tool's pose to the joints, near singular poses too; and where those poses are."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import random_robot, shipped_robot

from irb140_jax import kinematics
from irb140_jax.errors import RobotError

ROBOT, _ = shipped_robot()
POSES = 300
# Poses go through some 10 rotations of numbers below 1 there, and some 10 back.
ROUND_OFF = 1e-13

tool_pose = jax.jit(jax.vmap(kinematics.forward_kinematics, in_axes=(None, 0)))
solutions = jax.jit(jax.vmap(lambda T, near: kinematics.wrist_solutions(ROBOT, T, near)))


@partial(jax.jit, static_argnames=("orientation", "limits"))
def searched(robot, T, start, orientation=True, limits=False):
    """Damped least squares for many poses."""
    search = partial(kinematics.damped_least_squares, orientation=orientation, limits=limits)
    return jax.vmap(search, in_axes=(None, 0, 0))(robot, T, start)


def postures(seed: int) -> jnp.ndarray:
    """Joint positions anywhere within the limits."""
    rng = np.random.default_rng(seed)
    return jnp.asarray(rng.uniform(ROBOT.lower, ROBOT.upper, (POSES, 6)))


def distances(q, found) -> np.ndarray:
    """Largest difference of an angle to the nearest branch, for every pose."""
    apart = np.abs(np.asarray(found.q) - np.asarray(q)[:, None]).max(axis=2)
    return np.where(found.allowed, apart, np.inf).min(axis=1)


def test_one_of_the_branches_is_the_posture_that_made_the_pose():
    q = postures(0)
    found = solutions(tool_pose(ROBOT, q), q)
    # Angles lose the digits that the condition number takes, some 1e4 at the worst of these postures.
    assert distances(q, found).max() < 1e-9


def test_every_branch_that_counts_as_reachable_takes_the_tool_to_the_pose():
    q = postures(1)
    T = tool_pose(ROBOT, q)
    found = solutions(T, q)
    back = tool_pose(ROBOT, found.q.reshape(-1, 6)).reshape(POSES, 8, 4, 4)
    error = np.abs(back - T[:, None]).max(axis=(2, 3))
    reachable = np.asarray(found.reachable)
    assert error[reachable].max() < 1e-12
    assert reachable[:, :4].all() and 0.3 < reachable.mean() < 1.0  # the front always, the back not everywhere


def test_branches_within_the_limits_are_within_the_limits():
    found = solutions(tool_pose(ROBOT, postures(2)), postures(2))
    q = np.asarray(found.q)[np.asarray(found.allowed)]
    assert len(q) > POSES
    assert (q >= ROBOT.lower - 1e-9).all() and (q <= ROBOT.upper + 1e-9).all()


@pytest.mark.parametrize("bend", [0.0, 1e-14, 1e-12, 1e-8, 1e-4])
def test_a_wrist_as_good_as_straight_keeps_its_pose_and_its_posture(bend):
    q = postures(3).at[:, 4].set(bend)
    T = tool_pose(ROBOT, q)
    found = solutions(T, q)
    best = found.q[np.arange(POSES), np.abs(found.q - q[:, None]).max(axis=2).argmin(axis=1)]
    assert np.allclose(tool_pose(ROBOT, best), T, atol=10 * ROUND_OFF)
    # Only q4 + q6 shows in the pose, and each by itself to round-off over the bend; at none, q4 is the hint.
    assert np.allclose(best[:, 3] + best[:, 5], q[:, 3] + q[:, 5], atol=1e-7)
    if bend == 0.0 or bend > 1e-9:
        assert np.allclose(best, q, atol=max(1e-7, ROUND_OFF / max(bend, 1e-7)))


@pytest.mark.parametrize("short", [0.0, 1e-6, 1e-3])
def test_an_arm_as_good_as_stretched_keeps_its_pose(short):
    q = postures(4).at[:, 2].set(-np.pi / 2 + short)
    T = tool_pose(ROBOT, q)
    found = solutions(T, q)
    best = found.q[np.arange(POSES), np.abs(found.q - q[:, None]).max(axis=2).argmin(axis=1)]
    # The reach varies with the square of what the elbow lacks: half the digits of q3 and the pose alike.
    assert np.allclose(tool_pose(ROBOT, best), T, atol=1e-7)
    assert np.allclose(best, q, atol=3e-7)


def test_a_pose_out_of_reach_has_no_reachable_branch():
    T = tool_pose(ROBOT, postures(5)).at[:, :3, 3].multiply(5.0)
    far = np.linalg.norm(T[:, :3, 3], axis=1) > 2.0
    assert far.any() and not np.asarray(solutions(T, postures(5)).reachable)[far].any()


def test_the_nearest_solution_is_the_posture_itself():
    q = postures(6)[0]
    found, exists = kinematics.nearest_solution(ROBOT, kinematics.forward_kinematics(ROBOT, q), q + 0.01)
    assert exists and np.allclose(found, q, atol=1e-10)


def test_closed_form_refuses_an_arm_of_another_build():
    other, _ = random_robot("HHSHHH", 1)
    with pytest.raises(RobotError, match="damped_least_squares"):
        kinematics.wrist_solutions(other, jnp.eye(4))


def test_damped_least_squares_reaches_what_the_closed_form_reaches():
    q = postures(7)
    T = tool_pose(ROBOT, q)
    start = q + 0.5 * jnp.asarray(np.random.default_rng(7).normal(size=q.shape))
    found = searched(ROBOT, T, start)
    assert np.mean(found.converged) > 0.98  # a few of 300 starts may end in a local minimum
    converged = np.asarray(found.converged)
    assert np.allclose(tool_pose(ROBOT, found.q)[converged], T[converged], atol=1e-9)


def test_damped_least_squares_reaches_singular_poses():
    q = postures(8).at[:100, 4].set(0.0).at[100:200, 2].set(-np.pi / 2)
    T = tool_pose(ROBOT, q)
    found = searched(ROBOT, T, q + 0.2)
    assert np.mean(found.error < 1e-6) > 0.98


def test_damped_least_squares_stays_within_limits_when_asked():
    q = postures(9)
    found = searched(ROBOT, tool_pose(ROBOT, q), q, limits=True)
    assert np.all(found.converged)
    pushed = searched(ROBOT, tool_pose(ROBOT, q) + jnp.zeros((4, 4)).at[0, 3].set(3.0), q, limits=True)
    assert not np.any(pushed.converged)
    assert np.all(pushed.q >= ROBOT.lower) and np.all(pushed.q <= ROBOT.upper)


@pytest.mark.parametrize("kinds", ["SHS", "HHSHHH"])
def test_damped_least_squares_serves_any_arm(kinds):
    robot, _ = random_robot(kinds, 5)
    rng = np.random.default_rng(5)
    q = jnp.asarray(rng.uniform(-1, 1, (50, robot.n)))
    T = tool_pose(robot, q)
    found = searched(robot, T, q + 0.3, orientation=robot.n == 6)
    assert np.mean(found.converged) > 0.95
    ok = np.asarray(found.converged)
    assert np.allclose(tool_pose(robot, found.q)[ok][:, :3, 3], T[ok][:, :3, 3], atol=1e-9)


def test_rotation_vectors_hold_from_none_to_half_a_turn():
    rng = np.random.default_rng(0)
    for angle in (0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-7):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        R = kinematics.axis_rotation(jnp.asarray(axis), jnp.asarray(angle))
        assert np.allclose(kinematics.rotation_vector(R), angle * axis, atol=1e-14)


def test_singularity_map_finds_the_stretched_elbow():
    bent = jnp.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    found = kinematics.singularity_map(ROBOT, bent, points=(21, 57))
    at = np.argmin(np.abs(found.second + np.pi / 2))
    assert found.condition_number.shape == (21, 57)
    # -90 deg lies on the grid of 5 deg from -230 to 50 deg: stretched, so that one direction is lost.
    assert np.all(found.smallest[:, at] < 1e-12)
    assert np.all(found.condition_number[:, at] > 1e10) and np.min(found.condition_number) < 100.0


def test_singularity_map_agrees_with_the_condition_number_of_its_postures():
    bent = jnp.array([0.3, 0.0, 0.0, 0.2, 1.0, 0.0])
    found = kinematics.singularity_map(ROBOT, bent, points=(3, 4))
    q = bent.at[1].set(found.first[1]).at[2].set(found.second[2])
    assert np.isclose(found.condition_number[1, 2], kinematics.condition_number(ROBOT, q), rtol=1e-9)
    assert np.allclose(found.tool[1, 2], kinematics.forward_kinematics(ROBOT, q)[:3, 3], atol=ROUND_OFF)
