"""Text tables: any encoding, separator and decimal mark, comments above the header, units below it."""

import codecs
import csv
import dataclasses
import io
import pathlib
import re
import warnings

import numpy as np
import pandas as pd

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.opened import unpacked
from irb140_jax.recordings.formats.options import MAX_VALUES, FileOptions, Table
from irb140_jax.recordings.units import is_unit, known_unit, stated_unit

SEPARATORS = (";", "\t", "|", ",", "blanks")  # a mark of decimals may be a comma, so the comma comes late
SPOKEN = {";": "semicolons", "\t": "tabs", "|": "bars", "blanks": "blanks"}
COMMENTS = ("#", "%", "//")
COMMA_NUMBER = r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?"
HEAD_LINES, MAX_LINE = 300, 10**6  # lines in which the header is looked for, letters that a line may have
CONTROL = re.compile("[\x00-\x08\x0e-\x1f\x7f-\x84\x86-\x9f]")  # in no text that a person or a logger writes
BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
                    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Layout:
    """How a text table is laid out.

    Attributes:
        separator: One of `SEPARATORS`, or what the user gave.
        decimal: "." or ",".
        names: Of the columns.
        units: Below the names, or None.
        first: Index of the first line of numbers.
    """

    separator: str
    decimal: str
    names: list[str]
    units: list[str] | None
    first: int


def text_table(path: pathlib.Path, options: FileOptions) -> Table:
    """Read CSV and its relatives.

    Raises:
        RecordingError: It is not text, has no header, no rows, or rows of another length than the header.
    """
    text, notes = _decoded(unpacked(path), path, options.encoding)
    if "\n" not in text:
        text = text.replace("\r", "\n")
    head = [line.rstrip("\r") for line in text[: 4 * MAX_LINE].split("\n", HEAD_LINES)[:HEAD_LINES]]
    longest = max(range(len(head)), key=lambda i: len(head[i]))
    if len(head[longest]) > MAX_LINE:
        raise RecordingError(f"{path}: row {longest + 1} is longer than {MAX_LINE} letters; this is no table with one "
                             "row a sample")
    layout = _layout(head, path, options)
    if layout.separator != "," and options.separator is None:
        notes.append(f"The columns are parted by {SPOKEN[layout.separator]} instead of commas; read so")
    frame = _frame(text, layout, options)
    if layout.decimal == "." and layout.separator != "," and options.decimal is None and _has_commas(frame):
        # The rows that were looked at held whole numbers only.
        frame = _frame(text, dataclasses.replace(layout, decimal=","), options)
    if frame.size > MAX_VALUES:
        raise RecordingError(f"{path}: holds {frame.size:.3g} values; allowed are {MAX_VALUES:.0g}: cut it into "
                             "shorter recordings")
    empty = [n for n in layout.names if n.startswith("unnamed ") and bool(frame[n].isna().all())]
    below = zip(layout.names, layout.units or [], strict=False)
    units = {name: unit for name, field in below if (unit := known_unit(field))}
    units |= {name: unit for name in layout.names if (unit := stated_unit(name)) and name not in units}
    return Table(frame_columns(frame.drop(columns=empty)), notes, units, "CSV")


def frame_columns(frame: pd.DataFrame) -> dict[str, np.ndarray]:
    """Columns of a frame; what is not a number by its type stays an array of objects."""
    columns = {}
    for name in frame.columns:
        values = frame[name]
        numeric = pd.api.types.is_numeric_dtype(values.dtype) and values.dtype.kind != "c"
        columns[str(name).strip()] = values.to_numpy(float, na_value=np.nan) if numeric else values.to_numpy(object)
    return columns


