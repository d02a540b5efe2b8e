"""The Denavit-Hartenberg table of any robot, from its joint axes."""

import jax
import numpy as np
import pytest

from irb140_jax import kinematics
from irb140_jax.recordings.conceal import random_robot
from irb140_jax.robot import irb140, load_robot


def test_the_irb_140_has_the_published_table():
    table = kinematics.dh_of(irb140()).table
    for name in ("offset", "d", "a", "alpha"):
        # The file gives lengths in mm and angles exactly: round-off only.
        np.testing.assert_allclose(getattr(table, name), getattr(kinematics.IRB140_DH, name), atol=1e-9)


@pytest.mark.parametrize("n", [1, 3, 5, 7])
def test_the_table_of_a_random_robot_takes_the_tool_where_the_robot_does(n, tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(random_robot(n, n, slides=0.4))
    robot = load_robot(path)
    view = kinematics.dh_of(robot)
    q = np.random.default_rng(n).uniform(-2.0, 2.0, size=(20, n))
    ours = jax.vmap(lambda q: view.T_world_first @ kinematics.dh_forward(view.table, q) @ view.T_last_tool)(q)
    direct = jax.vmap(lambda q: kinematics.forward_kinematics(robot, q))(q)
    np.testing.assert_allclose(ours, direct, atol=1e-12)  # n products of rotations in float64
