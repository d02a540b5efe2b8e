"""What sensors scatter by comes from the sensors; a verdict needs motion, and a residual that is small."""

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
from irb140_jax.mismatch.enough import (
    coarse_positions,
    comparable,
    scatter_by_sensor,
    sensor_scatter,
    undecidable,
)
from irb140_jax.mismatch.prove import HeldOut
from irb140_jax.recordings import write_recording
from irb140_jax.recordings.condition import choose_band, condition
from irb140_jax.recordings.low_pass import Band, kernels
from irb140_jax.recordings.recording import Recording, rows_of
from irb140_jax.recordings.sensors import torque_scatter

BAND = Band(20.0, 32.0, 200.0, 4)
NOISE = 0.05


@pytest.mark.parametrize("friction", [0.0, 5.0])
def test_torque_noise_is_told_whatever_the_model_leaves_out(friction):
    recording = made.recording(friction=friction, noise=NOISE, duration=20.0)
    expected = NOISE * np.sqrt(np.sum(kernels(BAND.torque, 250.0)[0] ** 2))  # of white noise behind the same filter
    np.testing.assert_allclose(torque_scatter(recording, BAND), expected, rtol=0.15)


def test_encoder_noise_counts_where_torque_is_exact():
    rough, fine = (
        dataclasses.replace(r, q=r.q + std * np.random.default_rng(0).normal(size=r.q.shape))
        for std, r in ((3e-4, made.recording(noise=0.0, speeds=False)), (0.0, made.recording(noise=0.0, speeds=False)))
    )
    loud, quiet = (sensor_scatter(made.robot(), [r], [condition(r, BAND)], BAND) for r in (rough, fine))
    assert np.all(loud > 3.0 * quiet)


@pytest.mark.parametrize(("step", "said"), [(0.0, False), (np.radians(1.0), True)])
def test_positions_that_limit_the_comparison_are_said(step, said):
    recording = made.recording(speeds=False, duration=20.0)
    if step:
        recording = dataclasses.replace(recording, q=step * np.round(recording.q / step))
    robot = made.robot()
    band, recordings, smooth, _ = comparable(robot, [recording])
    notes = coarse_positions(robot, *scatter_by_sensor(robot, recordings, smooth, band), np.ones(robot.n, dtype=bool))
    assert [n.startswith("Positions are coarse") for n in notes] == ([True] if said else [])


def proof(left: float, rows: int = 2000) -> HeldOut:
    """Errors of this size on a joint, on so many rows."""
    error = np.full((rows, 1), left)
    return HeldOut([error], [error], [error], [error], [np.ones((rows, 1), dtype=bool)], np.zeros(1, dtype=bool))


@pytest.mark.parametrize(
    ("left", "rows", "scatter", "said"),
    [
        (0.05, 2000, 0.05, None),
        (0.3, 2000, 0.3, None),  # loud sensors, but the model's torque stands above them
        (0.09, 2000, 0.001, None),  # far above the sensors, and small
        (0.3, 2000, 0.05, "6 times the noise of the sensors"),
        (0.7, 2000, 0.7, "70 % of its torque"),
        (0.05, 100, 0.05, "only 2 s"),
    ],
)
def test_a_joint_is_told_of_by_enough_motion_and_a_small_residual(left, rows, scatter, said):
    torque = np.sqrt(2.0) * np.sin(np.linspace(0.0, 20.0 * np.pi, rows, endpoint=False))[:, None]
    sentences = undecidable(made.robot(pendulum=True), proof(left, rows), [torque], np.array([scatter]), BAND)
    assert (not sentences) if said is None else said in sentences[0]


def test_what_is_as_large_as_the_torque_is_no_verdict():
    # Positions that belong to another arm: nothing of the model is in the torque.
    robot, recordings = made.robot(pendulum=True), []
    for seed in range(2):
        one = made.recording(seed=seed, pendulum=True, speeds=False, rate=200.0, duration=10.0)
        noise = np.random.default_rng(seed).normal(size=one.tau.shape)
        recordings.append(dataclasses.replace(one, tau=one.tau.std() * noise))
    diagnosis = diagnose(robot, recordings).diagnosis
    assert diagnosis["verdict"] == "undecided" and "may hide anything" in diagnosis["summary"]
    assert "record" in diagnosis["summary"]


def test_the_band_of_a_recording_leaves_its_scatter_finite():
    recording = made.recording(duration=5.0, speeds=False)
    band = choose_band([recording], made.robot())
    assert np.isfinite(sensor_scatter(made.robot(), [recording], [condition(recording, band)], band)).all()


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
    diagnosis = diagnose(made.robot(pendulum=True), [still]).diagnosis
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
