"""Too little data is a diagnosis of its own, which says what to record."""

import dataclasses
import json
import pathlib

import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax import cli
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import diagnose
from irb140_jax.mismatch.regression.sufficient_data import comparable
from irb140_jax.recordings import write_recording
from irb140_jax.recordings.recording import Recording, rows_of


@pytest.fixture(scope="module")
def long() -> Recording:
    return made.recording(pendulum=True, speeds=False, duration=20.0)


@pytest.fixture(scope="module")
def diagnosed_folder(long, tmp_path_factory) -> pathlib.Path:
    """What the command line makes of 1.2 s of motion."""
    folder = tmp_path_factory.mktemp("short")
    (folder / "arm.xml").write_text(made.PENDULUM)
    write_recording(rows_of(long, slice(0, 300)), folder / "short.csv")
    words = ["diagnose", folder / "short.csv", "--robot", folder / "arm.xml", "--out", folder / "d"]
    assert cli.main([str(word) for word in words]) == 0
    return folder


def test_too_few_rows_are_a_whole_diagnosis_that_says_what_to_record(diagnosed_folder):
    d = json.loads((diagnosed_folder / "d" / "diagnosis.json").read_text())
    assert d["verdict"] == "undecided" and not d["findings"] and not d["unexplained"]
    assert "samples below" in d["summary"] and "record at least 15 s" in d["summary"]
    assert {b["effect"] for b in d["not_testable"]} >= {"coulomb_friction", "rotor_inertia"}
    assert {b["effect"] for b in d["not_testable"]} <= set(CATALOGUE)
    assert set(d["fit"]["hinge"].values()) == {None}
    assert d["provenance"]["recordings"][0]["rows"] == 300
    html = (diagnosed_folder / "d" / "report.html").read_text()
    assert "record at least 15 s" in html and "not judged" in html and "irb140 excite" in html


def test_too_few_rows_leave_the_nominal_model_to_predict_with(diagnosed_folder):
    out = diagnosed_folder / "torque.csv"
    words = ["predict", diagnosed_folder / "d", diagnosed_folder / "short.csv", "--out", out]
    assert cli.main([str(word) for word in words]) == 0
    nominal, refit, corrected = np.loadtxt(out, delimiter=",", skiprows=1)[:, 1:].T
    np.testing.assert_array_equal(refit, nominal)
    np.testing.assert_array_equal(corrected, nominal)
    assert np.std(nominal) > 0.1  # [N m]: it is a torque


def test_too_few_rows_lead_to_a_motion_that_shows_more(diagnosed_folder, capsys):
    words = ["excite", diagnosed_folder / "d", "--out", diagnosed_folder / "motion.csv", "--duration", "20"]
    assert cli.main([str(word) for word in words]) == 0
    shown = capsys.readouterr().out.split("This motion does not show")[0]
    assert "This motion shows what the recordings could not" in shown and "Coulomb friction on hinge" in shown


def test_a_joint_that_hardly_moves_is_no_verdict(long):
    turning = (long.t > 9.0) & (long.t < 9.5)
    at = int(np.flatnonzero(turning)[0]), int(np.flatnonzero(turning)[-1])
    q = np.concatenate([np.full(at[0], long.q[at[0], 0]), long.q[at[0] : at[1], 0],
                        np.full(len(long.t) - at[1], long.q[at[1], 0])])  # fmt: skip
    rng = np.random.default_rng(0)
    still = dataclasses.replace(long, q=(q + 1e-5 * rng.normal(size=q.shape))[:, None])
    diagnosis = diagnose(made.robot(pendulum=True), [still]).diagnosis.to_json()
    assert diagnosis["verdict"] == "undecided" and "No joint moves for long enough" in diagnosis["summary"]


def test_a_short_recording_beside_a_long_one_is_left_out_with_a_note():
    whole = made.recording(speeds=False, duration=20.0)
    both = [rows_of(whole, slice(0, 3000), "long"), rows_of(whole, slice(3500, 3850), "short")]
    _, recordings, smooth, said = comparable(made.robot(), both)
    assert [r.source for r in recordings] == [r.source for r in smooth] == ["long"]
    assert len(said) == 1 and said[0].startswith("short is left out")


def test_fewer_samples_than_any_filter_needs_are_refused(long):
    with pytest.raises(RecordingError, match="too short: 150 samples"):
        diagnose(made.robot(pendulum=True), [rows_of(long, slice(0, 150))])
