"""The proof in motion as a figure and a table."""

from collections.abc import Mapping, Sequence

from markupsafe import Markup

from irb140_jax.report import svg, text

MODELS = ("nominal", "refit", "corrected")
SHOWN_AT = (0.1, 0.5, 2.0)  # [s]


def motion_section(proof: Mapping) -> dict:
    """What the page shows of motion.json.

    Args:
        proof: What motion.json holds.
    """
    at = [proof["horizon"].index(time) for time in SHOWN_AT]
    rows = [("tool", proof["tool"]), *proof["joints"].items()]
    return {
        "driven_by": proof["driven_by"],
        "times": SHOWN_AT,
        "shown": proof["shown"],
        "figure": _figure(proof, proof["joints"].get(proof["shown"], proof["tool"]), proof["shown"]),
        "rows": [{"name": name, "unit": row["unit"], "cells": [_cells(row, k) for k in at]} for name, row in rows],
        "sentences": proof["sentences"],
        "windows": proof["windows"],
    }


def _figure(proof: Mapping, row: Mapping, what: str) -> Markup:
    """Median errors over the horizon; the thick line is how far the recorded motion went."""
    lines = [svg.Series("measured", row["moved"]["median"])]
    lines += [svg.Series(name, row[name]["median"]) for name in MODELS]
    name = f"How far each model's {what} is from the recorded one, over the time since the start"
    label = f"{what} off by [{row['unit']}]"
    drawn = svg.line_plot(proof["horizon"], lines, "time since the start [s]", label, (540, 250), log_y=True, name=name)
    return Markup(drawn)


def _cells(row: Mapping, k: int) -> dict:
    """Median and 90 % of each model at a time."""
    medians: Sequence[float | None] = [row[name]["median"][k] for name in MODELS]
    best, known = row["moved"]["median"][k], [m for m in medians if m is not None]
    cells = [{key: text.number(row[name][key][k]) for key in ("median", "p90")} for name in MODELS]
    return {"models": cells, "moved": text.number(best), "lost": not known or best is not None and min(known) > best}
