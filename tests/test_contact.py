"""A wall felt by an arm that moves in a plane: what of it is known, and what is not."""

import dataclasses

import numpy as np
import pytest

from irb140_jax.effects import Scales, external_wrench
from irb140_jax.effects.contact import _alike, _around, _finer, _gain, _peak, _proposal, _wall
from irb140_jax.effects.left_over import LeftOver

ACROSS = np.array([0.6, 0.0, 0.8])  # the arm moves in the plane across it
STIFFNESS = 800.0
NONE = np.zeros(2)
SCALES = Scales(NONE, NONE, NONE, NONE, NONE, 9.0, NONE, NONE)  # a wall asks for none of them


def path(seed: int, rows: int = 900) -> tuple[np.ndarray, np.ndarray]:
    """Tool (rows, 3) of a two-link arm in a plane that is off the origin, and its Jacobian (rows, 2, 3)."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 9.0, rows)
    q1, q2 = (np.sin(t * rng.uniform(0.8, 2.0) + rng.uniform(0, 6)) for _ in range(2))
    x, y = np.array([0.8, 0.0, -0.6]), np.array([0.0, 1.0, 0.0])
    along = lambda a: np.outer(np.cos(a), x) + np.outer(np.sin(a), y)  # noqa: E731
    turned = lambda a: np.outer(-np.sin(a), x) + np.outer(np.cos(a), y)  # noqa: E731
    tool = 0.3 * ACROSS + 0.4 * along(q1) + 0.3 * along(q1 + q2)
    second = 0.3 * turned(q1 + q2)
    velocities = np.stack([0.4 * turned(q1) + second, second], axis=1)
    return tool, np.concatenate([velocities, np.broadcast_to(ACROSS, velocities.shape)], axis=2)


def left_over(seed: int, normal: np.ndarray) -> tuple[LeftOver, np.ndarray]:
    """A wall across this direction, touched in a sixth of the rows, with some noise; and its shape."""
    tool, jacobian = path(seed)
    shape = np.append(normal, np.quantile(tool @ normal, 1 / 6))
    y = STIFFNESS * _wall(tool, jacobian, shape, np)
    y += 1e-3 * np.std(y) * np.random.default_rng(seed + 1).normal(size=y.shape)
    zero, weight = np.zeros(len(tool)), np.full(y.shape, 1e3 / np.std(y))
    return LeftOver(
        zero.astype(int), np.linspace(0.0, 9.0, len(tool)), np.zeros_like(y), tool, jacobian, weight, y * weight,
        np.ones((*y.shape, 1)),
    ), shape  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_a_wall_is_sought_where_the_arm_moves_and_tilted_only_there(seed):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    left, wall = left_over(seed, normal / np.linalg.norm(normal))
    grid = _proposal(left, SCALES, np.arange(2))
    assert grid is not None
    np.testing.assert_allclose(grid[:, :3] @ ACROSS, 0.0, atol=1e-9)
    flat = wall[:3] - ACROSS * (ACROSS @ wall[:3])
    size = np.linalg.norm(flat)
    assert grid[0, :3] @ flat / size > np.cos(0.02)
    assert grid[0, 3] == pytest.approx((wall[3] - 0.3 * (ACROSS @ wall[:3])) / size, abs=5e-3)
    rim = 1 + np.argmax(np.abs(grid[1:5] - grid[0]).sum(axis=1))
    moved, kept = _finer(grid, grid[rim]), _finer(grid, grid[0])
    width = lambda g: np.ptp(g[1:5, :3], axis=0).max()  # noqa: E731
    assert width(kept) == pytest.approx(0.5 * width(grid), rel=0.01)
    # Where the best is at the rim, the next grid goes on from there as wide as before, and not out of the plane.
    assert width(moved) == pytest.approx(width(grid), rel=0.03)
    np.testing.assert_allclose(moved[:, :3] @ ACROSS, 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_a_wall_is_turned_about_the_place_of_contact(seed):
    left, _ = left_over(seed, np.array([0.0, 1.0, 0.0]))
    grid = _proposal(left, SCALES, np.arange(2))
    assert grid is not None
    depth = np.maximum(grid[:, 3] - left.tool @ grid[:, :3].T, 0.0)
    # To first order a turn makes the wall deeper on one side and less deep on the other, by as much.
    np.testing.assert_allclose(depth[:, 1:5].sum(axis=0), depth[:, 0].sum(), rtol=0.01)
    assert depth[:, 5].sum() > 1.02 * depth[:, 0].sum()


@pytest.mark.parametrize("seed", range(4))
def test_walls_that_are_alike_push_alike(seed):
    normal = np.array([0.0, 1.0, 0.0])
    left, wall = left_over(seed, normal)
    alike = _alike(left, np.array([STIFFNESS]), wall)
    assert len(alike) == 2 and not np.allclose(alike[0], alike[1])
    pushed = STIFFNESS * _wall(left.tool, left.tool_jacobian, wall, np)
    for stiffness, *shape in alike:
        assert np.linalg.norm(shape[:3]) == pytest.approx(1.0)
        other = stiffness * _wall(left.tool, left.tool_jacobian, np.array(shape), np)
        np.testing.assert_allclose(other, pushed, atol=1e-9 * np.abs(pushed).max())


@pytest.mark.parametrize("seed", range(4))
def test_forces_that_are_alike_move_no_joint_otherwise_and_only_where_there_are_such(seed):
    shape, rng = np.array([1.0, 3.0, 1.0, 0.02]), np.random.default_rng(seed)
    w = rng.normal(size=6)
    left, _ = left_over(seed, np.array([0.0, 1.0, 0.0]))
    alike = external_wrench._alike(left, w, shape)
    assert alike.shape == (6, 10)  # a force across the plane and moments about two axes in it, either way
    np.testing.assert_allclose(np.delete(alike, range(3, 9), axis=1), np.tile(shape, (6, 1)))
    others = alike[:, 3:9] / external_wrench.LEVERS - w
    np.testing.assert_allclose(left.tool_jacobian @ others.T, 0.0, atol=1e-9)
    # As strong as the push.
    strong = np.linalg.norm(np.where(np.arange(6) < 3, others, 0.0), axis=1)
    np.testing.assert_allclose(np.sort(strong), np.append(np.zeros(4), [np.linalg.norm(w[:3])] * 2), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(others, axis=1).max(), max(np.linalg.norm(w[:3]), np.linalg.norm(w[3:])))
    turned = dataclasses.replace(left, tool_jacobian=rng.normal(size=left.tool_jacobian.shape))
    assert external_wrench._alike(turned, w, shape).shape == (0, 10)


@pytest.mark.parametrize("seed", range(4))
def test_the_top_of_a_grid_is_nearer_to_the_wall_than_its_points(seed):
    left, wall = left_over(seed, np.array([0.0, 1.0, 0.0]))
    turn, shift = np.array([[1.0, 0.0, 0.0, left.tool[:, 0].mean()], np.zeros(4)]), 2e-3
    off = wall + 2e-3 * turn[0] + [0.0, 0.0, 0.0, 1e-3]
    off[:3] /= np.linalg.norm(off[:3])
    grid = _around(off, turn, 5e-3, shift)
    odds = np.array([_gain(left, point[None])[0] for point in grid])
    top = _peak(grid, grid[0], odds)
    assert _gain(left, top[None])[0] > odds.max()
    inadmissible = np.where(np.arange(len(grid)) == 5, -np.inf, odds)
    np.testing.assert_array_equal(_peak(grid, grid[0], inadmissible), grid[0])
