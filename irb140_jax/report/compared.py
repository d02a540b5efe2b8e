"""A comparison of diagnoses: a table and sentences on a terminal, and a page with forest plots."""

from collections.abc import Iterator, Mapping

from markupsafe import Markup
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Column, Table

from irb140_jax.report import text
from irb140_jax.report.pages import stylesheet, template
from irb140_jax.report.svg_forest import forest_plot

SAYS = {"same": "the same", "differs": "differs", "cannot_tell": "can't tell", "named_in_some": "named in some"}
COLOURS = {"same": "green", "differs": "red", "cannot_tell": "yellow", "named_in_some": "dark_orange"}
MOST_COLUMNS = 6  # diagnoses side by side on a terminal; more are told in sentences and on the page


def print_comparison(comparison: Mapping, console: Console) -> None:
    """Print what is shared and what differs.

    Args:
        comparison: What compare.json holds.
        console: Where to.
    """
    names = [one["name"] for one in comparison["of"]]
    console.print()
    console.print(f"[bold]{escape(headline(comparison))}[/]", soft_wrap=True)
    console.print()
    if comparison["effects"]:
        console.print(_table(comparison, names))
    for effect in comparison["effects"]:
        console.print(Padding(f"[bold]{escape(title(effect))}[/]: {escape(effect['sentence'])}", (0, 0, 0, 2)))
        for p in effect["parameters"]:
            if p["p"] is not None:
                console.print(Padding(f"{text.words(p['parameter'])}: {escape(p['sentence'])}", (0, 0, 0, 4)))
    for note in comparison["notes"]:
        console.print(Padding(f"Note: {escape(note)}", (0, 0, 0, 2)))


def headline(comparison: Mapping) -> str:
    """The whole in one or two sentences."""
    many = len(comparison["of"])
    effects = comparison["effects"]
    if not effects:
        return f"None of the {many} diagnoses names an effect, so there is nothing to compare."
    said = []
    for says, words in (("differs", "differ"), ("same", "the same"), ("cannot_tell", "undecided")):
        found = [title(e) for e in effects if e["says"] == says]
        said += [f"{words}: {', '.join(found)}"] if found else []
    some = [title(e) for e in effects if e["says"] == "named_in_some"]
    said += [f"named in some only: {', '.join(some)}"] if some else []
    sentence = "; ".join(said)
    return f"{many} diagnoses. {sentence[0].upper()}{sentence[1:]}."


def title(effect: Mapping) -> str:
    """An effect and its joints."""
    return f"{text.words(effect['effect'])} on {', '.join(effect['joints'])}"


def comparison_html(comparison: Mapping) -> str:
    """The page as the text of one HTML file.

    Args:
        comparison: What compare.json holds.
    """
    return template("compared.html.j2").render(
        comparison=comparison,
        headline=headline(comparison),
        says=SAYS,
        effects=[{**effect, "title": title(effect), "plots": [*_plots(comparison, effect)]}
                 for effect in comparison["effects"]],
        style=Markup(stylesheet()),
    )  # fmt: skip


def _plots(comparison: Mapping, effect: Mapping) -> Iterator[dict]:
    names = [one["name"] for one in comparison["of"]]
    for p in effect["parameters"]:
        margin = comparison["same_within"] * abs(p["pooled"]["value"]) if p["pooled"] else 0.0
        what = text.words(p["parameter"])
        label = f"{what} [{p['unit']}]"
        drawn = forest_plot(names, p["values"], p["pooled"], margin, label, f"{what} of {title(effect)}, by diagnosis")
        yield {**p, "name": what, "drawing": Markup(drawn)}


def _table(comparison: Mapping, names: list[str]) -> Table:
    shown = names if len(names) <= MOST_COLUMNS else []
    right = lambda head: Column(escape(head), justify="right", no_wrap=True)  # noqa: E731
    heads = ["effect", "parameter", *map(right, shown), "unit", right("largest difference\n(90 %)"), right("p (Holm)")]
    table = Table(*heads, "", box=box.SIMPLE_HEAD)
    for effect in comparison["effects"]:
        head = title(effect)
        for p in effect["parameters"]:
            values = [text.with_std(v["value"], v["std"]) if v else "–" for v in p["values"]] if shown else []
            says = f"[{COLOURS[p['says']]}]{SAYS[p['says']]}[/]"
            name = text.words(p["parameter"])
            table.add_row(escape(head), name, *values, p["unit"], _difference(p), _p(p["p_holm"]), says)
            head = ""
    return table


def _difference(p: Mapping) -> str:
    d = p["largest"]
    if d is None:
        return "–"
    std = (d["high"] - d["low"]) / 2 / text.HALF_WIDTH_90
    value, low, high = (text.rounded_like(d[k], std) for k in ("value", "low", "high"))
    return f"{value} ({low} to {high})"


def _p(p: float | None) -> str:
    return "–" if p is None else "< 0.0001" if p < 1e-4 else f"{p:.2g}"
