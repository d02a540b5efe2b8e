"""Reading robot models: what is kept, what is mended with a note, what is refused and how it says so."""

import equinox as eqx
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import LONGEST, random_robot, random_robot_xml, random_state, recordings_folder, shipped_robot

from irb140_jax import dynamics, load_robot
from irb140_jax.errors import RobotError
from irb140_jax.oracle import mujoco as oracle
from irb140_jax.robot import Robot, irb140, irb140_path, robot_from_model, with_phi

ARM = """<mujoco model="arm"><option {option}/><compiler angle="degree" autolimits="true"/>{extra}
<worldbody><body name="base" {base}>
  <body name="one"><inertial pos="0 0 0.2" mass="2" diaginertia="0.2 0.2 0.1"/><joint {first} axis="0 1 0"/>
    <body name="two" pos="0 0 0.4"><inertial pos="0 0 0.2" mass="1" diaginertia="0.1 0.1 0.05"/>
      <joint {second} axis="0 1 0"/>{inside}</body>{beside}</body></body>{outside}</worldbody>
<actuator>{actuators}</actuator></mujoco>"""


def arm(**parts: str) -> str:
    """MJCF of a two-joint arm with something put into it."""
    empty = dict.fromkeys(("option", "extra", "base", "inside", "beside", "outside", "actuators"), "")
    return ARM.format(**{**empty, "first": 'name="a"', "second": 'name="b"', **parts})


def read(tmp_path, text: str, name: str = "arm.xml") -> Robot:
    path = tmp_path / name
    path.write_text(text)
    return load_robot(path)


# ---------------------------------------------------------------- what is kept


def test_shipped_robot_has_the_published_diagonal_of_its_mass_matrix():
    robot = irb140()
    diagonal = np.diag(dynamics.mass_matrix(robot, jnp.zeros(6))) - np.asarray(robot.armature)
    # Published to 3 or 4 digits.
    assert np.allclose(diagonal, [1.800, 4.217, 0.641, 0.00750, 0.00040, 0.0000127], rtol=2e-3)


def test_shipped_robot_has_the_published_masses_and_limits():
    robot = irb140()
    assert robot.name == "irb140"
    assert np.isclose(robot.mass.sum(), 71.706, atol=5e-4)  # 98 kg less the base, rounded to a gram
    assert np.allclose(np.degrees(robot.velocity_limit), [200, 200, 260, 360, 360, 450])
    assert np.allclose(np.degrees(robot.lower), [-180, -90, -230, -200, -115, -400])
    assert np.allclose(np.degrees(robot.upper), [180, 110, 50, 200, 115, 400])
    assert np.allclose(robot.effort_limit, [470, 300, 200, 50, 50, 30])
    assert np.allclose(robot.armature, [3, 2, 0.8, 0.1, 0.1, 0.05])


def test_shipped_robots_links_are_possible_bodies():
    robot = irb140()
    for inertia in np.asarray(robot.inertia):
        moments = np.linalg.eigvalsh(inertia)
        assert moments[0] > 0.0 and moments[0] + moments[1] > moments[2]


def test_shipped_model_is_found_in_a_checkout():
    assert irb140_path().name == "irb140.xml"


def test_ten_joints_with_bodies_that_share_them_are_read():
    robot, _ = random_robot(LONGEST, 8)
    assert robot.n == 10
    assert "".join("S" if slide else "H" for slide in robot.is_slide) == LONGEST
    assert np.count_nonzero(np.asarray(robot.mass) == 0.0) > 0  # links without mass between joints of one body


def test_armature_and_damping_of_actuators_count_with_the_square_of_the_gear(tmp_path):
    motor = '<motor joint="b" gear="-10" armature="0.01" damping="0.02"/>'
    robot = read(tmp_path, arm(second='name="b" armature="0.5" damping="0.3"', actuators=motor))
    assert np.allclose(robot.armature, [0, 1.5])
    assert np.allclose(robot.damping, [0, 2.3])
    assert np.allclose(robot.gear, [1, -10])
    model = oracle.oracle_model(tmp_path / "arm.xml")
    q, qd, qdd = random_state(2, 1)
    ours = dynamics.inverse_dynamics(robot, *(jnp.asarray(x) for x in (q, qd, qdd)))
    assert np.allclose(ours, oracle.inverse_dynamics(model, q, qd, qdd), atol=1e-12)


