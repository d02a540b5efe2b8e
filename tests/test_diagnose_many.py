"""irb140 diagnose-many: which units there are, processes that die, runs that are killed, and the table in the end."""

import os
import pathlib
import random
import signal
import subprocess
import sys
import time

import pandas as pd
import pytest
from helpers_cli import refused
from helpers_fleet import made_at_once, units_folder

import irb140_jax.fleet.run
from irb140_jax import cli
from irb140_jax.errors import InputError
from irb140_jax.fleet import diagnose_units, results_store, shard_of, units_in, write_table_and_page
from irb140_jax.fleet.workers import Done, _tried
from irb140_jax.recordings import write_recording
from irb140_jax.recordings.conceal import conceal, random_robot
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.report.many import by_severity, many_html
from irb140_jax.robot import load_robot

RUN = """
import pathlib, sys
import helpers_fleet
from irb140_jax.fleet import diagnose_units, results_store, units_in, write_table_and_page
folder, out, work = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), getattr(helpers_fleet, sys.argv[3])
if __name__ == "__main__":
    units = units_in(folder)
    with results_store(out, "1/1", {}, [folder]) as place:
        list(diagnose_units(units, place, work, 2))
        write_table_and_page(place, units, folder.name, [folder])
"""


def process(tmp_path: pathlib.Path, folder: pathlib.Path, out: pathlib.Path, work: str) -> subprocess.Popen:
    """A run as a process of its own."""
    script = tmp_path / "run.py"
    script.write_text(RUN)
    here = pathlib.Path(__file__).parent
    environment = os.environ | {"PYTHONPATH": f"{here}:{here.parent}"}
    return subprocess.Popen([sys.executable, str(script), str(folder), str(out), work], env=environment)


def run(folder: pathlib.Path, out: pathlib.Path, part: str = "1/1") -> pd.DataFrame:
    """A run without any further process; its table."""
    here = lambda tasks, work, jobs: (Done(task, *_tried(work, task)) for task in tasks)  # noqa: E731
    units = units_in(folder)
    with results_store(out, part, {}, [folder]) as place, pytest.MonkeyPatch.context() as patch:
        patch.setattr(irb140_jax.fleet.run, "run_tasks", here)
        list(diagnose_units(shard_of(units, part), place, made_at_once, 1))
        write_table_and_page(place, units, folder.name, [folder])
    return pd.read_parquet(out / "table.parquet")


def test_folders_and_loose_recordings_are_units_with_the_model_nearest_to_them(tmp_path):
    names = ("a/x.csv", "a/y.parquet", "a/own.urdf", "b/z.csv", "c.csv", "all.xml", "meshes/link.stl", "e/map.toml")
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    a, b, c, e = units_in(tmp_path)
    assert [path.name for path in a.recordings] == ["x.csv", "y.parquet"]
    assert [unit.robot and unit.robot.name for unit in (a, b, c)] == ["own.urdf", "all.xml", "all.xml"]
    assert "holds no recording" in e.problem


def test_a_second_model_in_a_unit_is_its_own_problem_and_in_the_folder_that_of_all(tmp_path):
    (tmp_path / "a").mkdir()
    for name in ("a/x.csv", "a/1.xml", "a/2.xml"):
        (tmp_path / name).write_text("")
    assert "1.xml, 2.xml" in units_in(tmp_path)[0].problem
    for name in ("1.xml", "2.xml"):
        (tmp_path / name).write_text("")
    with pytest.raises(InputError, match="--robot"):
        units_in(tmp_path)


def test_shards_hold_every_unit_once(tmp_path):
    units = units_in(units_folder(tmp_path / "u", ["ok"] * 7))
    parts = [shard_of(units, f"{i}/3") for i in (1, 2, 3)]
    assert sorted(unit.name for part in parts for unit in part) == [unit.name for unit in units]
    for wrong in ("0/3", "4/3", "1", "a/b"):
        with pytest.raises(InputError, match="--shard"):
            shard_of(units, wrong)


def test_a_bad_input_a_bug_and_a_process_that_dies_cost_their_own_row_only(tmp_path):
    folder = units_folder(tmp_path / "u", ["ok", "refuse", "raise", "die", "ok"])
    assert process(tmp_path, folder, tmp_path / "d", "made_at_once").wait() == 0
    rows = pd.read_parquet(tmp_path / "d" / "table.parquet")
    assert list(rows["status"]) == ["diagnosed", "refused", "failed", "failed", "diagnosed"]
    said = rows["message"].tolist()
    assert said[1] == "unit01.csv: no good; record again" and "a bug" in said[2] and "signal 9" in said[3]
    assert sorted(p.name for p in (tmp_path / "d" / "diagnoses").iterdir()) == ["unit00", "unit04"]


def test_a_run_that_is_killed_at_random_moments_ends_with_the_same_table(tmp_path):
    folder, rng = units_folder(tmp_path / "u", ["ok", "refuse", *["ok"] * 10]), random.Random(3)
    whole = run(folder, tmp_path / "whole")
    done = []
    for _ in range(2):
        one = process(tmp_path, folder, tmp_path / "killed", "made_slowly")
        while not (tmp_path / "killed" / "rows").exists():  # until then there is nothing to lose
            time.sleep(0.02)
        time.sleep(rng.uniform(1.0, 2.0))
        one.send_signal(signal.SIGKILL)
        one.wait()
        time.sleep(0.3)  # its processes notice
        units = (tmp_path / "killed" / "diagnoses").iterdir()
        assert all((unit / "diagnosis.json").exists() and (unit / "manifest.json").exists() for unit in units)
        done.append(len(list((tmp_path / "killed" / "rows").iterdir())))
    assert done == sorted(done)
    run(folder, tmp_path / "killed")
    assert (tmp_path / "killed" / "table.parquet").read_bytes() == (tmp_path / "whole" / "table.parquet").read_bytes()
    assert len(whole) == 12 and not list((tmp_path / "killed").glob(".irb140-part*"))


