"""Control laws against their formulas, told by MuJoCo; references against the geometry they promise."""

from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import IRB140_XML, random_robot, random_state, shipped_robot

from irb140_jax import control, dynamics, kinematics
from irb140_jax.errors import InputError, RobotError
from irb140_jax.oracle import mujoco as oracle
from irb140_jax.robot import first_joints, robot_from_model, subset

WHOLE, _ = shipped_robot()
ARM = first_joints(WHOLE, 3)
# Wrist bent and tool down: straight, as at zero, it is singular.
TOOL_DOWN = jnp.array([0.0, 0.0, 0.0, 0.0, np.pi / 2, 0.0])
SLOPE, GAIN, LAYER, DAMPING = 8.0, np.array([30.0, 40.0, 10.0]), 0.2, 5.0
# Torques of some 100 N m in double precision.
ROUND_OFF = 1e-11
# Compiling is what these tests spend their time on: whole functions are one program each, and paths of an arm have as
# many samples as each other, so that the next test finds the program.
POSE, TORQUE = jax.jit(kinematics.forward_kinematics), jax.jit(dynamics.inverse_dynamics)
POSES = jax.jit(jax.vmap(kinematics.forward_kinematics, in_axes=(None, 0)))
LAP: dict[str, Any] = {"duration": 2.0, "dt": 0.005, "ramp": 1.0}
SLOW_LAP: dict[str, Any] = {"duration": 4.0, "dt": 0.002}


def law(robot, model, switching, form, q, qd, wanted):
    """The law of the docstring in NumPy, M, C and g by other routines than the controller's."""
    e, ed = wanted[0] - q, wanted[1] - qd
    s, a = ed + SLOPE * e, wanted[2] + SLOPE * ed
    f = {"sign": np.sign(s), "tanh": np.tanh(s / LAYER), "saturation": np.clip(s / LAYER, -1.0, 1.0)}[switching]
    tau = oracle.inverse_dynamics(model, q, qd, a) + np.asarray(robot.frictionloss) * np.sign(qd)
    if form == "passivity":
        tau = tau + np.asarray(dynamics.coriolis_matrix(robot, jnp.asarray(q), jnp.asarray(qd))) @ s
    return tau + DAMPING * s + GAIN[: robot.n] * f


@pytest.mark.parametrize("form", ["computed", "passivity"])
@pytest.mark.parametrize("switching", ["saturation", "tanh", "sign"])
def test_sliding_mode_gives_the_torque_of_its_formula(switching, form):
    robot, model = random_robot("SHS", 4)
    controller = control.sliding_mode(
        robot, slope=SLOPE, gain=jnp.asarray(GAIN), layer=LAYER, damping=DAMPING, switching=switching, form=form
    )
    for seed in range(3):
        q, qd, qdd = random_state(3, seed)
        wanted = (q + 0.01 * qdd, qd - 0.02 * qdd, qdd)
        tau = controller.torque(
            jnp.asarray(q), jnp.asarray(qd), (jnp.asarray(wanted[0]), jnp.asarray(wanted[1]), jnp.asarray(qdd))
        )
        assert np.allclose(tau, law(robot, model, switching, form, q, qd, wanted), atol=ROUND_OFF)


def test_inside_the_layer_torque_is_continuous_and_outside_it_all_switchings_agree():
    q, qd = jnp.zeros(3), jnp.zeros(3)
    torque = {
        kind: control.sliding_mode(ARM, switching=kind).torque(q, qd, (q + 0.5, qd, qd))
        for kind in ("saturation", "tanh", "sign")
    }
    # s / layer is 50 here, where tanh is 1 to the last digit.
    assert np.allclose(torque["saturation"], torque["sign"]) and np.allclose(torque["tanh"], torque["sign"])
    near = [control.sliding_mode(ARM).torque(q, qd, (q + shift, qd, qd)) for shift in (-1e-9, 1e-9)]
    assert np.allclose(near[0], near[1], atol=1e-4)
    rough = [control.sliding_mode(ARM, switching="sign").torque(q, qd, (q + shift, qd, qd)) for shift in (-1e-9, 1e-9)]
    assert np.all(np.abs(rough[1] - rough[0]) > 10.0)


@pytest.mark.parametrize("wrong", [{"switching": "relay"}, {"form": "guess"}, {"gain": jnp.ones(4)}])
def test_sliding_mode_refuses_what_it_does_not_know(wrong):
    with pytest.raises(InputError, match="sliding mode"):
        control.sliding_mode(ARM, **wrong)


