"""Text tables as loggers, spreadsheets and controllers write them: the same numbers, however they are laid out."""

import bz2
import gzip
import io
import lzma
import zipfile

import helpers_recordings as made
import numpy as np
import pandas as pd
import pytest

from irb140_jax.recordings import Recording
from irb140_jax.recordings.read import unchecked_recording

JOINTS = ("shoulder", "elbow", "wrist")


@pytest.fixture(scope="module")
def sound() -> Recording:
    return made.recording(duration=1.5, speeds=False)


@pytest.fixture(scope="module")
def frame(sound) -> pd.DataFrame:
    return made.frame(sound)


def read(tmp_path, content: bytes | str, name="log.csv", lines: str | None = None) -> Recording:
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    if lines is not None:
        (tmp_path / "map.toml").write_text(lines)
    return unchecked_recording(tmp_path / name, JOINTS, None if lines is None else tmp_path / "map.toml")


def text(frame, **options) -> str:
    return frame.to_csv(index=False, **options)


def assert_same(again, sound, tolerance=1e-12):
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(sound, name), rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_unicode_is_read_in_every_form(frame, sound, tmp_path, encoding):
    assert_same(read(tmp_path, text(frame).encode(encoding)), sound)


def test_latin_letters_are_read_and_stated(frame, sound, tmp_path):
    again = read(tmp_path, text(frame.assign(**{"Gehäuse °C": 21.0})).encode("latin-1"))
    assert_same(again, sound)
    assert "Gehäuse °C" in again.extras and "Latin-1" in " ".join(again.notes)


def zipped(content: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("log.csv", content)
    return file.getvalue()


@pytest.mark.parametrize(("suffix", "pack"), [
    ("gz", gzip.compress), ("bz2", bz2.compress), ("xz", lzma.compress), ("zip", zipped),
])  # fmt: skip
def test_packed_text_is_unpacked(frame, sound, tmp_path, suffix, pack):
    assert_same(read(tmp_path, pack(text(frame).encode()), f"log.csv.{suffix}"), sound)


@pytest.mark.parametrize("comment", ["# made by a logger\n", "# a, b, c\n#\n\n", "% MATLAB\n% says\n", "\n\n"])
def test_lines_above_the_header_are_passed_over(frame, sound, tmp_path, comment):
    assert_same(read(tmp_path, comment + text(frame)), sound)


def test_a_title_above_the_header_is_passed_over(frame, sound, tmp_path):
    assert_same(read(tmp_path, "Trace of axis 1 to 3\nSampling: 4 ms\n" + text(frame)), sound)


def test_names_in_a_comment_as_numpy_writes_them_are_read(frame, sound, tmp_path):
    file = io.StringIO()
    np.savetxt(file, frame.to_numpy(), header=" ".join(frame.columns), fmt="%.17g")
    assert_same(read(tmp_path, file.getvalue(), "log.txt"), sound)


def test_a_row_of_units_is_applied_and_stated(frame, sound, tmp_path):
    table = frame.copy()
    table["q.elbow"] = np.degrees(table["q.elbow"])
    head, rest = text(table).split("\n", 1)
    units = {"t": "[s]", "q.elbow": "[deg]"}
    row = ",".join(units.get(name, "[Nm]" if "tau" in name else "[rad]") for name in table)
    again = read(tmp_path, f"{head}\n{row}\n{rest}")
    assert_same(again, sound)
    assert "Converted from deg, by the file's own header: q.elbow" in again.notes


def test_a_unit_in_brackets_behind_a_name_is_applied_and_stated(frame, sound, tmp_path):
    table = frame.rename(columns={"q.elbow": "q.elbow [deg]", "t": "t (ms)"})
    table["q.elbow [deg]"], table["t (ms)"] = np.degrees(table["q.elbow [deg]"]), 1000 * table["t (ms)"]
    assert_same(read(tmp_path, text(table)), sound)


def test_the_maps_unit_beats_the_files(frame, sound, tmp_path):
    table = frame.rename(columns={"q.elbow": "elbow [deg]"})
    assert_same(read(tmp_path, text(table), lines='[columns]\n"q.elbow" = "elbow [deg]"\n[scale]\n"q.elbow" = "rad"'),
                sound)  # fmt: skip


@pytest.mark.parametrize(("separator", "decimal"),
                         [(";", ","), (";", "."), ("\t", ","), ("\t", "."), ("|", "."), (" ", ".")])
def test_separators_and_decimal_marks_are_found(frame, sound, tmp_path, separator, decimal):
    assert_same(read(tmp_path, text(frame, sep=separator, decimal=decimal)), sound)


def test_decimal_commas_that_come_late_are_seen(frame, sound, tmp_path):
    table = text(frame, sep=";", decimal=",").split("\n")
    table[1] = ";".join(["0"] * len(frame.columns))
    again = read(tmp_path, "\n".join(table))
    np.testing.assert_allclose(again.q[1:], sound.q[1:], rtol=1e-12)


def test_a_separator_named_in_the_map_is_used(frame, sound, tmp_path):
    again = read(tmp_path, text(frame, sep="!", decimal=","), lines='separator = "!"\ndecimal = ","')
    assert_same(again, sound)


def test_names_with_commas_are_read_where_semicolons_part_the_columns(frame, sound, tmp_path):
    again = read(tmp_path, text(frame.assign(**{"a, b": 1.0}), sep=";"))
    assert_same(again, sound)
    assert "a, b" in again.extras


@pytest.mark.parametrize("style", ["%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f+02:00", "%H:%M:%S.%f"])
def test_times_as_text_are_read(frame, sound, tmp_path, style):
    stamps = pd.Timestamp("2026-11-24 12:00:00") + pd.to_timedelta(frame["t"], unit="s")
    assert_same(read(tmp_path, text(frame.assign(t=stamps.dt.strftime(style)))), sound)


def test_times_of_another_form_are_read_by_the_maps_format(frame, sound, tmp_path):
    stamps = pd.Timestamp("2026-11-24 12:00:00") + pd.to_timedelta(frame["t"], unit="s")
    content = text(frame.assign(t=stamps.dt.strftime("%d.%m.%Y %H:%M:%S.%f")))
    assert_same(read(tmp_path, content, lines='time_format = "%d.%m.%Y %H:%M:%S.%f"'), sound)


@pytest.mark.parametrize(("unit", "tolerance"), [(1, 1e-6), (1e3, 1e-6), (1e6, 1e-6), (1e9, 1e-6)])
def test_times_since_1970_are_counted_from_the_first_row(frame, sound, tmp_path, unit, tolerance):
    ticks = ((1_764_000_000 + frame["t"]) * unit).map(lambda x: f"{x:.6f}" if unit == 1 else f"{x:.0f}")
    again = read(tmp_path, text(frame.assign(t=ticks)))
    assert_same(again, sound, tolerance)
    assert "since 1970" in " ".join(again.notes)
