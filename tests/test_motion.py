"""Proof in motion: MuJoCo's leapfrog against a pendulum's energy and an independent integrator, and what is told."""

import dataclasses
import json
import types

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers_report import example_diagnosis, example_views
from scipy.integrate import solve_ivp

import irb140_jax.mismatch.output.store as store
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.corrected.native import beyond_file
from irb140_jax.mismatch.motion import proof_in_motion
from irb140_jax.mismatch.motion.laws import without_those
from irb140_jax.mismatch.motion.sentences import lost, sentences
from irb140_jax.mismatch.motion.windows import Span, spans, windows
from irb140_jax.oracle.mujoco import inverse_dynamics_along, oracle_model
from irb140_jax.oracle.rollout import positions, positions_under_law, simulated_model
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.report import html_report
from irb140_jax.robot import Robot, robot_from_model, robot_mjcf, with_phi

ARM = """<mujoco model="arm"><compiler angle="radian"/><worldbody>
<body pos="0 0 1"><joint name="a" axis="0 1 0"/><inertial mass="2" pos="0.3 0 0" diaginertia="0.01 0.02 0.02"/>
<body pos="0.5 0 0"><joint name="b" axis="0 1 0"/><inertial mass="1" pos="0.2 0 0" diaginertia="0.01 0.01 0.01"/>
<site name="tool" pos="0.4 0 0"/></body></body></worldbody></mujoco>"""
VISCOUS, DT = 1.5, 0.005
BAND = Band(10.0, 16.0, 200.0, 5)


def robot_of(text: str) -> Robot:
    return robot_from_model(mujoco.MjModel.from_xml_string(text), source="arm")


