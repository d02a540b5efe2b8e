"""Forest plots: a value with its interval for each of several diagnoses, and one for all."""

import html
from collections.abc import Mapping, Sequence

from irb140_jax.report import svg
from irb140_jax.report.text import HALF_WIDTH_90

ROW, TOP, LABELS, RIGHT = 22.0, 8.0, 150.0, 18.0  # [CSS pixels]
WIDTH = 540.0


def forest_plot(
    names: Sequence[str], values: Sequence[Mapping | None], pooled: Mapping | None, margin: float, label: str, name: str
) -> str:
    """Values with 90 % intervals, one a line; the mean of all as a diamond, and what is called the same as a band.

    Args:
        names: Of the diagnoses.
        values: {"value", "std"} of each; None where there is none.
        pooled: {"value", "std"} of all; None where there is none.
        margin: Half the width of the band.
        label: Of the axis.
        name: What a screen reader says.
    """
    spans = [_span(v) for v in values if v] + ([_span(pooled)] if pooled else [])
    if not spans:
        return ""
    low, high = min(a for a, _ in spans), max(b for _, b in spans)
    wide = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
    rows = len(names) + bool(pooled)
    box = svg.Box(LABELS, TOP, WIDTH - LABELS - RIGHT, ROW * rows, (low - wide, high + wide), (0.0, 1.0))
    body = [_band(box, pooled["value"], margin)] if pooled else []
    body.append(_frame(box, label))
    for k, (who, value) in enumerate(zip(names, values, strict=True)):
        y = TOP + ROW * (k + 0.5)
        body.append(svg.text(LABELS - 8, y + 3.5, _cut(who), "end", ' class="axis"'))
        body.append(_mark(box, value, y) if value else svg.text(box.left + 6, y + 3.5, "not named", "start"))
    if pooled:
        y = TOP + ROW * (len(names) + 0.5)
        body.append(svg.text(LABELS - 8, y + 3.5, "all", "end", ' class="title"'))
        body.append(_diamond(box, pooled, y))
    return svg.drawing(WIDTH, TOP + box.height + 36, name, "".join(body))


def _span(v: Mapping) -> tuple[float, float]:
    half = HALF_WIDTH_90 * (v["std"] or 0.0)
    return v["value"] - half, v["value"] + half


def _frame(box: svg.Box, label: str) -> str:
    bottom = box.top + box.height
    parts = [f'<rect x="{box.left:g}" y="{box.top:g}" width="{box.width:g}" height="{box.height:g}" class="frame"/>']
    for value in svg.ticks(*box.x, 6):
        x = box.px(value)
        parts.append(f'<path class="grid" d="M{x:.1f} {box.top:g}V{bottom:g}"/>')
        parts.append(svg.text(x, bottom + 14, svg.tick_text(value)))
    parts.append(svg.text(box.left + box.width / 2, bottom + 29, label, extra=' class="axis"'))
    return "".join(parts)


def _band(box: svg.Box, middle: float, margin: float) -> str:
    left, right = (min(max(box.px(middle + s * margin), box.left), box.left + box.width) for s in (-1, 1))
    return f'<rect class="band" x="{left:.1f}" y="{box.top:g}" width="{right - left:.1f}" height="{box.height:g}"/>'


def _mark(box: svg.Box, value: Mapping, y: float) -> str:
    low, high = (box.px(v) for v in _span(value))
    x = box.px(value["value"])
    line = f"M{low:.1f} {y:.1f}H{high:.1f}M{low:.1f} {y - 4:.1f}v8M{high:.1f} {y - 4:.1f}v8"
    point = f'<rect class="point" x="{x - 3.5:.1f}" y="{y - 3.5:.1f}" width="7" height="7"/>'
    return f'<path class="line corrected" d="{line}"/>{point}'


def _diamond(box: svg.Box, pooled: Mapping, y: float) -> str:
    low, high = (box.px(v) for v in _span(pooled))
    x = box.px(pooled["value"])
    low, high = min(low, x - 3), max(high, x + 3)
    return f'<path class="whole" d="M{low:.1f} {y:.1f}L{x:.1f} {y - 6:.1f}L{high:.1f} {y:.1f}L{x:.1f} {y + 6:.1f}z"/>'


def _cut(name: str) -> str:
    """A name as long as there is room for; the ends of long names tell them apart best."""
    return html.escape(name if len(name) <= 24 else f"…{name[-23:]}")
