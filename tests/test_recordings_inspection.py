"""A first look at a log tells columns, units, sides and what is doubtful, and drafts a map with which it is read."""

import helpers_formats as formats
import helpers_recordings as made
import numpy as np
import pandas as pd
import pytest

from irb140_jax.cli import main
from irb140_jax.recordings import Recording, read_recording
from irb140_jax.recordings.guess import channels, time_column
from irb140_jax.recordings.inspection import Inspection, inspect_recording

JOINTS = ("shoulder", "elbow", "wrist")
CONSTANT = np.array([12.0, 7.0, 3.0])  # N m/A at the joint


@pytest.fixture(scope="module")
def robot():
    return made.robot()


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording(duration=6.0)


def look_at(tmp_path, table: dict, robot=None) -> Inspection:
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    return inspect_recording(tmp_path / "log.csv", robot)


def log(sound, q="q.{joint}", qd=None, tau="tau.{joint}", angle=1.0, torque=1.0, first=1) -> dict:
    table = {"t": sound.t}
    for j, joint in enumerate(JOINTS):
        table[q.format(joint=joint, n=j + first)] = sound.q[:, j] * angle
        if qd:
            table[qd.format(joint=joint, n=j + first)] = sound.qd[:, j] * angle
        table[tau.format(joint=joint, n=j + first)] = sound.tau[:, j] * np.broadcast_to(torque, 3)[j]
    return table


def units(look: Inspection, quantity: str) -> set[str]:
    return {channel.likely.unit for channel in look.channels if channel.name.startswith(quantity + ".")}


def doubts(look: Inspection) -> str:
    return " ".join([*(f"{c.name}: {doubt}" for c in look.channels for doubt in c.doubts), *look.doubts])


@pytest.mark.parametrize(("names", "wanted"), [
    (["time", "pos_meas1", "pos_filt1", "vel_meas1", "tau_con1", "tau_meas1", "tau_fric1"],
     {"q": "pos_meas1", "qd": "vel_meas1", "tau": "tau_meas1"}),
    (["timestamp", "target_q_0", "actual_q_0", "actual_qd_0", "actual_current_0", "target_moment_0", "actual_TCP_0"],
     {"q": "actual_q_0", "qd": "actual_qd_0", "tau": "actual_current_0", "qdes": "target_q_0"}),
    (["__time", "/joint_states/base/position", "/joint_states/base/velocity", "/joint_states/base/effort"],
     {"q": "/joint_states/base/position", "qd": "/joint_states/base/velocity", "tau": "/joint_states/base/effort"}),
    (["timestamp", "observation.state.base.pos", "observation.state.base.torque", "action.base.pos"],
     {"q": "observation.state.base.pos", "tau": "observation.state.base.torque", "qdes": "action.base.pos"}),
    (["TIME", "POSITION", "CONTROL_POSITION", "VELOCITY", "TORQUE", "Q_CURRENT", "MOTOR_TEMPERATURE"],
     {"q": "POSITION", "qd": "VELOCITY", "tau": "TORQUE", "qdes": "CONTROL_POSITION"}),
    (["t", "Axis 1 [deg]", "Axis 1 (Nm)"], {"q": "Axis 1 [deg]", "tau": "Axis 1 (Nm)"}),
    (["Time", "actPos1", "actVel1", "motorCurrent1", "setPos1"],
     {"q": "actPos1", "qd": "actVel1", "tau": "motorCurrent1", "qdes": "setPos1"}),
    (["Zeit", "Achse 1 Ist-Position", "Achse 1 Soll-Position", "Achse 1 Drehmoment"],
     {"q": "Achse 1 Ist-Position", "qdes": "Achse 1 Soll-Position", "tau": "Achse 1 Drehmoment"}),
    (["t", "q1", "dq1", "ddq1", "tau1"], {"q": "q1", "qd": "dq1", "qdd": "ddq1", "tau": "tau1"}),
])  # fmt: skip
def test_names_as_loggers_give_them_are_understood(names, wanted):
    found = channels(names, {}, ("base",))
    assert {quantity: joints["base"][0].column for quantity, joints in found.items()} == wanted
    assert time_column(names) == names[0]


