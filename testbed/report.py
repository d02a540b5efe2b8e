"""docs/calibration.md and its figures, from stored results only.

    python -m testbed.report
"""

import collections
import pathlib
from collections.abc import Callable
from functools import partial
from typing import Any

import jinja2
import numpy as np

from testbed import cases, diagram, runner, scoring
from testbed.probes import PROBES
from testbed.statistics import calibration_error, covered, wilson

ROOT = pathlib.Path(__file__).parents[1]
LOOKS = ("first", "second", "third", "", "fifth", "sixth", "seventh")  # labels of the looks at *check*
# Labels of *check* under other conditions, as `testbed.runner` makes them.
CONDITIONS = {"quiet": "noise and steps of the sensors / 10"}
# Labels of *work* under other conditions.
OF_WORK = {f"error_{share}": f"inertials {100 * share:g} % wrong" for share in (0.02, 0.1, 0.2, 0.3)}
OF_WORK |= {"long": "recordings 10 times as long"}
# Forms of cases of servos in closed loop: what is logged, or known of their gains.
SERVOS = {"torque": "torque", "known": "commands; gains known", "wrong": "commands; gains about 10 % wrong",
          "unknown": "commands; gains unknown",
          "laws": "commands; gains known, a law of the servo hidden"}  # fmt: skip
LEVELS = (0.5, 0.9, 0.99)
WAYS = ("named", "in the class", "not testable", "unexplained", "missed")
WORDS = ("rightly", "otherwise")
PLACES = ("located", "named alike", "noted", "not said")
Lines = list[dict[str, Any]]
Rows = list[tuple[str, ...]]


def counted(facts: list[bool]) -> str:
    """A share with its 95 % interval: "12 of 40: 30 % (18 to 45)"."""
    if not facts:
        return "none"
    low, high = wilson(sum(facts), len(facts))
    return f"{sum(facts)} of {len(facts)}: {100 * np.mean(facts):.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def figures(lines: Lines) -> Rows:
    """Measure, figure and goal."""
    of = lambda fact: [x for line in lines for x in fact(line)]  # noqa: E731
    each = lambda fact: counted([fact(line) for line in lines])  # noqa: E731
    stated, classes, found = of(scoring.probabilities), of(scoring.stated_classes), of(scoring.intervals)
    return [
        *_about_names(lines, stated),
        *((f"{100 * level:.0f} % intervals that hold the truth",
           counted([covered(v, s, true, level) for *_, v, s, true in found]),
           "85 to 95 %" if level == 0.9 else "") for level in LEVELS),
        ("90 % intervals that hold the truth, of joints with structure that no effect explains",
         counted([covered(v, s, true, 0.9) for *_, v, s, true in of(partial(scoring.intervals, unexplained=True))]),
         ""),
        *_about_classes([c for c in classes if c["slug"]]),
        ("torque constants named within 5 %", counted(of(scoring.gains)), ""),
        *_about_noise("stated noise over the torque sensors'", of(scoring.floors), "all"),
        *_about_noise("stated noise over what the true plant leaves along the logged positions",
                      of(lambda x: scoring.floors(x, "left_in_band")), ""),
        ("things without a name that are located, named alike or noted",
         counted([how != "not said" for _, how in of(scoring.located)]), ""),
        ("error on unseen motions over refit's, median where something without a name is hidden",
         _median([scoring.unseen_ratio(x) for x in lines if scoring.located(x)]), "at most 0.5"),
        ("verdict that the truth allows", each(scoring.verdict_right), ""),
        ("cases with a sentence on a mass or inertia below zero", each(scoring.impossible_stated), "none"),
        ("exported models with a link that no body can be",
         each(lambda x: bool(x["impossible"].get("corrected"))), "none"),
    ]  # fmt: skip


def _about_noise(name: str, floors: list[float], goal: str) -> Rows:
    return [(f"{name}, median", _median(floors), ""),
            ("joints where it is at most 1.3", counted([x <= 1.3 for x in floors]), goal),
            ("joints where it is below 1 / 1.3: too low", counted([x < 1.0 / 1.3 for x in floors]), "")]  # fmt: skip