@pytest.fixture(scope="module")
def short_circle():
    return control.circle(ARM, **SLOW_LAP, ramp=1.0, radius=0.08, normal=(1.0, 0.0, 1.0))


@pytest.fixture(scope="module")
def circle_of_six_joints():
    return control.circle(WHOLE, **LAP, radius=0.05, posture=TOOL_DOWN)


def test_circle_is_a_circle_of_this_radius_in_this_plane(short_circle):
    T = POSES(ARM, short_circle.q)
    normal = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    start = np.asarray(POSE(ARM, ARM.reference)[:3, 3])
    centre = start - 0.08 * np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)
    away = np.asarray(T[:, :3, 3]) - centre
    assert np.allclose(away @ normal, 0.0, atol=1e-11) and np.allclose(np.linalg.norm(away, axis=1), 0.08, atol=1e-11)
    turned = np.unwrap(np.arctan2(away @ np.cross(normal, away[0] / 0.08), away @ away[0] / 0.08))
    assert np.isclose(turned[-1] - turned[0], 2.0 * np.pi, atol=1e-9)


def test_circle_begins_and_ends_at_rest_without_a_jolt(short_circle):
    for x in (short_circle.qd, short_circle.qdd):
        assert np.allclose(x[0], 0.0, atol=1e-12) and np.allclose(x[-1], 0.0, atol=1e-12)
    # The largest step of the acceleration, over 2 ms: no jump.
    assert np.abs(np.diff(short_circle.qdd, axis=0)).max() < 0.02 * np.abs(short_circle.qdd).max()


def test_velocities_and_accelerations_are_derivatives_of_the_positions(short_circle):
    dt = SLOW_LAP["dt"]
    for x, rate in ((short_circle.q, short_circle.qd), (short_circle.qd, short_circle.qdd)):
        # Central differences: off by dt^2 / 6 times a rate's second derivative, some 20 rad/s^4 where the ramp sets in.
        assert np.allclose((x[2:] - x[:-2]) / (2.0 * dt), rate[1:-1], atol=3e-5)


def test_six_joints_keep_the_tools_orientation(circle_of_six_joints):
    reference = circle_of_six_joints
    T = POSES(WHOLE, reference.q)
    start = POSE(WHOLE, TOOL_DOWN)
    assert np.allclose(T[:, :3, :3], start[:3, :3], atol=1e-11)
    assert np.isclose(np.ptp(T[:, 1, 3]), 0.1, atol=1e-4)
    assert np.allclose(np.gradient(reference.q, LAP["dt"], axis=0)[1:-1], reference.qd[1:-1], atol=1e-3)


def test_path_of_the_closed_form_is_that_of_the_iteration(circle_of_six_joints):
    T, q = POSES(WHOLE, circle_of_six_joints.q)[::40], circle_of_six_joints.q[::40]
    closed = jax.jit(jax.vmap(lambda T, q: kinematics.nearest_solution(WHOLE, T, q)[0]))(T, q)
    assert np.allclose(closed, q, atol=1e-9)


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": 3.0},
        {"duration": 1.0},
        {"normal": (0.0, 0.0, 0.0)},
        {"centre": (0.0, 0.0, 5.0), "posture": ARM.reference},
    ],
)
def test_a_circle_that_can_not_be_is_refused(wrong):
    with pytest.raises(InputError):
        control.circle(ARM, **{**SLOW_LAP, **wrong})


def test_a_path_for_two_joints_is_refused_with_what_would_do():
    with pytest.raises(InputError, match="joints' own motion as a Reference"):
        control.circle(first_joints(WHOLE, 2), duration=4.0, dt=0.01)


def planar_arm():
    """Three hinges about one axis, which stands askew."""
    link = '<geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>'
    joint = lambda i: f'<joint name="joint{i}" axis="0 0 1" range="-2 2"/>'  # noqa: E731
    hand = f'<body pos="0.3 0 0">{joint(3)}{link}<site name="tool" pos="0.3 0 0"/></body>'
    arm = f'<body euler="0.5 0.3 0">{joint(1)}{link}<body pos="0.3 0 0">{joint(2)}{link}{hand}</body></body>'
    text = f'<mujoco><compiler angle="radian"/><worldbody>{arm}</worldbody></mujoco>'
    return robot_from_model(mujoco.MjModel.from_xml_string(text), "planar")


ARMS = {
    "six joints, wrist straight at the reference": lambda: WHOLE,
    "seven joints, one too many": lambda: random_robot("HHHHHHH", 3)[0],
    "four joints, one a slide": lambda: random_robot("HSHH", 5)[0],
    "three joints in one plane": planar_arm,
}


