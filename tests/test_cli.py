"""The command line: complete help, errors of one line with exit code 2, results whole or not at all."""

# ruff: noqa: F811 (fixtures are used by the name under which they are imported)

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import types
import warnings

import helpers_report
import jax
import numpy as np
import pandas as pd
import pytest
from helpers_cli import MODEL, recording, refused, stub, table  # noqa: F401

import irb140_jax.mismatch
import irb140_jax.recordings
from irb140_jax import cli, compilation_cache
from irb140_jax.cli.commands import word
from irb140_jax.cli.diagnose import STEPS
from irb140_jax.cli.parsing import parsed
from irb140_jax.cli.shown import Share
from irb140_jax.errors import InputError

COMMANDS = ("diagnose", "predict", "demo", "excite", "inspect", "diagnose-many", "compare")


def irb140(*words, cwd=None) -> subprocess.CompletedProcess:
    """The command as a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(MODEL.parents[1]), "COLUMNS": "100"}
    command = [sys.executable, "-m", "irb140_jax", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=cwd, env=environment)


def test_the_help_has_one_line_for_every_command():
    done = irb140("--help")
    assert done.returncode == 0
    for command in COMMANDS:
        (line,) = [line for line in done.stdout.splitlines() if f"• {command} " in line]
        assert re.search(r"\w.*\.\s*│?$", line), line  # the sentence ends on its line


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("diagnose", ["REC", "--out", "--robot", "--inertial-uncertainty", "0.05", "--columns", "--json"]),
        ("predict", ["DIR", "REC", "--out", "--columns", "--measured"]),
        ("demo", ["--seed", "--out"]),
        ("excite", ["DIR", "--out"]),
    ],
)
def test_the_help_of_a_command_names_every_option(command, words, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([command, "--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert not [word for word in words if word not in said]


def test_the_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom irb140_jax.cli import main\ntry: main(['--help'])\nexcept SystemExit: pass\n"
        "print([m for m in ('jax', 'mujoco', 'pandas', 'numpy', 'matplotlib', 'jinja2') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip().endswith("[]")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([], "diagnose"),
        (["nonsense"], "nonsense"),
        (["diagnose", "a.csv"], "--out"),
        (["diagnose", "--out", "d"], "recording"),
        (["diagnose", "a.csv", "--out", "d", "--frobnicate", "3"], "--frobnicate"),
        (["diagnose", "a.csv", "--out", "d", "--inertial-uncertainty", "much"], "--inertial-uncertainty"),
        (["diagnose", "a.csv", "--out", "d", "--inertial-uncertainty", "-0.1"], "--inertial-uncertainty"),
        (["diagnose", "a.csv", "--out", "d", "--inertial-uncertainty", "nan"], "--inertial-uncertainty"),
        (["diagnose", "a.csv", "--out", "d", "--inertial-uncertainty", "5"], "--inertial-uncertainty"),
        (["diagnose", "a.csv", "--out", "d", "--inertial-uncertainty", "inf"], "--inertial-uncertainty"),
        (["demo", "--seed", "-1"], "--seed"),
        (["demo", "--seed", "nan"], "--seed"),
        (["demo", "--seed", "9" * 5000], "--seed"),
        (["excite", "d", "--out", "f.csv"], "model.json"),
    ],
)
def test_wrong_words_on_the_command_line_give_one_line_that_names_them(words, named, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert named in refused(capsys, *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [("frob",), ("diagnose", "a.csv", "--out", "d", "--frobnicate", "3")])
def test_what_is_wrong_with_the_words_is_said_once(words, capsys):
    assert refused(capsys, *words).lower().count("unrecognized options") == 1


def test_a_recording_that_is_not_there_is_named_and_nothing_is_written(tmp_path):
    done = irb140("diagnose", "absent.csv", "--out", "d", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "absent.csv" in done.stderr
    assert not done.stdout and not list(tmp_path.iterdir())


def test_a_recording_without_torque_is_refused_by_naming_file_and_column(recording, table, tmp_path, capsys):
    table.drop(columns="tau.joint3").to_csv(recording, index=False)
    said = refused(capsys, "diagnose", recording, "--out", tmp_path / "d")
    assert "wave.csv" in said and "tau.joint3" in said
    assert not (tmp_path / "d").exists()


def test_a_robot_model_that_is_not_there_is_named(recording, tmp_path, capsys):
    said = refused(capsys, "diagnose", recording, "--out", tmp_path / "d", "--robot", tmp_path / "absent.xml")
    assert "absent.xml" in said


def test_a_folder_with_other_things_in_it_is_not_overwritten(recording, tmp_path, capsys, stub):
    out = tmp_path / "precious"
    out.mkdir()
    (out / "thesis.tex").write_text("x")
    assert "thesis.tex" in refused(capsys, "diagnose", recording, "--out", out)
    assert [path.name for path in out.iterdir()] == ["thesis.tex"]


def test_an_out_that_is_a_file_is_refused(recording, tmp_path, capsys, stub):
    (tmp_path / "d").write_text("x")
    refused(capsys, "diagnose", recording, "--out", tmp_path / "d")
    refused(capsys, "diagnose", recording, "--out", tmp_path / "d" / "below")
    assert (tmp_path / "d").read_text() == "x"


def test_diagnose_writes_diagnosis_model_and_report_and_says_the_verdict(recording, tmp_path, capsys, stub):
    out = tmp_path / "new" / "d"
    assert (
        cli.main(["diagnose", str(recording), str(recording), "--out", str(out), "--inertial-uncertainty", "0.1"]) == 0
    )
    files = ["diagnosis.json", "manifest.json", "model.json", "report.html"]
    assert sorted(path.name for path in out.iterdir()) == files
    assert [path.name for path in out.parent.iterdir()] == ["d"]  # no scratch folder is left behind
    assert "Physics left out." in capsys.readouterr().out
    assert len(stub["recordings"]) == 2 and stub["config"].inertial_uncertainty == 0.1
    assert stub["robot"].joint_names == helpers_report.JOINTS


@pytest.mark.parametrize("error", [InputError("two lines\nof trouble"), RuntimeError("a bug")])
def test_a_run_that_breaks_off_leaves_a_former_diagnosis_as_it_was(recording, tmp_path, stub, monkeypatch, error):
    out = tmp_path / "d"
    assert cli.main(["diagnose", str(recording), "--out", str(out)]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def broken(*_):
        raise error

    monkeypatch.setattr(irb140_jax.mismatch, "save", broken)
    if isinstance(error, InputError):
        assert cli.main(["diagnose", str(recording), "--out", str(out)]) == 2
    else:
        monkeypatch.chdir(tmp_path / "in")  # where the file with the traceback goes
        assert cli.main(["diagnose", str(recording), "--out", str(out)]) == 3
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["d", "in"]


def test_an_unexpected_error_ends_with_one_line_and_a_file_that_tells_the_rest(
    recording, tmp_path, capsys, stub, monkeypatch
):
    def broken(*_):
        raise ZeroDivisionError("in the\nmiddle")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(irb140_jax.mismatch, "diagnose", broken)
    for count in (1, 2):  # a second one does not replace the first
        assert cli.main(["diagnose", str(recording), "--out", "a name"]) == 3
        said = capsys.readouterr().err
        files = sorted(tmp_path.glob("irb140-error-*.txt"))
        assert len(files) == count and said.count("\n") == 1
        assert "ZeroDivisionError: in the middle" in said and "please send irb140-error-" in said
    text = files[0].read_text()
    assert f"irb140 diagnose {recording} --out 'a name'" in text and "jaxlib 0." in text
    assert "Traceback" in text and "in broken" in text and "ZeroDivisionError" in text
    assert not (tmp_path / "a name").exists()


def test_where_the_current_folder_cannot_be_written_to_the_file_goes_to_that_for_temporary_ones(tmp_path, monkeypatch):
    from irb140_jax.cli.unexpected import report

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir("/sys")  # where not even the superuser makes files
    said = report(ValueError("x"), ["excite"])
    (file,) = tmp_path.iterdir()
    assert str(file) in said


@pytest.mark.parametrize("buffered", [True, False])
def test_a_reader_that_stops_leaves_no_traceback(buffered):
    env = {**os.environ, "PYTHONUNBUFFERED": "" if buffered else "1"}
    code = "import sys; from irb140_jax.cli import main; sys.exit(main())"
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-c", code, "--help"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, env=env)
    os.close(writer)
    assert done.returncode == 141 and not done.stderr


def test_predict_writes_one_row_per_row_with_the_columns_of_the_contract(recording, table, tmp_path, stub):
    out = tmp_path / "p.csv"
    assert cli.main(["predict", str(tmp_path), str(recording), "--out", str(out)]) == 0
    predicted = pd.read_csv(out)
    models, joints = ("nominal", "refit", "corrected"), helpers_report.JOINTS
    assert list(predicted.columns) == ["t", *(f"tau_{model}.{joint}" for model in models for joint in joints)]
    np.testing.assert_allclose(predicted["t"], table["t"], rtol=1e-8)  # nine digits are written
    np.testing.assert_allclose(predicted["tau_corrected.joint4"], 2 * table["tau.joint4"], rtol=1e-8)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "p.csv"]


def test_predict_refuses_a_folder_as_its_file(recording, tmp_path, capsys, stub):
    refused(capsys, "predict", tmp_path, recording, "--out", tmp_path)


@pytest.mark.parametrize(
    ("environment", "expected"),
    [({"IRB140_CACHE": "off"}, "None"), ({"IRB140_CACHE": "/x"}, "/x"), ({"XDG_CACHE_HOME": "/y"}, "/y/irb140_jax")],
)
def test_the_compilation_cache_is_where_the_environment_says(environment, expected):
    code = "from irb140_jax.compilation_cache import set_up_compilation_cache as f; print(f())"
    clean = {k: v for k, v in os.environ.items() if k not in ("IRB140_CACHE", "JAX_COMPILATION_CACHE_DIR")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True, env=clean | environment
    )
    assert done.stdout.strip() == expected


def test_demo_shows_the_seal_then_diagnoses_files_then_reveals_the_truth(table, tmp_path, stub, capsys, monkeypatch):
    joints = helpers_report.JOINTS
    channels = {kind: table[[f"{kind}.{joint}" for joint in joints]].to_numpy() for kind in ("q", "tau")}
    hidden = {
        "effect": "stribeck_friction",
        "joints": ["joint2"],
        "parameters": {"static": {"value": 13.0, "unit": "N m"}},
    }
    case = types.SimpleNamespace(
        recordings=[
            irb140_jax.recordings.Recording(t=table["t"].to_numpy(), joint_names=joints, source=name, **channels)
            for name in ("fast", "slow")
        ],
        truth={"schema": 1, "seed": 3, "effects": [hidden]},
        seal="5ea1" * 16,
    )
    import irb140_jax.recordings.conceal as conceal

    monkeypatch.setattr(conceal, "demo_case", lambda seed: case)
    out = tmp_path / "demo"
    for _ in range(2):  # the second time in place of the first
        assert cli.main(["demo", "--seed", "3", "--out", str(out)]) == 0
        said = capsys.readouterr().out
        assert 0 <= said.index(case.seal) < said.index("Physics left out") < said.index("The truth, now revealed")
    names = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert names == {
        "diagnosis.json", "manifest.json", "model.json", "report.html", "truth.json",
        "recordings/fast.csv", "recordings/slow.csv",
    }  # fmt: skip
    assert json.loads((out / "truth.json").read_text())["effects"] == [hidden]
    assert "The truth: what was hidden" in (out / "report.html").read_text(encoding="utf-8")
    np.testing.assert_allclose(stub["recordings"][0].q, channels["q"], atol=1e-8)  # read back from the file


def test_input_refused_during_the_first_step_leaves_one_line_too(recording, tmp_path, stub, monkeypatch, capsys):
    def diagnose(robot, recordings, config, progress):
        progress("smoothing")
        raise InputError("wave.csv: too short")

    monkeypatch.setattr(irb140_jax.mismatch, "diagnose", diagnose)
    assert "too short" in refused(capsys, "diagnose", recording, "--out", tmp_path / "d")
    assert not (tmp_path / "d").exists()


def test_progress_is_told_in_plain_lines_where_stderr_is_no_terminal(recording, tmp_path, stub, monkeypatch, capsys):
    quick = irb140_jax.mismatch.diagnose

    def diagnose(robot, recordings, config, progress):
        for sentence in ("first", "second", "third"):
            progress(sentence)
        return quick(robot, recordings, config, lambda _: None)

    monkeypatch.setattr(irb140_jax.mismatch, "diagnose", diagnose)
    assert cli.main(["diagnose", str(recording), "--out", str(tmp_path / "d")]) == 0
    assert capsys.readouterr().err.splitlines() == ["first", "second", "third"]


def test_the_share_done_and_the_time_left_are_told_as_far_as_they_are_known():
    now = iter([0.0, 20.0, 100.0, 160.0, 170.0, 180.0])
    share = Share({"second step": 0.1, "third step": 0.5, "fourth step": 0.95}, lambda: next(now))
    assert share.with_share("the first step") == "the first step"
    assert share.with_share("the second step") == "the second step (10% done, about 3 min left)"
    assert share.with_share("the third step again") == "the third step again (50% done, about 2 min left)"
    assert share.with_share("the fourth step") == "the fourth step (95% done, some seconds left)"
    assert share.with_share("once more, without some time") == "once more, without some time"
    assert share.with_share("the second step") == "the second step (10% done, about 2 min left)"


def test_the_steps_of_which_the_share_is_known_are_those_that_a_diagnosis_tells():
    told = " ".join(path.read_text() for path in (MODEL.parents[1] / "irb140_jax" / "mismatch").rglob("*.py"))
    for words in STEPS:
        assert re.sub(r" \(round \d\)", " (round {turn})", words) in told, words


def test_what_a_library_warns_of_is_not_said(recording, tmp_path, stub, monkeypatch, recwarn):
    def warned(*_, **__):
        warnings.warn("invalid value", RuntimeWarning, stacklevel=1)
        raise InputError("no")

    monkeypatch.setattr(irb140_jax.recordings, "read_recording", warned)
    assert cli.main(["diagnose", str(recording), "--out", str(tmp_path / "d")]) == 2
    assert not len(recwarn)


def test_json_is_all_that_stdout_holds(recording, tmp_path, stub, capsys):
    assert cli.main(["diagnose", str(recording), "--out", str(tmp_path / "d"), "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out) == json.loads((tmp_path / "d" / "diagnosis.json").read_text())
    assert "Physics left out." in said.err and "Report:" in said.err


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_ends_with_lines_that_work(command, capsys):
    with pytest.raises(SystemExit):
        cli.main([command, "--help"])
    lines = capsys.readouterr().out.split("examples:\n")[1].splitlines()
    assert len(lines) >= 2
    for line in lines:
        words = shlex.split(re.split(r"\s{3,}| > ", line.strip())[0])
        assert words[0] == "irb140" and word(type(parsed(words[1:]))) == words[1]


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0 and re.fullmatch(r"irb140 \d+\.\d+\.\d+\n", capsys.readouterr().out)


def test_compiled_programs_are_dropped_before_they_fill_what_a_process_may_map(monkeypatch):
    program = jax.jit(lambda x: 2.0 * x)
    program(1.0)
    # The tests before this one may have filled the process.
    monkeypatch.setattr(compilation_cache, "MOST_MAPS", 10**9)
    compilation_cache.make_room_for_programs()
    assert program._cache_size() == 1  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setattr(compilation_cache, "MOST_MAPS", 0)
    compilation_cache.make_room_for_programs()
    assert program._cache_size() == 0  # pyright: ignore[reportAttributeAccessIssue]
    assert program(1.0) == 2.0
