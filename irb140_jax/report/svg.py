"""Lines over axes as SVG text.  Nothing but scaling happens here."""

import html
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

PHONE_FONT = 12.0  # of the labels on a phone, where they are largest [px]
NARROW = ".·⁻⁰¹²³⁴⁵⁶⁷⁸⁹"


class Series(NamedTuple):
    """One line of a plot."""

    name: str  # the page's style gives every name its colour, light and dark
    y: Sequence[float | None]


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


def y_marks(y: tuple[float, float], log_y: bool, about: int) -> list[tuple[float, str]]:
    """Place and label of the ticks of a vertical axis."""
    return log_ticks(*y) if log_y else [(v, tick_text(v)) for v in ticks(*y, about)]


def margin(marks: Sequence[tuple[float, str]], font: float = PHONE_FONT) -> float:
    """Room at the left of a plotting area, in which the label of its axis stands clear of those of its ticks."""
    widths = (font * sum(0.35 if c in NARROW else 0.6 for c in label) for _, label in marks)
    return 1.5 * font + 6.0 + max(widths, default=0.0)


def drawing(width: float, height: float, label: str, body: str) -> str:
    """An SVG element with a name for screen readers."""
    name = html.escape(label)
    return f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{name}"><title>{name}</title>{body}</svg>'


def text(x: float, y: float, content: str, anchor: str = "middle", extra: str = "") -> str:
    """A label."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{extra}>{content}</text>'


def axes(
    box: Box, x_label: str, y_label: str, x_ticks: bool = True, log_y: bool = False, about: tuple[int, int] = (5, 4)
) -> str:
    """Frame, ticks and labels of a plotting area; with `log_y` its vertical data are logarithms to base ten."""
    right, bottom, middle = box.left + box.width, box.top + box.height, box.top + box.height / 2
    parts = [f'<rect x="{box.left:g}" y="{box.top:g}" width="{box.width:g}" height="{box.height:g}" class="frame"/>']
    for value, label in y_marks(box.y, log_y, about[1]):
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


def line_plot(
    x: Sequence[float],
    series: Sequence[Series],
    x_label: str,
    y_label: str,
    size: tuple[float, float] = (540, 170),
    log_y: bool = False,
    x_ticks: bool = True,
    name: str = "",
    beside: Sequence[Series] = (),
) -> str:
    """Lines over a common axis; gaps where a value is None.

    The frame leaves room for the labels of the lines `beside`, too, so that two drawings can stand below each other.
    """
    ranges = [_y_range(lines, log_y) for lines in (series, beside)]
    if ranges[0] is None or len(x) < 2:
        return ""
    scale = math.log10 if log_y else float
    bottom = 36 if x_ticks else 8
    left = max(58.0, *(margin(y_marks(y, log_y, 4)) for y in ranges if y))
    box = Box(left, 8, size[0] - 10 - left, size[1] - 8 - bottom, (x[0], x[-1]), ranges[0])
    body = [axes(box, x_label, y_label, x_ticks, log_y, about=(8 if size[0] > 400 else 5, 4))]
    body += [_line(box, s.name, x, [scale(v) if v is not None and (v > 0 or not log_y) else None for v in s.y])
             for s in series]  # fmt: skip
    return drawing(*size, name or y_label, "".join(body))


def loop_plot(
    x: Sequence[float | None], series: Sequence[Series], x_label: str, y_label: str,
    size: tuple[float, float] = (264, 220), name: str = "",
) -> str:  # fmt: skip
    """Curves over a quantity that comes and goes, such as torque over position."""
    values = [v for s in series for v in s.y if v is not None and math.isfinite(v)]
    places = [v for v in x if v is not None and math.isfinite(v)]
    if not values or len(places) < 2:
        return ""
    y = _widened(min(values), max(values))
    left = max(58.0, margin(y_marks(y, False, 5)))
    box = Box(left, 8, size[0] - 10 - left, size[1] - 44, _widened(min(places), max(places)), y)
    body = [axes(box, x_label, y_label, about=(4, 5)), *(_line(box, s.name, x, s.y) for s in series)]
    return drawing(*size, name or y_label, "".join(body))


def dot_plot(
    series: Mapping[str, tuple[Sequence[float], Sequence[float]]], x_label: str, y_label: str,
    size: tuple[float, float] = (340, 220), name: str = "",
) -> str:  # fmt: skip
    """Dots, by series; the page's style gives every name its colour."""
    places, values = ([v for pair in series.values() for v in pair[i]] for i in (0, 1))
    if len(places) < 2:
        return ""
    y = _widened(min(values), max(values))
    left = max(58.0, margin(y_marks(y, False, 5)))
    box = Box(left, 8, size[0] - 10 - left, size[1] - 44, _widened(min(places), max(places)), y)
    body = [axes(box, x_label, y_label, about=(4, 5))]
    for way, (xs, ys) in series.items():
        dots = "".join(f"M{box.px(a):.1f} {box.py(b):.1f}h0" for a, b in zip(xs, ys, strict=True))
        body.append(f'<path class="dots {way}" d="{dots}"/>')
    return drawing(*size, name or y_label, "".join(body))


def _y_range(series: Sequence[Series], log_y: bool) -> tuple[float, float] | None:
    """What a vertical axis shows of these lines; None where they hold no number."""
    values = [v for s in series for v in s.y if v is not None and math.isfinite(v) and (v > 0 or not log_y)]
    scale = math.log10 if log_y else float
    return _widened(scale(min(values)), scale(max(values))) if values else None


def _widened(low: float, high: float) -> tuple[float, float]:
    """A range with a margin."""
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _line(box: Box, name: str, x: Sequence[float | None], y: Sequence[float | None]) -> str:
    """Path of a line, broken where x or y is None."""
    parts, pen = [], "M"
    for a, b in zip(x, y, strict=True):
        if a is None or b is None or not math.isfinite(b):
            pen = "M"
            continue
        parts.append(f"{pen}{box.px(a):.1f} {box.py(b):.1f}")
        pen = "L"
    return f'<path class="line {name}" d="{"".join(parts)}"/>'