@pytest.mark.parametrize("pattern", ["Axis {n} position", "j{n}_pos", "actual_q_{n}", "{joint}_angle", "pos.{joint}"])
def test_a_log_of_radians_and_newton_metres_is_read_with_the_drafted_map(sound, robot, tmp_path, pattern):
    torque = pattern.replace("position", "torque").replace("pos", "torque").replace("angle", "torque")
    table = log(sound, pattern, tau=torque.replace("q", "torque") if "torque" not in torque else torque)
    look = look_at(tmp_path, table, robot)
    assert look.refusal == "" and units(look, "q") == {"rad"} and units(look, "tau") == {"N m"}
    (tmp_path / "map.toml").write_text(look.map)
    again = read_recording(tmp_path / "log.csv", robot, tmp_path / "map.toml")
    np.testing.assert_allclose(again.tau, sound.tau, rtol=1e-12)


def test_joints_numbered_from_zero_are_written_so(sound, robot, tmp_path):
    look = look_at(tmp_path, log(sound, "actual_q_{n}", tau="torque_{n}", first=0), robot)
    assert "first_number = 0" in look.map and '"q.*" = "actual_q_{n}"' in look.map and look.refusal == ""


@pytest.mark.parametrize("with_speeds", [False, True])
def test_degrees_are_told_by_the_model_where_the_range_does_not(robot, tmp_path, with_speeds):
    # So small a motion that its degrees could be radians.
    small = made.recording(duration=6.0, size=0.05)
    look = look_at(tmp_path, log(small, qd="qd.{joint}" if with_speeds else None, angle=180 / np.pi), robot)
    assert units(look, "q") == {"deg"}
    assert not with_speeds or units(look, "qd") == {"deg/s"}
    assert look.refusal == ""


def test_speeds_in_turns_a_minute_are_told_by_the_derivative(sound, tmp_path):
    table = log(sound) | {f"{joint} speed": sound.qd[:, j] * 60 / (2 * np.pi) for j, joint in enumerate(JOINTS)}
    assert units(look_at(tmp_path, table), "qd") == {"rpm"}


def test_milli_newton_metres_are_told_by_the_model(sound, robot, tmp_path):
    look = look_at(tmp_path, log(sound, torque=1000.0), robot)
    assert units(look, "tau") == {"mN m"} and look.refusal == ""


def test_torque_on_the_motors_side_gives_an_estimate_of_the_gear(sound, robot, tmp_path):
    look = look_at(tmp_path, log(sound, torque=1 / 80.0), robot)
    assert {c.likely.side for c in look.channels if c.name.startswith("tau.")} == {"motor"}
    ratios = [c.likely.constants["gear_ratio"] for c in look.channels if c.name in ("tau.shoulder", "tau.elbow")]
    np.testing.assert_allclose(ratios, 80.0, rtol=0.1)
    assert "put the data sheet's value here" in look.map


@pytest.mark.parametrize(("name", "section", "factor"), [
    ("current {n}", "torque_constant", 1.0), ("load {n}", "rated_torque", 100.0),
])  # fmt: skip
def test_currents_and_shares_give_an_estimate_of_their_constant(sound, robot, tmp_path, name, section, factor):
    look = look_at(tmp_path, log(sound, "position {n}", tau=name, torque=factor / CONSTANT), robot)
    found = [c.likely.constants[section] for c in look.channels if c.name.startswith("tau.")]
    np.testing.assert_allclose(found[:2], CONSTANT[:2], rtol=0.1)
    assert f"[{section}]" in look.map and look.refusal == ""


def test_a_current_without_a_model_leaves_the_constant_to_be_filled_in(sound, tmp_path):
    look = look_at(tmp_path, log(sound, tau="current.{joint}"))
    assert '# "tau.shoulder" =   # fill in' in look.map and "torque_constant" in look.refusal


