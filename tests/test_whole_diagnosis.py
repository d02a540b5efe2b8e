"""The whole way of a diagnosis, on plants that share nothing with it."""

import json

from testbed import runner, scoring
from testbed.cases import make


def said(index: int, draw: str = "work", commit: str = "") -> dict:
    """A case of the draw that may be looked at, or of one that is done with, as it is stored."""
    line = json.loads(json.dumps(runner.compact(runner.judged(make(draw, index, commit)))))
    assert line["diagnosis"], line
    return line


def test_torque_constants_all_wrong_alike_are_one_torque_scale_and_no_rotors():
    line = said(1)
    (finding,) = line["diagnosis"]["findings"]
    assert finding["effect"] == "torque_gain" and finding["joints"] == ["j1", "j2", "j3"]
    assert scoring.gains(line) == [True] * 3  # each within 5 %
    gain, true = finding["parameters"]["gain"], line["truth"]["hidden"][0]["parameters"]["gain"]
    assert abs(gain["value"] - true) < 2.6 * gain["std"]


def test_nothing_is_named_where_only_inertials_are_wrong():
    line = said(2)
    assert not line["diagnosis"]["findings"] and line["diagnosis"]["verdict"] == "parameters_only"


def test_friction_that_falls_as_the_speed_rises_is_named_whatever_the_form_of_its_law():
    line = said(86)  # Hess and Soom's law on j2, which the discrepancy's block of speed can hold whole
    by_joint = {f["joints"][0]: f for f in line["diagnosis"]["findings"] if f["effect"] == "stribeck_friction"}
    assert by_joint.keys() == {"j2"} and by_joint["j2"]["evidence"]["probability"] > 0.99
    truth = next(h["parameters"] for h in line["truth"]["hidden"] if h["slug"] == "stribeck_friction")
    for name, true in truth.items():  # at rest, too: of that rise the law alone finds less than half
        level = by_joint["j2"]["parameters"][name]
        assert abs(level["value"] - true) < 2.6 * level["std"] and level["std"] < true
    # No other law holds the joint's dry friction, and what else is named there has odds of its own.
    assert not any(f["effect"] == "coulomb_friction" and f["joints"] == ["j2"] for f in line["diagnosis"]["findings"])
    assert all(f["evidence"]["log_odds"] > 0.0 for f in line["diagnosis"]["findings"])


def test_a_torque_constant_does_not_stand_for_friction_that_is_most_of_a_joints_torque():
    line = said(32, "final", "af4dedc")  # a slide whose friction is many times what its links need
    named = {(f["effect"], *f["joints"]) for f in line["diagnosis"]["findings"]}
    assert {("position_dependent_friction", "j1"), ("viscous_friction", "j2")} <= named
    assert not scoring.false_names(line)


def test_play_is_found_by_its_blows_which_no_repair_takes_for_spikes():
    line = said(220)  # 500 Hz, blows of some samples on j3
    assert not any("spike" in n for n in line["diagnosis"]["notes"])
    (play,) = [f for f in line["diagnosis"]["findings"] if f["effect"] == "backlash"]
    true = next(h["parameters"]["gap"] for h in line["truth"]["hidden"] if h["slug"] == "backlash")
    gap = play["parameters"]["gap"]
    assert play["joints"] == ["j3"] and abs(gap["value"] - true) < 2.6 * gap["std"] and gap["std"] < 0.1 * true
