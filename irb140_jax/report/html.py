"""The report, one HTML file that needs no network: it shows what the diagnosis holds and computes nothing."""

import json
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from irb140_jax.mismatch.output.views import Ranked, Views
from irb140_jax.mismatch.records import plain
from irb140_jax.mismatch.result import Diagnosis
from irb140_jax.report import figures, text
from irb140_jax.report.motion import motion_section
from irb140_jax.report.next_steps import next_steps
from irb140_jax.report.overview import overview
from irb140_jax.report.pages import PAGE, template
from irb140_jax.report.reveal import Reveal

MODELS = {
    "nominal": "the model as given",
    "refit": "the same rigid bodies with refitted inertial parameters",
    "corrected": "refit plus what was found",
}
MOST_BARS = 12  # further candidates are folded away


def html_report(
    diagnosis: Diagnosis, views: Views, reveal: Reveal | None = None, folder: str | pathlib.Path = "DIR"
) -> str:
    """The report of a diagnosis as the text of one HTML file.

    Args:
        diagnosis: The diagnosis.
        views: Data of its drawings.
        reveal: What was hidden, where that is known (a demonstration).
        folder: Where diagnosis.json lies, for the commands that the report proposes.
    """
    joints = views.joints
    units = {joint: views.maps[joint].unit if joint in views.maps else "N m" for joint in joints}
    return template("report.html.j2").render(
        diagnosis=diagnosis,
        views=views,
        joints=joints,
        units=units,
        title=text.VERDICTS[diagnosis.verdict],
        notes=diagnosis.notes,
        provenance=diagnosis.provenance,
        overview=overview(diagnosis, joints, units),
        steps=next_steps(diagnosis, str(folder)),
        reveal=reveal,
        maps=[{"joint": joint, **figures.map_pair(data)} for joint, data in views.maps.items()],
        panels=[figures.panel(joint, units[joint], views.motions) for joint in joints if views.motions],
        spectra=[figures.spectrum(joint, data, units[joint]) for joint, data in views.residual_spectrum.items()],
        unexplained=[figures.unexplained(data) for data in views.unexplained],
        motion=motion_section(views.motion) if views.motion else None,
        # What the summary says of a link is not said again in the table.
        inertials=[replace(x, sentence="") if x.sentence in diagnosis.summary else x for x in views.inertials],
        ranking=_bars(views.ranking),
        models=MODELS,
        first_joint=_first_joint(diagnosis, joints),
        data=_embedded({"units": units, "motions": plain(views.motions)}),
        style=Markup((PAGE / "report.css").read_text(encoding="utf-8")),
        script=Markup((PAGE / "report.js").read_text(encoding="utf-8")),
    )


def _first_joint(diagnosis: Diagnosis, joints: Sequence[str]) -> str:
    """The joint that a reader wants to see first: that of the strongest finding, else of what has no name."""
    for entry in (*diagnosis.findings, *diagnosis.unexplained):
        return entry.joints[0]
    return joints[0] if joints else ""


def _embedded(data: Any) -> Markup:
    """Data for the page's own script; no name in it can end the element that holds it."""
    short = json.dumps(_shortened(data), separators=(",", ":"), allow_nan=False)
    return Markup(short.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def _shortened(x: Any) -> Any:
    """Numbers to five digits: finer than any screen, and half the size."""
    if isinstance(x, Mapping):
        return {key: _shortened(value) for key, value in x.items()}
    if isinstance(x, list | tuple):
        return [_shortened(value) for value in x]
    return float(f"{x:.5g}") if isinstance(x, float) else x


def _bars(ranking: Sequence[Ranked]) -> dict:
    """Candidates, best first, with the length of their bars in per cent."""
    rows = [{"log_odds": row.delta_bic / 2.0, **plain(row)} for row in ranking if row.stage == "alone"]
    rows.sort(key=lambda row: -row["log_odds"])
    longest = max((abs(row["log_odds"]) for row in rows), default=1.0) or 1.0
    rows = [{**row, "length": 100.0 * max(row["log_odds"], 0.0) / longest} for row in rows]
    return {"first": rows[:MOST_BARS], "rest": rows[MOST_BARS:]}
