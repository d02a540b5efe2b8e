"""Small HTML tables for notebooks: how robots, recordings and diagnoses show themselves there."""

import html
from collections.abc import Iterable, Sequence


def table_html(heads: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """A table; everything in it is escaped.

    Args:
        heads: Of the columns.
        rows: Cells, as many as heads.
        caption: A line above it.
    """
    cell = lambda tag, x: f"<{tag} style='text-align:left'>{html.escape(str(x))}</{tag}>"  # noqa: E731
    line = lambda tag, xs: f"<tr>{''.join(cell(tag, x) for x in xs)}</tr>"  # noqa: E731
    above = f"<p>{html.escape(caption)}</p>" if caption else ""
    return f"{above}<table>{line('th', heads)}{''.join(line('td', row) for row in rows)}</table>"
