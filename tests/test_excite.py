"""Designed motions: playable, of pieces that are what they say, and worth more than any that was not chosen."""

import dataclasses
import functools

import helpers_stored
import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irb140_jax import cli
from irb140_jax.errors import InputError
from irb140_jax.mismatch import diagnose, load_undecided, propose, save
from irb140_jax.mismatch import settings as decisions
from irb140_jax.mismatch.experiment_design import design
from irb140_jax.mismatch.experiment_design.questions import Questions
from irb140_jax.mismatch.experiment_design.undecided import Pair, save_undecided
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot, record_again
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import fourier_motion, motion_limits, slow_motion, within
from irb140_jax.recordings.segments import KINDS, Segment, joined, segment_motion
from irb140_jax.report import proposal_sentences
from irb140_jax.robot import Robot, robot_from_model

RATE = 200.0


@functools.cache
def arm() -> tuple[str, Robot]:
    limits = '<custom><numeric name="velocity_limit" size="2" data="2 2"/></custom>'
    text = random_robot(6, 2, slides=0.0).replace("<worldbody>", limits + "<worldbody>")
    return text, robot_from_model(arm_spec(text).compile(), "two hinges")


@functools.cache
def slow_case():
    """Load-dependent friction under slow motion of the other joint: nothing can be said of joint 2."""
    text, robot = arm()
    motions = [segment_motion(robot, Segment("fourier", 0, 0.3, 0.2, s), 8.0, 1000.0) for s in (1, 2)]
    hidden = Concealment("load_dependent_friction", ("joint2",), parameters={"coulomb": 0.2, "load_coefficient": 0.1})
    case = conceal(text, [hidden], motions, seed=5)
    return case, diagnose(robot, case.recordings)


@functools.cache
def proposal():
    return propose(arm()[1], slow_case()[1].undecided, seed=0, duration=36.0, rate=1000.0)


def segments():
    return [Segment(kind, joint, 0.7, 0.3, 11) for kind in KINDS for joint in (None, 1)]


@pytest.mark.parametrize("segment", segments(), ids=lambda s: f"{s.kind}-{s.joint}")
@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**31))
def test_a_piece_starts_and_ends_at_rest_within_all_limits(segment, seed):
    robot = arm()[1]
    m, limits = segment_motion(robot, dataclasses.replace(segment, seed=seed), 8.0, RATE), motion_limits(robot, 1.0)
    assert np.abs(m.qd[[0, -1]]).max() < 1e-6
    assert (m.q >= limits.lower - 1e-9).all() and (m.q <= limits.upper + 1e-9).all()
    assert (np.abs(m.qd) <= limits.speed).all() and (np.abs(m.qdd) <= limits.acceleration).all()
    assert np.ptp(m.q[:, 1]) > 1e-3


def test_small_reversals_in_a_posture_at_a_limit_are_not_cut_off():
    robot = arm()[1]
    limits = motion_limits(robot, 1.0)
    for seed in range(60):
        m = segment_motion(robot, Segment("micro", None, 0.7, 0.3, seed), 8.0, RATE)
        assert (m.q >= limits.lower - 1e-9).all() and (m.q <= limits.upper + 1e-9).all()
        assert np.abs(np.diff(m.qdd, axis=0)).max() < 0.2 * np.abs(m.qdd).max()


