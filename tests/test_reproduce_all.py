"""The whole study in one command, as small as can be."""

import contextlib
import io
import json
import pathlib
import re
import sys

import pytest

from irb140_jax.recordings.conceal import random_robot

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))

import reproduce_all  # noqa: E402

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
