"""The whole way of a diagnosis, on plants that share nothing with it."""

import json
import re

from testbed import runner, scoring
from testbed.cases import make


def said(index: int) -> dict:
    """A case of the draw that may be looked at, as it is stored."""
    line = json.loads(json.dumps(runner.compact(runner.judged(make("work", index)))))
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


def test_a_rise_of_friction_at_low_speed_that_is_not_named_is_said_with_its_place():
    line = said(86)  # Hess and Soom's law on j2, which the discrepancy's block of speed can hold whole
    named = any(f["effect"] == "stribeck_friction" and f["joints"] == ["j2"] for f in line["diagnosis"]["findings"])
    on_j2 = re.compile(r"adds torque that no effect explains.* on j2 [^;]*friction is higher at low speed")
    assert named or any(on_j2.search(note) for note in line["diagnosis"]["notes"])