def _about_names(lines: Lines, stated: list[tuple[str, float, bool]]) -> Rows:
    named = [x for x in stated if x[0] not in scoring.ORDINARY]
    error = lambda xs: f"{100 * calibration_error([p for _, p, _ in xs], [hit for *_, hit in xs]):.1f} % of {len(xs)}"  # noqa: E731
    mean = lambda ordinary: f"{np.mean([len(scoring.false_names(x, ordinary)) for x in lines]):.3g}"  # noqa: E731
    return [
        ("false names a case, ordinary friction aside", mean(False), "at most 0.05"),
        ("cases with one", counted([bool(scoring.false_names(x)) for x in lines]), ""),
        ("false ordinary friction a case", mean(True), ""),
        ("expected calibration error, all findings", error(stated), "at most 3 %"),
        ("the same, ordinary friction aside", error(named), ""),
        ("wrong above 0.99, all findings", counted([not hit for _, p, hit in stated if p > 0.99]), "at most 1 %"),
        ("the same, ordinary friction aside", counted([not hit for _, p, hit in named if p > 0.99]), "at most 1 %"),
    ]


def _about_classes(classes: list[dict[str, Any]]) -> Rows:
    sizes = [c["size"] for c in classes if c["size"]]
    seen = [c["size"] > 0 for c in classes if c["how"] != "not testable"]
    return [
        ("true effect in the stated class", counted([c["size"] > 0 for c in classes]), "at least 95 %"),
        ("the same, without what was listed as not testable", counted(seen), ""),
        ("names in that class, mean", f"{np.mean(sizes):.2f}" if sizes else "none", "at most 1.6"),
    ]


def _median(xs: list[float]) -> str:
    return f"{np.median(xs):.2f} of {len(xs)}" if xs else "none"


def coverage(lines: Lines) -> Rows:
    """Coverage of the intervals by effect."""
    by: dict[str, list[tuple[float, float, float]]] = collections.defaultdict(list)
    for line in lines:
        for effect, _, value, std, true in scoring.intervals(line):
            by[effect].append((value, std, true))
    share = lambda xs, level: f"{100 * np.mean([covered(v, s, true, level) for v, s, true in xs]):.0f}"  # noqa: E731
    return [(e, str(len(xs)), *(share(xs, level) for level in LEVELS)) for e, xs in sorted(by.items())]


def in_rows(what: str, runs: dict[str, Lines]) -> str:
    """Runs over a draw in a row each: the engine, and what came out."""
    rows = []
    for name, every in runs.items():
        lines = [x for x in every if x["diagnosis"]]
        found = [i for x in lines for i in scoring.intervals(x)]
        classes = [c["size"] > 0 for x in lines for c in scoring.stated_classes(x) if c["slug"]]
        rows.append((
            name, engines(every), str(len(every)),
            f"{np.mean([len(scoring.false_names(x)) for x in lines]):.3f}",
            f"{100 * np.mean([covered(v, s, true, 0.9) for *_, v, s, true in found]):.1f} % of {len(found)}",
            f"{100 * np.mean(classes):.1f} %", _median([f for x in lines for f in scoring.floors(x)]),
        ))  # fmt: skip
    head = (what, "engine at commit", "cases run", "false names a case", "90 % intervals that hold",
            "true effect in the stated class", "stated noise over the torque sensors', median")  # fmt: skip
    return markdown(head, rows)


def in_closed_loop(forms: dict[str, Lines]) -> str:
    """Cases of servos, a row for each form in which they were logged."""
    rows = []
    for form, every in forms.items():
        lines = [x for x in every if x["diagnosis"]]
        wrong = [len(scoring.false_names(x)) for x in lines]
        holding = [covered(v, s, true, 0.9) for x in lines for *_, v, s, true in scoring.intervals(x)]
        rows.append((
            form, engines(every), f"{len(lines)} of {len(every)}", f"{np.mean(wrong):.2f}",
            counted([c["size"] > 0 for x in lines for c in scoring.stated_classes(x) if c["slug"]]),
            counted([not x["diagnosis"]["findings"] for x in lines if not x["truth"]["hidden"]]),
            f"{100 * np.mean(holding):.0f} % of {len(holding)}",
            f"{np.median([scoring.unseen_ratio(x) for x in lines]):.2g}",
        ))  # fmt: skip
    return markdown(("logged", "engine at commit", "cases diagnosed", "false names a case",
                     "true effect in the stated class", "nothing named where nothing is hidden",
                     "90 % intervals that hold", "error on unseen torque over refit's, median"), rows)  # fmt: skip


