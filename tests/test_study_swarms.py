"""The study's readings and their table, with small swarms."""

import json
import math
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "experiments"))

import study_readings  # noqa: E402
import table3_report  # noqa: E402
import table3_swarms  # noqa: E402


def test_every_reading_has_a_name_of_its_own():
    readings = list(study_readings.all_readings())
    assert len({str(reading) for reading in readings}) == len(readings) > 2000


def test_every_choice_that_the_text_leaves_open_is_tried():
    readings = list(study_readings.all_readings())
    tried = lambda name, algorithm: {getattr(r, name) for r in readings if r.algorithm == algorithm}  # noqa: E731
    for algorithm in ("pso", "qpso"):
        assert tried("inertia", algorithm) == set(study_readings.INERTIA)
        assert tried("units", algorithm) == {"normalised", "si", "mm"}
        assert tried("place", algorithm) == {"centre", "anywhere"}
        assert tried("walls", algorithm) == {True, False}
        assert math.inf in tried("velocity_limit", algorithm)
    assert tried("decode", "qpso") == set(study_readings.DECODE)
    assert tried("penalty", "pso") == set(study_readings.PENALTY)


def test_the_published_row_is_at_distance_zero():
    published = study_readings.PUBLISHED["pso"]
    row = {"com": [published["com"]], "inertia": [published["inertia"]], "plateau": published["plateau"]}
    assert table3_report.distance(row, "pso") == 0.0
    assert table3_report.distance(row | {"plateau": 54}, "pso") == pytest.approx(math.log(2.0) / math.sqrt(3.0))


def test_the_same_reading_gives_the_same_row():
    reading = study_readings.Reading("qpso", "w 0.99 to 0.4", 0.05)
    size = {"particles": 10, "iterations": 6, "seeds": 3}
    arm = table3_swarms.Config().arm()
    first, second = (table3_swarms.judged(reading, arm, size) for _ in range(2))
    assert first == second


def test_the_table_is_made_whole_and_goes_on_where_it_stopped(tmp_path):
    command = [sys.executable, "experiments/table3_swarms.py", "--smoke", "--out", str(tmp_path)]
    command += ["--figures", str(tmp_path / "figures")]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    run = lambda: subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, timeout=300)  # noqa: E731
    first = run()
    assert first.returncode == 0, first.stderr
    lines = (tmp_path / "table3_swarms.jsonl").read_text().splitlines()
    table = json.loads((tmp_path / "table3_swarms.json").read_text())
    assert len(table["readings"]) == len(lines)
    assert max(row["com"] for row in table["baselines"]) < 1e-10  # [%] one linear solve
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == [f"figure{k}.svg" for k in (6, 7, 8, 9)]
    # Interrupted after three readings, it adds the others and ends at the same table.
    (tmp_path / "table3_swarms.jsonl").write_text("\n".join(lines[:3]) + "\n")
    assert run().returncode == 0
    assert json.loads((tmp_path / "table3_swarms.json").read_text())["readings"] == table["readings"]
