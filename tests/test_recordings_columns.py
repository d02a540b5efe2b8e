"""The column map: every line does what it says, or is refused with what would be right."""

import helpers_recordings as made
import numpy as np
import pandas as pd
import pytest

from irb140_jax.errors import RecordingError
from irb140_jax.recordings import Recording, recorded_joints
from irb140_jax.recordings.read import unchecked_recording

JOINTS = ("shoulder", "elbow", "wrist")


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording(duration=2.0)


def read(tmp_path, table: dict, lines: str, joints=JOINTS) -> Recording:
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.toml").write_text(lines)
    return unchecked_recording(tmp_path / "log.csv", joints, tmp_path / "map.toml")


def columns(sound, q="q.{joint}", tau="tau.{joint}", first=1) -> dict:
    """The columns of a recording under other names."""
    table = {"t": sound.t}
    for j, joint in enumerate(JOINTS):
        table[q.format(joint=joint, n=j + first)] = sound.q[:, j]
        table[tau.format(joint=joint, n=j + first)] = sound.tau[:, j]
    return table


def refusal(tmp_path, table, lines) -> str:
    with pytest.raises(RecordingError) as caught:
        read(tmp_path, table, lines)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def assert_same(again, sound):
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(sound, name), rtol=1e-9, atol=1e-9)


def test_numbered_joints_are_found_by_their_number(sound, tmp_path):
    table = columns(sound, "Axis {n} position", "Axis {n} torque")
    lines = '[columns]\n"q.*" = "Axis {n} position"\n"tau.*" = "Axis {n} torque"'
    assert_same(read(tmp_path, table, lines), sound)


def test_numbers_may_begin_at_zero_and_have_leading_zeros(sound, tmp_path):
    table = columns(sound, "actual_q_{n}", "tau_{n:02d}", first=0)
    lines = 'first_number = 0\n[columns]\n"q.*" = "actual_q_{n}"\n"tau.*" = "tau_{n:02}"'
    assert_same(read(tmp_path, table, lines), sound)


def test_numbers_may_follow_another_order_of_joints(sound, tmp_path):
    lines = 'joints = ["wrist", "shoulder", "elbow"]\n[columns]\n"q.*" = "q{n}"\n"tau.*" = "tau{n}"'
    again = read(tmp_path, columns(sound, "q{n}", "tau{n}"), lines)
    np.testing.assert_allclose(again.q[:, [2, 0, 1]], sound.q, rtol=1e-9)


def test_current_on_the_motor_side_becomes_torque_on_the_joint_side(sound, tmp_path):
    constant, ratio = np.array([0.11, 0.05, 0.02]), np.array([100.0, -80.0, 50.0])
    table = columns(sound, tau="current.{joint}")
    for j, joint in enumerate(JOINTS):
        table[f"current.{joint}"] = sound.tau[:, j] / (constant[j] * ratio[j])
    lines = '[columns]\n"tau.*" = "current.*"\n[scale]\n"tau.*" = "A"\n[torque_constant]\n'
    lines += "\n".join(f"{joint} = {constant[j]}" for j, joint in enumerate(JOINTS)) + "\n[gear_ratio]\n"
    lines += "\n".join(f'"tau.{joint}" = {ratio[j]}' for j, joint in enumerate(JOINTS))
    assert_same(read(tmp_path, table, lines), sound)


def test_a_gear_ratio_of_a_joint_holds_for_its_motion_and_its_torque(sound, tmp_path):
    table = columns(sound)
    for joint in JOINTS:
        table[f"q.{joint}"], table[f"tau.{joint}"] = 50 * table[f"q.{joint}"], table[f"tau.{joint}"] / 50
    assert_same(read(tmp_path, table, '[gear_ratio]\n"*" = 50'), sound)


