"""The page of calibration and the probes' rows, from lines written by hand."""

import pathlib
import sys

from helpers_testbed import finding, hidden, line

from testbed import compare, diagram, report

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))
import testbed_probes  # noqa: E402


def two_cases():
    """One with a gain named 2 % off and a false payload, one without a diagnosis."""
    said = [finding("torque_gain", "a", 0.999, gain=(0.82, 0.01)), finding("payload", "ab", 0.7)]
    good = line(said, [hidden("torque_gain", "a", gain=0.8)], unexplained=[{"joints": ["b"], "share": 0.4}])
    common = {"index": 3, "kinds": ["torque_gain"], "engine": "abc", "seconds": 2.0, "impossible": {"corrected": ["a"]}}
    return [good | common, {"diagnosis": None, "failed": "KeyError: x"} | common | {"index": 4}]


def test_a_section_holds_the_figures_of_its_cases():
    section = report.section("check", two_cases(), [])
    assert section["cases"] == 2 and section["diagnosed"] == 1 and section["engine"] == "abc"
    assert "| false names a case, ordinary friction aside | 1 | at most 0.05 |" in section["figures"]
    assert "| torque constants named within 5 % | 1 of 1: 100.0 % (21 to 100) |" in section["figures"]
    assert "| joints where it is at most 1.3 | 1 of 2: 50.0 % (9 to 91) | all |" in section["figures"]
    assert "| joints where it is at most 1.3 | none |  |" in section["figures"]  # stored before it was measured
    assert section["coverage"].endswith("| torque_gain | 1 | 0 | 0 | 100 |")  # two standard deviations off
    assert "payload on a, b | 0.7 |" in section["false"] and section["others"] == ["4 (torque_gain): KeyError: x"]


def test_cases_of_servos_are_a_row_for_each_form():
    said = report.in_closed_loop({"torque": two_cases()})
    assert "| torque | abc | 1 of 2 | 1.00 | 1 of 1: 100.0 % (21 to 100) | none |" in said


def test_the_figure_is_the_same_for_the_same_results(tmp_path):
    for name in ("one.svg", "two.svg"):
        diagram.draw(two_cases()[:1], tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_a_probe_is_a_row_of_true_beside_said():
    row = testbed_probes.row(two_cases()[0])
    assert "false names: payload on a,b (0.7)" in row and "gains within 5 %: 1 of 1" in row
    assert "unexplained: b 40 %" in row and "impossible bodies" in row
    assert testbed_probes.row(two_cases()[1]) == "KeyError: x"


def test_two_engines_are_compared_on_the_cases_that_both_diagnosed():
    false, failed = two_cases()
    clean = line([finding("torque_gain", "a", gain=(0.8, 0.01))], [hidden("torque_gain", "a", gain=0.8)])
    left, right = compare.common([false, failed], [false | clean, failed | {"index": 5}])
    assert [x["index"] for x in left] == [3] == [x["index"] for x in right]
    assert compare.changes(left, right) == [
        "3 torque_gain: false payload -> none; in the stated class 1 -> 1 of 1"
    ]  # fmt: skip