@pytest.mark.parametrize("arm", ARMS)
def test_any_arm_gets_a_circle_which_its_joints_follow_smoothly(arm):
    robot, dt = ARMS[arm](), LAP["dt"]
    reference = control.circle(robot, **LAP)
    T = np.asarray(POSES(robot, reference.q))
    # Evenly in angle, not in time: the middle of the circle is the middle of what is furthest apart.
    points = T[:, :3, 3]
    apart = np.linalg.norm(points - points[0], axis=1)
    middle = 0.5 * (points[0] + points[apart.argmax()])
    radius = np.linalg.norm(points - middle, axis=1)
    # The sample that is furthest away misses the opposite end by up to half a step of 2 %.
    assert radius.min() > 0.02 and np.ptp(radius) < 0.03 * radius.mean()
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
    assert np.abs((points - points[0]) @ normal).max() < 1e-9
    if robot.n >= 6:
        assert np.allclose(T[:, :3, :3], T[0, :3, :3], atol=1e-9)
    for x, rate in ((reference.q, reference.qd), (reference.qd, reference.qdd)):
        # Central differences: off by dt^2 / 6 times a rate's second derivative.
        error = np.abs((x[2:] - x[:-2]) / (2.0 * dt) - rate[1:-1]).max()
        assert error < 0.01 * np.abs(rate).max()
    assert bool(jnp.all((reference.q >= robot.lower) & (reference.q <= robot.upper)))


def test_the_study_s_arm_starts_its_circle_at_its_reference(short_circle):
    np.testing.assert_allclose(short_circle.q[0], ARM.reference, atol=1e-12)


@pytest.mark.parametrize("joints", [(1, 3, 4), ("joint5", "joint2"), (0, 2, 5)])
def test_any_choice_of_joints_is_mujocos_arm_with_the_others_removed(joints):
    spec = mujoco.MjSpec.from_file(str(IRB140_XML))
    keep = sorted(int(joint[-1]) - 1 if isinstance(joint, str) else joint for joint in joints)
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for i in set(range(6)) - set(keep):
        spec.delete(spec.joint(f"joint{i + 1}"))
    model, arm = oracle.oracle_model(spec.compile()), subset(WHOLE, joints)
    assert arm.joint_names == tuple(f"joint{i + 1}" for i in keep)
    for seed in range(3):
        q, qd, qdd = random_state(len(keep), seed)
        tau = TORQUE(arm, *(jnp.asarray(x) for x in (q, qd, qdd)))
        assert np.allclose(tau, oracle.inverse_dynamics(model, q, qd, qdd), atol=ROUND_OFF)
        T = POSE(arm, jnp.asarray(q))
        assert np.allclose(T, oracle.forward_kinematics(model, q), atol=1e-13)


@pytest.mark.parametrize("joints", [(), (0, 0), (6,), ("joint7",), ("joint1", 0)])
def test_a_choice_of_joints_that_are_not_there_or_twice_is_refused(joints):
    with pytest.raises(RobotError, match="none twice"):
        subset(WHOLE, joints)


def test_first_joints_are_mujocos_arm_with_the_other_joints_removed():
    spec = mujoco.MjSpec.from_file(str(IRB140_XML))
    for actuator in list(spec.actuators)[3:]:
        spec.delete(actuator)
    for name in ("joint4", "joint5", "joint6"):
        spec.delete(spec.joint(name))
    model = oracle.oracle_model(spec.compile())
    for seed in range(3):
        q, qd, qdd = random_state(3, seed)
        tau = TORQUE(ARM, *(jnp.asarray(x) for x in (q, qd, qdd)))
        assert np.allclose(tau, oracle.inverse_dynamics(model, q, qd, qdd), atol=ROUND_OFF)
        T = POSE(ARM, jnp.asarray(q))
        assert np.allclose(T, oracle.forward_kinematics(model, q), atol=1e-13)


def test_first_joints_may_hold_the_others_anywhere():
    held = jnp.array([0.0, 0.0, 0.0, 0.4, 0.9, -0.7])
    arm = first_joints(WHOLE, 3, held)
    q, qd, qdd = (jnp.asarray(x) for x in random_state(3, 0))
    pad = lambda x, rest: jnp.concatenate([x, rest])  # noqa: E731
    whole = TORQUE(WHOLE, pad(q, held[3:]), pad(qd, jnp.zeros(3)), pad(qdd, jnp.zeros(3)))
    assert np.allclose(TORQUE(arm, q, qd, qdd), whole[:3], atol=ROUND_OFF)
    T = POSE(WHOLE, pad(q, held[3:]))
    assert np.allclose(POSE(arm, q), T, atol=1e-13)