@pytest.mark.parametrize(("unit", "factor"), [("% of rated", 100.0), ("per mille of rated", 1000.0)])
def test_a_share_of_the_rated_torque_becomes_torque(sound, tmp_path, unit, factor):
    table = columns(sound)
    for joint in JOINTS:
        table[f"tau.{joint}"] = table[f"tau.{joint}"] / 12.5 * factor
    assert_same(read(tmp_path, table, f'[scale]\n"tau.*" = "{unit}"\n[rated_torque]\n"*" = 12.5'), sound)


def test_a_zero_and_a_sign_turn_the_reading_into_the_models_angle(sound, tmp_path):
    table = columns(sound)
    table["q.elbow"] = np.degrees(-sound.q[:, 1]) + 90.0
    table["tau.elbow"] = -sound.tau[:, 1]
    lines = '[scale]\n"q.elbow" = "deg"\n[sign]\nelbow = -1\n[zero]\nelbow = "90 deg"'
    assert_same(read(tmp_path, table, lines), sound)


def test_coupled_motors_are_taken_apart_by_the_matrix(sound, tmp_path):
    C = np.array([[1.0, 0.0], [0.4, -1.2]])
    table = columns(sound)
    motor_q, motor_tau = sound.q[:, 1:] @ np.linalg.inv(C).T, sound.tau[:, 1:] @ C
    for i, joint in enumerate(JOINTS[1:]):
        table[f"q.{joint}"], table[f"tau.{joint}"] = motor_q[:, i], motor_tau[:, i]
    # Power is the same on both sides; this is what the transposed inverse stands for.
    rate = lambda q: np.gradient(q, axis=0)  # noqa: E731
    np.testing.assert_allclose((motor_tau * rate(motor_q)).sum(1), (sound.tau * rate(sound.q))[:, 1:].sum(1), atol=1e-9)
    assert_same(read(tmp_path, table, '[coupling]\njoints = ["elbow", "wrist"]\nmatrix = [[1, 0], [0.4, -1.2]]'), sound)


def test_a_part_in_time_is_cut_out(sound, tmp_path):
    again = read(tmp_path, columns(sound), "from = 0.5\nto = 1.5")
    assert again.t[0] == 0.5 and again.t[-1] == 1.5


def test_commanded_positions_are_mapped_with_their_unit(sound, tmp_path):
    table = columns(sound) | {f"target {n}": np.degrees(sound.q[:, n - 1]) for n in (1, 2, 3)}
    again = read(tmp_path, table, '[columns]\n"qdes.*" = "target {n}"\n[scale]\n"qdes.*" = "deg"')
    np.testing.assert_allclose(again.extras["qdes.elbow"], sound.q[:, 1], atol=1e-9)


def test_lines_of_joints_that_are_held_are_left_aside(sound, tmp_path):
    table = columns(sound, "pos {n}", "eff {n}")
    del table["eff 1"]
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.toml").write_text('[columns]\n"q.*" = "pos {n}"\n"tau.*" = "eff {n}"\n[sign]\nshoulder = -1')
    again = unchecked_recording(tmp_path / "log.csv", JOINTS[1:], tmp_path / "map.toml", known_joints=JOINTS)
    np.testing.assert_allclose(again.q, sound.q[:, 1:], rtol=1e-12)


def test_numbers_of_joints_in_the_middle_need_a_list(sound, tmp_path):
    table = columns(sound, "pos {n}", "eff {n}")
    del table["eff 1"]
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    lines = '[columns]\n"q.*" = "pos {n}"\n"tau.*" = "eff {n}"'
    (tmp_path / "map.toml").write_text(lines)
    with pytest.raises(RecordingError, match="say whose numbers they are"):
        recorded_joints(tmp_path / "log.csv", tmp_path / "map.toml", JOINTS)
    (tmp_path / "map.toml").write_text('joints = ["shoulder", "elbow", "wrist"]\n' + lines)
    assert recorded_joints(tmp_path / "log.csv", tmp_path / "map.toml", JOINTS) == ("elbow", "wrist")
    # The same numbers hold where only these two are known.
    again = unchecked_recording(tmp_path / "log.csv", JOINTS[1:], tmp_path / "map.toml")
    np.testing.assert_allclose(again.q, sound.q[:, 1:], rtol=1e-12)


