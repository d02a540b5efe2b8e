"""The diagnosis in plain language on a terminal."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Column, Table

from irb140_jax.mismatch.output.views import Views
from irb140_jax.mismatch.result import Diagnosis, Finding, Fit, Unexplained
from irb140_jax.report import text
from irb140_jax.report.reveal import Reveal

VERDICT_COLOURS = {
    "no_mismatch": "green",
    "parameters_only": "green",
    "physics_left_out": "dark_orange",
    "undecided": "yellow",
    "unexplained": "red",
}


def print_diagnosis(diagnosis: Diagnosis, views: Views, console: Console) -> None:
    """Print verdict, findings and fit of a diagnosis; the views give the units of the joints' torque."""
    title, colour = text.VERDICTS[diagnosis.verdict], VERDICT_COLOURS[diagnosis.verdict]
    joints = list(diagnosis.fit)
    console.print()
    console.print(f"[bold {colour}]{title}.[/] {escape(diagnosis.summary)}")
    console.print()
    if diagnosis.findings:
        console.print(_findings(diagnosis.findings, joints))
    for sentence in (*_where(diagnosis.findings), *_unexplained(diagnosis.unexplained, joints)):
        console.print(Padding(sentence, (0, 0, 0, 2)))
    console.print(_fit(diagnosis.fit, views))
    if diagnosis.not_testable:
        names = dict.fromkeys(text.words(blind.effect) for blind in diagnosis.not_testable)
        console.print(f"Not testable with this motion, on some joints or all: {', '.join(names)}.")
    if diagnosis.notes:
        console.print("Notes:")
    for note in diagnosis.notes:
        console.print(Padding(escape(note), (0, 0, 0, 2)))


def print_reveal(reveal: Reveal, console: Console) -> None:
    """Print what was hidden beside what was found."""
    table = Table("hidden", "answer", "parameter", _right("true"), _right("diagnosed"), "unit", box=box.SIMPLE_HEAD)
    for effect in reveal.found:
        head = (_named(effect.effect, effect.joints), "[green]found[/]")
        for name, (true, p) in effect.parameters.items():
            both = text.rounded_like(true, p.std), text.with_std(p.value, p.std)
            table.add_row(*head, text.words(name), *both, p.unit)
            head = ("", "")
    for effect in reveal.missed:
        table.add_row(_named(effect["effect"], effect["joints"]), "[red]missed[/]")
    for finding in reveal.extra:
        table.add_row(_named(finding.effect, finding.joints), "[red]named, but not hidden[/]")
    if not table.rows:
        table.add_row("nothing", "[green]nothing named[/]")
    console.print("[bold]The truth, now revealed[/]")
    console.print(table)


def _findings(findings: Sequence[Finding], joints: Sequence[str]) -> Table:
    """One row per parameter of each finding."""
    heads = ("left out", "joints", "parameter", _right("value"), "unit", _right("probability"))
    table = Table(*heads, box=box.SIMPLE_HEAD)
    for finding in findings:
        head = [text.words(finding.effect), escape(text.joint_list(finding.joints, joints))]
        tail = text.percent(finding.evidence.probability)
        for name, p in finding.parameters.items():
            table.add_row(*head, text.words(name), text.with_std(p.value, p.std), p.unit, tail)
            head, tail = ["", ""], ""
    return table


def _where(findings: Sequence[Finding]) -> Iterator[str]:
    """Where each finding acts, and what else it may be."""
    for finding in findings:
        yield f"[bold]{text.words(finding.effect).capitalize()}[/]: {escape(finding.where)}"
        yield f"  Certain: {escape(finding.certain)}"
        for other in finding.alternatives:
            name, share = text.words(other.effect), text.percent(other.probability)
            yield f"  It may also be {name} ({share}). To separate them: {escape(other.separate_by)}"


def _unexplained(rests: Sequence[Unexplained], joints: Sequence[str]) -> Iterator[str]:
    """What has no name."""
    for rest in rests:
        names = escape(text.joint_list(rest.joints, joints))
        share = "" if rest.share is None else f" ({text.percent(rest.share)} of what is left)"
        yield f"[bold]Unexplained[/] on {names}{share}: {escape(rest.where)}"


def _fit(fit: Mapping[str, Fit], views: Views) -> Table:
    """Torque error of each model on unseen data."""
    heads = [_right(name) for name in ("model as given", "refit", "corrected", "noise floor")]
    table = Table("torque error on unseen data", *heads, "unit", box=box.SIMPLE_HEAD)
    for joint, row in fit.items():
        unit = views.maps[joint].unit if joint in views.maps else ""
        table.add_row(escape(joint), *map(text.number, dataclasses.astuple(row)), unit)
    return table


def _right(header: str) -> Column:
    """A column of numbers."""
    return Column(header, justify="right")


def _named(effect: str, joints: Sequence[str]) -> str:
    """An effect and its joints."""
    return escape(f"{text.words(effect)} on {', '.join(joints)}")
