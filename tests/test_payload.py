"""A body held at the tool: its torque is MuJoCo's, and little of it is told from links that are heavier than stated."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import KINDS, random_robot, random_robot_xml
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import dynamics
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch import diagnose
from irb140_jax.oracle.mujoco import inverse_dynamics, oracle_model
from irb140_jax.recordings.conceal import Concealment, conceal
from irb140_jax.recordings.conceal import random_robot as plant
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import about_origin, robot_from_model

PAYLOAD = CATALOGUE["payload"]


def of_points(masses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Inertial parameters of point masses about the origin of their coordinates."""
    inertia = np.zeros((3, 3))
    for m, p in zip(masses, points, strict=True):
        inertia += m * (p @ p * np.eye(3) - np.outer(p, p))
    return np.concatenate([[masses.sum()], masses @ points, inertia[np.triu_indices(3)]])


@given(st.integers(0, 10**6), st.integers(1, 5))
@settings(max_examples=30, deadline=None)
def test_inertial_parameters_of_points_are_moved_to_another_origin(seed, count):
    rng = np.random.default_rng(seed)
    masses, points, point = rng.uniform(0.1, 3.0, count), rng.normal(size=(count, 3)), rng.normal(size=3)
    moved = np.asarray(about_origin(jnp.asarray(point))) @ of_points(masses, points - point)
    np.testing.assert_allclose(moved, of_points(masses, points), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kinds", KINDS)
def test_a_held_ball_weighs_as_in_mujoco(kinds):
    rng = np.random.default_rng(len(kinds))
    robot, bare = random_robot(kinds, 3)
    mass, off = 0.7, rng.uniform(-0.1, 0.1, 3)
    spec = mujoco.MjSpec.from_string(random_robot_xml(3, len(kinds), kinds=kinds))
    tool = spec.site("tool")
    ball = tool.parent.add_body(pos=tool.pos, quat=tool.quat)
    ball.mass, ball.inertia, ball.explicitinertial = mass, 1e-12 * np.ones(3), True
    ball.ipos = np.asarray(robot.tool_rotation).T @ off  # `off` is in axes of the last link
    w, shape = PAYLOAD.law.amplitudes({"mass": mass, **dict(zip("xyz", off, strict=True))})
    assert PAYLOAD.export.in_model
    heavier = PAYLOAD.export.in_model(robot, tuple(range(robot.n)), w, shape)
    moving = rng.normal(size=(3, robot.n))
    more = [inverse_dynamics(m, *moving) for m in (oracle_model(spec.compile()), bare)]
    ours = [dynamics.inverse_dynamics(r, *map(jnp.asarray, moving)) for r in (heavier, robot)]
    np.testing.assert_allclose(ours[0] - ours[1], more[0] - more[1], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("share", [0.06, 0.5])  # of the torque: hardly more than the links' errors, and far more
def test_a_payload_is_told_from_heavier_links(share):
    xml = plant(2, 4, slides=0.0)
    robot = robot_from_model(arm_spec(xml).compile(), "random")
    case = conceal(xml, [Concealment("payload", (), share)], three_motions(robot, 10.0, 500.0, seed=2), seed=3)
    (finding,) = diagnose(robot, case.recordings).diagnosis.to_json()["findings"]
    assert finding["effect"] == "payload"
    mass, true = finding["parameters"]["mass"], case.truth["effects"][0]["parameters"]["mass"]["value"]
    assert abs(mass["value"] - true) < min(3.0 * mass["std"], 0.25 * true)
