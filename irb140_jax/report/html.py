"""The report, one HTML file without network or scripts: it shows what the diagnosis holds and computes nothing."""

import functools
import pathlib
from collections.abc import Mapping, Sequence

import jinja2
from markupsafe import Markup

from irb140_jax.report import svg, text
from irb140_jax.report.reveal import Reveal

# Okabe and Ito's colours, told apart by every kind of colour vision.  The measurement is a pale broad line beneath,
# since a good model would hide a fine one.
MEASURED_LINE = {"colour": "#c6cad1", "width": 4.0, "dash": ""}
MODEL_LINES = {
    "nominal": {"colour": "#5b616b", "width": 1.1, "dash": "4 3"},
    "refit": {"colour": "#e69f00", "width": 1.2, "dash": ""},
    "corrected": {"colour": "#0072b2", "width": 1.5, "dash": ""},
}
MODEL_TEXTS = {
    "measured": "as logged",
    "nominal": "the model as given",
    "refit": "the same rigid bodies with refitted inertial parameters",
    "corrected": "refit plus what was found",
}
MOST_POINTS = 1200  # a line of a plot is a few hundred pixels wide; more points only make the file longer
MOST_BARS = 12  # further candidates are folded away
FULL_COLOUR = 0.98  # share of cells below the full colour, so that a single bad cell can't wash out a map


def html_report(diagnosis: Mapping, views: Mapping, reveal: Reveal | None = None) -> str:
    """The report of a diagnosis as the text of one HTML file.

    Args:
        diagnosis: What diagnosis.json holds.
        views: Maps, traces, ranking, spectra, inertials and notes that belong to it.
        reveal: What was hidden, where that is known (a demonstration).
    """
    empty: dict = {name: [] for name in ("recordings", "ranking", "inertials", "notes")}
    empty |= {name: {} for name in ("maps", "traces", "residual_spectrum")}
    views = {**empty, **views}
    title, sentence = text.VERDICTS.get(diagnosis["verdict"], (text.words(diagnosis["verdict"]), ""))
    return _template().render(
        diagnosis=diagnosis,
        views=views,
        joints=views.get("joints") or list(diagnosis["fit"]),
        title=title,
        sentence=sentence,
        reveal=reveal,
        maps=[{"joint": joint, **_map_pair(data)} for joint, data in views["maps"].items()],
        traces=[{"joint": joint, **_trace(data, _unit(views, joint))} for joint, data in views["traces"].items()],
        spectra=[_spectrum(joint, data, _unit(views, joint)) for joint, data in views["residual_spectrum"].items()],
        ranking=[_bars(stage, views["ranking"]) for stage in ("alone", "given the others")],
        lines={"measured": MEASURED_LINE, **MODEL_LINES},
        meanings=MODEL_TEXTS,
    )


@functools.cache
def _template() -> jinja2.Template:
    """The page, with everything from outside escaped."""
    folder = pathlib.Path(__file__).parent
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {show.__name__: show for show in (text.words, text.joint_list, text.evidence, text.ratio)}
    numbers = (text.number, text.rounded_like, text.with_std, text.interval_90, text.percent)
    environment.filters |= {show.__name__: show for show in numbers}
    return environment.get_template("report.html.j2")


def _unit(views: Mapping, joint: str) -> str:
    """Unit of a joint's torque."""
    return views["maps"].get(joint, {}).get("unit", "N m")


def _map_pair(data: Mapping) -> dict:
    """Two heat maps on one colour scale: what the model misses before and after."""
    sizes = sorted(abs(v) for name in ("nominal", "corrected") for row in data[name] for v in row if v is not None)
    limit = sizes[int(FULL_COLOUR * (len(sizes) - 1))] if sizes else 1.0
    unit = text.motion_unit(data["unit"])
    draw = lambda title, name: Markup(  # noqa: E731
        svg.heat_map(title, data[name], data["q_edges"], data["qd_edges"], limit or 1.0, unit)
    )
    return {
        "nominal": draw("model as given", "nominal"),
        "corrected": draw("corrected", "corrected"),
        "bar": Markup(svg.colour_bar(limit or 1.0, data["unit"])),
    }


def _trace(data: Mapping, unit: str) -> dict:
    """Torque over time, and below it what each model misses of it."""
    step = max(1, -(-len(data["t"]) // MOST_POINTS))
    t, measured = data["t"][::step], data["measured"][::step]
    models = [(name, data[name][::step], style) for name, style in MODEL_LINES.items() if name in data]
    torque = [svg.Series("measured", measured, **MEASURED_LINE)]
    torque += [svg.Series(name, y, **style) for name, y, style in models]
    # Finer lines than above: what is missed is mostly noise, and broad lines would make a solid band of it.
    missed = [svg.Series(name, _difference(measured, y), **{**style, "width": 0.9}) for name, y, style in models]
    return {
        "recording": data["recording"],
        "torque": Markup(svg.line_plot(t, torque, "", f"torque [{unit}]", (540, 150), x_ticks=False)),
        "missed": Markup(svg.line_plot(t, missed, "time [s]", f"missed [{unit}]", (540, 150))),
    }


def _difference(a: Sequence[float | None], b: Sequence[float | None]) -> list[float | None]:
    """a - b, with gaps where either has one."""
    return [None if x is None or y is None else x - y for x, y in zip(a, b, strict=True)]


def _spectrum(joint: str, data: Mapping, unit: str) -> dict:
    """Spectrum of what each model misses."""
    series = [svg.Series(name, data[name], **style) for name, style in MODEL_LINES.items() if name in data]
    drawn = svg.line_plot(data["f"], series, "frequency [Hz]", f"missed [{unit}/√Hz]", (340, 170), log_y=True)
    return {"joint": joint, "drawing": Markup(drawn)}


def _bars(stage: str, ranking: Sequence[Mapping]) -> dict:
    """Candidates of one stage, best first, with the length of their bars in per cent."""
    rows = sorted((row for row in ranking if row["stage"] == stage), key=lambda row: -row["delta_bic"])
    longest = max((abs(row["delta_bic"]) for row in rows), default=1.0) or 1.0
    rows = [{**row, "length": 100.0 * max(row["delta_bic"], 0.0) / longest} for row in rows]
    return {"stage": stage, "first": rows[:MOST_BARS], "rest": rows[MOST_BARS:]}
