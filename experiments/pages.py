"""Where the pages go that experiments write from their results."""

import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[1]


def page_of(results: pathlib.Path, name: str) -> pathlib.Path:
    """docs/ for the stored results; beside them for any others, so that a trial run does not replace the page."""
    return (ROOT / "docs" if results.resolve() == ROOT / "results" else results) / name
