"""Files become recordings, and what is wrong with a file is said in one line that names it."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pandas as pd
import pytest

from irb140_jax.errors import RecordingError
from irb140_jax.recordings import (
    Recording,
    read_recording,
    recorded_joints,
    recording_columns,
    rows_of,
    write_recording,
)
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.condition import condition


@pytest.fixture(scope="module")
def robot():
    return made.robot()


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording()


@pytest.fixture
def frame(sound):
    return made.frame(sound)


def written(frame, tmp_path, name="log.csv", **options):
    path = tmp_path / name
    frame.to_csv(path, index=False, **options)
    return path


def refusal(path, robot, columns=None) -> str:
    with pytest.raises(RecordingError) as caught:
        read_recording(path, robot, columns)
    message = str(caught.value)
    assert "\n" not in message, "one line, so that the command line prints one line"
    assert path.name in message or str(columns) in message
    return message


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz"])
def test_what_is_written_is_read_back(sound, robot, tmp_path, suffix):
    again = read_recording(write_recording(sound, tmp_path / f"log{suffix}"), robot)
    # Parquet and NPZ hold the bits; CSV's decimals are parsed to within one unit in the last place.
    for name in ("t", "q", "qd", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(sound, name), rtol=4e-16, atol=0)
    assert again.qdd is None and again.joint_names == sound.joint_names
    assert again.source == f"log{suffix}" and again.notes == ()


def test_extra_columns_are_kept_with_their_holes(frame, robot, tmp_path):
    frame["temperature.elbow"] = np.where(np.arange(len(frame)) % 100 == 0, 31.5, np.nan)
    again = read_recording(written(frame, tmp_path), robot)
    np.testing.assert_array_equal(again.extras["temperature.elbow"], frame["temperature.elbow"])


def test_the_order_of_the_columns_does_not_matter(frame, sound, robot, tmp_path):
    again = read_recording(written(frame[sorted(frame.columns, reverse=True)], tmp_path), robot)
    np.testing.assert_allclose(again.tau, sound.tau, rtol=1e-15)


def test_a_header_with_blanks_after_the_commas_is_read(frame, sound, robot, tmp_path):
    path = written(frame, tmp_path)
    head, _, rest = path.read_text().partition("\n")
    path.write_text(head.replace(",", ", ") + "\n" + rest)
    assert len(read_recording(path, robot).t) == len(sound.t)


def test_semicolons_and_decimal_commas_are_read_and_stated(frame, sound, robot, tmp_path):
    again = read_recording(written(frame, tmp_path, sep=";", decimal=","), robot)
    np.testing.assert_allclose(again.q, sound.q, rtol=1e-14)
    assert "semicolons" in " ".join(again.notes)


def test_npz_may_hold_one_array_for_all_joints(sound, robot, tmp_path):
    np.savez(tmp_path / "log.npz", t=sound.t, q=sound.q, tau=sound.tau)
    again = read_recording(tmp_path / "log.npz", robot)
    np.testing.assert_array_equal(again.tau, sound.tau)
    assert again.qd is None


def test_a_missing_column_is_named_with_what_came_and_the_nearest_name(frame, robot, tmp_path):
    message = refusal(written(frame.rename(columns={"tau.elbow": "tau_elbow"}), tmp_path), robot)
    assert "missing column tau.elbow" in message
    assert "did you mean 'tau_elbow'?" in message and "q.shoulder" in message and "--columns" in message


def test_a_missing_time_column_is_named(frame, robot, tmp_path):
    assert "missing column t;" in refusal(written(frame.drop(columns="t"), tmp_path), robot)


@pytest.mark.parametrize(("name", "content", "says"), [
    ("log.csv", b"", "empty"),
    ("log.csv", b"t,q.shoulder\n", "no samples"),
    ("log.csv", b"\x00\x81\xff\xfe", "not a text file"),
    ("log.csv", b"0.0,1.0,2.0\n0.1,1.0,2.0\n", "holds numbers where names are needed"),
    ("log.csv", b"t,q,q\n0,1,2\n", "column q is there 2 times"),
    ("log.csv", b"t,q.shoulder\n0,1\n0,1,2,3\n", "can't read this as CSV"),
    ("log.parquet", b"no parquet", "can't read this as Parquet"),
    ("log.npz", b"no zip", "can't read this as NPZ"),
    ("log.xlsx", b"PK", "allowed is .csv (also packed"),
])
def test_a_file_that_is_no_table_is_refused(robot, tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    assert says in refusal(tmp_path / name, robot)


def test_a_file_that_is_not_there_is_refused(robot, tmp_path):
    assert "No such file" in refusal(tmp_path / "nowhere.csv", robot)


def test_a_folder_is_refused(robot, tmp_path):
    (tmp_path / "runs.csv").mkdir()
    assert "folder" in refusal(tmp_path / "runs.csv", robot)


def test_columns_of_different_length_are_refused(sound, robot, tmp_path):
    np.savez(tmp_path / "log.npz", t=sound.t, q=sound.q, tau=sound.tau[:-1])
    assert "differ in length" in refusal(tmp_path / "log.npz", robot)


def test_a_text_among_the_numbers_is_named_by_column_and_row(frame, robot, tmp_path):
    frame["q.wrist"] = frame["q.wrist"].astype(object)
    frame.loc[16, "q.wrist"] = "ERR"
    message = refusal(written(frame, tmp_path), robot)
    assert "column q.wrist, row 17" in message and "'ERR' is not a number" in message


def test_text_in_a_column_that_is_not_needed_is_left_out_and_stated(frame, robot, tmp_path):
    frame["mode"] = "auto"
    again = read_recording(written(frame, tmp_path), robot)
    assert "mode" not in again.extras and "Column mode holds text" in " ".join(again.notes)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_few_missing_values_are_interpolated_and_stated(frame, sound, robot, tmp_path, bad):
    frame.loc[[40, 41, 700], "q.elbow"] = bad
    again = read_recording(written(frame, tmp_path), robot)
    # The motion bends by less than this within two samples.
    np.testing.assert_allclose(again.q, sound.q, atol=1e-3)
    assert "q.elbow: 3 missing values filled by interpolation, the first at row 41" in again.notes


def test_a_number_beyond_all_reason_counts_as_missing(frame, robot, tmp_path):
    frame.loc[40, "tau.elbow"] = 1e30
    again = read_recording(written(frame, tmp_path), robot)
    assert np.abs(again.tau).max() < 1e3
    assert "tau.elbow: 1 missing value filled by interpolation, the first at row 41" in again.notes


def test_many_missing_values_are_refused(frame, robot, tmp_path):
    frame.loc[200:260, "tau.elbow"] = np.nan
    message = refusal(written(frame, tmp_path), robot)
    assert "column tau.elbow: 61 of 2000 values" in message and "row 201" in message


def test_a_column_without_values_is_refused(frame, robot, tmp_path):
    frame["tau.elbow"] = np.nan
    assert "column tau.elbow holds no finite value" in refusal(written(frame, tmp_path), robot)


def test_rows_before_the_first_value_of_a_channel_are_cut_off_and_stated(frame, robot, tmp_path):
    frame.loc[:30, "tau.elbow"] = np.nan
    again = read_recording(written(frame, tmp_path), robot)
    assert len(again.t) == len(frame) - 31 and again.t[0] == frame["t"][31]
    assert "31 rows at the ends" in " ".join(again.notes)


def test_speeds_full_of_holes_are_dropped_and_stated(frame, robot, tmp_path):
    frame.loc[100:900, "qd.elbow"] = np.nan
    again = read_recording(written(frame, tmp_path), robot)
    assert again.qd is None and "derived from q instead" in " ".join(again.notes)


def test_speeds_of_some_joints_only_are_left_aside_and_stated(frame, robot, tmp_path):
    again = read_recording(written(frame.drop(columns="qd.elbow"), tmp_path), robot)
    assert again.qd is None and "qd.wrist" in again.extras and "qd.elbow is missing" in " ".join(again.notes)


def test_repeated_rows_are_dropped_and_stated(frame, sound, robot, tmp_path):
    again = read_recording(written(frame.iloc[[*range(100), 99, 99, *range(100, len(frame))]], tmp_path), robot)
    assert len(again.t) == len(sound.t)
    assert "2 rows repeating the row before in every column, the first at row 101, left out" in again.notes


@pytest.mark.parametrize(("value", "says"), [(0.1, "goes back"), (99 / 250, "stands still"), (np.nan, "is missing")])
def test_a_time_that_does_not_rise_is_named_by_row(frame, robot, tmp_path, value, says):
    frame.loc[100, "t"] = value
    message = refusal(written(frame, tmp_path), robot)
    assert "column t, row 101" in message and says in message


@pytest.mark.parametrize(("factor", "says"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_a_time_that_is_not_in_seconds_is_recognised(frame, robot, tmp_path, factor, says):
    frame["t"] *= factor
    message = refusal(written(frame, tmp_path), robot)
    assert f"looks like {says}" in message and f"t = {1 / factor:g}" in message


def test_too_few_samples_are_refused(frame, robot, tmp_path):
    assert "too short: 150 samples" in refusal(written(frame[:150], tmp_path), robot)


def test_too_short_a_time_is_refused(frame, robot, tmp_path):
    frame["t"] /= 10
    assert "too short: 0.8 s" in refusal(written(frame, tmp_path), robot)


def test_too_slow_a_rate_is_refused(robot, tmp_path):
    slow = made.frame(made.recording(duration=100.0, rate=4.0))
    assert "4 samples a second" in refusal(written(slow, tmp_path), robot)


def test_jitter_and_lost_samples_pass_and_are_stated(sound, robot, tmp_path):
    rng = np.random.default_rng(0)
    kept = np.sort(rng.choice(len(sound.t), 1800, replace=False))
    jittery = rows_of(sound, slice(None))
    frame = made.frame(jittery).iloc[kept]
    frame["t"] += rng.uniform(-0.3, 0.3, len(frame)) / 250
    again = read_recording(written(frame, tmp_path), robot)
    assert len(again.t) == 1800
    assert "samples are missing" in " ".join(again.notes) and "jitters" in " ".join(again.notes)


def test_a_gap_in_the_recording_passes_and_is_stated(frame, robot, tmp_path):
    again = read_recording(written(frame.drop(index=range(500, 700)), tmp_path), robot)
    assert "longest gap is 804 ms after row 500" in " ".join(again.notes)


MAP = """
[columns]
"t" = "stamp"
"q.*" = "pos_*"
"tau.*" = "effort_*"
"tau.elbow" = "current_elbow"
[scale]
"t" = "ms"
"q.*" = "deg"
"tau.elbow" = -2.0
[offset]
"q.wrist" = 0.5
"""


def mapped_frame(sound):
    table = {"stamp": 1000 * sound.t}
    for j, name in enumerate(sound.joint_names):
        table[f"pos_{name}"] = np.degrees(sound.q[:, j] - (0.5 if name == "wrist" else 0.0))
        table[f"effort_{name}"] = sound.tau[:, j]
    table["current_elbow"] = table.pop("effort_elbow") / -2.0
    return pd.DataFrame(table)


def test_a_column_map_gives_names_units_signs_and_offsets(sound, robot, tmp_path):
    (tmp_path / "map.toml").write_text(MAP)
    again = read_recording(written(mapped_frame(sound), tmp_path), robot, tmp_path / "map.toml")
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(sound, name), rtol=1e-12, atol=1e-12)


def test_a_column_map_may_exchange_columns_and_give_the_rate(frame, sound, robot, tmp_path):
    names = {"tau.elbow": "tau.wrist", "tau.wrist": "tau.elbow"}
    lines = [f'"{ours}" = "{theirs}"\n' for ours, theirs in names.items()]
    (tmp_path / "map.toml").write_text("rate = 250\n[columns]\n" + "".join(lines))
    path = written(frame.rename(columns=names).drop(columns="t"), tmp_path)
    again = read_recording(path, robot, tmp_path / "map.toml")
    np.testing.assert_allclose(again.tau, sound.tau, rtol=1e-15)
    np.testing.assert_allclose(again.t, sound.t, atol=1e-12)


@pytest.mark.parametrize(("text", "says"), [
    ('[columns]\n"t" = "tiem"', "no such column"),
    ('[columns]\n"q.knee" = "a"', "no joint 'knee'; its joints are shoulder, elbow, wrist"),
    ('[columns]\nq.elbow = "a"', "must be quoted"),
    ('[columns]\n"t" = 3', "allowed is the name of a column"),
    ('[scale]\n"q.*" = "gon"', "allowed is a number, not 0, or one of rad"),
    ('[columns\n', "is not TOML"),
    ('[colums]\n"t" = "t"', "unknown section 'colums'"),
    ("rate = -3", "allowed is a positive number"),
])
def test_a_wrong_column_map_is_refused_with_what_is_allowed(frame, robot, tmp_path, text, says):
    (tmp_path / "map.toml").write_text(text)
    assert says in refusal(written(frame, tmp_path), robot, tmp_path / "map.toml")


def test_a_recording_is_written_to_known_formats_only(sound, tmp_path):
    with pytest.raises(RecordingError, match="allowed is .csv, .parquet, .npz"):
        write_recording(sound, tmp_path / "log.mat")


def test_a_recording_with_arrays_that_do_not_fit_is_refused(sound):
    with pytest.raises(RecordingError, match=r"tau has shape \(2000, 2\)"):
        Recording(t=sound.t, q=sound.q, tau=sound.tau[:, :2], joint_names=sound.joint_names)


def test_a_planned_motion_is_read_without_torque_where_torque_is_optional(frame, sound, robot, tmp_path):
    path = written(frame.drop(columns=[f"tau.{joint}" for joint in sound.joint_names]), tmp_path)
    planned = read_recording(path, robot, torque="optional")
    np.testing.assert_allclose(planned.q, sound.q, rtol=1e-15)
    assert not planned.has_torque and not any(c.startswith("tau.") for c in recording_columns(planned))
    assert "missing columns tau.shoulder" in refusal(path, robot)


def test_torque_of_some_joints_only_is_no_planned_motion(frame, robot, tmp_path):
    path = written(frame.drop(columns="tau.elbow"), tmp_path)
    with pytest.raises(RecordingError, match="missing column tau.elbow"):
        read_recording(path, robot, torque="optional")


def test_a_motion_without_torque_is_conditioned_as_with_it(sound, robot):
    planned = dataclasses.replace(sound, tau=np.full_like(sound.tau, np.nan))
    band = choose_band([sound], robot)
    with_torque, without = condition(sound, band, pad=True), condition(planned, band, pad=True)
    np.testing.assert_array_equal(without.qdd, with_torque.qdd)
    assert np.isnan(without.tau).all()


def test_commanded_positions_are_kept(frame, robot, tmp_path):
    frame["qdes.elbow"] = frame["q.elbow"] + 0.01
    again = read_recording(written(frame, tmp_path), robot)
    np.testing.assert_allclose(again.extras["qdes.elbow"], frame["qdes.elbow"], rtol=1e-15)


def test_the_joints_a_file_holds_are_found_in_the_models_order(frame, robot, tmp_path):
    path = written(frame.drop(columns=["q.elbow", "tau.elbow", "qd.elbow"]), tmp_path)
    assert recorded_joints(path, None, ("gripper", "wrist", *robot.joint_names[:2])) == ("wrist", "shoulder")
