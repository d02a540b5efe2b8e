"""Parquet, and the LeRobot datasets that are made of it.

A LeRobot file holds lists, `observation.state` and `action`, whose entries the dataset's meta/info.json names.
"""

import json
import pathlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.options import MAX_BYTES, MAX_VALUES, FileOptions, Table
from irb140_jax.recordings.formats.text import frame_columns

LISTS = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
MAX_ENTRIES = 1000  # of a list a sample
FOLDERS_ABOVE = 4  # of a data file, in which meta/info.json is looked for
EPISODE = "episode_index"


def parquet_table(path: pathlib.Path, options: FileOptions) -> Table:
    """Read Parquet; a list becomes a column an entry, `name.entry` where the dataset names it, else `name[0]` ...

    Raises:
        RecordingError: It declares more values than a recording has, lists differ in length, or it holds several
            episodes of which none is chosen.
    """
    file = pq.ParquetFile(path)
    meta = file.metadata
    declared = meta.num_rows * meta.num_columns
    size = sum(meta.row_group(i).total_byte_size for i in range(meta.num_row_groups))
    if not 0 <= declared <= MAX_VALUES or size > MAX_BYTES:
        raise RecordingError(f"{path}: declares {declared:.3g} values in {size / 2**20:.0f} MB; allowed are "
                             f"{MAX_VALUES:.0g} values in {MAX_BYTES // 2**20} MB: it is damaged, or has to be cut "
                             "into shorter recordings")
    data = file.read()
    if EPISODE in data.column_names:
        data = _episode(data, path, options)
    entries, notes = _entry_names(path), []
    plain, columns = [], {}
    for field in data.schema:
        if any(is_kind(field.type) for is_kind in LISTS):
            columns |= _list_columns(data, field.name, entries.get(field.name), path, notes)
        elif pa.types.is_nested(field.type):
            notes.append(f"Column {field.name} holds {field.type} and is left out")
        else:
            plain.append(field.name)
    columns = frame_columns(data.select(plain).to_pandas()) | columns
    return Table(columns, notes, format="LeRobot" if entries else "Parquet")


def _list_columns(
    data: pa.Table, name: str, entries: list[str] | None, path: pathlib.Path, notes: list[str]
) -> dict[str, np.ndarray]:
    lists = data.column(name).to_pylist()
    widths = {len(entry) if entry is not None else 0 for entry in lists}
    if len(widths) != 1 or max(widths) > MAX_ENTRIES:
        notes.append(f"Column {name} holds lists of {min(widths, default=0)} to {max(widths, default=0)} entries and "
                     "is left out")
        return {}
    try:
        values = np.asarray(lists, dtype=float)
    except (TypeError, ValueError):
        notes.append(f"Column {name} holds lists that are no numbers and is left out")
        return {}
    if values.ndim != 2:
        notes.append(f"Column {name} holds lists of lists and is left out")
        return {}
    given = entries if entries is not None and len(entries) == values.shape[1] else None
    names = [f"{name}.{entry}" for entry in given] if given else [f"{name}[{i}]" for i in range(values.shape[1])]
    return {column: values[:, i] for i, column in enumerate(names)}


def _episode(data: pa.Table, path: pathlib.Path, options: FileOptions) -> pa.Table:
    """The rows of the episode that the column map names, where there are several."""
    index = data.column(EPISODE).to_numpy()
    found = np.unique(index)
    if options.episode is None and len(found) == 1:
        return data
    if options.episode not in found:
        asked = f"has no episode {options.episode}, only" if options.episode is not None else "holds episodes"
        raise RecordingError(f"{path}: {asked} {found[0]} to {found[-1]}; a recording is one of them: choose it with "
                             "episode = N in the column map")
    return data.filter(pa.array(index == options.episode))


def _entry_names(path: pathlib.Path) -> dict[str, list[str]]:
    """What the entries of each list are called, by the dataset's own description; empty outside a dataset."""
    for folder in list(path.resolve().parents)[:FOLDERS_ABOVE]:
        info = folder / "meta" / "info.json"
        if info.is_file() and info.stat().st_size < 2**24:
            features = json.loads(info.read_text(encoding="utf-8")).get("features", {})
            return {name: _flat_names(feature.get("names")) for name, feature in features.items()
                    if isinstance(feature, dict) and feature.get("names")}  # fmt: skip
    return {}


def _flat_names(names: object) -> list[str]:
    """["a.pos", "b.pos"] of that, or of {"motors": ["a.pos", "b.pos"]}."""
    if isinstance(names, dict):
        return [entry for inner in names.values() for entry in (inner if isinstance(inner, list) else [str(inner)])]
    return [str(name) for name in names] if isinstance(names, list) else []
