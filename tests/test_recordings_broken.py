"""A broken file ends with one line that names it: no traceback, no hang, no memory filled."""

import bz2
import gzip
import io
import os
import random
import threading
import zipfile

import helpers_formats as formats
import helpers_recordings as made
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from test_recordings_formats import WRITERS

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats import mat_worker, options
from irb140_jax.recordings.read import unchecked_recording

JOINTS = ("shoulder", "elbow", "wrist")
SEEDS, SEEDS_OF_MAT = 25, 4  # broken copies of each file; MAT is read by a process of its own, which takes longer


@pytest.fixture(scope="module")
def sound():
    return made.recording(duration=1.2, speeds=False)


def refusal(path, columns=None) -> str:
    with pytest.raises(RecordingError) as caught:
        unchecked_recording(path, JOINTS, columns)
    message = str(caught.value)
    assert path.name in message and "\n" not in message and len(message) < 900
    return message


def broken(content: bytes, rng: random.Random) -> bytes:
    """The content with bytes changed, lost, zeroed or doubled."""
    b = bytearray(content)
    at = rng.randrange(len(b))
    match rng.choice(["flip", "header", "cut", "zero", "twice"]):
        case "flip":
            for _ in range(rng.choice([1, 3, 30])):
                b[rng.randrange(len(b))] = rng.randrange(256)
        case "header":
            for _ in range(5):
                b[rng.randrange(min(len(b), 400))] = rng.choice([0, 127, 255])
        case "cut":
            del b[at:]
        case "zero":
            b[at : at + 500] = bytes(len(b[at : at + 500]))
        case "twice":
            b[at:at] = b[at : at + 1000]
    return bytes(b)


@pytest.mark.parametrize("kind", sorted(WRITERS.keys() - {"ros2", "ros2 mcap", "plotjuggler", "rtde"}))
def test_whatever_breaks_in_a_file_it_is_read_or_refused_in_one_line(sound, tmp_path, kind):
    write, lines = WRITERS[kind]
    path = write(sound, tmp_path)
    (tmp_path / "map.toml").write_text(lines or "")
    content, rng = path.read_bytes(), random.Random(kind)
    for _ in range(SEEDS_OF_MAT if kind.startswith("mat") else SEEDS):
        path.write_bytes(broken(content, rng))
        try:
            recording = unchecked_recording(path, JOINTS, tmp_path / "map.toml")
        except RecordingError as error:
            assert "\n" not in str(error)
        else:  # what a flipped digit makes is a number
            assert np.isfinite(recording.q).all() and np.isfinite(recording.tau).all()


def test_a_reader_that_crashes_takes_nobody_with_it(sound, tmp_path, monkeypatch):
    path = formats.write_mat(sound, tmp_path / "log.mat")
    (tmp_path / "worker.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGBUS)\n")
    monkeypatch.setattr(mat_worker, "__file__", str(tmp_path / "worker.py"))
    assert "its reader does not survive" in refusal(path)


def test_the_database_of_a_bag_that_is_cut_off_is_refused(sound, tmp_path):
    bag = formats.write_ros2(sound, tmp_path / "bag")
    database = next(bag.glob("*.db3"))
    database.write_bytes(database.read_bytes()[:3000])
    refusal(bag)


def npz(path, **members: bytes):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def npy(values, **options) -> bytes:
    file = io.BytesIO()
    np.save(file, values, **options)
    return file.getvalue()


def test_an_array_that_declares_more_than_it_holds_is_refused(tmp_path):
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000,), }".ljust(117) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    assert "declares 1e+15 values" in refusal(npz(tmp_path / "log.npz", t=content))


