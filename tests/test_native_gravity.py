"""Leaning gravity and heavier links as MuJoCo has them, where wrong inertials could stand for them."""

import mujoco
import numpy as np
import pytest
from helpers_native import CYLINDRICAL, LIFT_AND_TURN, PENDULUM, SCARA, TWO_LINKS, named, recorded

from irb140_jax.mismatch import diagnose
from irb140_jax.robot import robot_from_model


@pytest.mark.parametrize("seed", [0, 1])
def test_gravity_that_leans_on_links_known_roughly_comes_without_a_spring(seed):
    def hide(true):
        true.opt.gravity[:] = 9.81 * np.array([0.06, -0.06, -1.0])
        true.body_ipos[1, :2] += [-0.015, 0.02]

    # Nothing but leaning gravity shows where the first link's mass is.
    expected = {("gravity_tilt", "turn", "reach"): 0.06 * np.sqrt(2.0)}
    assert named(CYLINDRICAL, hide, seed) == pytest.approx(expected, rel=0.02)


def test_a_tilt_stays_where_nothing_else_shows_where_the_mass_is():
    def hide(true):
        true.opt.gravity[:] = 9.81 * np.array([0.04, 0.03, -1.0])
        true.dof_frictionloss[1] = 0.1

    expected = {("gravity_tilt", "rise", "turn"): 0.05, ("coulomb_friction", "turn"): 0.1}
    assert named(LIFT_AND_TURN, hide, 0) == pytest.approx(expected, rel=0.06)  # known no better than the inertials


def test_a_rotor_that_only_impossible_inertials_could_stand_for_is_named():
    def hide(true):
        true.dof_armature[0] += 0.25  # the link has 0.35 about the joint, known to 5 %

    assert named(PENDULUM, hide, 0) == pytest.approx({("rotor_inertia", "swing"): 0.25}, rel=0.15)


def test_a_payload_that_only_a_far_heavier_link_could_stand_for_is_named():
    def hide(true):
        true.body_mass[-1] *= 1.8

    assert named(SCARA, hide, 0) == pytest.approx({("payload", "shoulder", "elbow", "lift"): 0.8 * 1.06}, rel=0.15)


def test_a_tilt_that_one_joint_shows_a_part_of_is_not_known_by_its_size():
    def hide(true):
        true.opt.gravity[:] = 9.81 * np.array([0.05, 0.12, -1.0])  # the second along the joint's axis
        true.dof_frictionloss[0] = 0.3

    rng, robot = np.random.default_rng(0), robot_from_model(mujoco.MjModel.from_xml_string(TWO_LINKS), source="native")
    found = diagnose(robot, [recorded(TWO_LINKS, hide, rng) for _ in range(2)]).diagnosis.to_json()["findings"]
    tilt = next(f["parameters"]["tilt"] for f in found if f["effect"] == "gravity_tilt")
    assert abs(tilt["value"] - 0.13) < 1.645 * tilt["std"] < 0.3
