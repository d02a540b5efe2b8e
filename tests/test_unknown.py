"""Physics in no library, made by MuJoCo: it is located by joint and by variables, and no name is forced upon it."""

from types import SimpleNamespace
from typing import Any

import helpers_recordings as made
import numpy as np
import pytest
from scipy import signal

from irb140_jax.mismatch import diagnose, settings
from irb140_jax.mismatch.output.notes import slight_notes
from irb140_jax.mismatch.regression.discrepancy import relaxed
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.validation import unexplained
from irb140_jax.mismatch.validation.competitors import Axis, Rows, competitors
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.unexplained import carrier, narrowest, predicted, shortest
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import irb140, irb140_path, robot_from_model
from testbed import scoring

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
    columns = {k: rng.normal(size=(500, 1)) for k in ("q", "qd", "qdd", "nominal", "tau")}
    one: Any = SimpleNamespace(t=t, begin=0.0, motion=0, **columns)
    quiet, slow = rng.normal(size=500), np.sqrt(2.0) * np.sin(2.0 * np.pi * 0.3 * t)
    rows = Rows(
        [np.full(500, True)] * 2, np.append(quiet, slow), np.repeat([1.0, louder], 500), np.repeat([0, 1], 500)
    )
    time = competitors([one, one], 0, rows, ("hinge",))[-1]
    assert time.variable.startswith("time")
    share = predicted(time, rows.residual[:, None], rows)[0]
    assert 0.4 < share < 0.6  # all of one recording, nothing of the other


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


@pytest.mark.parametrize("stop", [0.9, 0.2])
def test_a_narrow_part_of_the_range_that_holds_most_of_what_is_left_is_told_and_a_wide_one_is_not(stop):
    rng, t = np.random.default_rng(2), 0.01 * np.arange(4000)
    q = np.sin(t)[:, None]
    logs: Any = [SimpleNamespace(q=q), SimpleNamespace(q=-q)]
    left = [rng.normal(size=4000) * np.where(s.q[:, 0] > stop, 30.0, 1.0) for s in logs]
    where = narrowest(logs, left, Axis("q", 0))
    assert narrowest(logs, left, Axis("t", 0)) is None
    if 1.0 - stop > 2.0 * settings.BRIEF:
        assert where is None
        return
    assert where is not None and stop < where.begin < where.end < 1.0
    assert settings.MOST_OF_ERROR <= where.share < settings.MOST_OF_ERROR + 0.01


T = 0.02 * np.arange(1500)


def moving(slow, fast, phase):
    """Position, speed and acceleration of a joint."""
    q = np.sin(slow * T) + 0.5 * np.sin(fast * T + phase)
    qd = slow * np.cos(slow * T) + 0.5 * fast * np.cos(fast * T + phase)
    return q, qd, np.gradient(qd, T)


def competing(law):
    """The competitors that know the motion, and the share that each predicts of what `law` leaves at one of two joints.
    """
    joints = [moving(0.7, 1.1, 1.0), moving(0.53, 1.37, 2.0)]
    columns = {name: np.stack([x[k] for x in joints], axis=1) for k, name in enumerate(("q", "qd", "qdd"))}
    columns["nominal"] = columns["tau"] = np.cos(columns["q"]) + 0.1 * columns["qdd"]
    one: Any = SimpleNamespace(t=T, begin=0.0, motion=0, **columns)
    rows = Rows([np.full(1500, True)], law(columns), np.ones(1500), np.zeros(1500, int))
    rivals = [c for c in competitors([one], 0, rows, ("hinge", "neighbour")) if c.shifts]
    return rivals, np.array([predicted(c, rows.residual[:, None], rows)[0] for c in rivals])


def hose(x):
    """A spring that gives way within a second."""
    return signal.lfilter([1.0, -1.0], [1.0, -np.exp(-0.02)], x["q"][:, 0])


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda x: np.sign(x["qd"][:, 0]) * np.sin(18.0 * np.pi * x["q"][:, 0]),
         "the joint's position and its direction of motion"),
        (lambda x: np.exp(-((x["q"][:, 0] - 0.3) ** 2) / 0.01), "the joint's position"),
        (lambda x: np.sign(x["qd"][:, 0]) * (1.0 + 0.9 * np.sin(3.0 * x["q"][:, 1])),
         "the position of neighbour and the joint's own direction of motion"),
        (lambda x: x["qd"][:, 0] * x["qd"][:, 1], "the motion of neighbour together with the joint's own"),
        (lambda x: relaxed(x["q"][:, 0], 0.6), "the joint's own past"),
        (hose, "the joint's own past"),
    ],
    ids=["teeth", "latch", "led cable", "gyroscope", "hysteresis", "hose"],
)  # fmt: skip
def test_what_is_left_is_said_to_depend_on_what_made_it(law, words):
    rivals, shares = competing(law)  # without time, with which whatever is slow goes as well
    chosen = carrier(rivals, shares)
    assert rivals[chosen].variable == words and shares[chosen] > 0.8