def outside(draws: dict[str, Lines]) -> str:
    """Cases of physics outside the usual mixture, a row for each draw."""
    rows = []
    for draw, every in draws.items():
        lines = [x for x in every if x["diagnosis"]]
        of = lambda fact, lines=lines: [x for line in lines for x in fact(line)]  # noqa: E731
        rows.append((
            draw, engines(every), f"{len(lines)} of {len(every)}",
            f"{np.mean([len(scoring.false_names(x)) for x in lines]):.2f}",
            counted([how != "not said" for _, how in of(scoring.located)]),
            counted([right for _, right in of(scoring.places)]),
            f"{np.median([scoring.unseen_ratio(x) for x in lines]):.2g}",
        ))  # fmt: skip
    return markdown(("draw", "engine at commit", "cases diagnosed", "false names a case",
                     "located, named alike or noted", "of those located, what it depends on said rightly",
                     "error on unseen torque over refit's, median"), rows)  # fmt: skip


def tally(lines: Lines, of: Callable[[dict[str, Any]], list[tuple[str, str]]], ways: tuple[str, ...]) -> Rows:
    """How often each kind came out in which way."""
    by = collections.defaultdict(collections.Counter)
    for line in lines:
        for kind, how in of(line):
            by[kind][how] += 1
    return [(kind, str(n.total()), *(str(n[way] or "") for way in ways)) for kind, n in sorted(by.items())]


def false_rows(lines: Lines) -> Rows:
    """Every false name."""
    return [
        (str(x["index"]), " + ".join(x["kinds"]), _short(f), f"{f['evidence']['probability']:.5g}")
        for x in lines for f in scoring.false_names(x)
    ] or [("none", "", "", "")]  # fmt: skip


def probe_row(line: dict[str, Any]) -> tuple[str, ...]:
    """A probe in a row of a table."""
    found, said = scoring.intervals(line), line["diagnosis"]
    holding = sum(covered(v, s, true, 0.9) for *_, v, s, true in found)
    at = [f"{', '.join(u['joints'])} {100 * u['share']:.0f} %" for u in said["unexplained"]]
    return (
        PROBES[line["probe"]][0], "; ".join(map(_short, scoring.false_names(line))) or "none",
        f"{np.max(scoring.floors(line)):.2f}", f"{holding} of {len(found)}", _gains(line), "; ".join(at) or "none",
        f"{scoring.unseen_ratio(line):.3g}", said["verdict"] + ("" if scoring.verdict_right(line) else " (wrong)"),
    )  # fmt: skip


def _gains(line: dict[str, Any]) -> str:
    gains = scoring.gains(line)
    return f"{sum(gains)} of {len(gains)}" if gains else ""


def narrower(lines: Lines) -> str:
    """Standard deviations of the files given five times over those of the same given once, median and least."""
    by = {x["probe"]: scoring.intervals(x) for x in lines}
    if not {"plain", "five_times"} <= by.keys():
        return ""
    once = {(e, p, true): std for e, p, _, std, true in by["plain"]}
    ratios = [std / once[e, p, true] for e, p, _, std, true in by["five_times"] if (e, p, true) in once]
    return f"{np.median(ratios):.2f} (least {np.min(ratios):.2f}, {len(ratios)} intervals)"


def _short(finding: dict[str, Any]) -> str:
    joints = finding["joints"]
    return f"{finding['effect']} on {', '.join(joints) if len(joints) <= 3 else f'{len(joints)} joints'}"


def markdown(head: tuple[str, ...], rows: Rows) -> str:
    """A table."""
    first, *rest = [f"| {' | '.join(row)} |" for row in (head, *rows)]
    return "\n".join([first, "|" + "---|" * len(head), *rest])


def section(name: str, every: Lines, first: Lines) -> dict[str, Any]:
    """What the page says of a draw; `first` are the same cases by the first engine, where those are stored."""
    same = {x["index"] for x in every if x["diagnosis"]}
    before = [x for x in first if x["diagnosis"] and x["index"] in same]
    lines = [x for x in every if x["diagnosis"]]
    kinds = lambda line: [(c["kind"], c["how"]) for c in scoring.stated_classes(line) if c["slug"]]  # noqa: E731
    return {
        "name": name, "cases": len(every), "last": max(x["index"] for x in every), "diagnosed": len(lines),
        "engine": engines(every), "seconds": f"{np.median([x['seconds'] for x in lines]):.0f}",
        "figures": side_by_side(lines, before), "before": len(before), "before_engine": engines(before),
        "coverage": markdown(("effect", "parameters", *(f"{100 * x:.0f} %" for x in LEVELS)), coverage(lines)),
        "outcomes": markdown(("hidden", "times", *WAYS), tally(lines, kinds, WAYS)),
        "places": markdown(("hidden", "times", *PLACES), tally(lines, scoring.located, PLACES)),
        "false": markdown(("case", "hidden", "said", "probability"), false_rows(lines)),
        "others": [f"{x['index']} ({' + '.join(x['kinds'])}): {x.get('refused') or x.get('failed')}"
                   for x in every if not x["diagnosis"]],
    }  # fmt: skip


