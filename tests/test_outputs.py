"""No command costs anybody a file that is not its own, and no result is lost."""

# ruff: noqa: F811 (fixtures are used by the name under which they are imported)

import errno
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from helpers_cli import recording, refused, stub, table  # noqa: F401

import irb140_jax.mismatch
from irb140_jax import cli
from irb140_jax.errors import InputError, MisplacedResultError
from irb140_jax.report import is_our_table, results_file, results_folder, write_table

OURS = lambda path: is_our_table(path, ("tau_",))  # noqa: E731


def contents(folder: pathlib.Path) -> dict[str, bytes]:
    """Every file below a folder, hidden ones too, by its name."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*words) -> int:
    return cli.main([str(word) for word in words])


def letter(folder: pathlib.Path, text: str = "first") -> None:
    """A result of two files."""
    (folder / "below").mkdir()
    (folder / "diagnosis.json").write_text(text)
    (folder / "below" / "data.csv").write_text(text)


# A folder


def test_a_folder_that_holds_an_input_is_refused_and_left_as_it_was(recording, tmp_path, capsys, stub):
    demo = tmp_path / "demo"
    assert run("diagnose", recording, "--out", demo) == 0
    (demo / "recordings").mkdir()
    mine = demo / "recordings" / "a.csv"
    mine.write_bytes(recording.read_bytes())
    before = contents(demo)
    capsys.readouterr()
    for given in (mine, demo / ".." / "demo" / "recordings" / "a.csv"):
        assert "a.csv is an input" in refused(capsys, "diagnose", given, "--out", demo)
    assert contents(demo) == before


def test_a_folder_reached_by_a_link_is_the_same_folder(recording, tmp_path, capsys, stub):
    (tmp_path / "link").symlink_to(recording.parent)
    assert "is an input" in refused(capsys, "diagnose", recording, "--out", tmp_path / "link")
    (tmp_path / "wave.csv").symlink_to(recording)
    assert "is an input" in refused(capsys, "diagnose", tmp_path / "wave.csv", "--out", recording.parent)


@pytest.mark.parametrize("option", ["--robot", "--columns"])
def test_the_model_and_the_map_are_inputs_too(option, recording, tmp_path, capsys, stub):
    given = tmp_path / "d" / "own.file"
    given.parent.mkdir()
    given.write_text("mine")
    assert "own.file is an input" in refused(capsys, "diagnose", recording, "--out", given.parent, option, given)
    assert contents(given.parent) == {"own.file": b"mine"}


def test_the_current_folder_is_refused_where_an_input_lies_in_it(recording, monkeypatch, capsys, stub):
    monkeypatch.chdir(recording.parent)
    assert "wave.csv is an input" in refused(capsys, "diagnose", "wave.csv", "--out", ".")


def test_an_empty_current_folder_is_filled(recording, tmp_path, monkeypatch, stub):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert run("diagnose", recording, "--out", ".") == 0
    assert (tmp_path / "empty" / "report.html").exists()


def test_what_else_lies_in_a_former_diagnosis_stays(recording, tmp_path, stub):
    out = tmp_path / "d"
    assert run("diagnose", recording, "--out", out) == 0
    (out / "notes.txt").write_text("mine")
    (out / "figures").mkdir()
    (out / "figures" / "a.svg").write_text("mine, too")
    assert run("diagnose", recording, "--out", out) == 0
    after = contents(out)
    assert (after.pop("notes.txt"), after.pop("figures/a.svg")) == (b"mine", b"mine, too")
    assert sorted(after) == ["diagnosis.json", "manifest.json", "model.json", "report.html"]


def test_a_result_that_was_changed_by_hand_is_kept_under_another_name(recording, tmp_path, capsys, stub):
    out = tmp_path / "d"
    assert run("diagnose", recording, "--out", out) == 0
    (out / "report.html").write_text("with my remarks")
    assert run("diagnose", recording, "--out", out) == 0
    assert "kept as report.html.kept" in capsys.readouterr().err
    assert (out / "report.html.kept").read_text() == "with my remarks"
    assert (out / "report.html").read_text() != "with my remarks"
    (out / "report.html").write_text("again")
    assert run("diagnose", recording, "--out", out) == 0
    assert (out / "report.html.kept1").read_text() == "again"


def test_a_diagnosis_of_a_version_that_kept_no_list_is_replaced_and_kept(recording, tmp_path, stub):
    out = tmp_path / "d"
    assert run("diagnose", recording, "--out", out) == 0
    (out / "manifest.json").unlink()
    assert run("diagnose", recording, "--out", out) == 0
    assert (out / "diagnosis.json.kept").exists() and (out / "manifest.json").exists()


def test_a_file_of_somebody_else_that_is_called_diagnosis_is_no_former_one(recording, tmp_path, capsys, stub):
    out = tmp_path / "d"
    out.mkdir()
    (out / "diagnosis.json").write_text('{"patient": "x"}')
    refused(capsys, "diagnose", recording, "--out", out)
    assert contents(out) == {"diagnosis.json": b'{"patient": "x"}'}


def test_a_list_of_files_outside_of_the_folder_is_not_believed(recording, tmp_path, capsys, stub):
    mine, out = tmp_path / "mine.txt", tmp_path / "d"
    out.mkdir()
    mine.write_text("x")
    planted = {"schema": 1, "command": "irb140 diagnose", "files": {"../mine.txt": "2d711642"}}
    (out / "manifest.json").write_text(json.dumps(planted))
    refused(capsys, "diagnose", recording, "--out", out)
    assert mine.read_text() == "x"


def test_files_of_a_former_run_that_the_new_one_lacks_go_and_their_empty_folder_too(tmp_path):
    with results_folder(tmp_path / "d", "test") as results:
        results.write(letter)
    with results_folder(tmp_path / "d", "test") as results:
        results.write(lambda folder: (folder / "diagnosis.json").write_text("second"))
    assert sorted(p.name for p in (tmp_path / "d").iterdir()) == ["diagnosis.json", "manifest.json"]


def test_a_folder_of_one_command_is_not_replaced_by_another(tmp_path):
    with results_folder(tmp_path / "d", "irb140 demo") as results:
        results.write(letter)
    before = contents(tmp_path)
    with (
        pytest.raises(InputError, match="written by `irb140 demo`"),
        results_folder(tmp_path / "d", "irb140 diagnose"),
    ):
        raise AssertionError("not reached")
    assert contents(tmp_path) == before


def test_a_folder_inside_of_a_recording_that_is_a_folder_is_refused(tmp_path):
    (tmp_path / "bag").mkdir()
    with (
        pytest.raises(InputError, match="lies in .*bag, which is an input"),
        results_folder(tmp_path / "bag" / "d", "test", [tmp_path / "bag"]),
    ):
        raise AssertionError("not reached")
    assert not list((tmp_path / "bag").iterdir())


# A file


@pytest.mark.parametrize("how", ["itself", "link", "hard link", "dotted"])
def test_predict_does_not_write_over_its_recording(how, recording, tmp_path, capsys, stub):
    before, out = recording.read_bytes(), recording
    if how == "link":
        (out := tmp_path / "l.csv").symlink_to(recording)
    elif how == "hard link":
        (out := tmp_path / "l.csv").hardlink_to(recording)
    elif how == "dotted":
        out = recording.parent / ".." / "in" / "wave.csv"
    assert "is an input" in refused(capsys, "predict", tmp_path, recording, "--out", out)
    assert recording.read_bytes() == before
    assert sorted(contents(tmp_path)) == (["in/wave.csv", "l.csv"] if "link" in how else ["in/wave.csv"])


@pytest.mark.parametrize("command", ["predict", "excite"])
def test_a_file_that_is_no_former_result_is_not_overwritten(command, recording, tmp_path, capsys, stub):
    mine = tmp_path / "mine.csv"
    mine.write_bytes(recording.read_bytes())
    words = [tmp_path, recording] if command == "predict" else [tmp_path]
    assert "no former result" in refused(capsys, command, *words, "--out", mine)
    assert mine.read_bytes() == recording.read_bytes()


def test_a_former_prediction_is_replaced(recording, tmp_path, stub):
    for _ in range(2):
        assert run("predict", tmp_path, recording, "--out", tmp_path / "p.csv") == 0
    assert sorted(contents(tmp_path)) == ["in/wave.csv", "p.csv"]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text + "# 12 N m at the stop\n",
        lambda text: text.replace("tau_b", "torque"),
        lambda text: text.replace("+1.000000000e+00", "1"),
        lambda text: text.replace("\n", ",remark\n", 1),
    ],
)
def test_a_table_in_which_somebody_wrote_is_no_longer_ours(spoil, tmp_path):
    path = tmp_path / "p.csv"
    write_table({"t": np.array([0.0, 0.5]), "tau_a": np.array([1.0, -2e-12]), "tau_b": np.array([3.0, 4.0])}, path)
    assert OURS(path)
    path.write_text(spoil(path.read_text()))
    assert not OURS(path)


def test_tables_keep_times_since_1970_to_the_microsecond(tmp_path):
    t = 1.7e9 + np.array([0.0, 0.001, 0.002])
    write_table({"t": t, "tau_a": t}, tmp_path / "p.csv")
    np.testing.assert_allclose(np.loadtxt(tmp_path / "p.csv", delimiter=",", skiprows=1)[:, 0], t, rtol=0, atol=1e-6)


def test_an_empty_file_may_be_written_to_and_a_link_stays_one(recording, tmp_path, stub):
    (tmp_path / "p.csv").touch()
    (tmp_path / "link.csv").symlink_to(tmp_path / "p.csv")
    assert run("predict", tmp_path, recording, "--out", tmp_path / "link.csv") == 0
    assert (tmp_path / "link.csv").is_symlink() and OURS(tmp_path / "p.csv")


# What can't be written to


@pytest.mark.parametrize("command", ["diagnose", "predict", "excite"])
@pytest.mark.parametrize(
    "where",
    ["dangling", "dangling/below", "long", "very long", "null", "below a file", "loop", "loop/below", "/sys/x"],
)
def test_what_cannot_be_written_to_is_refused_before_the_work(command, where, recording, tmp_path, capsys, monkeypatch):
    (tmp_path / "dangling").symlink_to(tmp_path / "gone")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    names = {
        "long": "x" * 256,
        "very long": "/".join(["x" * 200] * 30),
        "null": "a\0b",
        "below a file": "in/wave.csv/p",
    }
    before = contents(tmp_path)
    words = {"diagnose": [recording], "predict": [tmp_path, recording], "excite": [tmp_path]}[command]
    refused(capsys, command, *words, "--out", tmp_path / names.get(where, where))
    assert contents(tmp_path) == before and not (tmp_path / "gone").exists()


def test_a_name_of_250_letters_is_a_name(recording, tmp_path, stub):
    assert run("diagnose", recording, "--out", tmp_path / ("x" * 250)) == 0
    assert run("predict", tmp_path, recording, "--out", tmp_path / ("y" * 246 + ".csv")) == 0
    with results_file(tmp_path / ("z" * 246 + ".csv"), OURS) as results:
        results.write(lambda folder: (folder / results.name).write_text("0"))
    assert (tmp_path / ("z" * 246 + ".csv")).read_text() == "0"


def test_a_name_that_leaves_no_room_for_that_of_the_layout_is_refused_before_the_work(
    recording, tmp_path, capsys, stub
):
    before = contents(tmp_path)
    words = ["predict", tmp_path, recording, "--measured", "--out", tmp_path / ("y" * 246 + ".csv")]
    assert "ile name too long" in refused(capsys, *words)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("command", ["predict", "excite"])
def test_the_current_folder_is_no_file(command, recording, tmp_path, monkeypatch, capsys, stub):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    words = [tmp_path, recording] if command == "predict" else [tmp_path]
    assert "name a file, for example result.csv" in refused(capsys, command, *words, "--out", ".")
    assert not list((tmp_path / "empty").iterdir())


def test_a_file_that_is_a_mount_point_is_refused_before_the_work(recording, tmp_path, capsys, stub, monkeypatch):
    out = tmp_path / "p.csv"
    assert run("predict", tmp_path, recording, "--out", out) == 0
    before = contents(tmp_path)

    def link(*_):
        raise OSError(errno.EXDEV, "Invalid cross-device link")  # what Linux says of a file that is mounted

    monkeypatch.setattr(os, "link", link)
    capsys.readouterr()
    assert "is a mount point" in refused(capsys, "predict", tmp_path, recording, "--out", out)
    assert contents(tmp_path) == before


def test_a_disk_without_links_is_a_place_for_results(recording, tmp_path, stub, monkeypatch):
    def link(*_):
        raise OSError(errno.EPERM, "Operation not permitted")  # FAT and exFAT

    monkeypatch.setattr(os, "link", link)
    for _ in range(2):
        assert run("predict", tmp_path, recording, "--out", tmp_path / "p.csv") == 0


@pytest.mark.parametrize("command", ["diagnose", "predict"])
def test_a_disk_that_is_mounted_takes_results(command, recording, tmp_path, stub):
    """Moving files from one disk to another is no renaming: results are made on the disk where they shall be."""
    disk = next((d for d in ("/dev/shm", "/run/user") if os.path.ismount(d) and os.access(d, os.W_OK)), None)
    if disk is None or os.stat(disk).st_dev == os.stat(tmp_path).st_dev:
        pytest.skip("no second disk here")
    out = pathlib.Path(tempfile.mkdtemp(dir=disk)) / "d"
    try:
        words = [recording] if command == "diagnose" else [tmp_path, recording]
        for _ in range(2):
            assert run(command, *words, "--out", out) == 0
        assert [p.name for p in out.parent.iterdir()] == ["d"]
    finally:
        shutil.rmtree(out.parent)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_folder_that_may_not_be_written_to_is_refused_before_the_work(recording, tmp_path, capsys):
    (tmp_path / "shut").mkdir(mode=0o500)
    assert "ermission" in refused(capsys, "diagnose", recording, "--out", tmp_path / "shut" / "d")


def test_a_device_is_no_file_to_write_to(recording, tmp_path, capsys, stub):
    assert "no former result" in refused(capsys, "predict", tmp_path, recording, "--out", "/dev/null")


def test_a_full_disk_is_noticed_before_the_work(recording, tmp_path, capsys, stub):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10**6, hard))
    try:
        assert "no room for" in refused(capsys, "diagnose", recording, "--out", tmp_path / "new" / "d")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "recordings" not in stub and not (tmp_path / "new").exists()


# After the work


@pytest.mark.parametrize("forever", [False, True])
def test_a_result_that_cannot_take_its_place_is_left_beside_it(forever, tmp_path, monkeypatch):
    real, failed = pathlib.Path.rename, []

    def rename(self, target):
        if pathlib.Path(target) == tmp_path / "d" / "diagnosis.json" and (forever or not failed):
            failed.append(self)
            raise OSError(5, "Input/output error")
        return real(self, target)

    with results_folder(tmp_path / "d", "test") as results:
        results.write(letter)
    before, places = contents(tmp_path / "d"), []
    with (
        pytest.raises(MisplacedResultError, match="Input/output error.* it is in") as said,
        results_folder(tmp_path / "d", "test") as results,
    ):
        monkeypatch.setattr(pathlib.Path, "rename", rename)
        places.append(results.write(lambda folder: (folder / "diagnosis.json").write_text("second")))
    (where,) = places
    assert str(where) in str(said.value) and (where / "diagnosis.json").read_text() == "second"
    after = contents(tmp_path / "d")
    if forever:  # not even what was there could be put back
        (former,) = (name for name in after if name.endswith("former/diagnosis.json"))
        assert str(tmp_path / "d" / former).removesuffix("/diagnosis.json") in str(said.value)
        before[former] = before.pop("diagnosis.json")
    assert before.items() <= after.items()


def test_a_folder_that_is_gone_after_the_work_costs_no_result(recording, tmp_path, capsys, stub, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    quick = irb140_jax.mismatch.diagnose

    def diagnose(*args):
        shutil.rmtree(tmp_path / "d")
        return quick(*args)

    monkeypatch.setattr(irb140_jax.mismatch, "diagnose", diagnose)
    assert run("diagnose", recording, "--out", tmp_path / "d") == 3
    said = capsys.readouterr()
    assert "the result is in" in said.err and "Physics left out." in said.out
    (found,) = (tmp_path / "tmp").glob("irb140-result-*/result/report.html")
    assert str(found) in said.out.replace("\n", "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_while_files_take_their_place_waits_until_they_have(number, tmp_path, monkeypatch):
    real = pathlib.Path.rename

    def rename(self, target):
        os.kill(os.getpid(), number)
        return real(self, target)

    def stop(*_):
        raise KeyboardInterrupt

    former = signal.signal(number, stop)
    try:
        with pytest.raises(KeyboardInterrupt), results_folder(tmp_path / "d", "test") as results:
            monkeypatch.setattr(pathlib.Path, "rename", rename)
            results.write(letter)
    finally:
        signal.signal(number, former)
    assert sorted(contents(tmp_path)) == ["d/below/data.csv", "d/diagnosis.json", "d/manifest.json"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_command_leaves_nothing(number, code, recording, tmp_path):
    planted = (
        # A shell's background job, as tests may be, ignores interruptions, and hands that on.
        "import signal, sys, time, irb140_jax.recordings as r\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def read_recording(*_, **__):\n    print('reading', flush=True)\n    time.sleep(60)\n"
        "r.read_recording = read_recording\nfrom irb140_jax.cli import main\nsys.exit(main())"
    )
    command = [sys.executable, "-c", planted, "diagnose", str(recording), "--out", str(tmp_path / "a" / "d")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "reading\n"
    assert (tmp_path / "a" / "d").exists()  # room has been taken
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == code and "Traceback" not in said
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in"]


def test_an_error_in_the_work_leaves_no_folder_that_was_made_for_it(tmp_path):
    with pytest.raises(InputError), results_file(tmp_path / "a" / "b" / "p.csv", OURS):
        raise InputError("no")
    assert not (tmp_path / "a").exists()