def test_a_star_that_finds_some_joints_leaves_the_others(sound, tmp_path):
    table = columns(sound, "pos {n}", "eff {n}")
    del table["pos 2"], table["eff 2"]
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    lines = '[columns]\n"q.*" = "pos {n}"\n"tau.*" = "eff {n}"'
    (tmp_path / "map.toml").write_text('joints = ["shoulder", "elbow", "wrist"]\n' + lines)
    assert recorded_joints(tmp_path / "log.csv", tmp_path / "map.toml", JOINTS) == ("shoulder", "wrist")


@pytest.mark.parametrize(("lines", "says"), [
    ('[columns]\n"q.*" = "pos_*"', "q.* = 'pos_*', for q.shoulder 'pos_shoulder', but the recording has no"),
    ('[columns]\n"q.*" = "q.elbow"', "gives column 'q.elbow' to q.shoulder and to q.elbow"),
    ('[columns]\n"q.elbow" = "q.wrist"\n"q.wrist" = "q.wrist"', "gives column 'q.wrist' to"),
    ('[scale]\n"tua.*" = -1', "[scale] tua.* = -1 matches no column of the recording"),
    ('[scale]\n"qd.elbow" = "deg/s"', "[scale] qd.elbow = 'deg/s' matches no column"),
    ('[offset]\n"temperature.elbow" = 3', "[offset] temperature.elbow = 3 matches no column"),
    ('[scale]\n"tau.*" = "A"', "[torque_constant] \"tau.shoulder\" = N m/A"),
    ('[scale]\n"tau.*" = "%"', "[rated_torque] \"tau.shoulder\" = N m"),
    ('[scale]\n"tau.*" = "mN m"\n[torque_constant]\n"*" = 0.1', "leave one of them out"),
    ('[rated_torque]\nelbow = 3', "its unit is no share of it"),
    ('[scale]\n"q.*" = 0', "not 0"),
    ('[scale]\n"q.*" = true', "allowed is a number"),
    ('[scale]\n"q.*" = nan', "allowed is a number"),
    ('[sign]\nelbow = 2', "allowed is 1 or -1"),
    ('[sign]\nknee = 1', "the joints are shoulder, elbow, wrist"),
    ('[zero]\n"tau.elbow" = 1', "the joints are shoulder, elbow, wrist"),
    ('[zero]\nelbow = "90 grad"', "\"90 deg\""),
    ('[gear_ratio]\nelbow = 0', "allowed is a number, not 0"),
    ('[coupling]\njoints = ["elbow", "wrist"]\nmatrix = [[1, 1], [1, 1]]', "can't be inverted"),
    ('[coupling]\njoints = ["elbow", "wrist"]\nmatrix = [[1, 1, 1]]', "2 rows of 2 numbers"),
    ('[coupling]\njoints = ["elbow"]', "needs joints"),
    ('[coupling]\njoints = ["elbow", "wrist"]\nmatrix = [[1, 0], [1, 1]]\nchannels = ["qd"]', "needs qd.elbow"),
    ("from = 1\nto = 0.5", "is not before"),
    ("from = 50", "leaves no row"),
    ('encoding = "klingon"', "allowed is a name"),
    ('separator = "ab"', "allowed is one sign"),
    ('decimal = ";"', "allowed is"),
    ("first_number = -1", "allowed is a whole number"),
    ('joints = ["elbow", "elbow"]', "list of different joints"),
    ("a = " + 2000 * "[" + 2000 * "]", "is not TOML"),
    ('frmo = 1', "unknown section 'frmo'; did you mean 'from'?"),
])  # fmt: skip
def test_a_line_that_can_not_be_meant_is_refused(sound, tmp_path, lines, says):
    assert says in refusal(tmp_path, columns(sound), lines)
