"""What the testbed counts as right, on documents written by hand."""

import numpy as np
import pytest
from helpers_testbed import finding, hidden, line

from testbed import scoring, statistics


def test_a_name_is_false_at_another_joint_or_where_nothing_allows_it():
    truth = [hidden("stribeck_friction", "a", tolerate=["coulomb_friction"])]
    said = [finding("stribeck_friction", "a"), finding("stribeck_friction", "b"), finding("payload", "ab"),
            finding("coulomb_friction", "a"), finding("viscous_friction", "b")]  # fmt: skip
    assert [f["effect"] for f in scoring.false_names(line(said, truth))] == ["stribeck_friction", "payload"]
    assert [f["effect"] for f in scoring.false_names(line(said, truth), ordinary=True)] == ["viscous_friction"]
    assert [right for *_, right in scoring.probabilities(line(said, truth))] == [True, False, False, True, False]


def test_what_acts_on_every_joint_is_right_whichever_joints_are_listed():
    assert not scoring.false_names(line([finding("payload", "b")], [hidden("payload", "ab")]))


def test_a_name_at_a_dead_channel_is_false():
    truth = [hidden("rotor_inertia", "a")]
    assert scoring.false_names(line([finding("rotor_inertia", "a")], truth, dead="a"))


def test_intervals_are_those_of_the_same_name_at_the_same_joint():
    truth = [hidden("coulomb_friction", "a", coulomb=2.0)]
    said = [finding("coulomb_friction", "a", coulomb=(2.1, 0.1)), finding("coulomb_friction", "b", coulomb=(9.0, 0.1))]
    assert scoring.intervals(line(said, truth)) == [("coulomb_friction", "coulomb", 2.1, 0.1, 2.0)]
    assert not scoring.intervals(line(said, truth), unexplained=True)
    left = line(said, truth, unexplained=[{"joints": ["a"], "share": 0.5}])
    assert scoring.intervals(left, unexplained=True) == scoring.intervals(left)


@pytest.mark.parametrize(
    ("said", "not_testable", "unexplained", "how", "size"),
    [
        ([finding("stribeck_friction", "a", alternatives=["coulomb_friction"])], [], [], "named", 2),
        ([finding("coulomb_friction", "a", alternatives=["stribeck_friction"])], [], [], "in the class", 2),
        ([], [{"effect": "stribeck_friction", "joints": ["a"]}], [], "not testable", 0),
        ([], [], [{"joints": ["a"], "share": 0.2}], "unexplained", 0),
        ([finding("stribeck_friction", "b")], [], [], "missed", 0),
    ],
)
def test_a_true_effect_is_named_in_its_class_open_left_over_or_missed(said, not_testable, unexplained, how, size):
    out = scoring.stated_classes(
        line(said, [hidden("stribeck_friction", "a")], unexplained=unexplained, not_testable=not_testable)
    )
    assert [(c["how"], c["size"]) for c in out] == [(how, size)]


def test_a_gain_counts_within_five_per_cent():
    truth = [hidden("torque_gain", "a", gain=0.8), hidden("torque_gain", "b", gain=0.8)]
    said = [finding("torque_gain", "a", gain=(0.82, 0.01)), finding("torque_gain", "b", gain=(0.9, 0.01))]
    assert scoring.gains(line(said, truth)) == [True, False]


def test_floors_errors_and_places_are_read_off():
    odd = [hidden(None, "a", unnamed=True)]
    got = line([], odd, unexplained=[{"joints": ["a"], "share": 0.5}])
    assert scoring.floors(got) == pytest.approx([3.0, 1.0])
    assert scoring.floors(got | {"left_in_band": {"a": 0.2, "b": 0.1}}, "left_in_band") == pytest.approx([1.5, 1.0])
    assert scoring.floors(got, "left_in_band") == []  # of results that were stored before it was measured
    assert scoring.unseen_ratio(got) == pytest.approx(0.5)
    assert scoring.located(got) == [("odd", "located")]
    assert scoring.located(line([], odd, notes=["a: its torque is constant"])) == [("odd", "noted")]
    assert scoring.located(line([], odd, notes=["a: 3 samples were filled in"])) == [("odd", "not said")]
    slight = f"Less than 2 % {scoring.SLIGHT}c 1 N m RMS, which depends on time; {{}} 1 N m RMS, which depends on {{}}."
    for joint, other, how in (("a", "b", "noted"), ("b", "the motion of a", "not said"), ("ab", "time", "not said")):
        assert scoring.located(line([], odd, notes=[slight.format(joint, other)])) == [("odd", how)]
    assert scoring.located(line([], odd)) == [("odd", "not said")]


@pytest.mark.parametrize(
    ("where", "right"),
    [("a: 2 N m RMS that no effect explains; it depends on the torque of b", True),
     ("a: 2 N m RMS that no effect explains; it depends on the joint's speed", False)],
)  # fmt: skip
def test_what_is_left_has_to_be_said_to_depend_on_what_it_depends_on(where, right):
    odd = hidden(None, "a", unnamed=True)
    got = line([], [odd | {"depends": ["of b"]}, odd], unexplained=[{"joints": ["a"], "where": where}])
    assert scoring.places(got) == [("odd", right)]


@pytest.mark.parametrize(
    ("truth", "verdict", "right"),
    [
        ([], "parameters_only", True),
        ([], "physics_left_out", False),
        ([hidden("payload", "ab")], "physics_left_out", True),
        ([hidden("payload", "ab")], "no_mismatch", False),
        ([hidden(None, "a", unnamed=True)], "unexplained", True),
        ([hidden(None, "a", unnamed=True)], "physics_left_out", False),
    ],
)
def test_a_verdict_is_right_where_the_truth_allows_it(truth, verdict, right):
    assert scoring.verdict_right(line([], truth, verdict)) is right


def test_a_sentence_with_a_negative_mass_is_seen():
    bad, good = "mass 1.8 -> -8.4 kg", "m cz 0.98 -> -0.45 kg m, mass 1.8 -> 1.2 kg"
    assert scoring.impossible_stated(line([], []) | {"sentences": [bad]})
    assert not scoring.impossible_stated(line([], []) | {"sentences": [good]})


def test_wilsons_interval_is_the_published_one():
    # Newcombe, Statistics in Medicine 17, 1998, table I: 81 of 263 and 0 of 20.
    assert statistics.wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert statistics.wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)


def test_probabilities_that_hold_have_no_calibration_error_and_boasts_have():
    rng = np.random.default_rng(0)
    p = rng.uniform(0.3, 1.0, 20000)
    assert statistics.calibration_error(p.tolist(), (rng.random(20000) < p).tolist()) < 0.02
    assert statistics.calibration_error([0.999] * 10, [True] * 5 + [False] * 5) == pytest.approx(0.499)


def test_normal_intervals_hold_what_they_say():
    assert statistics.covered(1.0, 0.1, 1.16, 0.9) and not statistics.covered(1.0, 0.1, 1.17, 0.9)