@pytest.mark.parametrize("segment", segments(), ids=lambda s: f"{s.kind}-{s.joint}")
def test_speeds_and_accelerations_of_a_piece_are_those_of_its_positions(segment):
    m = segment_motion(arm()[1], segment, 8.0, RATE)
    for x, rate in ((m.q, m.qd), (m.qd, m.qdd)):
        numeric = np.gradient(x, 1.0 / RATE, axis=0)
        # Central differences at 200 Hz of motions below some 5 Hz.
        np.testing.assert_allclose(numeric[2:-2], rate[2:-2], atol=0.02 * np.abs(rate).max() + 1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_the_other_joints_rest_where_one_moves_alone(kind):
    m = segment_motion(arm()[1], Segment(kind, 0, 0.5, 0.3, 3), 8.0, RATE)
    assert np.ptp(m.q[:, 1]) == 0.0 and np.ptp(m.q[:, 0]) > 0.0


def test_a_ladder_has_speeds_from_very_slow_to_the_one_asked_for():
    robot = arm()[1]
    m = segment_motion(robot, Segment("ladder", 0, 0.6, 0.1, 1), 8.0, RATE)
    speed = np.abs(m.qd[:, 0])
    assert speed.max() > 0.2 * 0.6 * 2.0  # the joint's range ends the fastest rung early
    assert 0.0 < np.quantile(speed[speed > 1e-6], 0.1) < 0.05 * speed.max()


def test_joined_pieces_have_no_jumps():
    robot = arm()[1]
    pieces = [segment_motion(robot, Segment(kind, None, 0.5, 0.3, 7), 8.0, RATE) for kind in KINDS]
    m, limits = joined(robot, pieces, RATE), motion_limits(robot, 1.0)
    assert np.abs(np.diff(m.q, axis=0)).max() < 1.01 * limits.speed.max() / RATE
    assert (np.abs(m.qd) <= limits.speed).all()
    np.testing.assert_allclose(np.diff(m.t), 1.0 / RATE, rtol=1e-9)


def test_a_robot_without_limits_gets_those_of_what_was_seen():
    lower, upper, none = jnp.array([-jnp.inf, -1.0]), jnp.array([jnp.inf, 1.0]), jnp.full(2, jnp.inf)
    robot = dataclasses.replace(arm()[1], lower=lower, upper=upper, velocity_limit=none)
    low, high, speed = np.array([-0.5, -0.2]), np.array([0.7, 0.3]), np.array([0.4, 0.5])
    bounded = within(robot, low, high, speed)
    np.testing.assert_allclose([bounded.lower, bounded.upper, bounded.velocity_limit], [[-0.5, -1], [0.7, 1], speed])


def test_what_another_joints_motion_cannot_show_is_not_testable():
    _, result = slow_case()
    blind = {n.effect: n for n in result.diagnosis.not_testable}
    assert not any("joint2" in f.joints for f in result.diagnosis.findings)
    for effect in ("load_dependent_friction", "coulomb_friction", "stribeck_friction", "viscous_friction"):
        assert "joint2" in blind[effect].joints and "joint1" not in blind[effect].joints
        assert blind[effect].needs.startswith("Needs ")
    assert "external_wrench" not in blind  # a push leaves its trace whenever it comes


def test_the_proposed_motion_makes_the_hidden_effect_visible():
    open_, designed = slow_case()[1].undecided, proposal()
    at = [k for k, c in enumerate(open_.hidden) if open_.columns[c].slug == "load_dependent_friction"]
    assert at and all(designed.seen_now[k] < decisions.VISIBLE for k in at)
    assert max(designed.seen[k] for k in at) > decisions.VISIBLE


def test_recording_the_proposed_motion_names_what_was_hidden():
    case, _ = slow_case()
    again = diagnose(arm()[1], [*case.recordings, *record_again(case, [proposal().motion], seed=6)]).diagnosis
    assert ("load_dependent_friction", ("joint2",)) in [(f.effect, f.joints) for f in again.findings]


def test_the_proposed_motion_stays_within_the_limits_from_rest_to_rest():
    robot, m = arm()[1], proposal().motion
    assert (m.q > np.asarray(robot.lower)).all() and (m.q < np.asarray(robot.upper)).all()
    assert (np.abs(m.qd) <= np.asarray(robot.velocity_limit)).all()
    assert np.abs(m.qd[[0, -1]]).max() < 1e-5  # of 2 rad/s: what the blending of pieces leaves


def test_expected_log_odds_grow_with_what_is_added_and_start_at_those_of_the_recordings():
    open_ = undecided_pair()
    questions = Questions(arm()[1], open_)
    lively = questions.gram(fourier_motion(arm()[1], 8.0, open_.band.rate, seed=4))
    assert lively is not None
    (pair,) = open_.pairs
    now, more, most = (questions.margin(k * lively, pair) for k in (0.0, 0.1, 1.0))
    assert np.isfinite([now, more, most]).all() and now < more < most


@functools.cache
def undecided_pair():
    """A diagnosis in which friction that grows with load is called in doubt with plain Coulomb friction, by hand."""
    text, robot = arm()
    motions = [slow_motion(robot, 10.0, 1000.0, seed=s) for s in (3, 4)]
    case = conceal(text, [Concealment("coulomb_friction", ("joint2",), parameters={"coulomb": 0.3})], motions, seed=7)
    open_ = diagnose(robot, case.recordings).undecided
    mine = next(k for k in open_.chosen if open_.columns[k].slug == "coulomb_friction")
    rival = next(k for k, c in enumerate(open_.columns) if c.slug == "position_dependent_friction" and c.joints == (0,))
    rest = tuple(k for k in open_.chosen if k != mine)
    pair = Pair((1,), "coulomb_friction", "position_dependent_friction", 0.5, rest, ((mine,),), ((rival,),))
    return dataclasses.replace(open_, pairs=(pair,))


def test_what_is_open_survives_its_way_to_disk(tmp_path):
    open_ = undecided_pair()
    save_undecided(open_, tmp_path)
    again = load_undecided(tmp_path)
    assert (again.columns, again.chosen, again.pairs, again.hidden) == (
        open_.columns, open_.chosen, open_.pairs, open_.hidden)  # fmt: skip
    np.testing.assert_array_equal(again.gram, open_.gram)


def test_excite_writes_a_motion_that_is_the_same_for_the_same_seed(tmp_path, capsys):
    save(slow_case()[1], tmp_path)
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in paths:
        assert cli.main(["excite", str(tmp_path), "--out", str(path), "--duration", "9", "--rate", "100"]) == 0
    said = capsys.readouterr().out
    assert "from rest to rest" in said and "This motion shows" in said
    table = pd.read_csv(paths[0])
    assert list(table) == ["t", *(f"{k}.joint{j}" for k in ("q", "qd", "qdd") for j in (1, 2))]
    np.testing.assert_allclose(np.diff(table["t"]), 0.01, rtol=1e-6)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    "words", [
        ["--duration", "2"], ["--duration", "nan"], ["--duration", "inf"], ["--duration", "1e9"], ["--rate", "3"],
        ["--rate", "nan"], ["--rate", "1e9"], ["--rate", "-inf"], ["--seed", "-1"],
    ],
)  # fmt: skip
def test_excite_refuses_times_that_make_no_motion(words, tmp_path, capsys):
    save(slow_case()[1], tmp_path)
    assert cli.main(["excite", str(tmp_path), "--out", str(tmp_path / "a.csv"), *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "a.csv").exists()


def test_excite_refuses_a_folder_without_a_diagnosis(tmp_path, capsys):
    assert cli.main(["excite", str(tmp_path), "--out", str(tmp_path / "a.csv")]) == 2
    assert "model.json" in capsys.readouterr().err


def test_the_search_ends_where_its_budget_does(monkeypatch):
    spent = []
    for most in (0, 200, design.MOST_COMPARISONS):
        monkeypatch.setattr(design, "MOST_COMPARISONS", most)
        margins, real = [], Questions.margin

        def margin(self, *args, margins=margins, real=real, **kwargs):
            margins.append(1)
            return real(self, *args, **kwargs)

        with monkeypatch.context() as patched:
            patched.setattr(Questions, "margin", margin)
            made = propose(helpers_stored.model().robot, helpers_stored.open_questions(), seed=1, rate=50.0)
        assert len(made.pieces) == 4
        spent.append(len(margins))
    assert spent[0] < 20 < spent[1] < 220 < spent[2]


def test_a_motion_of_another_step_is_not_recorded():
    with pytest.raises(InputError, match="sample it every"):
        record_again(slow_case()[0], [fourier_motion(arm()[1], 2.0, 100.0, seed=1)], seed=1)


def test_the_sentences_say_what_is_separated_and_what_is_not():
    open_ = undecided_pair()
    seen = (9.0,) * len(open_.hidden)
    made = dataclasses.replace(proposal(), odds_now=(0.5,), odds=(40.0,), exact=(50.0,), seen=seen)
    said = " ".join(proposal_sentences(arm()[1], open_, made))
    assert "On joint2, Coulomb friction or" in said and "should reach 40 at least" in said and "alone give 0.5" in said
    failed = dataclasses.replace(made, odds=(1.0,))
    said = " ".join(proposal_sentences(arm()[1], open_, failed))
    assert "none of the motions tried separates them" in said and "less than a real joint differs from" in said
    alike = dataclasses.replace(failed, exact=(1.0,), tried=52, too_strong=7)
    said = " ".join(proposal_sentences(arm()[1], open_, alike))
    assert "along all 45 segments" in said and "7 others need more torque" in said
    assert "can explain what the other" in said
    nothing = dataclasses.replace(open_, pairs=(), hidden=())
    none = dataclasses.replace(made, odds_now=(), odds=(), exact=(), seen=())
    assert "left no question open" in " ".join(proposal_sentences(arm()[1], nothing, none))
