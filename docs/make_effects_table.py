"""Write docs/effects.md, the table of all effects, from the catalogue:  python docs/make_effects_table.py"""

import pathlib

from irb140_jax.effects.catalogue import CATALOGUE

PAGE = pathlib.Path(__file__).with_name("effects.md")
HEAD = """# The effects

<!-- Written by docs/make_effects_table.py; a test compares the two. -->

What a diagnosis can name today, from the files in `irb140_jax/effects/`; [adding one](adding-an-effect.md) is adding a
file. Units are those of a hinge; for a slide read N for N m and m for rad.
"""


def parameter_range(low: float, high: float) -> str:
    """The admissible range in words, empty where there is none."""
    if low == 0.0 and high == float("inf"):
        return ", >= 0"
    return "" if high == float("inf") else f", {low:.3g} to {high:.3g}"


def page() -> str:
    """The whole page as Markdown."""
    lines = [HEAD, "| effect | torque | parameters | special case | needs |", "| --- | --- | --- | --- | --- |"]
    for slug, effect in sorted(CATALOGUE.items()):
        parameters = "<br>".join(
            f"`{p.name}` [{p.unit_of(False)}{parameter_range(p.low, p.high)}]" for p in effect.law.parameters
        )
        special = ", ".join(f"`{c}`" for c in effect.law.contains)
        cells = (f"`{slug}`", f"`{effect.law.equation}`", parameters, special, effect.needs)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    lines += ["", "## What looks alike, and what separates it", ""]
    lines += ["| effect | look-alike | record |", "| --- | --- | --- |"]
    for slug, effect in sorted(CATALOGUE.items()):
        lines += [f"| `{slug}` | `{other}` | {motion} |" for other, motion in sorted(effect.confused_with.items())]
    lines += ["", "## Sources", ""]
    lines += [f"- `{slug}`: {effect.law.source}." for slug, effect in sorted(CATALOGUE.items())]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