def spoiled(sound, column, value):
    table = log(sound, qd="qd.{joint}")
    table[column] = value(np.array(table[column]))
    return table


def frozen(x):
    return np.where(np.arange(len(x)) > 0.6 * len(x), x[int(0.6 * len(x))], x)


@pytest.mark.parametrize(("column", "value", "says"), [
    ("tau.elbow", lambda x: 0 * x, "tau.elbow: dead: 0 in every row"),
    ("tau.elbow", frozen, "tau.elbow: frozen: one value for 2.4 s (40% of the rows)"),
    ("tau.elbow", lambda x: np.clip(x, -3, 3), "tau.elbow: saturated?"),
    ("q.elbow", lambda x: np.round(x, 2), "q.elbow: coarse: comes in steps of 0.01"),
    ("tau.elbow", np.abs, "tau.elbow: never negative"),
    ("tau.elbow", lambda x: -x, "tau.elbow: reversed?"),
    ("qd.elbow", lambda x: -x, "qd.elbow: reversed"),
    ("q.wrist", lambda x: np.where(np.arange(len(x)) == 9, np.nan, x), "q.wrist: 0.07% missing"),
])  # fmt: skip
def test_what_is_doubtful_is_said(sound, robot, tmp_path, column, value, says):
    assert says in doubts(look_at(tmp_path, spoiled(sound, column, value), robot))


def test_a_sound_log_raises_no_doubt(sound, robot, tmp_path):
    assert doubts(look_at(tmp_path, log(sound, qd="qd.{joint}"), robot)) == ""


@pytest.mark.parametrize("kind", ["qd", "tau"])
def test_exchanged_channels_are_said(sound, robot, tmp_path, kind):
    table = log(sound, qd="qd.{joint}")
    table[f"{kind}.elbow"], table[f"{kind}.wrist"] = table[f"{kind}.wrist"], table[f"{kind}.elbow"]
    said = doubts(look_at(tmp_path, table, robot))
    assert "xchanged" in said and f"{kind}.elbow" in said and f"{kind}.wrist" in said


def test_joints_without_columns_are_named(sound, robot, tmp_path):
    table = {name: values for name, values in log(sound).items() if name not in ("q.wrist", "tau.elbow")}
    assert "No position is found for wrist" in doubts(look_at(tmp_path, table, robot))
    assert "No torque or current is found for elbow" in doubts(look_at(tmp_path, table, robot))


def test_columns_that_name_joints_only_are_said(sound, tmp_path):
    table = {"t": sound.t} | {f"Joint_{n}": sound.q[:, n - 1] for n in (1, 2, 3)}
    assert '"q.*" = "Joint_{n}"' in doubts(look_at(tmp_path, table))


def test_milliseconds_are_told_by_their_step(sound, tmp_path):
    look = look_at(tmp_path, log(sound) | {"t": 1000 * sound.t})
    assert look.time_unit == "ms" and 't = "ms"' in look.map and look.refusal == ""


def test_the_command_shows_a_look_and_writes_a_map_that_diagnose_takes(sound, tmp_path, capsys):
    formats.write_plotjuggler(sound, tmp_path / "log.csv")
    assert main(["inspect", str(tmp_path / "log.csv"), "--write-columns", str(tmp_path / "map.toml")]) == 0
    out = capsys.readouterr().out
    assert "250 per second" in out and "/joint_states/elbow/position" in out and "--columns" in out
    again = read_recording(tmp_path / "log.csv", made.robot(), tmp_path / "map.toml")
    np.testing.assert_allclose(again.q, sound.q, rtol=1e-12)


def test_a_map_that_is_there_is_never_replaced(sound, tmp_path, capsys):
    formats.write_plotjuggler(sound, tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text("# mine")
    assert main(["inspect", str(tmp_path / "log.csv"), "--write-columns", str(tmp_path / "map.toml")]) == 2
    assert "exists already" in capsys.readouterr().err and (tmp_path / "map.toml").read_text() == "# mine"