@pytest.mark.parametrize(
    ("joint", "motor", "limit"),
    [
        ("", '<motor joint="b" gear="-10" ctrlrange="-2 3"/>', 30.0),
        ("", '<motor joint="b" gear="10" ctrlrange="-2 3" forcerange="-1 1"/>', 10.0),
        ('actuatorfrcrange="-7 7"', '<motor joint="b" gear="10" ctrlrange="-2 3"/>', 7.0),
        ("", '<position joint="b" kp="100" ctrlrange="-1 1"/>', np.inf),  # a range of positions, not of torques
        ("", '<position joint="b" kp="100" forcerange="-5 5" gear="2"/>', 10.0),
    ],
)
def test_effort_limit_is_the_tightest_that_the_file_gives(tmp_path, joint, motor, limit):
    robot = read(tmp_path, arm(second=f'name="b" {joint}', actuators=motor))
    assert np.isclose(robot.effort_limit[1], limit)


def test_velocity_limits_come_from_a_custom_numeric(tmp_path):
    robot = read(tmp_path, arm(extra='<custom><numeric name="velocity_limit" data="2 3"/></custom>'))
    assert np.allclose(robot.velocity_limit, [2, 3])
    assert np.all(np.isinf(read(tmp_path, arm()).velocity_limit))


def test_limits_in_degrees_are_read_in_radians(tmp_path):
    robot = read(tmp_path, arm(second='name="b" range="-90 45"'))
    assert np.allclose([robot.lower[1], robot.upper[1]], np.radians([-90, 45]))
    assert np.isinf(robot.lower[0]) and np.isinf(robot.upper[0])


def test_gravity_is_told_in_the_axes_of_a_tilted_base(tmp_path):
    robot = read(tmp_path, arm(base='euler="90 0 0"'))
    assert np.allclose(robot.gravity, [0, -9.81, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("flag", "field"),
    [("gravity", "gravity"), ("spring", "stiffness"), ("damper", "damping"), ("frictionloss", "frictionloss")],
)
def test_physics_that_the_file_switches_off_is_off(tmp_path, flag, field):
    both = {"first": 'name="a" damping="1" stiffness="1" frictionloss="1"'}
    assert np.any(getattr(read(tmp_path, arm(**both)), field))
    text = arm(**both).replace("<option />", f'<option><flag {flag}="disable"/></option>')
    assert not np.any(getattr(read(tmp_path, text), field))


def test_nameless_model_is_called_after_its_file(tmp_path):
    assert read(tmp_path, arm().replace(' model="arm"', ""), "left_arm.xml").name == "left_arm"


def test_phi_and_with_phi_undo_each_other():
    robot, _ = random_robot("HHSHHH", 4)
    again = with_phi(robot, robot.phi)
    assert np.allclose(again.com, robot.com, atol=1e-14) and np.allclose(again.inertia, robot.inertia, atol=1e-14)


# ---------------------------------------------------------------- URDF

URDF = """<?xml version="1.0"?><robot name="bench">{links}
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.5" rpy="0.1 0 0"/></joint>
<link name="base"><visual><geometry><mesh filename="package://nowhere/base.stl"/></geometry></visual></link>
<link name="upper"><inertial><origin xyz="0 0 0.1" rpy="0 0.2 0"/><mass value="2"/>
  <inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.12" iyz="0" izz="0.09"/></inertial>
  <collision><geometry><box size="1 1 1"/></geometry></collision></link>
<link name="lower"><inertial><origin xyz="0.05 0 0.1"/><mass value="{mass}"/>
  <inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="2" effort="50" velocity="3"/><dynamics damping="0.4" friction="0.7"/></joint>
<joint name="b" type="{kind}"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3"/>{inside}
  <limit lower="-0.1" upper="0.2" effort="0" velocity="0"/></joint>
<joint name="grip" type="fixed"><parent link="lower"/><child link="tool0"/><origin xyz="0.2 0 0"/></joint>
<link name="tool0"/><transmission name="t"><joint name="a"/><actuator name="m"/></transmission>{more}</robot>"""


def urdf(**parts: str) -> str:
    usual = {"links": "", "more": "", "inside": "", "kind": "prismatic", "mass": "1", "inertia": "0.01"}
    return URDF.format(**{**usual, **parts})


def test_urdf_keeps_friction_and_limits_and_merges_what_is_fixed(tmp_path):
    robot = read(tmp_path, urdf(), "bench.urdf")
    assert robot.joint_names == ("a", "b") and robot.is_slide == (False, True) and robot.name == "bench"
    assert np.allclose(robot.damping, [0.4, 0]) and np.allclose(robot.frictionloss, [0.7, 0])
    assert np.allclose(robot.lower, [-1, -0.1]) and np.allclose(robot.upper, [2, 0.2])
    assert np.allclose(robot.effort_limit, [50, np.inf]) and np.allclose(robot.velocity_limit, [3, np.inf])
    assert np.allclose(robot.mass, [2, 1])  # the box is a shape, not a mass
    assert np.allclose(robot.tool_position, [0.2, 0, 0])
    assert np.allclose(robot.base_position, [0, 0, 0.5])


def test_tool_is_the_centre_of_mass_where_the_file_names_none(tmp_path):
    arm = '<mujoco><worldbody><body><joint name="a"/><geom size=".1" pos="0 0 .3"/>{}</body></worldbody></mujoco>'
    assert np.allclose(read(tmp_path, arm.format(""), "arm.xml").tool_position, [0, 0, 0.3])
    assert np.allclose(read(tmp_path, arm.format("<site/>"), "arm.xml").tool_position, 0)  # named, so meant


def test_urdf_axis_is_x_where_it_is_not_given(tmp_path):
    robot = read(tmp_path, urdf(), "bench.urdf")
    assert np.allclose(robot.axis[1], [1, 0, 0])


def test_urdf_with_a_world_link_is_the_same_robot(tmp_path):
    bare, with_world = read(tmp_path, urdf(), "a.urdf"), read(tmp_path, urdf(links='<link name="world"/>'), "b.urdf")
    assert eqx.tree_equal(bare, with_world)


def test_urdf_link_without_rotational_inertia_is_read_with_a_note(tmp_path):
    robot = read(tmp_path, urdf(inertia="0"), "bench.urdf")
    assert np.allclose(robot.inertia[1], 0.0, atol=1e-11)
    assert robot.notes == ("link 'lower' has no rotational inertia in the file and counts as a point mass",)


def test_urdf_link_without_mass_is_read_with_a_note(tmp_path):
    robot = read(tmp_path, urdf(mass="0.0", inertia="0.0e0"), "bench.urdf")
    assert np.allclose(robot.mass[1], 0.0, atol=1e-11)
    assert robot.notes == ("link 'lower' has no mass of its own in the file",)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"kind": "spherical"}, "joint 'b' is of type 'spherical'; known: revolute, continuous, prismatic, fixed"),
        ({"inside": '<mimic joint="a"/>'}, "no joint is left .* 'b' mimics 'a'"),
        ({"inside": '<axis xyz="${x} 0 0"/>'}, "xacro"),
        ({"mass": "-1"}, "link 'lower' has mass -1 kg"),
        ({"inertia": "-0.1"}, "link 'lower' has mass 1 kg and principal moments"),
        ({"mass": "nan"}, "link 'lower': not finite"),
        ({"mass": "heavy"}, "link 'lower': could not convert string to float: 'heavy'"),
        ({"kind": "prismatic", "inside": '<axis xyz="0 0 0"/>'}, "MuJoCo can't compile"),
        ({"more": '<joint name="c" type="fixed"><parent link="base"/><child link="gone"/></joint>'}, "child 'gone'"),
    ],
)
def test_urdf_that_is_no_robot_is_refused(tmp_path, parts, says):
    with pytest.raises(RobotError, match=says):
        read(tmp_path, urdf(**parts), "bench.urdf")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [('name="b"', 'name="a"', "two joints"), ('name="lower"', 'name="upper"', "two links")],
)
def test_urdf_with_a_name_twice_is_refused(tmp_path, old, new, says):
    with pytest.raises(RobotError, match=f"{says} have the name"):
        read(tmp_path, urdf().replace(old, new), "bench.urdf")