def side_by_side(lines: Lines, before: Lines) -> str:
    """The table of figures, with those of the first engine where it was run."""
    rows = figures(lines)
    if not before:
        return markdown(("measure", "figure (95 % interval)", "goal"), rows)
    both = [(name, old, new, goal) for (name, old, _), (_, new, goal) in zip(figures(before), rows, strict=True)]
    return markdown(("measure", "first engine", "figure (95 % interval)", "goal"), both)


def engines(lines: Lines) -> str:
    """The commits that diagnosed."""
    return ", ".join(sorted({x.get("engine") or "unknown" for x in lines}))


def main() -> None:
    """Write the page and its figures."""
    looks = [look for look in (runner.read(runner.stored("check", label)) for label in LOOKS) if look]
    conditions = {said: runner.read(runner.stored("check", label)) for label, said in CONDITIONS.items()}
    conditions = {said: every for said, every in conditions.items() if any(x["diagnosis"] for x in every)}
    of_work = {said: runner.read(runner.stored("work", label)) for label, said in OF_WORK.items()}
    of_work = {said: every for said, every in of_work.items() if any(x["diagnosis"] for x in every)}
    servos = {said: runner.read(runner.stored("check", f"servo_{form}")) for form, said in SERVOS.items()}
    servos = {said: every for said, every in servos.items() if any(x["diagnosis"] for x in every)}
    beyond = {draw: runner.read(runner.stored(draw, "outside")) for draw in ("work", "check")}
    beyond = {f"*{draw}*": every for draw, every in beyond.items() if any(x["diagnosis"] for x in every)}
    last = [x for x in [*beyond.values()][-1] if x["diagnosis"]] if beyond else []
    words = lambda line: [(kind, WORDS[not right]) for kind, right in scoring.places(line)]  # noqa: E731
    draws = {"final": runner.read(runner.stored("final")), "check": looks[-1]}
    draws = {name: every for name, every in draws.items() if any(x["diagnosis"] for x in every)}
    for name, every in draws.items():
        diagram.draw([x for x in every if x["diagnosis"]], ROOT / "docs" / "figures" / f"calibration_{name}.svg")
    probes = [x for x in runner.read(runner.RESULTS / "testbed_probes.jsonl") if x["diagnosis"]]
    many = collections.Counter(cases.PASS)
    head = ("probe", "false names", "noise over the sensors', largest", "90 % intervals that hold",
            "gains within 5 %", "unexplained", "unseen error over refit's", "verdict")  # fmt: skip
    text = jinja2.Environment(keep_trailing_newline=True, trim_blocks=False).from_string(
        (pathlib.Path(__file__).parent / "calibration.md.j2").read_text(encoding="utf-8")
    ).render(
        mixture=", ".join(f"{n} {name}" if n > 1 else name for name, n in many.items()),
        looks=in_rows("look at *check*", {str(number): every for number, every in enumerate(looks, 1)}),
        conditions=in_rows("cases of *check* with", conditions) if conditions else "",
        of_work=in_rows("cases of *work* with", of_work) if of_work else "",
        servos=in_closed_loop(servos) if servos else "", outside=outside(beyond) if beyond else "",
        outside_places=markdown(("hidden", "times", *PLACES), tally(last, scoring.located, PLACES)),
        outside_words=markdown(("located", "times", *WORDS), tally(last, words, WORDS)),
        outside_false=markdown(("case", "hidden", "said", "probability"), false_rows(last)),
        draws=[section(name, every, runner.read(runner.stored(name, "first"))) for name, every in draws.items()],
        probes=markdown(head, [probe_row(x) for x in probes]) if probes else "", probes_engine=engines(probes),
        narrower=narrower(probes),
    )  # fmt: skip
    (ROOT / "docs" / "calibration.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
