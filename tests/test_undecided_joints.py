"""A joint is decided only with enough motion and a small remaining error."""

import dataclasses

import helpers_recordings as made
import numpy as np
import pytest

from irb140_jax.mismatch import diagnose
from irb140_jax.mismatch.output.notes import left_notes, recording_notes, rest_notes
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.undecided_joints import made_worse, undecidable
from irb140_jax.recordings.low_pass import Band

BAND = Band(20.0, 32.0, 200.0, 4)


def proof(left: float, rows: int = 2000) -> HeldOut:
    """Errors of this size on a joint, on so many rows."""
    error, moves = [np.full((rows, 1), left)], np.ones((rows, 1), dtype=bool)
    return HeldOut(error, error, error, error, error, [moves], [moves], np.zeros(1, dtype=bool))


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


def test_the_note_on_an_error_points_to_what_it_depends_on_where_that_is_said():
    torque = np.sqrt(2.0) * np.sin(np.linspace(0.0, 20.0 * np.pi, 2000, endpoint=False))[:, None]
    given = made.robot(pendulum=True), proof(0.7, 2000), [torque], np.array([0.05]), BAND
    plain, pointing = (undecidable(*given, located=joints)[0] for joints in ((), (0,)))
    assert "anything: check its columns" in plain and "`unexplained` says what it depends on; check" in pointing


@pytest.mark.parametrize(
    ("refit", "left", "scatter", "measured", "worse"),
    [
        (0.6, 0.7, 0.05, True, True),
        (0.6, 0.7, 0.7, True, False),
        (0.8, 0.7, 0.05, True, False),
        (0.1, 0.3, 0.001, True, True),
        (0.1, 0.3, 0.001, False, False),  # of torque made of commands
        (0.6, 0.7, 0.05, False, True),
    ],
)
def test_an_explanation_that_makes_the_error_larger_explains_nothing(refit, left, scatter, measured, worse):
    torque = np.sqrt(2.0) * np.sin(np.linspace(0.0, 20.0 * np.pi, 2000, endpoint=False))[:, None]
    errors = dataclasses.replace(proof(left), nominal=[np.ones((2000, 1))], refit=[np.full((2000, 1), refit)])
    assert made_worse(errors, [torque], np.array([scatter]), measured) == worse


def test_no_effect_is_named_on_a_joint_whose_error_it_makes_larger(monkeypatch):
    robot = made.robot(pendulum=True)
    rubbing = [made.recording(seed=seed, pendulum=True, speeds=False, rate=200.0, duration=10.0) for seed in range(2)]
    assert diagnose(robot, rubbing).diagnosis.findings
    monkeypatch.setattr(HeldOut, "rmse", lambda self, error, at_rest=False: np.array([1e3 * (error is self.corrected)]))
    result = diagnose(robot, rubbing)
    assert not result.diagnosis.findings and not result.model.named


def test_positions_too_coarse_for_any_friction_are_no_verdict():
    robot, step, recordings = made.robot(pendulum=True), np.radians(2.0), []
    for seed in range(2):
        one = made.recording(seed=seed, pendulum=True, speeds=False, rate=200.0, duration=10.0)
        recordings.append(dataclasses.replace(one, q=step * np.round(one.q / step)))
    diagnosis = diagnose(robot, recordings).diagnosis.to_json()
    assert diagnosis["verdict"] == "undecided" and "friction of a usual size" in diagnosis["summary"].lower()


def test_what_is_as_large_as_the_torque_is_no_verdict():
    # Positions that belong to another arm: nothing of the model is in the torque.
    robot, recordings = made.robot(pendulum=True), []
    for seed in range(2):
        one = made.recording(seed=seed, pendulum=True, speeds=False, rate=200.0, duration=10.0)
        noise = np.random.default_rng(seed).normal(size=one.tau.shape)
        recordings.append(dataclasses.replace(one, tau=one.tau.std() * noise))
    diagnosis = diagnose(robot, recordings).diagnosis.to_json()
    assert diagnosis["verdict"] == "undecided" and "may hide anything" in diagnosis["summary"]
    assert "record" in diagnosis["summary"]


def test_errors_are_those_of_the_rows_that_are_asked_for():
    some = proof(1.0, 4)
    moves = np.array([[True], [True], [False], [False]])
    recorded = np.array([[True], [True], [True], [False]])
    error = [np.array([[3.0], [3.0], [6.0], [100.0]])]
    some = dataclasses.replace(some, recorded=[recorded], use=[moves])
    np.testing.assert_allclose(some.rmse(error), [3.0])
    np.testing.assert_allclose(some.rmse(error, at_rest=True), [np.sqrt(18.0)])


@pytest.mark.parametrize(("at_rest", "scatter", "told"), [(5.0, 0.1, True), (5.0, 5.0, False), (0.5, 0.1, False)])
def test_errors_while_a_joint_moves_are_told_where_most_of_the_error_is_at_rest(at_rest, scatter, told):
    moves = np.arange(100)[:, None] < 60
    error = lambda moving: [np.where(moves, moving, at_rest)]  # noqa: E731
    some = dataclasses.replace(
        proof(1.0, 100), nominal=error(3.0), refit=error(2.0), corrected=error(1.0),
        recorded=[np.ones_like(moves)], use=[moves],
    )  # fmt: skip
    notes = rest_notes(made.robot(pendulum=True), some, np.array([scatter]))
    assert len(notes) == told
    if told:
        assert all(part in notes[0] for part in ("rests", "is 3 N", "2 with refitted", "1 with the corrected"))


@pytest.mark.parametrize(("size", "scatter", "elsewhere", "told"), [
    (10.0, 0.1, (), True), (10.0, 0.1, (0,), False), (10.0, 0.5, (), False), (100.0, 0.1, (), False),
])  # fmt: skip
def test_more_than_noise_that_depends_on_nothing_known_is_told(size, scatter, elsewhere, told):
    rows = [np.full((100, 1), True)]
    some = dataclasses.replace(proof(1.0, 100), corrected=[np.ones((100, 1))], recorded=rows, use=rows)
    when = lambda j: [f"mostly from {j} to 2 s"]  # noqa: E731
    notes = left_notes(made.robot(pendulum=True), some, np.array([scatter]), np.array([size]), elsewhere, when)
    assert len(notes) == told
    if told:
        assert "hinge 1 N m RMS (10 % of its torque), mostly from 0 to 2 s" in notes[0]


def test_the_recording_that_holds_most_of_an_error_is_told_where_it_is_less_than_half_of_all():
    rows = [np.full((k, 1), True) for k in (100, 60, 100)]
    errors = lambda a, b: [np.full((len(u), 1), x) for u, x in zip(rows, (a, b, a), strict=True)]  # noqa: E731
    told = lambda left, order=(0, 1, 2): recording_notes(  # noqa: E731
        made.robot(pendulum=True), dataclasses.replace(proof(1.0, 100), corrected=left, recorded=rows, use=rows),
        order, ("a.csv", "b.csv", "c.csv"), np.array([0.1]), np.array([10.0]))  # fmt: skip
    (note,) = told(errors(0.2, 2.0))
    assert "is in b.csv: 97 % on hinge" in note
    assert not told(errors(2.0, 2.0)) and not told(errors(0.01, 0.1))
    assert not told(errors(2.0, 0.1), (0, 1, 0))  # most of all rows