def test_warnings_of_mujoco_become_notes(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    robot = read(tmp_path, arm(extra='<size nuser_jnt="1"/>', first='name="a" user="nan"'))
    assert robot.notes == ("MuJoCo warns: XML contains a 'NaN'. Please check it carefully.",)
    assert capfd.readouterr() == ("", "") and not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_real_urdf_without_meshes_or_world_link_is_read():
    folder = recordings_folder()
    tx40 = load_robot(folder / "staubli_tx40" / "tx40_mdh_modified.urdf")
    assert tx40.joint_names == tuple(f"joint_{i}" for i in range(1, 7))
    assert np.allclose(tx40.mass, [10.5, 3.6, 4.07, 3.62, 1.02, 0.2])
    assert np.allclose(tx40.effort_limit, [131.84, 131.84, 103.49, 46.08, 43.19, 30.72])
    assert "link_6" in tx40.notes[0]


@pytest.mark.parametrize(
    ("file", "friction"),
    [
        ("design_C.1/model_1.0_pendubot.urdf", [0.16, 0.12]),
        ("design_C.1/model_1.1_pendubot.urdf", [0, 0]),
        ("design_A.0/model_2.1_pendubot.urdf", [0, 0]),
    ],
)
def test_real_urdf_of_a_double_pendulum_hangs_at_zero(file, friction):
    robot = load_robot(recordings_folder() / "dfki_double_pendulum" / file)
    assert np.allclose(robot.frictionloss, friction)
    assert np.allclose(dynamics.gravity_torque(robot, jnp.zeros(2)), 0.0, atol=1e-3)
    # Turned by a quarter it pulls down: a positive hinge about x needs torque to be held there.
    assert dynamics.gravity_torque(robot, jnp.array([np.pi / 2, 0.0]))[0] > 1.0


# ---------------------------------------------------------------- what is refused

GONE = '<asset><mesh name="gone" file="gone.stl"/></asset>'
TENDON = '<tendon><fixed name="t" stiffness="1"><joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed></tendon>'


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"extra": '<equality><joint name="e" joint1="a" joint2="b"/></equality>'}, "equality constraint 'e'"),
        ({"extra": '<equality><connect body1="two" anchor="0 0 0"/></equality>'}, "equality constraint"),
        ({"extra": TENDON}, "no joint is left .*tendon 't' pulls at it"),
        ({"first": 'name="a" damping="1 0.5"'}, "joint 'a' has polynomial damping"),
        ({"first": 'name="a" stiffness="1 0.5"'}, "joint 'a' has polynomial stiffness"),
        ({"option": 'density="1.2"'}, "fluid"),
        ({"option": 'viscosity="1"'}, "fluid"),
        ({"option": 'wind="1 0 0"'}, "fluid"),
        ({"actuators": '<motor name="m" joint="a" delay="0.01" nsample="5"/>'}, "actuator 'm' has a delay"),
        ({"actuators": '<motor name="m" joint="a" damping="1 0.5"/>'}, "actuator 'm' has polynomial damping"),
        ({"actuators": '<motor name="m" joint="a"/><motor joint="a" gear="2"/>'}, "joint 'a' has two actuators"),
        ({"actuators": '<muscle name="m" joint="a" lengthrange="-1 1"/>'}, "actuator 'm' is a muscle"),
        ({"actuators": '<motor name="m" site="s"/>', "inside": '<site name="s"/>'}, "'m' drives no joint but the arm"),
        ({"extra": '<custom><numeric name="velocity_limit" data="2"/></custom>'}, "one for each of the 2 joints"),
        ({"extra": '<custom><numeric name="velocity_limit" data="2 0"/></custom>'}, "allowed: positive numbers"),
        ({"first": 'name="a" armature="-1"'}, "joint 'a' has armature -1; allowed: 0 or more"),
        ({"second": 'name="b" frictionloss="-0.1"'}, "joint 'b' has frictionloss -0.1"),
        ({"first": 'name="a" damping="nan"'}, "damping is .*nan"),
        ({"first": 'name="b"'}, "MuJoCo can't compile this model: .*repeated name 'b'"),
        ({"extra": GONE, "inside": '<body name="c"><geom type="mesh" mesh="gone"/></body>'}, "'c' .*mesh.*gone.stl"),
    ],
)
def test_what_a_robot_can_not_represent_is_refused_by_name(tmp_path, parts, says):
    with pytest.raises(RobotError, match=says) as error:
        read(tmp_path, arm(**parts))
    assert "\n" not in str(error.value) and str(tmp_path / "arm.xml") in str(error.value)


