"""Small drawings for the report as SVG text: heat map, colour bar, line plot.  Nothing but scaling happens here."""

import math
from collections.abc import Sequence
from typing import NamedTuple

Grid = Sequence[Sequence[float | None]]

# Blue to orange through a light grey: told apart by every kind of colour vision; the middle is not the page's white.
BLUES = ((8, 69, 148), (66, 146, 198), (158, 202, 225))
ORANGES = ((253, 190, 133), (230, 85, 13), (140, 45, 4))
DIVERGING = (*BLUES, (236, 236, 233), *ORANGES)
SHADES = 24  # distinct colours of a map; more can't be told apart and would only make the file longer


class Series(NamedTuple):
    """One line of a plot."""

    name: str
    y: Sequence[float | None]
    colour: str
    width: float = 1.4
    dash: str = ""


class Box(NamedTuple):
    """The plotting area inside a drawing, and the data range it shows."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]

    def px(self, value: float) -> float:
        """Horizontal place of a value."""
        low, high = self.x
        return self.left + self.width * (value - low) / ((high - low) or 1.0)

    def py(self, value: float) -> float:
        """Vertical place of a value; large values are high up."""
        low, high = self.y
        return self.top + self.height * (1.0 - (value - low) / ((high - low) or 1.0))


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers between low and high, around so many of them."""
    span = high - low
    if not span > 0 or not math.isfinite(span):
        return [low]
    raw = span / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = min((m * power for m in (1, 2, 5, 10)), key=lambda step: abs(span / step - about))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Place and label of ticks between powers of ten: the powers, and twice and five times them where they are few."""
    marks = []
    for power in range(math.floor(low), math.ceil(high) + 1):
        exponent = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        for m in (1, 2, 5) if high - low < 2.5 else (1,):
            label = tick_text(m * 10.0**power) if -3 < power < 4 else f"{m}·10{exponent}".removeprefix("1·")
            marks.append((power + math.log10(m), label))
    return [(place, label) for place, label in marks if low <= place <= high]


def tick_text(value: float) -> str:
    """A tick's label, with a true minus sign."""
    return f"{value:.6g}".replace("-", "−").replace("e−0", "e−")


def shade(u: float) -> str:
    """Colour of u in [-1, 1]."""
    place = (min(max(u, -1.0), 1.0) + 1.0) / 2.0 * (len(DIVERGING) - 1)
    i = min(int(place), len(DIVERGING) - 2)
    rgb = (round(a + (place - i) * (b - a)) for a, b in zip(DIVERGING[i], DIVERGING[i + 1], strict=True))
    return "#" + "".join(f"{c:02x}" for c in rgb)


def drawing(width: float, height: float, label: str, body: str) -> str:
    """An SVG element with a name for screen readers."""
    return f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{label}">{body}</svg>'


