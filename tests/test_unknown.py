"""Physics in no library, made by MuJoCo: it is located by joint and by variables, and no name is forced upon it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from irb140_jax.mismatch import diagnose, settings
from irb140_jax.mismatch.validation.unexplained import Rows, competitors, predicted, shortest
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import irb140, irb140_path, robot_from_model

SHARE = 0.15  # of the joint's torque


def test_a_rotors_gyroscope_is_located_by_joint_and_variables_and_not_named():
    robot = irb140()
    motions = three_motions(robot, 8.0, 500.0, seed=1)
    case = conceal(str(irb140_path()), [Concealment("rotor_gyroscope", ("joint2",), SHARE)], motions, seed=2)
    diagnosis = diagnose(robot, case.recordings).diagnosis.to_json()
    assert not diagnosis["findings"] and diagnosis["verdict"] == "unexplained"
    (rest,) = diagnosis["unexplained"]
    assert rest["joints"] == ["joint2"]
    assert "together with the joint's own" in str(rest)


def test_what_goes_with_time_counts_where_a_slow_sweep_makes_position_go_with_time_too():
    """Copies of the residual, shifted in time, are as predictable by position there: it is no surer than chance."""
    xml = random_robot(100, 1)
    robot = robot_from_model(arm_spec(xml).compile(), source="random robot")
    motions = three_motions(robot, 15.0, 500.0, seed=113)
    case = conceal(xml, [Concealment("back_emf_sag", ("joint1",), SHARE)], motions, seed=2)
    diagnosis = diagnose(robot, case.recordings).diagnosis.to_json()
    assert diagnosis["findings"] == []
    assert [u["joints"] for u in diagnosis["unexplained"]] == [["joint1"]]


def test_a_damper_between_joints_is_no_viscous_friction():
    xml = random_robot(8, 3)
    robot = robot_from_model(arm_spec(xml).compile(), source="random robot")
    motions = three_motions(robot, 15.0, 500.0, seed=1)
    diagnosis = diagnose(
        robot, conceal(xml, [Concealment("cross_damping", ("joint3",), SHARE)], motions, seed=2).recordings
    ).diagnosis.to_json()
    # A tenth of it looks like dry friction.
    assert {f["effect"] for f in diagnosis["findings"]} <= {"coulomb_friction"}
    (rest,) = diagnosis["unexplained"]
    assert rest["joints"] == ["joint3"] and rest["share"] > 0.5


def test_viscous_friction_stays_beside_friction_that_grows_with_load_where_more_is_left():
    robot, joint = irb140(), ("joint2",)
    motions = three_motions(robot, 8.0, 500.0, seed=1)
    hidden = {"load_dependent_friction": SHARE, "viscous_friction": 0.06, "cross_damping": SHARE}
    case = conceal(str(irb140_path()), [Concealment(e, joint, share) for e, share in hidden.items()], motions, seed=2)
    diagnosis = diagnose(robot, case.recordings).diagnosis.to_json()
    found = {f["effect"] for f in diagnosis["findings"]}
    # Beside so much without a name, whether dry friction grows with load can't be told.
    assert "viscous_friction" in found and found <= {"load_dependent_friction", "coulomb_friction", "viscous_friction"}
    assert [u["joints"] for u in diagnosis["unexplained"]] == [["joint2"]]


@pytest.mark.parametrize("louder", [1.0, 100.0])
def test_what_one_recording_leaves_is_seen_to_go_with_time_however_much_louder_it_is(louder):
    rng, t = np.random.default_rng(0), 0.03 * np.arange(500)
    one: Any = SimpleNamespace(t=t, **{k: rng.normal(size=(500, 1)) for k in ("q", "qd", "qdd", "nominal")})
    quiet, slow = rng.normal(size=500), np.sqrt(2.0) * np.sin(2.0 * np.pi * 0.3 * t)
    rows = Rows(
        [np.full(500, True)] * 2, np.append(quiet, slow), np.repeat([1.0, louder], 500), np.repeat([0, 1], 500)
    )
    time = competitors([one, one], 0, rows, ("hinge",))[-1]
    assert time.variable.startswith("time")
    assert 0.4 < predicted(time, rows.residual[:, None])[0] < 0.6  # all of one recording, nothing of the other


@pytest.mark.parametrize("lasts", [3.0, 40.0])
def test_a_short_time_that_holds_most_of_what_is_left_is_told_and_a_long_one_is_not(lasts):
    rng, t = np.random.default_rng(1), 5.0 + 0.05 * np.arange(1200)
    logs: Any = [SimpleNamespace(recording=k, t=t, tau=np.full((1200, 1), 50.0)) for k in (0, 1)]
    left = [rng.normal(size=1200), rng.normal(size=1200)]
    left[1][(t > 20.0) & (t < 20.0 + lasts)] *= 30.0
    when = shortest(logs, left, 0)
    if lasts > settings.BRIEF * 120.0:
        assert when is None
        return
    assert when is not None and when.recording == 1
    assert 20.0 < when.begin < when.end < 20.0 + lasts
    assert settings.MOST_OF_ERROR <= when.share < settings.MOST_OF_ERROR + 0.05
    assert when.of_torque == pytest.approx(30.0 / 50.0, rel=0.2)


def test_what_the_teeth_of_a_gear_leave_goes_with_position_and_direction():
    t = 0.02 * np.arange(1500)
    q = np.sin(0.7 * t) + 0.5 * np.sin(1.1 * t + 1.0)
    qd = 0.7 * np.cos(0.7 * t) + 0.55 * np.cos(1.1 * t + 1.0)
    columns = {"q": q, "qd": qd, "qdd": np.gradient(qd, t), "nominal": np.cos(q)}
    one: Any = SimpleNamespace(t=t, **{k: v[:, None] for k, v in columns.items()})
    teeth = np.sign(qd) * np.sin(2.0 * np.pi * 9.0 * q)
    rows = Rows([np.full(1500, True)], teeth, np.ones(1500), np.zeros(1500, int))
    shares = {c.variable: predicted(c, rows.residual[:, None])[0] for c in competitors([one], 0, rows, ("hinge",))}
    along = shares.pop("the joint's position and its direction of motion")
    assert along > 0.8 and max(shares.values()) < 0.5
