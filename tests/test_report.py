"""The report shows everything that the diagnosis holds, in one file that needs no network."""

import dataclasses
import html.parser
import io
import json
import re
import shlex
import time

import helpers_report
import numpy as np
import pytest
from rich.console import Console

from irb140_jax.cli.parsing import parsed
from irb140_jax.mismatch.output.views import Views
from irb140_jax.mismatch.result import Diagnosis, Estimate, Fit, Unexplained
from irb140_jax.report import html_report, print_diagnosis, print_reveal, revealed, svg, svg_maps, text
from irb140_jax.report.next_steps import next_steps
from irb140_jax.report.overview import overview

VOID = {"meta", "br", "img", "hr", "input", "link", "rect", "path"}


class Page(html.parser.HTMLParser):
    """Visible words of a page, and what is wrong with its nesting."""

    def __init__(self, source: str):
        super().__init__()
        self.words, self.open, self.wrong, self.attributes = [], [], [], []
        self.feed(source)
        self.visible = re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag, attrs):
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return helpers_report.example_diagnosis()


@pytest.fixture(scope="module")
def views() -> Views:
    return helpers_report.example_views()


@pytest.fixture(scope="module")
def page(diagnosis, views) -> Page:
    return Page(html_report(diagnosis, views))


def printed(diagnosis) -> str:
    """What the terminal would show, with white space made even."""
    console = Console(file=io.StringIO(), width=160)
    print_diagnosis(diagnosis, helpers_report.example_views(), console)
    return re.sub(r"\s+", " ", console.file.getvalue())  # pyright: ignore[reportAttributeAccessIssue]


def test_every_finding_is_in_the_report_with_its_parameters_units_and_alternatives(diagnosis, page):
    for finding in diagnosis.findings:
        assert text.words(finding.effect).capitalize() in page.visible
        assert finding.where in page.visible
        for name, p in finding.parameters.items():
            value, interval = text.with_std(p.value, p.std), text.interval_90(p.value, p.std)
            assert f"{text.words(name)} {value} {interval} {p.unit}" in page.visible
        for other in finding.alternatives:
            assert other.separate_by in page.visible


def test_what_is_unexplained_or_not_testable_is_in_the_report(diagnosis, page):
    for rest in diagnosis.unexplained:
        assert rest.where in page.visible
    for blind in diagnosis.not_testable:
        assert blind.needs in page.visible


def test_what_is_unexplained_is_drawn_over_what_it_depends_on(page):
    name = "Torque of joint4 that no effect explains, over position of joint5 [rad]"
    assert ("svg", "aria-label", name) in page.attributes and "position of joint5 [rad]" in page.visible
    dots = [value.count("h0") for tag, key, value in page.attributes if (tag, key) == ("path", "d")]
    assert {3, 2} <= set(dots)  # forward, backward; those of the legend are single


def test_every_joint_has_its_row_of_errors_its_maps_and_its_torque(diagnosis, views, page):
    for joint, row in diagnosis.fit.items():
        numbers = " ".join(map(text.number, dataclasses.astuple(row)))
        assert f"{joint} {numbers}" in page.visible
        assert f"{joint}, {views.motions[0].recording}" in page.visible  # the livelier one
    maps_and_loop = 3
    assert page.visible.count("position [rad]") == maps_and_loop * len(views.joints)


def test_the_first_table_has_every_finding_at_its_joints_and_what_is_not_judged(diagnosis, views):
    stop = Unexplained(("joint6",), "joint6: stands still", None, None)
    left = (*diagnosis.unexplained, stop)
    judged = dataclasses.replace(diagnosis, fit=diagnosis.fit | {"joint4": Fit()}, unexplained=left)
    units = dict.fromkeys(views.joints, "N m")
    rows = {row["name"]: row["cells"] for row in overview(judged, views.joints, units)}
    values = {name: [cell["value"] for cell in cells] for name, cells in rows.items()}
    assert values["stribeck friction"] == ["", "8.431 ± 0.071", "", "", "", ""]
    assert values["transmission coupling"][4:] == ["2.310 ± 0.040"] * 2
    assert rows["stribeck friction"][1]["more"] == "N m · 97 %, 1 alternative"
    assert rows["stribeck friction"][1]["kind"] == "sure open" and rows["transmission coupling"][4]["kind"] == "sure"
    assert values["blocked"] == [""] * 5 + ["yes"]
    assert values["error left"][3] == "not judged"
    assert "joint4 not judged" in Page(html_report(judged, views)).visible


