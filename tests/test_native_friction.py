"""Friction, damping and rotors as MuJoCo has them, on arms and in a loop that are not ours."""

import pytest
from helpers_native import PENDULUM, SCARA, named


def test_what_mujoco_itself_calls_friction_damping_and_armature_is_named():
    def hide(true):
        true.dof_frictionloss[0], true.dof_damping[2] = 0.2, 25.0
        true.dof_armature[1] += 0.04

    friction = {("coulomb_friction", "shoulder"): 0.2, ("viscous_friction", "lift"): 25.0}
    hidden = friction | {("rotor_inertia", "elbow"): 0.04}
    assert named(SCARA, hide, 0) == pytest.approx(hidden, rel=0.03)


@pytest.mark.parametrize("seed", [0, 1])
def test_friction_that_mujoco_turns_over_early_is_no_delay(seed):
    def hide(true):
        true.dof_frictionloss[0] = 1.0

    assert named(PENDULUM, hide, seed) == pytest.approx({("coulomb_friction", "swing"): 1.0}, rel=0.01)


@pytest.mark.parametrize("friction", [1.5, 4.0])
def test_friction_under_which_mujoco_lets_a_slide_creep_is_no_stribeck(friction):
    def hide(true):
        true.dof_frictionloss[2], true.dof_damping[2] = friction, 8.0

    hidden = {("coulomb_friction", "lift"): friction, ("viscous_friction", "lift"): 8.0}
    assert named(SCARA, hide, 0) == pytest.approx(hidden, rel=0.03)


def test_what_a_gear_rubs_without_load_is_told_from_what_it_rubs_by_load():
    def under(true, load):
        true.dof_frictionloss[2] = 1.0 + 0.15 * abs(load[2])  # of a load that the motion changes by a tenth

    found = named(SCARA, lambda _: None, 0, under=under)
    assert found == pytest.approx({("load_dependent_friction", "lift"): 0.15}, rel=0.1)