def _decoded(raw: bytes, path: pathlib.Path, encoding: str | None) -> tuple[str, list[str]]:
    """The text, and a note where its encoding had to be guessed."""
    notes: list[str] = []
    found = encoding or next((name for mark, name in BYTE_ORDER_MARKS if raw.startswith(mark)), None)
    if found is None and raw[:4096].count(0) > 0.3 * len(raw[:4096]):
        # Latin letters in UTF-16 have a zero byte each, before or after.
        found = "utf-16-le" if raw[1:4096:2].count(0) > raw[:4096:2].count(0) else "utf-16-be"
        raw = raw[: len(raw) // 2 * 2]
    try:
        text = raw.decode(found or "utf-8")
    except LookupError:
        raise RecordingError(f"{path}: encoding '{encoding}' is unknown; allowed are utf-8, utf-16, latin-1, cp1252 "
                             "and whatever else Python knows") from None
    except UnicodeDecodeError as error:
        text = raw.decode("latin-1") if found is None else "\x00"
        if found is not None and not CONTROL.search(raw[:200].decode("latin-1")):
            raise RecordingError(f"{path}: this is not text in {found} (byte {error.start}); give the right encoding "
                                 "= \"...\" in the column map, or save it in UTF-8") from error
        notes.append("The file is not in UTF-8; read as Latin-1")
    if control := CONTROL.search(text):
        row = text.count("\n", 0, control.start()) + 1
        if row == 1:
            raise RecordingError(f"{path}: this is not a text file in UTF-8 or UTF-16 (byte {control.start()}); save "
                                 "it as CSV, Parquet or NPZ")
        raise RecordingError(f"{path}: line {row} holds bytes that are no text, as after a crash or a full disk; "
                             "delete this line and what is broken below it")
    return text, notes


def _layout(lines: list[str], path: pathlib.Path, options: FileOptions) -> Layout:
    """Where the header is and what parts the columns: the first separator by which header and numbers agree."""
    spare = None
    for separator in (options.separator,) if options.separator else SEPARATORS:
        rows = [_fields(line, separator) for line in lines]
        first = next((i for i, row in enumerate(rows) if len(row) > 1 and _are_numbers(row, lines[i], options)), None)
        if first is None:
            continue
        width = len(rows[first])
        above = [i for i in range(first) if lines[i].strip()]
        # The nearest line above that is no comment; numpy writes the names as one.
        named = [i for i in above if not _is_comment(lines[i], options)] or above[-1:]
        cut = {i: _fields(_uncommented(lines[i], options), separator) for i in named}
        fits = [i for i in named if len(cut[i]) == width]
        decimal = options.decimal or _decimal(rows[first], separator)
        if not fits:
            spare = spare or (separator, decimal, cut[named[-1]] if named else None, first)
            continue
        header, units = fits[-1], None
        if len(fits) > 1 and all(is_unit(field) for field in cut[header]) and any(cut[header]):
            header, units = fits[-2], cut[header]
        return Layout(separator, decimal, _names(cut[header], path), units, first)
    if spare is not None and spare[2] is not None and len(spare[2]) > 1:
        # Header and rows differ in length; pandas says which row.
        separator, decimal, names, first = spare
        return Layout(separator, decimal, _names(names or [], path), None, first)
    if spare is not None and spare[3] == 0 or spare is not None and spare[2] is None:
        sample = ", ".join(_fields(lines[spare[3]], spare[0])[:3])
        raise RecordingError(f"{path}: row 1 holds numbers where names are needed ({sample} ...); put a header line t, "
                             "q.<joint>, tau.<joint> on top, or name the columns there and map them with --columns")
    names = [line for line in lines if line.strip() and not _is_comment(line, options)]
    if names:  # for its own faults, a name twice say
        _names(_fields(names[0], options.separator or _likeliest(names[0])), path)
    raise RecordingError(f"{path}: this file holds no samples; give a recording with a header and one row of numbers a "
                         "sample, or name what parts its columns: separator = \"...\" in the column map")


def _likeliest(line: str) -> str:
    return max(SEPARATORS[:-1], key=line.count)


def _fields(line: str, separator: str) -> list[str]:
    if separator == "blanks":
        return line.split()
    if len(separator) != 1:
        return [field.strip() for field in line.split(separator)]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]
    except csv.Error:
        return []


def _are_numbers(fields: list[str], line: str, options: FileOptions) -> bool:
    """Whether a row is one of samples: the first field and most of the others are numbers or times, or empty."""
    if _is_comment(line, options):
        return False
    given = [field for field in fields if field]
    numbers = sum(_is_number(field.replace(",", ".")) or _is_time(field) for field in given)
    return bool(given) and numbers >= max(1, 0.5 * len(given))


def _decimal(fields: list[str], separator: str) -> str:
    commas = separator != "," and any(re.fullmatch(COMMA_NUMBER, field) for field in fields)
    return "," if commas else "."


def _is_comment(line: str, options: FileOptions) -> bool:
    return line.lstrip().startswith(options.comment or COMMENTS)


def _uncommented(line: str, options: FileOptions) -> str:
    line = line.strip()
    for mark in (options.comment,) if options.comment else COMMENTS:
        line = line.removeprefix(mark)
    return line.strip()


def _names(fields: list[str], path: pathlib.Path) -> list[str]:
    # A separator at the end of the line makes an empty last name; its column holds nothing.
    names = [field.strip().strip('"').strip() or f"unnamed {i}" for i, field in enumerate(fields)]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise RecordingError(f"{path}: column {twice[0]} is there {names.count(twice[0])} times; every name may come "
                             "once")
    return names


def _frame(text: str, layout: Layout, options: FileOptions) -> pd.DataFrame:
    separator = r"\s+" if layout.separator == "blanks" else layout.separator
    with warnings.catch_warnings():
        # Rows with more values than there are names would be cut off with a mere warning.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        return pd.read_csv(
            io.StringIO(text), sep=separator, decimal=layout.decimal, header=None, names=layout.names,
            skiprows=layout.first, index_col=False, skipinitialspace=True, comment=(options.comment or "#")[:1],
            low_memory=False,
        )  # fmt: skip


def _has_commas(frame: pd.DataFrame) -> bool:
    """Whether a column of text holds numbers with a decimal comma."""
    texts = (frame[name].dropna() for name in frame.columns if not pd.api.types.is_numeric_dtype(frame[name].dtype))
    return any(bool(column.astype(str).str.fullmatch(COMMA_NUMBER).any()) for column in texts)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_time(text: str) -> bool:
    """Whether this may be a date or a time of day."""
    return bool(re.match(r"\d{1,4}[-/.:]\d{1,2}[-/.:]\d", text))
