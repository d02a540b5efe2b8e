"""The oracles themselves: MuJoCo and MJX agree with each other and with ours, and refuse what they would get wrong."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import random_robot, random_robot_xml, random_state, shipped_robot

from irb140_jax import dynamics, kinematics
from irb140_jax.errors import RobotError
from irb140_jax.oracle import mujoco as oracle
from irb140_jax.robot import robot_from_model


@pytest.fixture(scope="session")
def mjx_opinion():
    """M, bias, tau and tool pose of the IRB 140 by MJX and by ours, at one state.  Compiled once: it takes 10 s."""
    from irb140_jax.oracle import mjx

    robot, model = shipped_robot()
    state = [jnp.asarray(x) for x in random_state(6, 11)]

    @jax.jit
    def opinion(model, q, qd, qdd):
        return (
            mjx.mass_matrix(model, q),
            mjx.bias(model, q, qd),
            mjx.inverse_dynamics(model, q, qd, qdd),
            mjx.forward_kinematics(model, q),
        )

    return robot, model, state, opinion(mjx.oracle_model(model), *state)


def test_mjx_agrees_with_mujoco(mjx_opinion):
    _, model, state, (M, bias, tau, T) = mjx_opinion
    q, qd, qdd = (np.asarray(x) for x in state)
    # The same algorithms in double precision: some tens of roundings of numbers up to 100.
    assert np.allclose(M, oracle.mass_matrix(model, q), atol=1e-12)
    assert np.allclose(bias, oracle.bias(model, q, qd), atol=1e-12)
    assert np.allclose(tau, oracle.inverse_dynamics(model, q, qd, qdd), atol=1e-12)
    assert np.allclose(T, oracle.forward_kinematics(model, q), atol=1e-14)


def test_ours_agrees_with_mjx(mjx_opinion):
    robot, _, (q, qd, qdd), (M, bias, tau, T) = mjx_opinion
    ours = dynamics.coriolis_matrix(robot, q, qd) @ qd + dynamics.gravity_torque(robot, q)
    # Other algorithms, other order of sums: numbers up to 100 with a few hundred roundings.
    assert np.allclose(dynamics.mass_matrix(robot, q), M, atol=1e-11)
    assert np.allclose(ours, bias, atol=1e-11)
    assert np.allclose(dynamics.inverse_dynamics(robot, q, qd, qdd), tau, atol=1e-11)
    assert np.allclose(kinematics.forward_kinematics(robot, q), T, atol=1e-13)


def test_the_tool_that_no_site_marks_is_the_last_centre_of_mass():
    from irb140_jax.oracle import mjx

    arm = '<mujoco><worldbody><body><joint name="a"/><geom size=".1" pos="0 .1 .3"/></body></worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(arm)
    robot, at, q = robot_from_model(model), np.array([0.7]), jnp.array([0.7])
    T = oracle.forward_kinematics(model, at)
    assert np.allclose(kinematics.forward_kinematics(robot, q), T, atol=1e-13)
    assert np.allclose(jax.jit(mjx.forward_kinematics)(mjx.oracle_model(model), q), T, atol=1e-13)
    assert np.allclose(kinematics.jacobian(robot, q), oracle.jacobian(model, at), atol=1e-13)


@pytest.mark.parametrize(
    ("joint", "actuator", "what"),
    [
        ("", 'delay="0.01" nsample="5"', "actuator delay"),
        ('damping="1 0.5"', "", "polynomial joint damping"),
        ('stiffness="1 0.5"', "", "polynomial joint stiffness"),
        ("", 'armature="0.1"', "actuator armature"),
        ("", 'damping="0.1"', "actuator damping"),
    ],
)
def test_mjx_oracle_refuses_what_mjx_ignores(joint, actuator, what):
    from irb140_jax.oracle import mjx

    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/>
        <joint name="a" axis="1 0 0" {joint}/></body></worldbody>
        <actuator><motor joint="a" {actuator}/></actuator></mujoco>"""
    )
    with pytest.raises(RobotError, match=what):
        mjx.oracle_model(model)


def test_oracle_leaves_the_given_model_alone():
    model = mujoco.MjModel.from_xml_string(random_robot_xml(1, 2))
    before = model.opt.disableflags
    assert oracle.oracle_model(model).opt.disableflags != before
    assert model.opt.disableflags == before


def test_oracle_leaves_dry_friction_out():
    _, model = random_robot("SHS", 3)
    q, qd, qdd = random_state(3, 3)
    tau = oracle.inverse_dynamics(model, q, qd, qdd)
    rest = oracle.mass_matrix(model, q) @ qdd + oracle.bias(model, q, qd) + oracle.passive(model, q, qd)
    assert model.dof_frictionloss.min() > 0.0
    assert np.allclose(tau, rest, atol=1e-12)


def test_oracles_forward_dynamics_undoes_its_inverse_dynamics():
    _, model = random_robot("SHS", 3)
    q, qd, qdd = random_state(3, 3)
    tau = oracle.inverse_dynamics(model, q, qd, qdd)
    # M of this robot has a condition number below 1e3.
    assert np.allclose(oracle.forward_dynamics(model, q, qd, tau), qdd, atol=1e-11)
