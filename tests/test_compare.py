"""irb140 compare: heterogeneity tests against other ways to the same numbers, sentences, and what is refused."""

import dataclasses
import json

import numpy as np
import pytest
from helpers_cli import refused
from helpers_fleet import diagnosis_with
from scipy import stats

from irb140_jax import cli
from irb140_jax.errors import InputError
from irb140_jax.fleet.compare import Given, compare
from irb140_jax.fleet.heterogeneity import cochran, differences, holm, pooled
from irb140_jax.mismatch.result import NotTestable
from irb140_jax.report.compared import comparison_html, headline


def given(*values: tuple[float, float]) -> list[Given]:
    """Diagnoses a, b, c ... that name one effect with these values and standard deviations."""
    return [Given("abcdef"[k], diagnosis_with(x, s, f"r{k}.csv")) for k, (x, s) in enumerate(values)]


def only(comparison: dict) -> dict:
    """The one parameter compared."""
    ((parameter,),) = [effect["parameters"] for effect in comparison["effects"]]
    return parameter


def test_for_two_diagnoses_the_test_is_the_z_test_of_their_difference():
    x, s = np.array([3.0, 3.5]), np.array([0.1, 0.2])
    z = (x[1] - x[0]) / np.hypot(*s)
    q, p = cochran(x, s)
    assert q == pytest.approx(z**2) and p == pytest.approx(2 * stats.norm.sf(z))


def test_for_many_it_is_what_least_squares_leaves():
    rng = np.random.default_rng(1)
    x, s = rng.normal(5.0, 1.0, 6), rng.uniform(0.1, 0.5, 6)
    _, rest, *_ = np.linalg.lstsq(1 / s[:, None], x / s, rcond=None)
    assert cochran(x, s)[0] == pytest.approx(rest[0])


def test_equal_units_are_said_to_differ_as_rarely_as_the_level_allows():
    rng, s = np.random.default_rng(2), np.full(4, 0.3)
    said = [cochran(rng.normal(1.0, s), s)[1] < 0.05 for _ in range(2000)]
    assert 0.035 < np.mean(said) < 0.065  # three standard deviations of a share of 2000


def test_the_spread_between_units_is_found_again():
    rng, s = np.random.default_rng(3), np.full(12, 0.1)
    found = [pooled(rng.normal(rng.normal(2.0, 0.4, 12), s), s).between for _ in range(300)]
    assert np.mean(np.square(found)) ** 0.5 == pytest.approx(0.4, rel=0.06)  # 2.5 % is a standard error


def test_holm_adjusts_as_in_a_worked_example():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])  # 3p, 2 x 0.03, 2p, 4p


def test_the_largest_difference_comes_first_with_its_own_interval():
    d = differences(np.array([1.0, 4.0, 2.0]), np.array([0.1, 0.2, 0.3]))[0]
    assert (d.first, d.second, d.value) == (0, 1, 3.0)
    assert d.high - d.value == pytest.approx(1.6449 * np.hypot(0.1, 0.2), rel=1e-4)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ([(10.0, 0.1), (10.1, 0.1), (9.9, 0.1)], "same"),
        ([(10.0, 0.1), (12.0, 0.1)], "differs"),
        ([(10.0, 2.0), (10.1, 2.0)], "cannot_tell"),  # near each other, but nobody knows
        ([(10.0, 0.001), (10.02, 0.001)], "same"),  # a difference beyond doubt, and too small to matter
    ],
)
def test_the_same_is_said_only_where_every_difference_is_known_to_be_small(values, says):
    assert only(compare(given(*values)))["says"] == says


def test_the_odd_one_is_named():
    comparison = compare(given((10.0, 0.1), (10.1, 0.1), (14.0, 0.1)))
    assert only(comparison)["most_unlike"] == 2 and "c is the most unlike" in only(comparison)["sentence"]
    assert "+4.00" in only(comparison)["sentence"] and "+40 %" in only(comparison)["sentence"]


def test_an_effect_that_one_could_not_have_shown_is_no_difference():
    a, b = given((10.0, 0.1), (10.0, 0.1))
    (coupling,) = b.diagnosis.findings
    silent = dataclasses.replace(b.diagnosis, findings=())
    blind = dataclasses.replace(silent, not_testable=(NotTestable(coupling.effect, coupling.joints, "more"),))
    (found,) = compare([a, Given("b", blind)])["effects"]
    assert found["says"] == "named_in_some" and "could not have shown it" in found["sentence"]
    assert "could have shown it and does not name it" in compare([a, Given("b", silent)])["effects"][0]["sentence"]


def test_what_cannot_be_compared_is_refused():
    a, b = given((1.0, 0.1), (2.0, 0.1))
    with pytest.raises(InputError, match="only one"):
        compare([a])
    with pytest.raises(InputError, match="r0.csv is in a"):
        compare([a, Given("again", a.diagnosis)])
    other = dataclasses.replace(b.diagnosis.provenance.robot, joints=("elbow",))
    origin = dataclasses.replace(b.diagnosis.provenance, robot=other)
    with pytest.raises(InputError, match="elbow"):
        compare([a, Given("b", dataclasses.replace(b.diagnosis, provenance=origin))])


def test_the_page_has_a_plot_for_each_parameter_and_takes_no_markup_from_names():
    comparison = compare([one._replace(name=f"<b>{one.name}") for one in given((1.0, 0.1), (2.0, 0.1))])
    page = comparison_html(comparison)
    assert page.count("<svg") == 1 and "<b>" not in page and "http" not in page
    assert headline(comparison).startswith("2 diagnoses. Differ: transmission coupling on joint5, joint6")


def test_the_command_writes_what_it_says(tmp_path, capsys):
    for one in given((10.0, 0.1), (12.0, 0.1)):
        (tmp_path / one.name).mkdir()
        (tmp_path / one.name / "diagnosis.json").write_text(json.dumps(one.diagnosis.to_json()))
    for _ in range(2):  # the second replaces the first
        assert cli.main(["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--out", str(tmp_path / "c")]) == 0
    assert "Differs: from a to b by +2.00" in " ".join(capsys.readouterr().out.split())
    written = json.loads((tmp_path / "c" / "compare.json").read_text())
    assert only(written)["largest"]["value"] == 2.0 and (tmp_path / "c" / "compare.html").exists()


def test_folders_without_a_diagnosis_and_shares_beyond_one_are_refused(tmp_path, capsys):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    out = ["--out", tmp_path / "c"]
    assert "holds no recording" in refused(capsys, "compare", tmp_path / "a", tmp_path / "b", *out)
    assert "given twice" in refused(capsys, "compare", tmp_path / "a", tmp_path / "a", *out)
    assert "two or more" in refused(capsys, "compare", tmp_path / "a", *out)
    assert "--same-within" in refused(capsys, "compare", tmp_path / "a", tmp_path / "b", "--same-within", "2", *out)
    (tmp_path / "a" / "diagnosis.json").write_text("{")
    assert "diagnose again" in refused(capsys, "compare", tmp_path / "a", tmp_path / "b", *out)
    assert not (tmp_path / "c").exists()