def test_what_to_do_next_comes_as_commands_that_the_command_line_understands(diagnosis):
    lines = [line for step in next_steps(diagnosis, "my folder") for line in step.code if line.startswith("irb140 ")]
    commands = [parsed(shlex.split(line)[1:]) for line in lines]
    assert [type(command).__name__ for command in commands] == ["Excite", "Diagnose", "Predict"]
    again = commands[1]
    assert [path.name for path in again.recordings] == ["wave_1.csv", "wave_2.csv", "wave_3.csv", "recorded.csv"]
    assert str(again.out) == "my folder-2" and str(commands[0].folder) == "my folder"


def test_an_undecided_diagnosis_proposes_a_recording_and_no_corrected_model(diagnosis, views):
    nothing = dataclasses.replace(diagnosis, verdict="undecided", findings=(), unexplained=(), not_testable=())
    steps = next_steps(nothing, "out")
    assert steps[0].code == ("irb140 excite out --out motion.csv",)
    assert not any("corrected" in step.say for step in steps)


def test_the_report_says_where_it_comes_from(diagnosis, page):
    provenance = diagnosis.provenance
    assert provenance.command in page.visible and provenance.robot.sha256 in page.visible
    for recording in provenance.recordings:
        assert f"{recording.file} {recording.rows} 250.0 30.00 {recording.sha256[:16]}" in page.visible


@pytest.mark.parametrize("shifts", [False, True])
def test_no_sentence_stands_twice_in_the_report(diagnosis, views, shifts):
    shifted = "Refitting changes the inertial parameters of the link behind link2 by 5.2 standard deviations."
    if shifts:  # of which the summary speaks, too
        diagnosis = dataclasses.replace(diagnosis, summary=f"{diagnosis.summary} {shifted}")
        link = dataclasses.replace(views.inertials[0], sentence=shifted)
        views = dataclasses.replace(views, inertials=(link, *views.inertials))
    page = Page(html_report(diagnosis, views))
    assert page.visible.count(shifted) == shifts
    sentences = [s.strip() for s in re.split(r"(?<=[.:])\s", page.visible) if len(s) > 40]
    assert len(sentences) > 10
    assert len(set(sentences)) == len(sentences)


def test_every_drawing_and_every_table_has_a_name_for_those_who_do_not_see_it(diagnosis, views, page):
    source = html_report(diagnosis, views)
    drawings = re.findall(r"<svg [^>]*>", source.split("<script", 1)[0])
    assert len(drawings) > 30
    assert all("aria-label=" in tag or "aria-hidden=" in tag for tag in drawings)
    assert source.count('<div class="scroll" role="region" aria-label="') == source.count("<table>")


