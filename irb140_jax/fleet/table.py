"""All rows as a Parquet table and a page."""

import pathlib
from collections.abc import Iterable, Sequence
from typing import Any

import pyarrow
import pyarrow.parquet

from irb140_jax.fleet.layout import Unit
from irb140_jax.fleet.row import FACTORS
from irb140_jax.fleet.store import COMMAND, ResultsStore, only_writer
from irb140_jax.report import results_folder
from irb140_jax.report.many import many_html

TABLE, PAGE = "table.parquet", "index.html"
_TEXT, _REAL, _WHOLE = pyarrow.string(), pyarrow.float64(), pyarrow.int64()
COLUMNS = pyarrow.schema([
    ("unit", _TEXT), ("status", _TEXT), ("severity", _WHOLE), ("verdict", _TEXT), ("robot", _TEXT), ("joints", _WHOLE),
    ("recordings", pyarrow.list_(_TEXT)), ("seconds", _REAL), ("worst_joint", _TEXT),
    *((f"{name}_over_noise", _REAL) for name in FACTORS), ("effects", pyarrow.list_(_TEXT)),
    ("probabilities", pyarrow.list_(_REAL)), ("open", _WHOLE), ("unexplained", pyarrow.list_(_TEXT)),
    ("summary", _TEXT), ("findings", _TEXT), ("fit", _TEXT), ("message", _TEXT), ("folder", _TEXT),
])  # fmt: skip


def write_table_and_page(
    store: ResultsStore, units: Sequence[Unit], name: str, inputs: Iterable[pathlib.Path]
) -> list[dict[str, Any]]:
    """Write the table and the page of all units that have a row, those of other parts included.

    Args:
        store: Where the rows are.
        units: All units, of every part.
        name: Of the folder of recordings.
        inputs: Files and folders that are read.

    Returns:
        The rows.
    """
    with only_writer(store.out):
        rows = [row for unit in units if (row := store.row(unit.name))]

        def write(folder: pathlib.Path) -> None:
            write_parquet(rows, folder / TABLE)
            (folder / PAGE).write_text(many_html(rows, name, len(units) - len(rows)), encoding="utf-8")

        with results_folder(store.out, COMMAND, inputs) as results:
            results.write(write)
    return rows


def write_parquet(rows: Sequence[dict[str, Any]], path: pathlib.Path) -> None:
    """Write rows as Parquet; the same rows give the same bytes."""
    folders = [{"folder": f"diagnoses/{row['unit']}" if row["status"] == "diagnosed" else None} for row in rows]
    known = [{name: row.get(name) for name in COLUMNS.names} | more for row, more in zip(rows, folders, strict=True)]
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(known, COLUMNS), path, compression="zstd")
