"""The joints named make the robot, all others are held: against MuJoCo's C engine with the whole model."""

import pathlib

import jax.numpy as jnp
import mujoco
import numpy as np
import pandas as pd
import pytest
from helpers import random_state
from helpers_trees import tree_xml

from irb140_jax import dynamics, kinematics
from irb140_jax.cli.robots import held_positions, recorded_robot
from irb140_jax.errors import InputError, RobotError
from irb140_jax.oracle import mujoco as oracle
from irb140_jax.robot import Robot, load_robot, movable_joints, robot_from_model
from irb140_jax.robot.inertia import is_lopsided, possible

TORSO = (-1, 0, 1, 0, 3)
ROUND_OFF = 1e-10  # as in test_trees


def read(tmp_path: pathlib.Path, text: str, name: str = "arm.xml", **asked) -> Robot:
    (tmp_path / name).write_text(text)
    return load_robot(tmp_path / name, **asked)


def assert_same_as_whole(robot: Robot, whole: mujoco.MjModel, held: dict[str, float]) -> None:
    """Torque, and where the tool is, as of the whole model with its other joints where they are held."""
    whole = oracle.oracle_model(whole)
    at = [whole.joint(name).id for name in robot.joint_names]
    state = random_state(robot.n, 3)
    q, qd, qdd = whole.qpos0.copy(), np.zeros(whole.nv), np.zeros(whole.nv)
    for name, value in held.items():
        q[whole.joint(name).id] = value
    q[at], qd[at], qdd[at] = state
    theirs = oracle.inverse_dynamics(whole, q, qd, qdd)[at]
    ours = dynamics.inverse_dynamics(robot, *(jnp.asarray(x) for x in state))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUND_OFF * max(1.0, np.abs(theirs).max()))


# ---------------------------------------------------------------- held joints


@pytest.mark.parametrize("joints", [("j1", "j3", "j4"), ("j0", "j2"), ("j4",)])
def test_torque_is_that_of_the_whole_model_with_the_others_held(joints):
    model = mujoco.MjModel.from_xml_string(tree_xml(TORSO, 5))
    hold = {"j1": 0.4, "j3": -0.7} if "j1" not in joints else {"j0": 0.9}
    hold = {name: value for name, value in hold.items() if name not in joints}
    robot = robot_from_model(model, joints=joints, hold=hold)
    assert set(robot.joint_names) == set(joints)
    assert_same_as_whole(robot, model, hold)