def test_what_a_neighbours_torque_makes_in_loud_and_quiet_recordings_is_said_to_depend_on_it():
    """A constant and a factor are the same in every recording, however much louder one is than another."""
    q, qd, qdd = moving(0.7, 1.1, 1.0)
    there = moving(0.53, 1.37, 2.0)
    logs, left = [], []
    for i, (share, torque) in enumerate(((1.0, 10.0 * there[2]), (0.1, 5.0 + q))):
        pairs = {"q": (share * q, there[0]), "qd": (share * qd, there[1]), "qdd": (share * qdd, there[2]),
                 "nominal": (np.cos(share * q), 0.0 * T), "tau": (np.cos(share * q), torque)}  # fmt: skip
        columns = {k: np.stack(v, axis=1) for k, v in pairs.items()}
        rows = {"use": np.full((1500, 2), True), "unsure": np.zeros((1500, 2))}
        logs.append(SimpleNamespace(recording=i, motion=i, t=T, begin=0.0, **rows, **columns))
        left.append(np.stack([torque, 0.0 * T], axis=1))
    loud, quiet = np.full(2, 10.0), np.full(2, 0.2)
    noise = Noise(np.eye(1, 11).repeat(2, axis=0), np.stack([loud, quiet]), np.stack([loud, quiet]), np.ones(2))
    ex: Any = SimpleNamespace(noise=noise, data=SimpleNamespace(stretches=logs))
    proof: Any = SimpleNamespace(left=left)
    left_over = unexplained._rows(ex, proof, 0)
    rivals = competitors(logs, 0, left_over, ("hinge", "neighbour"))
    shares = {c.variable: predicted(c, left_over.residual[:, None], left_over)[0] for c in rivals}
    assert max(shares, key=lambda k: shares[k]) == "the torque of neighbour"
    assert shares["the torque of neighbour"] > 0.95


def test_what_goes_with_time_in_repeats_of_a_motion_is_not_said_to_go_with_the_motion():
    joints = [moving(0.7, 1.1, 1.0), moving(0.53, 1.37, 2.0)]
    columns = {name: np.stack([x[k] for x in joints], axis=1) for k, name in enumerate(("q", "qd", "qdd"))}
    columns["nominal"] = columns["tau"] = np.cos(columns["q"])
    one: Any = SimpleNamespace(t=T, begin=0.0, motion=0, **columns)
    rng = np.random.default_rng(0)
    blocks = np.repeat(rng.normal(size=60), 25)  # the same in every repeat, and unlike anything of the motion
    rows = Rows([np.full(1500, True)] * 3, np.tile(blocks, 3), np.ones(4500), np.repeat(np.arange(3), 1500))
    rivals = competitors([one] * 3, 0, rows, ("hinge", "neighbour"))
    shares = {c.variable: predicted(c, rows.residual[:, None], rows)[0] for c in rivals}
    assert shares.pop("time or on the motion, which repeats of it can't tell apart") > 0.95
    assert max(shares.values()) < 0.1


@pytest.mark.parametrize(("size", "scatter", "matters", "slight"), [
    (0.05, 0.001, True, False), (0.01, 0.001, False, True), (0.01, 0.01, False, False),
])  # fmt: skip
def test_structure_of_little_torque_is_told_apart_and_only_above_the_noise_of_the_sensors(
    size, scatter, matters, slight
):
    q, qd, qdd = moving(0.7, 1.1, 1.0)
    tau = np.cos(q) + 0.1 * qdd
    tau -= np.mean(tau)
    columns = {k: x[:, None] for k, x in {"q": q, "qd": qd, "qdd": qdd, "nominal": tau, "tau": tau}.items()}
    use = np.full((1500, 1), True)
    one: Any = SimpleNamespace(
        recording=0, motion=0, t=T, begin=0.0, use=use, unsure=np.zeros((1500, 1)), **columns)  # fmt: skip
    noise = Noise(np.eye(1, 11), np.full((1, 1), 1e-3), np.full((1, 1), 1e-3), np.ones(1))
    robot = made.robot(pendulum=True)
    ex: Any = SimpleNamespace(noise=noise, data=SimpleNamespace(stretches=[one]), lib=SimpleNamespace(robot=robot))
    law = np.sign(qd) * np.sin(9.0 * np.pi * q)  # as of teeth
    left = [(size * np.std(tau) * law / np.std(law))[:, None]]
    proof = HeldOut(left, left, left, left, left, [use], [use], np.zeros(1, dtype=bool))
    found = unexplained.unexplained(ex, proof, np.array([scatter * np.std(tau)]))
    assert [len(x) for x in found] == [matters, slight]
    notes = slight_notes(robot, found[1])
    assert len(notes) == slight
    if slight:
        assert found[1][0].of_torque == pytest.approx(size, rel=0.1)
        told = notes[0].partition(scoring.SLIGHT)[2]  # by this, testbed/ knows the note
        assert told.startswith("hinge ")
        assert "% of its torque), which depends on the joint's position and its direction of motion" in told
