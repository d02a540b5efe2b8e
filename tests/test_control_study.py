"""The control part of the study in smoke mode: it runs, agrees with MuJoCo, and goes on where it stopped."""

import json
import pathlib
import sys

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))

import table4_control  # noqa: E402
import table4_report  # noqa: E402


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    config = table4_control.Config(smoke=True, out=tmp_path_factory.mktemp("results"))
    result = table4_control.run(config)
    return config, result, table4_report.write_report(result, config.out)


def test_every_reading_is_stored_and_every_table_and_figure_written(study):
    _, result, paths = study
    assert len(result["readings"]) == 2 * 3 * 2  # laws of the smoke run, sides, disturbances
    assert [path.name.split("_")[0] for path in paths] == ["table4"] * 2 + [f"figure{i}" for i in (14, 15, 16, 17)]
    assert all(path.stat().st_size > 1000 for path in paths)


def test_our_loop_is_mujocos_in_every_reading_that_was_run_beside_it(study):
    _, result, paths = study
    table = json.loads(paths[0].read_text())["table"]
    differences = [told["largest difference from MuJoCo [rad]"] for name, told in table.items() if "of_peak" in name
                   and "computed" in name]  # fmt: skip
    assert len(differences) == 3 and max(differences) < 1e-6


def test_a_second_run_computes_nothing_anew_unless_something_changed(study):
    config, result, _ = study
    files = [pathlib.Path(path) for path in result["readings"].values()]
    before = [path.stat().st_mtime_ns for path in files]
    table4_control.run(config)
    assert [path.stat().st_mtime_ns for path in files] == before
    arm = table4_control.arm_of(config)
    sets, _ = table4_control.identified(config, arm)
    mark = table4_control._mark(table4_control.reduced(config), sets, arm)
    assert mark != table4_control._mark(config, sets, arm)


def test_matched_model_of_the_reference_tracks_better_than_a_wrong_one(study):
    _, result, _ = study
    values = table4_report.measures_of(result["readings"][table4_report.SHOWN])
    tracking = np.linalg.norm(values["tracking"][:, :, 0], axis=-1).mean(axis=1)
    assert tracking[0] < tracking[1:].min()


def test_stored_sets_of_the_swarms_take_the_place_of_random_ones(tmp_path):
    config = table4_control.Config(seeds=2, out=tmp_path)
    arm = table4_control.arm_of(config)
    exact = np.concatenate([np.ravel(arm.com), np.asarray(arm.inertia)[:, *np.triu_indices(3)].ravel()])
    sets = {"PSO": [(1.1 * exact).tolist()] * 2, "QPSO": [(0.9 * exact).tolist()] * 2}
    (tmp_path / "table3_swarms.json").write_text(json.dumps({"sets": sets}))
    found, source = table4_control.identified(config, arm)
    assert "table3_swarms" in source
    assert np.allclose(found["PSO"][0][1], 1.1 * np.asarray(arm.com))
    assert np.allclose(found["QPSO"][1][0], 0.9 * np.asarray(arm.inertia))


def test_a_difference_beyond_luck_is_told_and_chance_is_not():
    rng = np.random.default_rng(0)
    low, high = rng.normal(size=30), rng.normal(size=30) + 3.0
    rows = [table4_report.smaller("", *pair) for pair in ((low, high), (high, low), (low, low + 1e-3))]
    table4_report.give_verdicts({"a": rows})
    assert [row["holds"] for row in rows] == ["yes", "no, the opposite", "no difference"]
