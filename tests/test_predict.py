"""`irb140 predict`: motions with and without torque, and a table that PlotJuggler opens."""

import json
import shutil
import xml.etree.ElementTree as ET

import helpers_recordings
import helpers_stored
import numpy as np
import pandas as pd
import pytest
from helpers_cli import refused

from irb140_jax import cli
from irb140_jax.recordings import write_recording

JOINTS = ("shoulder", "elbow", "wrist")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return helpers_stored.stored(tmp_path_factory.mktemp("diagnosis"))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "r.csv"
    return write_recording(helpers_recordings.recording(rate=100.0, speeds=False), path)


@pytest.fixture(scope="module")
def predicted(folder, recording, tmp_path_factory) -> pd.DataFrame:
    return run(folder, recording, tmp_path_factory.mktemp("out") / "p.csv")


def run(folder, recording, out, *more) -> pd.DataFrame:
    assert cli.main(["predict", str(folder), str(recording), "--out", str(out), *more]) == 0
    return pd.read_csv(out)


def test_a_motion_without_torque_gets_the_same_prediction(folder, recording, predicted, tmp_path):
    table = pd.read_csv(recording)
    table.drop(columns=[f"tau.{joint}" for joint in JOINTS]).to_csv(tmp_path / "planned.csv", index=False)
    planned = run(folder, tmp_path / "planned.csv", tmp_path / "p.csv")
    pd.testing.assert_frame_equal(planned, predicted)


def test_numbers_of_joints_mean_those_of_the_whole_model_where_some_were_held(
    folder, recording, predicted, tmp_path
):
    held = shutil.copytree(folder, tmp_path / "held")
    model = json.loads((held / "model.json").read_text())
    model["known_joints"] = ["torso", *JOINTS]
    (held / "model.json").write_text(json.dumps(model))
    table = pd.read_csv(recording)
    names = {f"{kind}.{joint}": f"{kind} {n}" for kind in ("q", "tau") for n, joint in enumerate(JOINTS, 2)}
    table.rename(columns=names).to_csv(tmp_path / "numbered.csv", index=False)
    (tmp_path / "map.toml").write_text('[columns]\n"q.*" = "q {n}"\n"tau.*" = "tau {n}"\n')
    again = run(held, tmp_path / "numbered.csv", tmp_path / "p.csv", "--columns", str(tmp_path / "map.toml"))
    pd.testing.assert_frame_equal(again, predicted)


def test_the_prediction_is_mujocos_torque_of_the_model(recording, predicted):
    made = helpers_recordings.recording(rate=100.0, friction=0.0, noise=0.0)
    inside = slice(60, -60)  # filters have no past or future at the ends
    for i, joint in enumerate(JOINTS):
        error = (predicted[f"tau_nominal.{joint}"] - made.tau[:, i])[inside]
        assert np.std(error) < 0.02 * np.std(made.tau[:, i])  # what the band of 8 Hz cuts off


def test_what_excite_writes_can_be_predicted(folder, tmp_path):
    motion = helpers_recordings.motion(3, rate=100.0)
    from irb140_jax.recordings.excite import Excitation, motion_columns
    from irb140_jax.report import write_table

    write_table(motion_columns(Excitation("own", *motion), JOINTS), tmp_path / "m.csv")
    assert np.isfinite(run(folder, tmp_path / "m.csv", tmp_path / "p.csv").to_numpy()).all()


def test_measured_torque_models_and_residuals_are_in_one_table(folder, recording, predicted, tmp_path):
    table = run(folder, recording, tmp_path / "m.csv", "--measured")
    models = ("nominal", "refit", "corrected")
    assert list(table) == [
        "t", *(f"tau_{kind}.{joint}" for kind in ("measured", *models) for joint in JOINTS),
        *(f"residual_{model}.{joint}" for model in models for joint in JOINTS),
    ]  # fmt: skip
    pd.testing.assert_frame_equal(table.loc[:, list(predicted)], predicted)
    given = pd.read_csv(recording)
    for joint in JOINTS:
        np.testing.assert_allclose(table[f"tau_measured.{joint}"], given[f"tau.{joint}"], rtol=1e-8, atol=1e-12)
        for model in models:
            left = table[f"tau_measured.{joint}"] - table[f"tau_{model}.{joint}"]
            np.testing.assert_allclose(table[f"residual_{model}.{joint}"], left, atol=1e-7)


def test_rows_that_reading_leaves_out_are_in_the_table(folder, recording, tmp_path):
    table = pd.read_csv(recording)
    twice = pd.concat([table[:300], table[299:]])
    twice.to_csv(tmp_path / "r.csv", index=False)
    measured = run(folder, tmp_path / "r.csv", tmp_path / "m.csv", "--measured")
    assert len(measured) == len(twice)
    np.testing.assert_allclose(measured["tau_measured.elbow"], twice["tau.elbow"], rtol=1e-8)


def test_the_layout_shows_every_column_and_finds_the_table(folder, recording, tmp_path, capsys):
    for _ in range(2):  # the second replaces the first
        table = run(folder, recording, tmp_path / "m.csv", "--measured")
    assert f"plotjuggler --layout {tmp_path / 'm.plotjuggler.xml'}" in capsys.readouterr().out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["m.csv", "m.plotjuggler.xml"]
    root = ET.parse(tmp_path / "m.plotjuggler.xml").getroot()
    assert [tab.get("tab_name") for tab in root.iter("Tab")] == list(JOINTS)
    assert {curve.get("name") for curve in root.iter("curve")} == set(table) - {"t"}
    (info,) = root.iter("fileInfo")
    assert (tmp_path / str(info.get("filename"))).exists()
    assert [e.attrib for e in info.iter("default")] == [{"time_axis": "t", "delimiter": "0"}]
    for plot in root.iter("plot"):
        edges = {side: float(value) for side, value in plot.find("range").attrib.items()}  # pyright: ignore
        values = table[[curve.get("name") for curve in plot.iter("curve")]].to_numpy()
        assert edges["bottom"] < values.min() and values.max() < edges["top"]
        assert edges["left"] == 0.0 and edges["right"] == pytest.approx(table["t"].iloc[-1])


def test_a_layout_that_somebody_arranged_anew_is_not_overwritten(folder, recording, tmp_path, capsys):
    run(folder, recording, tmp_path / "m.csv", "--measured")
    layout = tmp_path / "m.plotjuggler.xml"
    layout.write_text(layout.read_text().replace("0.5;0.5", "0.7;0.3"))
    before = layout.read_text()
    words = ["predict", folder, recording, "--out", tmp_path / "m.csv", "--measured"]
    assert "m.plotjuggler.xml: this file is there" in refused(capsys, *words)
    assert layout.read_text() == before


def test_measured_needs_torque(folder, recording, tmp_path, capsys):
    table = pd.read_csv(recording)
    table.drop(columns=[f"tau.{joint}" for joint in JOINTS]).to_csv(tmp_path / "planned.csv", index=False)
    said = refused(capsys, "predict", folder, tmp_path / "planned.csv", "--out", tmp_path / "p.csv", "--measured")
    assert "holds no torque" in said and sorted(p.name for p in tmp_path.iterdir()) == ["planned.csv"]