def recorded(seconds: float = 6.0, viscous: float = VISCOUS, torque_scale: float = 1.0) -> Conditioned:
    """The arm with viscous friction on its first joint, moved along sines; torque by MuJoCo's inverse dynamics."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    t = np.arange(0.0, seconds, DT)
    w, a, phase = np.array([2.0, 3.1]), np.array([0.5, 0.7]), np.array([0.3, 1.1])
    angle = w * t[:, None] + phase
    q, qd, qdd = a * np.sin(angle), a * w * np.cos(angle), -a * w**2 * np.sin(angle)
    tau = np.zeros_like(q)
    for i in range(len(t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], qd[i], qdd[i]
        mujoco.mj_inverse(model, data)
        tau[i] = data.qfrc_inverse + np.array([viscous, 0.0]) * qd[i]
    one, moves = np.ones(2), np.ones(q.shape, bool)
    return Conditioned("r", t, q, qd, qdd, torque_scale * tau, moves, moves, 0.01 * one, 1e-5 * one,
                       np.sign(qd), 0.0 * q, ())  # fmt: skip


def model_of(robot: Robot, *named: Named) -> CorrectedModel:
    phi = np.asarray(robot.phi)
    return CorrectedModel(robot, phi, phi, named, BAND, np.full(2, 0.01), robot.joint_names)


def named(slug: str, joint: int, *amplitudes: float) -> Named:
    return Named(CATALOGUE[slug], (joint,), tuple(range(len(amplitudes))), np.array(amplitudes), np.zeros(0))


def proof(*effects: Named, **options) -> dict:
    """The proof for an arm with these findings, all of one recording unseen."""
    robot = robot_of(ARM)
    recording = recorded(**options)
    unseen = [Span(0, 0, 0.0, float(recording.t[-1]))]
    made = proof_in_motion(robot, lambda _: model_of(robot, *effects), unseen, [recording], [0.0 * recording.tau])
    assert made is not None
    return made


def test_simulated_motion_is_that_of_an_integrator_of_high_order():
    model = simulated_model(ARM, 0.0025)
    model.dof_damping[:] = 0.4
    q0, qd0, data = np.array([0.3, -0.4]), np.array([1.0, -2.0]), mujoco.MjData(model)
    tau = lambda t: np.array([3.0 * np.sin(3 * t), -1.0 + t])  # noqa: E731

    def rate(t, x):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = x[:2], x[2:], tau(t)
        mujoco.mj_forward(model, data)
        return np.concatenate([x[2:], data.qacc])

    true = solve_ivp(rate, (0.0, 1.0), np.concatenate([q0, qd0]), rtol=1e-9, atol=1e-9).y[:2, -1]
    before = qd0 - 0.5 * 0.0025 * rate(0.0, np.concatenate([q0, qd0]))[2:]
    steps = np.stack([tau(t) for t in 0.0025 * np.arange(400)])
    ours = positions([model], q0[None], before[None], steps[None])[0, -1]
    without = positions([model], q0[None], qd0[None], steps[None])[0, -1]
    assert np.abs(ours - true).max() < 1e-3  # what damping and Coriolis torque half a step early amount to
    assert np.abs(without - true).max() > 1.5 * np.abs(ours - true).max()


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_joint_that_friction_holds_stays_where_it_is(step):
    robot, still = robot_of(ARM), np.zeros((1, 2))
    gravity = np.abs(inverse_dynamics_along(oracle_model(ARM), still, still, still)[0])
    model = simulated_model(robot_mjcf(dataclasses.replace(robot, frictionloss=jnp.asarray(2.0 * gravity))), step)
    went = positions([model], still, still, np.zeros((1, round(10.0 / step), 2)))[0, -1]
    assert np.all(gravity > 1.0) and np.abs(went).max() < 2e-3
    usual = mujoco.MjModel.from_xml_string(ARM)
    model.dof_solref[:], model.dof_solimp[:] = usual.dof_solref, usual.dof_solimp
    crept = positions([model], still, still, np.zeros((1, round(10.0 / step), 2)))[0, -1]
    assert np.all((0.4 < np.abs(crept)) & (np.abs(crept) < 1.0))  # why it is not MuJoCo's default
    bare = simulated_model(robot_mjcf(robot), step)
    fell = positions_under_law([bare], still, still, np.zeros((1, round(2.0 / step), 2)), None, lambda *_: (
        2.0 * gravity[None], still))[0, -1]  # fmt: skip
    assert np.abs(fell).max() < 2e-3


def test_what_flies_away_is_infinite_and_leaves_no_file_behind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model = simulated_model(ARM, 0.0025)
    tau = np.full((1, 50, 2), 1e13)
    assert np.isinf(positions([model], np.zeros((1, 2)), np.zeros((1, 2)), tau)[0, -1]).all()
    assert not list(tmp_path.iterdir())


def test_the_right_effect_moves_as_recorded_and_none_does_not():
    motion = proof(named("viscous_friction", 0, VISCOUS))
    at = motion["horizon"].index(0.5)
    joint = motion["joints"]["a"]
    assert joint["corrected"]["median"][at] < 0.01 * joint["refit"]["median"][at]
    assert motion["tool"]["corrected"]["p90"][at] < 0.02 * motion["tool"]["moved"]["median"][at]
    assert motion["as_torque"] == [] and lost(motion) is None


def test_friction_of_four_times_its_size_does_not_halve_the_error():
    joint = proof(named("viscous_friction", 0, 4 * VISCOUS))["joints"]["a"]
    assert joint["corrected"]["median"][5] > 0.5 * joint["refit"]["median"][5]


def test_a_torque_constant_in_the_gear_is_undone_in_the_simulation():
    motion = proof(named("torque_gain", 0, 0.25), named("torque_gain", 1, 0.25), viscous=0.0, torque_scale=1.25)
    joint = motion["joints"]["a"]
    assert joint["corrected"]["median"][5] < 0.02 * joint["refit"]["median"][5]


def test_friction_that_mjcf_cannot_hold_acts_where_the_motion_goes_and_other_torque_as_computed():
    both = named("asymmetric_friction", 0, 1.0, 3.0)
    robot, recording = robot_of(ARM), recorded(viscous=0.0)
    friction, other = np.where(recording.qd[:, 0] > 0, 1.0, -3.0), 0.3 * np.sin(recording.t)
    bare = recording.tau + np.stack([0.0 * other, other], axis=1)
    recording = dataclasses.replace(recording, tau=bare + np.stack([friction, 0.0 * friction], axis=1))
    model = model_of(robot, both)
    missing = beyond_file(without_those(model), [recording], [bare])  # the sine, which the file does not hold
    made = proof_in_motion(robot, lambda _: model, [Span(0, 0, 0.0, 5.99)], [recording], missing or [])
    assert made and made["as_law"] == ["friction that differs by direction"] and not made["as_torque"]
    assert "in the corrected model it acts at each state that the simulation reaches" in made["sentences"][-1]
    for joint in made["joints"].values():
        assert joint["corrected"]["median"][5] < 0.1 * joint["refit"]["median"][5]
    assert made["joints"]["b"]["file"]["median"][5] > 5 * made["joints"]["b"]["corrected"]["median"][5]
    assert any("applied as a torque" in x for x in sentences(made | {"as_torque": ["a coupling"]}))


def test_a_joint_without_inertia_follows_the_recording_and_the_others_are_judged():
    robot = robot_of(ARM)
    bare = with_phi(robot, robot.phi.at[1].set(1e-9 * robot.phi[1]))
    recording = recorded()
    effect = named("viscous_friction", 0, VISCOUS)
    missing = [0.0 * recording.tau]
    made = proof_in_motion(bare, lambda _: model_of(bare, effect), [Span(0, 0, 0.0, 5.99)], [recording], missing)
    assert made and made["followed"] == ["b"] and list(made["joints"]) == ["a"]
    assert any("follows the recording" in sentence for sentence in made["sentences"])


def test_spans_are_the_time_that_folds_leave_out():
    t = np.linspace(0.0, 10.0, 101)
    recording = np.array([0] * 5 + [1] * 5)
    first, rest = np.array([True] * 5 + [False] * 5), np.array([False] * 5 + [True, True, False, True, False])
    assert spans([first, rest], recording, [t, t]) == [
        Span(0, 0, 0.0, 10.0), Span(1, 1, 0.0, 4.0), Span(1, 1, 6.0, 8.0)
    ]  # fmt: skip


def test_windows_lie_in_their_spans_and_share_the_number():
    t = np.arange(0.0, 20.0, 0.01)
    made = windows([Span(0, 0, 0.0, 20.0), Span(1, 1, 5.0, 10.0)], [t, t], 2.0, 20)
    assert [sum(w.recording == r for w in made) for r in (0, 1)] == [16, 4]
    for w in made:
        low, high = ((0.0, 20.0), (5.0, 10.0))[w.recording]
        assert low <= t[w.first] and t[w.last] <= high and t[w.last] - t[w.first] == pytest.approx(2.0, abs=0.02)


def test_where_every_model_is_lost_the_text_says_from_when():
    curve = lambda *values: {"median": list(values), "p90": list(values)}  # noqa: E731
    tool = {"unit": "mm", "nominal": curve(1.0, 9.0, None), "refit": curve(1.0, 8.0, 90.0),
            "corrected": curve(0.1, 2.0, 40.0), "moved": curve(3.0, 6.0, 20.0)}  # fmt: skip
    made = {"horizon": [0.1, 0.5, 2.0], "windows": 7, "tool": tool, "whole_run": None, "as_torque": [],
            "as_law": [], "followed": [], "driven_by": "torque"}  # fmt: skip
    assert lost(made) == 2.0
    assert any("From 2 s on every model is farther off" in sentence for sentence in sentences(made))
    tool["corrected"] = curve(0.1, 2.0, 19.0)
    assert lost(made) is None


def test_the_report_shows_the_proof_and_the_folder_holds_it_apart_from_the_diagnosis(tmp_path, monkeypatch):
    motion = proof(named("viscous_friction", 0, VISCOUS))
    views = dataclasses.replace(example_views(), motion=motion)
    page = html_report(example_diagnosis(), views)
    assert "Proof in motion" in page and motion["sentences"][0] in page
    assert "Proof in motion" not in html_report(example_diagnosis(), example_views())
    for name in ("save_undecided", "save_native", "to_json"):
        monkeypatch.setattr(store, name, lambda *_: {})
    result = types.SimpleNamespace(diagnosis=example_diagnosis(), views=views, model=None, undecided=None)
    store.save(result, tmp_path)  # pyright: ignore[reportArgumentType]
    assert json.loads((tmp_path / "motion.json").read_text()) == json.loads(json.dumps(motion))
    assert "motion" not in json.loads((tmp_path / "views.json").read_text())
    assert "motion" not in json.loads((tmp_path / "diagnosis.json").read_text())