def test_the_data_of_the_viewer_are_those_of_the_views_to_five_digits(diagnosis, views):
    source = html_report(diagnosis, views)
    (block,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', source)
    for shown, given in zip(json.loads(block)["motions"], views.motions, strict=True):
        for joint, columns in given.joints.items():
            for name, values in columns.items():
                wanted = [np.nan if v is None else v for v in values]
                got = [np.nan if v is None else v for v in shown["joints"][joint][name]]
                np.testing.assert_allclose(got, wanted, rtol=1e-4)


def test_notes_and_inertials_are_in_the_report(views, page):
    for sentence in [*views.notes, *(link.sentence for link in views.inertials)]:
        assert sentence in page.visible


def test_the_report_is_well_formed_and_loads_nothing_from_elsewhere(diagnosis, views, page):
    source = html_report(diagnosis, views)
    assert not page.wrong and not page.open
    assert "://" not in source, "an address"
    assert "url(" not in source and "@import" not in source
    assert not [a for a in page.attributes if a[1] in ("src", "href", "srcset", "data", "action")]
    for way in ("fetch(", "XMLHttpRequest", "import(", "eval(", "WebSocket", "localStorage"):
        assert way not in source


def test_no_drawing_holds_a_number_that_is_none(diagnosis, views):
    source = html_report(diagnosis, views)
    assert not re.search(r"\b(nan|inf|None)\b", Page(source).visible)
    assert not re.search(r' d="[^"]*(nan|inf)', source)


def test_names_from_files_cannot_inject_markup(diagnosis, views):
    evil = dataclasses.replace(views, recordings=("<b onload=x>.csv",))
    source = html_report(dataclasses.replace(diagnosis, notes=("<script>alert(1)</script>",)), evil)
    assert "alert(1)</script" not in source and "<b onload" not in source


def test_names_from_files_cannot_end_the_element_that_holds_the_data(diagnosis, views):
    first, *others = views.motions
    evil = dataclasses.replace(first, recording="</script><script>alert(1)</script>")
    assert html_report(diagnosis, dataclasses.replace(views, motions=(evil, *others))).count("</script>") == 2


def test_the_report_is_made_within_its_time(diagnosis, views):
    start = time.perf_counter()
    html_report(diagnosis, views)
    assert time.perf_counter() - start < 1.5  # [s]; the budget of the report, about ten times what it takes


def test_a_diagnosis_without_findings_or_views_has_a_report_too(diagnosis, views):
    clean = dataclasses.replace(diagnosis, verdict="no_mismatch", findings=(), unexplained=(), not_testable=())
    page = Page(html_report(clean, Views(views.joints, ("a.csv",))))
    assert "No mismatch" in page.visible and "The model needs no change." in page.visible
    assert not page.wrong


@pytest.mark.parametrize("verdict", ["no_mismatch", "parameters_only", "physics_left_out", "unexplained", "undecided"])
def test_every_verdict_stands_before_the_summary_in_the_report_and_on_the_terminal(diagnosis, views, verdict):
    judged = dataclasses.replace(diagnosis, verdict=verdict)
    title, start = text.VERDICTS[verdict], diagnosis.summary[:40]
    assert f"{title} {start}" in Page(html_report(judged, views)).visible
    assert f"{title}. {start}" in printed(judged)


def test_the_terminal_names_every_finding_with_value_and_unit(diagnosis):
    shown = printed(diagnosis)
    for finding in diagnosis.findings:
        assert f"{text.words(finding.effect)} {text.joint_list(finding.joints)}" in shown
        for name, p in finding.parameters.items():
            assert f"{text.words(name)} {text.with_std(p.value, p.std)} {p.unit}" in shown


def test_the_truth_is_sorted_into_found_missed_and_extra(diagnosis):
    hidden = [
        {
            "effect": "transmission_coupling",
            "joints": ["joint6", "joint5"],
            "parameters": {"viscous": {"value": 2.3, "unit": "N m s/rad"}},
        },
        {"effect": "stribeck_friction", "joints": ["joint3"], "parameters": {}},
    ]
    reveal = revealed(hidden, diagnosis, "seal")
    assert [effect.effect for effect in reveal.found] == ["transmission_coupling"]
    assert reveal.found[0].parameters["viscous"] == (2.3, Estimate(2.31, 0.04, "N m s/rad"))
    assert [effect["joints"] for effect in reveal.missed] == [["joint3"]]
    assert [finding.joints for finding in reveal.extra] == [("joint2",)]
    assert not reveal.right


def test_the_revealed_truth_is_shown_on_the_terminal_and_in_the_report(diagnosis, views):
    reveal = revealed([{"effect": "backlash", "joints": ["joint4"], "parameters": {}}], diagnosis, "abc123")
    console = Console(file=io.StringIO(), width=160)
    print_reveal(reveal, console)
    shown = console.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]
    page = Page(html_report(diagnosis, views, reveal))
    for place in (shown, page.visible):
        assert "backlash" in place and "missed" in place and "named, but not hidden" in place
    assert "abc123" in page.visible


