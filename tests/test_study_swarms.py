"""The study's readings and their table, with small swarms."""

import math
import pathlib
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
    assert tried("decode", "qpso") == set(study_readings.DECODE) | set(study_readings.CHOOSING)
    assert tried("start_speed", "pso") == {0.0, *study_readings.START_SPEEDS}
    assert len(tried("perturbation", "qpso")) > 3
    assert tried("penalty", "pso") == set(study_readings.PENALTY)


def test_the_published_row_is_at_distance_zero():
    published = study_readings.PUBLISHED["pso"]
    row = {"com": published["com"], "inertia": published["inertia"], "plateau_of_mean": published["plateau"]}
    assert table3_report.distance(row, "pso") == 0.0
    assert table3_report.distance(row | {"plateau_of_mean": 54}, "pso") == pytest.approx(math.log(2.0) / math.sqrt(3.0))


def test_the_same_reading_gives_the_same_row():
    reading = study_readings.Reading("qpso", "w 0.99 to 0.4", 0.05)
    size = {"particles": 10, "iterations": 6, "seeds": 3}
    arm = table3_swarms.Config().arm()
    first, second = (table3_swarms.judged(reading, arm, size) for _ in range(2))
    assert first == second


def test_an_interrupted_sweep_adds_what_is_missing_and_ends_at_the_same_rows(tmp_path):
    config = table3_swarms.Config(smoke=True, out=tmp_path)
    arm = config.arm()
    readings = config.readings(arm)
    rows = table3_swarms.run(config, arm, readings)
    path = tmp_path / "table3_swarms.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:2]) + lines[2][:40])  # the third was being written
    assert table3_swarms.run(config, arm, readings) == rows
    assert len(path.read_text().splitlines()) == len(rows)


def test_rows_of_swarms_of_another_size_are_not_taken_for_these(tmp_path):
    config = table3_swarms.Config(smoke=True, out=tmp_path)
    reading = config.readings(config.arm())[:1]
    row = table3_swarms.run(config, config.arm(), reading)[0]
    path = tmp_path / "table3_swarms.jsonl"
    assert table3_swarms._stored(path, len(row["com"])) == [row]
    assert table3_swarms._stored(path, table3_swarms.FULL["seeds"]) == []


def test_one_linear_solve_beats_every_swarm():
    baselines = table3_swarms.baselines(table3_swarms.Config().arm(), few=True)
    assert max(max(row["com"], row["inertia"]) for row in baselines) < 1e-10  # [%] round-off


def test_what_is_zero_in_the_reference_is_not_sought():
    arm = table3_swarms.Config(joints=6).arm()
    left = {name for name, sought in zip(arm.unknowns.names, arm.unknowns.sought, strict=True) if not sought}
    assert left == {"cy6", "Ixy6", "Iyz6"}  # as in the robot's file
    assert study_readings.objective(study_readings.Reading("pso"), arm).reference.shape == (6 * 9 - 3,)