def test_a_joint_held_between_two_on_one_body_turns_the_second_ones_axis():
    text = """<mujoco><worldbody><body name="b"><inertial pos="0.1 0.2 0.3" mass="2" diaginertia="0.1 0.2 0.25"/>
    <joint name="a" axis="1 0 0"/><joint name="x" axis="0 1 0"/><joint name="c" axis="0 0.6 0.8" pos="0 .1 0"/>
    <joint name="y" axis="1 0 0" pos="0.1 0 0"/><site name="tool" pos="0 0 .2"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    hold = {"x": 0.7, "y": -0.4}
    robot = robot_from_model(model, joints=("a", "c"), hold=hold)
    assert_same_as_whole(robot, model, hold)
    q = np.array([0.3, 0.7, -0.9, -0.4])
    np.testing.assert_allclose(
        kinematics.forward_kinematics(robot, jnp.asarray(q[[0, 2]])), oracle.forward_kinematics(model, q), atol=1e-12
    )


def test_the_branch_of_the_joint_named_last_carries_the_tool():
    model = mujoco.MjModel.from_xml_string(tree_xml(TORSO, 5))
    robot = robot_from_model(model, joints=("j0", "j3", "j4", "j1", "j2"))
    assert robot.joint_names == ("j0", "j3", "j4", "j1", "j2") and robot.parent == (-1, 0, 1, 0, 3)
    assert any("last joint, 'j2'" in note for note in robot.notes)
    assert_same_as_whole(robot, model, {})


def test_what_is_held_and_where_is_noted():
    model = mujoco.MjModel.from_xml_string(tree_xml((-1, 0, 1), 5, "HHS"))
    robot = robot_from_model(model, joints=("j0",), hold={"j2": 0.25})
    assert robot.notes == (f"held still: 'j1' at {model.qpos0[1]:.4g} rad, 'j2' at 0.25 m",)


def test_a_joint_held_outside_its_limits_is_noted():
    text = tree_xml((-1, 0), 5).replace('<joint name="j1"', '<joint limited="true" range="1 2" name="j1"')
    robot = robot_from_model(mujoco.MjModel.from_xml_string(text), joints=("j0",), hold={"j1": 0.5})
    assert "'j1' at 0.5 rad (outside its limits 1 to 2)" in robot.notes[0]


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"joints": ("j0", "elbow")}, "no joint 'elbow'; its movable joints are 'j0', 'j1'"),
        ({"hold": {"elbow": 0.0}}, "no joint 'elbow'"),
        ({"hold": {"j0": float("nan")}}, "held at nan; give a number"),
        ({"joints": ("j0",), "hold": {"j0": 0.0}}, "no joint is left"),
    ],
)
def test_joints_that_are_not_there_are_refused(asked, says):
    model = mujoco.MjModel.from_xml_string(tree_xml((-1, 0), 5))
    with pytest.raises(RobotError, match=says):
        robot_from_model(model, **asked)


# ---------------------------------------------------------------- what touches the joints, and what does not

BALL = '<body name="ball"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="c" type="ball"/></body>'
LOOP = '<equality><connect body1="body2" body2="body1" anchor="0 0 0"/></equality>'
TENDON = '<tendon><fixed name="t" stiffness="9"><joint joint="j2" coef="1"/></fixed></tendon>'
PULLED = TENDON.replace(' stiffness="9"', "") + '<actuator><motor tendon="t"/></actuator>'
FOLLOWS = '<equality><joint joint1="j2" joint2="j1" polycoef="0.1 2 0 0 0"/></equality>'


@pytest.mark.parametrize("extra", [LOOP, TENDON, PULLED, FOLLOWS, '<actuator><muscle joint="j2"/></actuator>'])
def test_what_touches_no_joint_of_the_robot_is_no_obstacle(extra):
    text = tree_xml((-1, 0, 1), 5, extra=extra.replace("<muscle", '<muscle lengthrange="-1 1"'))
    model = mujoco.MjModel.from_xml_string(text)
    robot = robot_from_model(model, joints=("j0",), hold={"j1": 0.3, "j2": 0.1})
    assert_same_as_whole(robot, model, {"j1": 0.3, "j2": 0.1})


@pytest.mark.parametrize(
    ("extra", "says"),
    [(LOOP, "closes a loop"), (TENDON, "tendon 't' pulls"), (PULLED, "tendon 't' pulls"), (FOLLOWS, "ties it")],
)
def test_what_touches_a_joint_of_the_robot_is_refused_with_the_option_to_hold_it(extra, says):
    model = mujoco.MjModel.from_xml_string(tree_xml((-1, 0, 1), 5, extra=extra))
    with pytest.raises(RobotError, match=f"joint 'j2' .*{says}.*--hold j2=VALUE"):
        robot_from_model(model, joints=("j0", "j2"))
    assert "j2" not in robot_from_model(model).joint_names  # of itself it is held, with a note


def test_a_held_follower_is_where_its_leader_puts_it():
    model = mujoco.MjModel.from_xml_string(tree_xml((-1, 0, 1), 5, extra=FOLLOWS))
    robot = robot_from_model(model, joints=("j0",), hold={"j1": 0.3})
    follower = model.qpos0[2] + 0.1 + 2 * (0.3 - model.qpos0[1])
    assert_same_as_whole(robot, model, {"j1": 0.3, "j2": follower})


def test_a_ball_joint_is_held_and_can_not_be_named():
    model = mujoco.MjModel.from_xml_string(tree_xml((-1, 0), 5, inside={1: BALL}))
    assert any("ball joint is held still" in note for note in robot_from_model(model).notes)
    with pytest.raises(RobotError, match="'c' can't be diagnosed: it is a ball joint"):
        robot_from_model(model, joints=("j0", "c"))


def test_a_floating_base_is_refused_unless_it_is_held():
    text = tree_xml((-1, 0), 5).replace("<body name=\"base\"", '<body name="base"', 1)
    text = text.replace('<body name="body0"', '<freejoint/><inertial pos="0 0 0" mass="9" diaginertia="1 1 1"/>'
                        '<body name="body0"')  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    with pytest.raises(RobotError, match="body 'base' floats .*--fix-base"):
        robot_from_model(model)
    robot = robot_from_model(model, fix_base=True)
    fixed = robot_from_model(mujoco.MjModel.from_xml_string(tree_xml((-1, 0), 5)))
    assert any("the base floats" in note for note in robot.notes)
    np.testing.assert_allclose(robot.gravity, fixed.gravity, atol=1e-12)
    np.testing.assert_allclose(robot.phi, fixed.phi, atol=1e-12)


def test_a_loose_thing_beside_the_arm_is_no_part_of_it():
    box = '<body name="box"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
    text = tree_xml((-1, 0), 5).replace("</worldbody>", box)
    assert robot_from_model(mujoco.MjModel.from_xml_string(text)).notes == ()


# ---------------------------------------------------------------- files as they come

URDF = """<robot name="r"><link name="base"/>{links}
<joint name="a" type="{base}"><parent link="base"/><child link="one"/><axis xyz="0 1 0"/></joint>
<joint name="b" type="continuous"><parent link="one"/><child link="two"/><axis xyz="0 1 0"/><origin xyz="0 0 .3"/>
</joint>
<joint name="m" type="revolute"><parent link="two"/><child link="tip"/><axis xyz="1 0 0"/>{mimic}</joint>
<joint name="f" type="fixed"><parent link="two"/><child link="antenna"/><origin xyz="0 0 .1"/></joint></robot>"""
LINK = """<link name="{}"><inertial><origin xyz="0 0 .1" rpy="0 .2 0"/><mass value="{}"/>
<inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/></inertial></link>"""
GOOD = {"one": (2, 0.2, 0.2, 0.1), "two": (1, 0.02, 0.02, 0.01), "tip": (0.1, 1e-3, 1e-3, 1e-3)}


def urdf(base: str = "continuous", mimic: str = "", **links) -> str:
    numbers = {**GOOD, "antenna": (1e-6, 1e-9, 1e-9, 1e-9), **links}
    return URDF.format(base=base, mimic=mimic, links="".join(LINK.format(k, *v) for k, v in numbers.items()))


def test_a_mimic_joint_follows_the_joint_that_is_held(tmp_path):
    mimic = '<mimic joint="b" multiplier="2" offset="0.1"/>'
    follows = read(tmp_path, urdf(mimic=mimic), joints=("a",), hold={"b": 0.4})
    direct = read(tmp_path, urdf(), joints=("a",), hold={"b": 0.4, "m": 0.9})
    np.testing.assert_allclose(follows.phi, direct.phi, atol=1e-14)
    assert "'m' mimics 'b'" in follows.notes[-1]


def test_a_base_that_floats_in_a_urdf_is_refused_unless_it_is_held(tmp_path):
    with pytest.raises(RobotError, match="'one' floats and carries joint 'b'.*--fix-base"):
        read(tmp_path, urdf(base="floating"))
    assert read(tmp_path, urdf(base="floating"), fix_base=True).joint_names == ("b", "m")


def test_a_broken_inertia_of_an_antenna_is_absorbed_by_what_carries_it(tmp_path):
    broken = read(tmp_path, urdf(antenna=(1e-6, -3.5e-8, 3.5e-8, 9.1e-8)), joints=("a", "b"))
    assert "link 'antenna' has mass 1e-06 kg" in broken.notes[0] and "possible one" in broken.notes[0]
    np.testing.assert_allclose(broken.phi, read(tmp_path, urdf(), joints=("a", "b")).phi, atol=1e-7)


def test_a_broken_inertia_of_what_stands_still_is_no_matter(tmp_path):
    robot = read(tmp_path, urdf(one=(2, -1, 0.2, 0.1)), joints=("b",), hold={"a": 0.0})
    assert not any("'one'" in note for note in robot.notes)


def test_a_lopsided_inertia_is_mended_to_the_nearest_and_noted(tmp_path):
    robot = read(tmp_path, urdf(two=(1, 0.02, 0.02, 0.09)), joints=("a", "b"), hold={"m": 0.0})
    assert not is_lopsided(np.asarray(robot.inertia[1]))
    assert any("link 'two'" in note and "exceeds the sum of the others" in note for note in robot.notes)


def test_a_negative_inertia_of_a_link_that_moves_is_refused(tmp_path):
    with pytest.raises(RobotError, match="link 'two' has mass 1 kg .* none may be negative"):
        read(tmp_path, urdf(two=(1, -0.2, 0.02, 0.09)))


def test_the_nearest_possible_inertia_keeps_the_largest_moment():
    R = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    mended = np.linalg.eigvalsh(possible(R @ np.diag([1.0, 2.0, 5.0]) @ R.T))
    np.testing.assert_allclose(mended, [2.0, 3.0, 5.0], rtol=1e-7)


def test_meshes_need_not_be_there(tmp_path):
    gone = (
        '<asset><mesh name="g" file="gone.stl"/><texture name="t" type="2d" file="gone.png"/>'
        '<material name="m" texture="t"/></asset>'
    )
    shapes = '<geom type="mesh" mesh="g" material="m"/><geom type="capsule" size=".1 .1" material="m"/>'
    text = tree_xml((-1, 0), 5, extra=gone, inside={1: shapes})
    robot = read(tmp_path, text)
    np.testing.assert_array_equal(robot.phi, robot_from_model(mujoco.MjModel.from_xml_string(tree_xml((-1, 0), 5))).phi)


def test_a_lopsided_inertia_in_mjcf_is_mended_and_noted(tmp_path):
    body = '<body name="thin"><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.3"/></body>'
    robot = read(tmp_path, tree_xml((-1, 0), 5, inside={1: body}))
    assert "link 'thin' has principal moments of inertia 0.1, 0.1, 0.3 kg m^2" in robot.notes[0]


def test_movable_joints_are_hinges_and_slides(tmp_path):
    (tmp_path / "arm.xml").write_text(tree_xml((-1, 0), 5, inside={1: BALL}))
    assert movable_joints(tmp_path / "arm.xml") == ("j0", "j1")


# ---------------------------------------------------------------- the recording's joints choose


def recorded(tmp_path: pathlib.Path, name: str, *columns: str) -> pathlib.Path:
    t = np.arange(300) / 100
    pd.DataFrame({"t": t, **{c: 0.5 + 0.0 * t for c in columns}}).to_csv(tmp_path / name, index=False)
    return tmp_path / name


def pairs(*joints: str) -> list[str]:
    return [f"{kind}.{joint}" for joint in joints for kind in ("q", "tau")]


@pytest.fixture
def model(tmp_path) -> pathlib.Path:
    (tmp_path / "tree.xml").write_text(tree_xml(TORSO, 5))
    return tmp_path / "tree.xml"


def test_joints_without_columns_are_held(tmp_path, model):
    log = recorded(tmp_path, "log.csv", *pairs("j3", "j4"))
    robot = recorded_robot(model, [log], None, held_positions(["j0=0.5"]), False)
    assert robot.joint_names == ("j3", "j4")
    assert "'j0' at 0.5 rad" in robot.notes[0] and "'j1' at" in robot.notes[0]


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ([*pairs("j3"), "q.j4"], "missing column tau.j4, while there is q.j4; .*--hold j4=0.5"),
        ([*pairs("j3"), "tau.j4"], "missing column q.j4, while there is tau.j4"),
        ([*pairs("j3"), *pairs("J4 ")], "holds joint 'J4', which the model has not; did you mean 'j4'"),
    ],
)
def test_half_a_joint_is_refused(tmp_path, model, columns, says):
    with pytest.raises(InputError, match=says):
        recorded_robot(model, [recorded(tmp_path, "log.csv", *columns)], None, {}, False)


def test_a_joint_to_hold_may_have_columns(tmp_path, model):
    log = recorded(tmp_path, "log.csv", *pairs("j3"), "q.j4")
    assert recorded_robot(model, [log], None, {"j4": 0.5}, False).joint_names == ("j3",)


def test_recordings_of_different_joints_are_refused(tmp_path, model):
    logs = [recorded(tmp_path, "a.csv", *pairs("j3", "j4")), recorded(tmp_path, "b.csv", *pairs("j3"))]
    with pytest.raises(InputError, match="b.csv: holds other joints than .*a.csv does .j4"):
        recorded_robot(model, logs, None, {}, False)


@pytest.mark.parametrize("word", ["j1", "j1=", "=1", "j1=much"])
def test_what_is_no_name_and_number_can_not_be_held(word):
    with pytest.raises(InputError, match="--hold .*allowed is the name of a joint"):
        held_positions([word])


def test_a_joint_can_be_held_once():
    with pytest.raises(InputError, match="once each"):
        held_positions(["j1=1", "j1=2"])