@pytest.mark.parametrize(
    ("value", "std", "shown"),
    [
        (8.4312, 0.0712, "8.431 ± 0.071"),
        (12345.6, 120.0, "12350 ± 120"),
        (-0.5, 0.25, "−0.50 ± 0.25"),
        (2.0, None, "2.000"),
        (1.5, 0.0, "1.500 ± 0"),
    ],
)
def test_a_value_is_shown_to_the_digits_its_uncertainty_makes_worth_reading(value, std, shown):
    assert text.with_std(value, std) == shown


def test_the_90_percent_interval_is_that_of_a_normal_distribution():
    # 1.6449 standard deviations hold 90 % of a normal distribution.
    assert text.interval_90(10.0, 1.0) == "8.4 to 11.6"


def test_a_share_is_never_rounded_up_to_certainty():
    assert text.percent(0.99999) == "> 99.9 %"
    assert text.percent(1.0) == "> 99.9 %"  # odds beyond what a float can tell from certainty
    assert text.percent(0.00001) == "< 0.1 %"


@pytest.mark.parametrize(("low", "high"), [(-2.0, 2.0), (0.0, 0.013), (-1e-7, 3e-7), (99.0, 101.0), (-1234.0, 88.0)])
def test_ticks_are_a_handful_of_places_inside_the_range(low, high):
    places = svg.ticks(low, high)
    slack = 1e-9 * (high - low)
    assert 3 <= len(places) <= 9
    assert all(low - slack <= place <= high + slack for place in places)


def test_the_heat_map_is_blue_below_orange_above_and_empty_where_there_are_no_data():
    drawn = svg_maps.heat_map("m", [[-1.0, 1.0], [None, 0.0]], [0, 1, 2], [0, 1, 2], 1.0, "rad")
    assert re.findall(r'<path fill="(#\w+)"', drawn) == [svg_maps.shade(u) for u in (-1, 0, 1)]
    assert drawn.count("z") == 3  # cells


def test_a_line_is_broken_where_a_value_is_missing():
    drawn = svg.line_plot([0, 1, 2, 3, 4], [svg.Series("s", [0.0, 1.0, None, 1.0, 0.0])], "t", "y")
    assert re.search(r'class="line s" d="M[\d. ]+L[\d. ]+M[\d. ]+L[\d. ]+"', drawn)


@pytest.mark.parametrize(("low", "high"), [(1e-5, 9e-4), (1e-8, 3e-8), (0.2, 30.0)])
def test_the_label_of_the_vertical_axis_stands_clear_of_those_of_its_ticks(low, high):
    lines = [svg.Series("s", [low, high, -high])]
    plots = [svg.line_plot([0, 1, 2], lines, "t", "y", log_y=log_y) for log_y in (True, False)]
    for drawn in (*plots, svg.loop_plot([0, 1, 2], lines, "t", "y")):
        (turned,) = re.findall(r'<text x="([\d.]+)"[^>]*rotate', drawn)
        marks = re.findall(r'<text x="([\d.]+)"[^>]*"end">([^<]+)', drawn)
        begin = [float(x) - 12 * sum(0.34 if c in svg.NARROW else 0.58 for c in label) for x, label in marks]
        assert min(begin) > float(turned) + 3.0  # [px]: letters of 12 px hang 3 px below their line


@pytest.mark.parametrize(("low", "high"), [(-4.2, -3.3), (-1.9, 0.4), (-6.0, 2.0)])
def test_a_logarithmic_axis_has_several_ticks_and_true_labels(low, high):
    marks = svg.log_ticks(low, high)
    assert len(marks) >= 3
    digits = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    for place, label in marks:
        factor, _, exponent = label.rpartition("·") if "·" in label else ("", "", label)
        power = exponent[2:].translate(digits) if exponent[2:].translate(digits) != exponent[2:] else None
        value = float(factor or 1) * 10.0 ** int(power) if power is not None else float(label)
        assert value == pytest.approx(10.0**place, rel=1e-9)


@pytest.mark.parametrize(
    ("value", "shown"), [(1278120.0, "1\u202f278\u202f120"), (-6.12, "−6.1"), (99.96, "100.0"), (None, "–")]
)
def test_evidence_keeps_a_decimal_only_where_it_decides(value, shown):
    assert text.evidence(value) == shown
