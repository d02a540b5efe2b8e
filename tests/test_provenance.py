"""Where a diagnosis comes from: the same for the same input, another for another."""

import dataclasses
import pathlib
import shlex

import equinox as eqx
import helpers_recordings as made
import pytest

from irb140_jax.cli.diagnose import Diagnose
from irb140_jax.cli.parsing import parsed
from irb140_jax.mismatch.output.provenance import provenance
from irb140_jax.recordings import read_recording, write_recording
from irb140_jax.recordings.recording import content_hash

OPTIONS = {"inertial_uncertainty": 0.05}


def test_the_date_is_that_of_source_date_epoch(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert provenance(made.robot(), [made.recording()], OPTIONS).date == "1970-01-02"


@pytest.mark.parametrize("nonsense", ["tomorrow", "-1", "9" * 30])
def test_a_date_that_no_calendar_has_is_today(monkeypatch, nonsense):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", nonsense)
    assert provenance(made.robot(), [made.recording()], OPTIONS).date > "2020"


def test_the_same_numbers_have_the_same_hash_under_any_name_and_other_numbers_another():
    one = made.recording()
    other = dataclasses.replace(one, q=one.q + 1e-9)
    assert content_hash(one) == content_hash(dataclasses.replace(one, source="copy")) != content_hash(other)


def test_a_robot_with_another_mass_has_another_hash():
    robot = made.robot()
    heavier = eqx.tree_at(lambda r: r.mass, robot, robot.mass.at[0].multiply(1.001))
    hashes = [provenance(r, [made.recording()], OPTIONS).robot.sha256 for r in (robot, made.robot(), heavier)]
    assert hashes[0] == hashes[1] != hashes[2]


def test_the_command_can_be_run_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = ["in/a run.csv", "in/more/b.csv", "my arm.xml"]
    (tmp_path / "in" / "more").mkdir(parents=True)
    (tmp_path / files[2]).write_text(made.ARM.format(more=""))
    read = [read_recording(write_recording(made.recording(), name), made.robot()) for name in files[:2]]
    command = Diagnose((), pathlib.Path("d"), pathlib.Path(files[2]))
    origin = provenance(made.robot(), read, OPTIONS, command._words())
    words = shlex.split(origin.command)
    assert [word for word in words if pathlib.Path(word).is_file()] == files
    again = parsed(words[1:])
    assert again == dataclasses.replace(command, recordings=tuple(map(pathlib.Path, files[:2])))
    assert [r.file for r in origin.recordings] == ["a run.csv", "b.csv"]