def test_what_is_done_is_not_done_again_unless_a_file_changed_or_it_failed(tmp_path):
    folder = units_folder(tmp_path / "u", ["ok", "ok", "raise"])
    run(folder, tmp_path / "d")
    before = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "d" / "rows").iterdir()}
    (folder / "unit01.csv").write_text("ok 41\n")
    (folder / "unit02.csv").touch()
    rows = run(folder, tmp_path / "d")
    after = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "d" / "rows").iterdir()}
    assert [name for name in sorted(before) if before[name] != after[name]] == ["unit01.json", "unit02.json"]
    assert '"value": 41.0' in rows["findings"].tolist()[1]


def test_shards_in_one_folder_end_with_the_table_of_a_single_run(tmp_path):
    folder = units_folder(tmp_path / "u", ["ok"] * 5)
    run(folder, tmp_path / "whole")
    for part in ("2/2", "1/2"):
        run(folder, tmp_path / "parts", part=part)
    assert (tmp_path / "parts" / "table.parquet").read_bytes() == (tmp_path / "whole" / "table.parquet").read_bytes()


def test_two_runs_cannot_work_on_one_part(tmp_path):
    folder = units_folder(tmp_path / "u", ["ok"])
    said = "another run works on part 1/1"
    with results_store(tmp_path / "d", "1/1", {}, [folder]), pytest.raises(InputError, match=said):
        run(folder, tmp_path / "d")


def test_what_a_user_put_into_a_diagnosis_outlives_a_new_one(tmp_path):
    folder, unit = units_folder(tmp_path / "u", ["ok"]), tmp_path / "d" / "diagnoses" / "unit00"
    run(folder, tmp_path / "d")
    (unit / "notes.txt").write_text("mine")
    (unit / "model.json").write_text("changed")
    (folder / "unit00.csv").write_text("ok 5\n")
    run(folder, tmp_path / "d")
    assert (unit / "notes.txt").read_text() == "mine" and (unit / "model.json").read_text() == "{}"
    assert (unit / "model.json.kept").read_text() == "changed"


def test_units_are_sorted_by_verdict_and_then_by_error_over_noise():
    rows = [{"unit": f"{verdict}{error}", "severity": verdict, "given_over_noise": error} for verdict, error in
            ((0, 9.0), (3, 2.0), (4, None), (3, 7.0))]  # fmt: skip
    assert [row["unit"] for row in by_severity(rows)] == ["4None", "37.0", "32.0", "09.0"]


def test_the_page_holds_every_unit_needs_no_network_and_takes_no_markup_from_names(tmp_path):
    rows = run(units_folder(tmp_path / "u", ["ok", "refuse"]), tmp_path / "d").to_dict("records")
    page = (tmp_path / "d" / "index.html").read_text()
    assert "unit00" in page and "unit01.csv: no good; record again" in page and "http" not in page
    evil = many_html([{**rows[1], "unit": "<script>"}], "<b>", 3)
    assert "<script>" not in evil and "3 not yet diagnosed" in evil


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--shard", "3/2"], "--shard 3/2"), (["--jobs", "0"], "--jobs 0"), (["--robot", "no.xml"], "no such file"),
     (["--inertial-uncertainty", "7"], "--inertial-uncertainty"), (["--out", "OWN"], "isn't empty")],
)  # fmt: skip
def test_wrong_options_are_refused_before_anything_is_done(words, said, tmp_path, capsys):
    folder, own = units_folder(tmp_path / "u", ["ok"]), tmp_path / "own"
    own.mkdir()
    (own / "thesis.tex").write_text("mine")
    words = [str(own) if word == "OWN" else word for word in words]
    assert said in refused(capsys, "diagnose-many", folder, *words)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["own", "u"] and [*own.iterdir()] == [own / "thesis.tex"]


def test_a_real_run_diagnoses_what_it_can_and_says_what_it_could_not(tmp_path, capsys):
    (tmp_path / "u").mkdir()
    arm = random_robot(7, 2, slides=0.0)
    (tmp_path / "u" / "arm.xml").write_text(arm)
    motion = fourier_motion(load_robot(tmp_path / "u" / "arm.xml"), 8.0, 500.0, seed=1)
    write_recording(conceal(arm, (), [motion], seed=1, rate=250.0).recordings[0], tmp_path / "u" / "good.csv")
    table = pd.read_csv(tmp_path / "u" / "good.csv")
    table.drop(columns="q.joint2").to_csv(tmp_path / "u" / "half.csv", index=False)
    assert cli.main(["diagnose-many", str(tmp_path / "u"), "--jobs", "1"]) == 0
    said = capsys.readouterr()
    assert "2 units" in said.out and "half: half.csv: missing column q.joint2" in said.out
    rows = pd.read_parquet(tmp_path / "u-diagnoses" / "table.parquet").set_index("unit")
    assert rows["status"].to_dict() == {"good": "diagnosed", "half": "refused"}
    assert rows["verdict"]["good"] in ("no_mismatch", "parameters_only")  # nothing is hidden
    assert (tmp_path / "u-diagnoses" / "diagnoses" / "good" / "report.html").exists()
