"""The report's drawings: maps over position and speed, torque over time, position and speed, spectra."""

import math
from collections.abc import Sequence

from markupsafe import Markup

from irb140_jax.mismatch.output.views import MODELS, Maps, Spectrum, Traces, UnexplainedTorque
from irb140_jax.report import svg, svg_maps, text

FULL_COLOUR = 0.98  # share of cells below the full colour, so that a single bad cell can't wash out a map
MOST_POINTS = 350  # of a line on paper; the page's script draws all of them


def map_pair(data: Maps) -> dict:
    """Two heat maps on one colour scale: what the model misses before and after."""
    sizes = sorted(abs(v) for grid in (data.nominal, data.corrected) for row in grid for v in row if v is not None)
    limit = (sizes[int(FULL_COLOUR * (len(sizes) - 1))] if sizes else 1.0) or 1.0
    unit = text.motion_unit(data.unit)

    def draw(title: str, grid: svg_maps.Grid) -> Markup:
        full = f"full colour at {text.number(limit)} {data.unit}"
        label = f"{title}: mean torque missed over position and speed, {full}"
        return Markup(svg_maps.heat_map(title, grid, data.q_edges, data.qd_edges, limit, unit, label))

    return {
        "nominal": draw("model as given", data.nominal),
        "corrected": draw("corrected", data.corrected),
        "bar": Markup(svg_maps.colour_bar(limit, data.unit)),
    }


def panel(joint: str, unit: str, motions: Sequence[Traces]) -> dict:
    """A joint's liveliest recording: torque over time, what is missed of it, torque over position and over speed."""
    motion = max(motions, key=lambda m: _power(m.joints[joint]["qd"]))
    step = max(1, -(-len(motion.t) // MOST_POINTS))
    t = motion.t[::step]
    data = {name: values[::step] for name, values in motion.joints[joint].items()}
    lines = [svg.Series(name, data[name]) for name in ("measured", *MODELS)]
    missed = [svg.Series(name, _difference(data["measured"], data[name])) for name in MODELS]
    loops = [line for line in lines if line.name != "refit"]
    moves = text.motion_unit(unit)
    named = lambda what: f"{what} of {joint} in {motion.recording}"  # noqa: E731
    return {
        "joint": joint,
        "recording": motion.recording,
        "torque": Markup(svg.line_plot(t, lines, "", f"torque [{unit}]", (540, 150), x_ticks=False,
                                       beside=missed, name=named("Torque over time"))),
        "missed": Markup(svg.line_plot(t, missed, "time [s]", f"missed [{unit}]", (540, 150), beside=lines,
                                       name=named("Measured minus modelled torque over time"))),
        "over_q": Markup(svg.loop_plot(data["q"], loops, f"position [{moves}]", f"torque [{unit}]",
                                       name=named("Torque over position"))),
        "over_qd": Markup(svg.loop_plot(data["qd"], loops, f"speed [{moves}/s]", f"torque [{unit}]",
                                        name=named("Torque over speed"))),
    }  # fmt: skip


def spectrum(joint: str, data: Spectrum, unit: str) -> dict:
    """Spectrum of what each model misses."""
    series = [svg.Series(name, data[name]) for name in MODELS if name in data]
    name = f"Amplitude spectrum of what each model misses of the torque of {joint}"
    missed = f"missed [{unit}/√Hz]"
    drawn = svg.line_plot(data["f"], series, "frequency [Hz]", missed, (340, 180), log_y=True, name=name)
    return {"joint": joint, "drawing": Markup(drawn)}


def unexplained(data: UnexplainedTorque) -> dict:
    """What no effect explains, over what it depends on."""
    ways = {"forward": data.forward, "backward": data.backward}
    name = f"Torque of {data.joint} that no effect explains, over {data.over}"
    drawn = svg.dot_plot(ways, data.over, f"unexplained [{data.unit}]", name=name)
    return {"joint": data.joint, "drawing": Markup(drawn)}


def _power(values: Sequence[float | None]) -> float:
    """Mean square."""
    known = [v for v in values if v is not None and math.isfinite(v)]
    return sum(v * v for v in known) / max(len(known), 1)


def _difference(a: Sequence[float | None], b: Sequence[float | None]) -> list[float | None]:
    """a - b, with gaps where either has one."""
    return [None if x is None or y is None else x - y for x, y in zip(a, b, strict=True)]
