"""Heat maps over position and speed as SVG text."""

import math
from collections.abc import Sequence

from irb140_jax.report import svg

Grid = Sequence[Sequence[float | None]]

# Blue to orange through a light grey: told apart by every kind of colour vision; the middle is not the page's white.
BLUES = ((8, 69, 148), (66, 146, 198), (158, 202, 225))
ORANGES = ((253, 190, 133), (230, 85, 13), (140, 45, 4))
DIVERGING = (*BLUES, (236, 236, 233), *ORANGES)
PHONE_FONT = 14.0  # of the labels of maps on a phone [px], where a pair of them is narrow
SHADES = 24  # distinct colours of a map; more can't be told apart and would only make the file longer


def shade(u: float) -> str:
    """Colour of u in [-1, 1]."""
    place = (min(max(u, -1.0), 1.0) + 1.0) / 2.0 * (len(DIVERGING) - 1)
    i = min(int(place), len(DIVERGING) - 2)
    rgb = (round(a + (place - i) * (b - a)) for a, b in zip(DIVERGING[i], DIVERGING[i + 1], strict=True))
    return "#" + "".join(f"{c:02x}" for c in rgb)


def heat_map(title: str, grid: Grid, rows: Sequence[float], columns: Sequence[float], limit: float, unit: str,
             name: str = "") -> str:
    """Mean residual over position (upwards) and speed (to the right); cells without data stay white.

    Args:
        title: Heading of the map.
        grid: Values, one row per position bin, one column per speed bin; None where there are no data.
        rows, columns: Edges of the bins.
        limit: Value at which the colours are full.
        unit: Unit of positions, rad or m.
        name: What a screen reader says, by default the title.
    """
    left = max(48.0, svg.margin(svg.y_marks((rows[0], rows[-1]), False, 4), PHONE_FONT))
    box = svg.Box(left, 20, 216 - left, 150, (columns[0], columns[-1]), (rows[0], rows[-1]))
    cells: dict[int, list[str]] = {}
    for i, row in enumerate(grid):
        top, bottom = box.py(rows[i + 1]), box.py(rows[i])
        for j, value in enumerate(row):
            if value is None or not math.isfinite(value):
                continue
            left, right = box.px(columns[j]), box.px(columns[j + 1])
            step = round(min(max(value / limit if limit else 0.0, -1.0), 1.0) * SHADES / 2)
            # One path per colour instead of a rectangle per cell keeps the file small.
            cell = f"M{left:.1f} {top:.1f}H{right:.1f}V{bottom:.1f}H{left:.1f}z"
            cells.setdefault(step, []).append(cell)
    body = [svg.text(box.left + box.width / 2, 12, title, extra=' class="title"')]
    body.append(svg.axes(box, f"speed [{unit}/s]", f"position [{unit}]"))
    fills = (f'<path fill="{shade(2 * step / SHADES)}" d="{"".join(d)}"/>' for step, d in sorted(cells.items()))
    body.append(f'<g shape-rendering="crispEdges">{"".join(fills)}</g>')
    return svg.drawing(224, 206, name or title, "".join(body))


def colour_bar(limit: float, unit: str) -> str:
    """The legend of a pair of heat maps."""
    box = svg.Box(6, 20, 12, 150, (0.0, 1.0), (-limit, limit))
    height = box.height / SHADES
    steps = range(SHADES)
    body = "".join(
        f'<rect x="6" y="{box.top + k * height:.1f}" width="12" height="{height + 0.5:.1f}" '
        f'fill="{shade(1 - (2 * k + 1) / SHADES)}"/>'
        for k in steps
    )
    body += "".join(svg.text(23, box.py(v) + 3.5, svg.tick_text(v), "start") for v in svg.ticks(-limit, limit, 5))
    return svg.drawing(74, 206, f"colour scale in {unit}", body + svg.text(6, 12, unit, "start", ' class="axis"'))
