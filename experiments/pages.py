"""Where the pages go that experiments write from their results."""

import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[1]

# On top of every page whose stored results no later engine has made anew.
FIRST_ENGINE = (
    "The figures of this page are stored results of the first statistical engine, which\n"
    "[decisions 30 to 33](decisions/index.md) replaced: its cases are kept as regression tests, and the figures do\n"
    "not say how good a diagnosis is today."
)


def page_of(results: pathlib.Path, name: str) -> pathlib.Path:
    """docs/ for the stored results; beside them for any others, so that a trial run does not replace the page."""
    return (ROOT / "docs" if results.resolve() == ROOT / "results" else results) / name