def text(x: float, y: float, content: str, anchor: str = "middle", extra: str = "") -> str:
    """A label."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{extra}>{content}</text>'


def axes(
    box: Box, x_label: str, y_label: str, x_ticks: bool = True, log_y: bool = False, about: tuple[int, int] = (5, 4)
) -> str:
    """Frame, ticks and labels of a plotting area; with `log_y` its vertical data are logarithms to base ten."""
    right, bottom, middle = box.left + box.width, box.top + box.height, box.top + box.height / 2
    parts = [f'<rect x="{box.left:g}" y="{box.top:g}" width="{box.width:g}" height="{box.height:g}" class="frame"/>']
    for value, label in log_ticks(*box.y) if log_y else [(v, tick_text(v)) for v in ticks(*box.y, about[1])]:
        y = box.py(value)
        parts.append(f'<path class="grid" d="M{box.left:g} {y:.1f}H{right:g}"/>')
        parts.append(text(box.left - 6, y + 3.5, label, "end"))
    for value in ticks(*box.x, about[0]):
        x = box.px(value)
        parts.append(f'<path class="grid" d="M{x:.1f} {box.top:g}V{bottom:g}"/>')
        if x_ticks:
            parts.append(text(x, bottom + 14, tick_text(value)))
    if x_ticks:
        parts.append(text(box.left + box.width / 2, bottom + 29, x_label, extra=' class="axis"'))
    turn = f' class="axis" transform="rotate(-90 12 {middle:.1f})"'
    parts.append(text(12, middle, y_label, extra=turn))
    return "".join(parts)


def heat_map(title: str, grid: Grid, rows: Sequence[float], columns: Sequence[float], limit: float, unit: str) -> str:
    """Mean residual over position (upwards) and speed (to the right); cells without data stay white.

    Args:
        title: Heading of the map.
        grid: Values, one row per position bin, one column per speed bin; None where there are no data.
        rows, columns: Edges of the bins.
        limit: Value at which the colours are full.
        unit: Unit of positions, rad or m.
    """
    box = Box(48, 20, 168, 150, (columns[0], columns[-1]), (rows[0], rows[-1]))
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
    body = [text(box.left + box.width / 2, 12, title, extra=' class="title"')]
    body.append(axes(box, f"speed [{unit}/s]", f"position [{unit}]"))
    fills = (f'<path fill="{shade(2 * step / SHADES)}" d="{"".join(d)}"/>' for step, d in sorted(cells.items()))
    body.append(f'<g shape-rendering="crispEdges">{"".join(fills)}</g>')
    return drawing(224, 206, title, "".join(body))


def colour_bar(limit: float, unit: str) -> str:
    """The legend of a pair of heat maps."""
    box = Box(6, 20, 12, 150, (0.0, 1.0), (-limit, limit))
    height = box.height / SHADES
    steps = range(SHADES)
    body = "".join(
        f'<rect x="6" y="{box.top + k * height:.1f}" width="12" height="{height + 0.5:.1f}" '
        f'fill="{shade(1 - (2 * k + 1) / SHADES)}"/>'
        for k in steps
    )
    body += "".join(text(23, box.py(v) + 3.5, tick_text(v), "start") for v in ticks(-limit, limit, 5))
    return drawing(74, 206, f"colour scale in {unit}", body + text(6, 12, unit, "start", ' class="axis"'))


def line_plot(
    x: Sequence[float],
    series: Sequence[Series],
    x_label: str,
    y_label: str,
    size: tuple[float, float] = (540, 170),
    log_y: bool = False,
    x_ticks: bool = True,
) -> str:
    """Lines over a common axis; gaps where a value is None."""
    values = [v for s in series for v in s.y if v is not None and math.isfinite(v) and (v > 0 or not log_y)]
    if not values or len(x) < 2:
        return ""
    scale = math.log10 if log_y else float
    low, high = scale(min(values)), scale(max(values))
    margin = 0.05 * (high - low) or 1.0
    bottom = 36 if x_ticks else 8
    box = Box(58, 8, size[0] - 68, size[1] - 8 - bottom, (x[0], x[-1]), (low - margin, high + margin))
    body = [axes(box, x_label, y_label, x_ticks, log_y, about=(8, 4))]
    for s in series:
        dash = f' stroke-dasharray="{s.dash}"' if s.dash else ""
        path = _path(box, x, [scale(v) if v is not None and (v > 0 or not log_y) else None for v in s.y])
        body.append(f'<path class="line" stroke="{s.colour}" stroke-width="{s.width:g}"{dash} d="{path}"/>')
    return drawing(*size, y_label, "".join(body))


def _path(box: Box, x: Sequence[float], y: Sequence[float | None]) -> str:
    """Path of a line, broken where y is None."""
    parts, pen = [], "M"
    for a, b in zip(x, y, strict=True):
        if b is None or not math.isfinite(b):
            pen = "M"
            continue
        parts.append(f"{pen}{box.px(a):.1f} {box.py(b):.1f}")
        pen = "L"
    return "".join(parts)