def test_gravity_compensation_is_refused(tmp_path):
    with pytest.raises(RobotError, match="body 'two' has gravcomp"):
        read(tmp_path, arm().replace('name="two"', 'name="two" gravcomp="1"'))


def test_equality_that_is_switched_off_does_no_harm(tmp_path):
    robot = read(tmp_path, arm(extra='<equality><joint joint1="a" joint2="b" active="false"/></equality>'))
    assert robot.n == 2


@pytest.mark.parametrize(("joints", "says"), [(0, "no joint is left"), (41, "41 joints .* 1 to 40 are allowed")])
def test_number_of_joints_out_of_bounds_is_refused(joints, says):
    model = mujoco.MjModel.from_xml_string(random_robot_xml(1, joints) if joints else "<mujoco/>")
    with pytest.raises(RobotError, match=says):
        robot_from_model(model)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(RobotError, match="no such file"):
        load_robot(tmp_path / "nowhere.xml")


@pytest.mark.parametrize("text", ["", "not xml", "<html></html>", "\x00\x01"])
def test_file_that_is_no_model_is_refused(tmp_path, text):
    with pytest.raises(RobotError, match="give an MJCF or URDF file|convert it"):
        read(tmp_path, text)


def test_robot_with_arrays_of_the_wrong_shape_is_refused():
    robot, _ = shipped_robot()
    fields = {name: getattr(robot, name) for name in robot.__dataclass_fields__}
    with pytest.raises(RobotError, match=r"mass has shape \(5,\); for 6 joints give \(6,\)"):
        Robot(**{**fields, "mass": robot.mass[:5]})
    with pytest.raises(RobotError, match="no name twice"):
        Robot(**{**fields, "joint_names": ("a",) * 6})
