"""The whole study in one command, as small as can be."""

import contextlib
import dataclasses
import io
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
from typing import Any

import pandas as pd
import pytest

from irb140_jax.errors import InputError
from irb140_jax.recordings.conceal import random_robot

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))

import reproduce_all  # noqa: E402
import study_page  # noqa: E402

SEED = 0


def reproduced(config: reproduce_all.Config) -> str:
    """What the command says while it works."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        reproduce_all.run(config, config.arm())
    return said.getvalue()


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The study of a robot that someone could have built, of three joints, one of them a slide."""
    out = tmp_path_factory.mktemp("study")
    robot = out / "robot.xml"
    robot.write_text(random_robot(SEED, 3, slides=0.3))
    config = reproduce_all.Config(robot=robot, smoke=True, out=out)
    return out, config, reproduced(config)


def test_every_table_and_figure_is_on_the_page(study):
    out, _, _ = study
    page = (out / "study.md").read_text()
    for title in ("Table 1", "Table 2", "Table 3", "Table 4", "Table 5"):
        assert f"## {title}" in page
    pictures = re.findall(r"\]\((figures/[^)]+)\)", page)
    assert len(pictures) == 10
    assert all((out / picture).stat().st_size > 1000 for picture in pictures)
    assert not re.search(r"\bnan\b", page)


def test_the_page_is_of_the_robot_that_was_given(study):
    out, _, _ = study
    page = (out / "study.md").read_text()
    assert page.startswith(f"# The study, reproduced: random {SEED}")
    assert all(f"| joint{i} |" in page for i in (1, 2, 3))
    assert "Carter" not in page  # others' figures are of the IRB 140
    assert len(json.loads((out / "table3_sets.json").read_text())["sets"]["PSO"][0]) == 3 * 9


def test_a_second_run_finds_every_step_done_and_makes_a_lost_one_anew(study):
    out, config, first = study
    assert "there already" not in first
    (out / "tables_1_2.json").unlink()
    assert reproduced(config).count("there already") == 7
    assert (out / "tables_1_2.json").is_file()


def test_again_forgets_every_part_but_keeps_the_results(tmp_path):
    parts = [tmp_path / reproduce_all.RECORD, tmp_path / "table3_swarms.jsonl", tmp_path / "table4_runs" / "a.npz",
             tmp_path / "tracking_runs" / "b.npz"]  # fmt: skip
    kept = tmp_path / "table3_swarms.json"
    for path in (*parts, kept):
        path.parent.mkdir(exist_ok=True)
        path.write_text("{}")
    reproduce_all.forget(tmp_path)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [kept]


def run_of(steps: list[reproduce_all.Step], folder: pathlib.Path, monkeypatch) -> dict[str, str]:
    """What is recorded as done after these steps in place of the study's."""
    monkeypatch.setattr(reproduce_all, "steps", lambda config, arm: steps)
    monkeypatch.setattr(study_page, "write", lambda config, arm: folder / "study.md")
    config = reproduce_all.Config(smoke=True, out=folder)
    reproduce_all.run(config, config.arm())
    return json.loads((folder / reproduce_all.RECORD).read_text())


def test_what_measures_time_waits_until_the_process_beside_it_has_ended(tmp_path, monkeypatch):
    ended, there = tmp_path / "ended", []
    code = f"import pathlib, time; time.sleep(0.5); pathlib.Path({str(ended)!r}).touch()"
    look = lambda: there.append(ended.exists())  # noqa: E731
    steps = [
        reproduce_all.Step("beside", lambda: subprocess.Popen([sys.executable, "-c", code]), (ended,), ""),
        reproduce_all.Step("meanwhile", look, (), ""),
        reproduce_all.Step("times", look, (), "", times=True),
    ]
    assert list(run_of(steps, tmp_path, monkeypatch)) == ["meanwhile", "beside", "times"]
    assert there == [False, True]


def test_a_process_that_fails_ends_the_run_and_is_not_done(tmp_path, monkeypatch):
    failing = lambda: subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])  # noqa: E731
    steps = [reproduce_all.Step("fails", failing, (), ""), reproduce_all.Step("meanwhile", lambda: None, (), "")]
    with pytest.raises(subprocess.CalledProcessError):
        run_of(steps, tmp_path, monkeypatch)
    assert list(json.loads((tmp_path / reproduce_all.RECORD).read_text())) == ["meanwhile"]


def test_a_step_that_breaks_takes_the_process_beside_it_along(tmp_path, monkeypatch):
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])

    def broken() -> None:
        raise InputError("nothing to be done")

    steps = [reproduce_all.Step("beside", lambda: process, (), ""), reproduce_all.Step("breaks", broken, (), "")]
    with pytest.raises(InputError):
        run_of(steps, tmp_path, monkeypatch)
    assert process.wait(timeout=60) != 0


def test_errors_that_are_not_defined_are_called_so_and_nothing_is_claimed_of_them(study, tmp_path):
    out, config, _ = study
    shutil.copytree(out, tmp_path / "study")
    folder = tmp_path / "study"
    runs, path = pd.read_parquet(folder / "table3_runs.parquet"), folder / "table3_swarms.json"
    runs.assign(com=math.nan).to_parquet(folder / "table3_runs.parquet")
    folder.joinpath("table3_swarms.json").write_text(json.dumps(without_centres(json.loads(path.read_text()))))
    config = dataclasses.replace(config, out=folder, figures=folder / "figures")
    page = study_page.write(config, config.arm()).read_text()
    assert not re.search(r"\bnan\b", page)
    assert page.count("not defined") > 5
    assert "| all centres of mass of this arm are zero |  | **cannot be judged** |" in page


def without_centres(stored: Any) -> Any:
    """A result as it is stored for an arm whose centres of mass are all zero."""
    if isinstance(stored, list):
        return [without_centres(part) for part in stored]
    if not isinstance(stored, dict):
        return stored
    undefined = {key: None for key in ("com", "com_sd", "averaged_com") if isinstance(stored.get(key), float)}
    told: dict[str, Any] = {key: without_centres(value) for key, value in stored.items()} | undefined
    if "over_pairs" in told:
        told["over_pairs"]["com"] = {"lower": 0.0, "higher": 0.0, "pairs": 0}
    if told.get("column") == "com":
        told |= {"p": 1.0, "p_holm": 1.0, "medians": [math.nan, math.nan], "lower": "neither", "effect": 0.0}
        told |= {"effect_interval": [0.0, 0.0], "difference": None, "difference_interval": None}
    return told
