"""The report, one HTML file that needs no network: it shows what the diagnosis holds and computes nothing."""

import json
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

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
    diagnosis: Mapping, views: Mapping, reveal: Reveal | None = None, folder: str | pathlib.Path = "DIR"
) -> str:
    """The report of a diagnosis as the text of one HTML file.

    Args:
        diagnosis: What diagnosis.json holds.
        views: Maps, motions, ranking, spectra and inertials that belong to it.
        reveal: What was hidden, where that is known (a demonstration).
        folder: Where diagnosis.json lies, for the commands that the report proposes.
    """
    known: dict[str, Any] = {"recordings": [], "ranking": [], "inertials": [], "motions": [], "maps": {}}
    known |= {"residual_spectrum": {}} | dict(views)
    joints = list(known.get("joints") or diagnosis["fit"])
    units = {joint: known["maps"].get(joint, {}).get("unit", "N m") for joint in joints}
    return template("report.html.j2").render(
        diagnosis=diagnosis,
        views=known,
        joints=joints,
        units=units,
        title=text.VERDICTS.get(diagnosis["verdict"], text.words(diagnosis["verdict"])),
        notes=diagnosis.get("notes") or known.get("notes") or [],
        provenance=diagnosis.get("provenance") or {},
        overview=overview(diagnosis, joints, units),
        steps=next_steps(diagnosis, str(folder)),
        reveal=reveal,
        maps=[{"joint": joint, **figures.map_pair(data)} for joint, data in known["maps"].items()],
        panels=[figures.panel(joint, units[joint], known["motions"]) for joint in joints if known["motions"]],
        spectra=[figures.spectrum(joint, data, units[joint]) for joint, data in known["residual_spectrum"].items()],
        motion=motion_section(known["motion"]) if known.get("motion") else None,
        ranking=_bars(known["ranking"]),
        models=MODELS,
        first_joint=_first_joint(diagnosis, joints),
        data=_embedded({"units": units, "motions": known["motions"]}),
        style=Markup((PAGE / "report.css").read_text(encoding="utf-8")),
        script=Markup((PAGE / "report.js").read_text(encoding="utf-8")),
    )


def _first_joint(diagnosis: Mapping, joints: Sequence[str]) -> str:
    """The joint that a reader wants to see first: that of the strongest finding, else of what has no name."""
    for entry in (*diagnosis["findings"], *diagnosis["unexplained"]):
        return entry["joints"][0]
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


def _bars(ranking: Sequence[Mapping]) -> dict:
    """Candidates, best first, with the length of their bars in per cent."""
    rows = [{"log_odds": row.get("delta_bic", 0.0) / 2.0, **row} for row in ranking if row["stage"] == "alone"]
    rows.sort(key=lambda row: -row["log_odds"])
    longest = max((abs(row["log_odds"]) for row in rows), default=1.0) or 1.0
    rows = [{**row, "length": 100.0 * max(row["log_odds"], 0.0) / longest} for row in rows]
    return {"first": rows[:MOST_BARS], "rest": rows[MOST_BARS:]}
