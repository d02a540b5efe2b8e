"""The control part of the study in smoke mode: it runs, agrees with MuJoCo, and goes on where it stopped."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import dataclasses
import json
import pathlib
import sys

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))

import study_provenance  # noqa: E402
import study_statistics  # noqa: E402
import table4_control  # noqa: E402
import table4_report  # noqa: E402

from irb140_jax.errors import InputError  # noqa: E402


def sets_of(arm, error: float) -> dict:
    """What table3_swarms.py stores: two sets each, the PSO's off by this share and the QPSO's by a tenth of it."""
    x = np.asarray(arm.x)
    sets = {"PSO": [((1.0 + error) * x).tolist()] * 2, "QPSO": [((1.0 - 0.1 * error) * x).tolist()] * 2}
    return {"arm": arm.name, "reference": x.tolist(), "sets": sets}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    config = table4_control.Config(smoke=True, out=tmp_path_factory.mktemp("results"))
    arm = config.arm()
    folder = config.folder(arm)
    (folder / "table3_sets.json").write_text(json.dumps(sets_of(arm, 0.04)))
    result = table4_control.run(config)
    return config, result, table4_report.write_report(result, folder, config.figure_folder(arm))


def test_every_reading_is_stored_and_every_table_and_figure_written(study):
    _, result, paths = study
    assert len(result["readings"]) == 3 * 2  # sides, disturbances; the smoke run has one law
    assert [path.stem for path in paths] == ["table4_control"] * 2 + [f"figure{i}" for i in (14, 15, 16, 17)]
    assert all(path.stat().st_size > 1000 for path in paths)


def test_our_loop_is_mujocos_in_every_reading_that_was_run_beside_it(study):
    _, result, paths = study
    differences = json.loads(paths[0].read_text())["mujoco"].values()
    assert len(differences) == 3 and max(differences) < 1e-6


def test_a_second_run_computes_nothing_anew_unless_something_changed(study):
    config, result, paths = study
    files = [paths[0].parent / "table4_runs" / f"{name}.npz" for name in result["readings"]]
    before = [path.stat().st_mtime_ns for path in files]
    table4_control.run(config)
    assert [path.stat().st_mtime_ns for path in files] == before
    small, arm = table4_control.reduced(config), config.arm()
    sets, robot = table4_control.identified(small, arm), table4_control.arm_of(small, arm)
    marks = {table4_control._mark(c, sets, robot) for c in (small, dataclasses.replace(small, radius=0.09))}
    sets["PSO"] = (1.0 + 1e-9) * sets["PSO"][0], sets["PSO"][1]
    assert len(marks | {table4_control._mark(small, sets, robot)}) == 3


def test_matched_model_of_the_reference_tracks_better_than_a_wrong_one(study):
    _, _, paths = study
    told = pd.read_parquet(paths[0].parent / table4_report.FILE)
    mine = told[(told["reading"] == "controller_of_peak_saturation_computed") & (told["condition"] == "nominal")]
    tracking = mine.groupby("model")["tracking"].mean()
    assert tracking["reference"] < tracking["PSO"]


def test_the_identified_link_carries_the_rest_of_the_arm_as_the_true_one_does(study):
    config, _, _ = study
    arm = config.arm()
    sets = table4_control.identified(table4_control.reduced(config), arm)
    mass = np.asarray(arm.mass)
    lumped = np.asarray(arm.reduced().mass)
    for model, factor in (("reference", 1.0), ("PSO", 1.04), ("QPSO", 0.996)):
        com = sets[model][0][0]
        np.testing.assert_allclose(com[:2], factor * np.asarray(arm.whole.com[:2]), rtol=1e-12)
        # The third link moves its own share of the body that it forms with the wrist.
        moved = com[2] - np.asarray(arm.reduced().com[2])
        np.testing.assert_allclose(moved, (factor - 1) * mass[2] / lumped[2] * np.asarray(arm.whole.com[2]), atol=1e-12)


def test_without_sets_or_with_those_of_another_arm_it_says_what_to_run(study, tmp_path):
    _, _, paths = study
    config = table4_control.Config(smoke=True, out=tmp_path)
    with pytest.raises(InputError, match="run experiments/table3_swarms.py"):
        table4_control.identified(config, config.arm())
    (tmp_path / "table3_sets.json").write_bytes((paths[0].parent / "table3_sets.json").read_bytes())
    with pytest.raises(InputError, match="holds sets of 'irb140, first 3 joints', not of 'irb140'"):
        table4_control.identified(config, table4_control.Config(joints=6).arm())


def test_a_difference_beyond_luck_is_told_and_chance_is_not(tmp_path):
    rng = np.random.default_rng(0)
    values = {"low": rng.normal(size=30), "high": rng.normal(size=30) + 3.0}
    values["near"] = values["low"] + 1e-3
    frame = pd.DataFrame({"which": np.repeat(list(values), 30), "x": np.concatenate([*values.values()])})
    study_provenance.store(frame, tmp_path / "runs.parquet")
    pairs = (("low", "high"), ("high", "low"), ("low", "near"))
    tests = [study_statistics.Test("control", "", "runs.parquet", "x", *((("which", w),) for w in p)) for p in pairs]
    assert [row["lower"] for row in study_statistics.tested(tests, tmp_path)] == ["first", "second", "neither"]


def test_holms_correction_is_the_textbooks():
    assert study_statistics.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