def test_pickled_objects_are_refused_unread(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    content = npy(np.array([Trap()], dtype=object), allow_pickle=True)
    assert "Python objects" in refusal(npz(tmp_path / "log.npz", t=content))
    assert not (tmp_path / "sprung").exists()


def test_a_single_array_under_the_name_of_an_npz_is_refused(tmp_path):
    (tmp_path / "log.npz").write_bytes(npy(np.zeros(300)))
    assert "one array (.npy)" in refusal(tmp_path / "log.npz")


def test_a_text_in_the_place_of_an_array_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.npz", "w") as archive:
        archive.writestr("readme.txt", "hello")
    assert "'readme.txt', which is no array" in refusal(tmp_path / "log.npz")


def encrypted(path):
    """Mark every member as encrypted, as zip does where a password is set."""
    content = bytearray(path.read_bytes())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = -1
        while (at := content.find(mark, at + 1)) >= 0:
            content[at + place] |= 1
    path.write_bytes(content)
    return path


def test_encrypted_archives_are_refused(sound, tmp_path):
    assert "without a password" in refusal(encrypted(npz(tmp_path / "log.npz", t=npy(np.zeros(9)))))
    with zipfile.ZipFile(tmp_path / "log.csv.zip", "w") as archive:
        archive.writestr("log.csv", "t,q\n0,1\n")
    assert "without a password" in refusal(encrypted(tmp_path / "log.csv.zip"))


@pytest.fixture
def small_limits(monkeypatch):
    """Limits that a test can exceed without filling the memory."""
    for module in ("opened", "arrays", "parquet"):
        monkeypatch.setattr(f"irb140_jax.recordings.formats.{module}.MAX_BYTES", 2**20)
    for module in ("text", "arrays", "parquet"):
        monkeypatch.setattr(f"irb140_jax.recordings.formats.{module}.MAX_VALUES", 10**5)


@pytest.mark.parametrize(("name", "pack"), [("log.csv.gz", gzip.compress), ("log.csv.bz2", bz2.compress)])
def test_packed_bombs_are_noticed_while_they_unpack(small_limits, tmp_path, name, pack):
    (tmp_path / name).write_bytes(pack(b"t,q\n" + 8 * 2**20 * b"0"))
    assert "holds more than 1 MB" in refusal(tmp_path / name)


def test_a_bomb_of_arrays_is_refused_before_it_is_unpacked(small_limits, tmp_path):
    assert "allowed are" in refusal(npz(tmp_path / "log.npz", t=npy(np.zeros(2**20))))


def test_a_bomb_of_parquet_is_refused_by_what_it_declares(small_limits, tmp_path):
    pq.write_table(pa.table({"t": np.zeros(2 * 10**5)}), tmp_path / "log.parquet")
    assert "declares 2e+05 values" in refusal(tmp_path / "log.parquet")


def test_limits_leave_room_for_long_recordings():
    assert options.MAX_VALUES > 19 * 5000 * 600  # six joints, all channels, 5 kHz, ten minutes


def test_columns_of_lists_of_different_length_are_left_out(sound, tmp_path):
    frame = formats.columns_of(sound)
    frame["image"] = [[1.0] * (i % 3) for i in range(len(frame))]
    frame["pose"] = [{"x": 1.0}] * len(frame)
    frame.to_parquet(tmp_path / "log.parquet")
    notes = " ".join(unchecked_recording(tmp_path / "log.parquet", JOINTS).notes)
    assert "Column image holds lists of 0 to 2 entries" in notes and "Column pose holds struct" in notes


def test_a_list_where_a_number_is_needed_is_a_missing_column(sound, tmp_path):
    frame = formats.columns_of(sound)
    frame["q.elbow"] = [[1.0, 2.0]] * len(frame)
    frame.to_parquet(tmp_path / "log.parquet")
    assert "missing column q.elbow" in refusal(tmp_path / "log.parquet")


def test_a_pipe_is_refused_before_it_is_opened(tmp_path):
    os.mkfifo(tmp_path / "log.csv")
    done: list[str] = []
    thread = threading.Thread(target=lambda: done.append(refusal(tmp_path / "log.csv")), daemon=True)
    thread.start()
    thread.join(10)
    assert done and "pipe" in done[0]


def test_a_device_is_refused(tmp_path):
    (tmp_path / "log.csv").symlink_to("/dev/zero")
    assert "device" in refusal(tmp_path / "log.csv")


def test_a_column_map_that_is_a_pipe_is_refused(sound, tmp_path):
    formats.columns_of(sound).to_csv(tmp_path / "log.csv", index=False)
    os.mkfifo(tmp_path / "map.toml")
    with pytest.raises(RecordingError, match="map.toml: this is a pipe"):
        unchecked_recording(tmp_path / "log.csv", JOINTS, tmp_path / "map.toml")


HEADER = "t,q.shoulder,q.elbow,q.wrist,tau.shoulder,tau.elbow,tau.wrist\n"


@pytest.mark.parametrize(("content", "says"), [
    (HEADER, "holds no samples"),
    ("\n\n\n", "holds no samples"),
    (HEADER + "0,0,0,0\x00\x00\x00\x00,1,1,1\n", "line 2 holds bytes that are no text"),
    (HEADER + "0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6,7,8\n", "can't read this as CSV"),
    (HEADER + 2_000_000 * "7", "row 2 is longer"),
    ("t,t" + HEADER[1:] + 8 * "0," + "1\n", "column t is there 2 times"),
    (HEADER.replace(",", ";") + "0,1,2,3\n", "name what parts its columns"),
    ('t,"q.shoulder\n0,1\n0,1\n', "holds"),
    ("[" * 100_000, "holds no samples"),
])  # fmt: skip
def test_a_text_that_is_no_table_is_refused(tmp_path, content, says):
    (tmp_path / "log.csv").write_text(content)
    assert says in refusal(tmp_path / "log.csv")


def test_a_file_that_was_cut_off_in_its_last_row_is_read_without_it(sound, tmp_path):
    content = formats.columns_of(sound).to_csv(index=False)
    (tmp_path / "log.csv").write_text(content.rstrip("\n").rpartition(",")[0])
    recording = unchecked_recording(tmp_path / "log.csv", JOINTS)
    assert len(recording.t) == len(sound.t) - 1 and "1 row at the ends" in " ".join(recording.notes)


def test_a_spreadsheet_under_the_name_of_a_table_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.csv", "w") as archive:
        for name in ("xl/workbook.xml", "xl/sheet1.xml"):
            archive.writestr(name, "<x/>")
    assert "this archive holds 2 files (xl/workbook.xml" in refusal(tmp_path / "log.csv")


def test_a_table_of_numbers_that_are_all_broken_is_refused(tmp_path):
    pd.DataFrame({name: ["x"] * 300 for name in HEADER.strip().split(",")}).to_csv(tmp_path / "log.csv", index=False)
    assert "no samples" in refusal(tmp_path / "log.csv")
