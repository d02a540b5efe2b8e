"""Files to named columns: CSV, Parquet and NPZ.  Nothing here knows what a column means."""

import pathlib
import re
import warnings
import zipfile

import numpy as np
import pandas as pd
import pyarrow

from irb140_jax.errors import RecordingError

READABLE = {".csv": "CSV", ".txt": "CSV", ".tsv": "CSV", ".parquet": "Parquet", ".npz": "NPZ"}
# What pandas, pyarrow and numpy raise on files that are not what their suffix says.
BROKEN = (ValueError, KeyError, EOFError, pyarrow.ArrowException, zipfile.BadZipFile, pd.errors.ParserWarning)


def read_table(path: pathlib.Path, joint_names: tuple[str, ...]) -> tuple[dict[str, np.ndarray], list[str]]:
    """The columns of a file by name, each of shape (T,) and any type, and notes on what was guessed.

    Raises:
        RecordingError: The file is missing, empty, of unknown type, not a table, or holds a column twice.
    """
    if path.suffix.lower() not in READABLE:
        raise RecordingError(f"{path}: can't tell the format from '{path.suffix}'; allowed is .csv, .parquet or .npz")
    if path.is_dir():
        raise RecordingError(f"{path}: this is a folder; give the files of the recordings in it")
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise RecordingError(f"{path}: can't open this file: {error.strerror or error}; check the path") from error
    if size == 0:
        raise RecordingError(f"{path}: this file is empty; give a recording with a header and one row a sample")
    kind = READABLE[path.suffix.lower()]
    notes: list[str] = []
    try:
        if kind == "NPZ":
            table = _npz_table(path, joint_names)
        elif kind == "Parquet":
            table = _frame_columns(pd.read_parquet(path))
        else:
            table = _csv_table(path, notes)
    except RecordingError:
        raise
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: this is not a text file in UTF-8 (byte {error.start}); save it as CSV, Parquet "
                             "or NPZ") from error
    except BROKEN as error:
        reason = re.sub(r"\s+", " ", str(error)).strip() or type(error).__name__
        raise RecordingError(f"{path}: can't read this as {kind}: {reason}; save it again, one row a sample and as "
                             "many values in each row as names in the header") from error
    lengths = {name: len(values) for name, values in table.items()}
    if not lengths or not max(lengths.values()):
        raise RecordingError(f"{path}: this file holds no samples; give a recording with a header and one row a sample")
    if len(set(lengths.values())) > 1:
        short, long = min(lengths, key=lambda k: lengths[k]), max(lengths, key=lambda k: lengths[k])
        raise RecordingError(f"{path}: columns differ in length: {short} has {lengths[short]} values, {long} has "
                             f"{lengths[long]}; every column needs one value a sample")
    return table, notes


def _csv_table(path: pathlib.Path, notes: list[str]) -> dict[str, np.ndarray]:
    with path.open(encoding="utf-8-sig") as file:
        header = file.readline().strip()
        second = file.readline()
    separator = next((s for s in (",", ";", "\t") if s in header), r"\s+" if " " in header else ",")
    decimal = "," if separator == ";" and "," in second else "."
    if separator != ",":
        name = {";": "semicolons", "\t": "tabs"}.get(separator, "blanks")
        notes.append(f"The columns are parted by {name} instead of commas; read so")
    names = [n.strip().strip('"').strip() for n in re.split(separator, header.lstrip("# "))]
    # A separator at the end of the line makes an empty last name; its column holds nothing.
    names = [name or f"unnamed {i}" for i, name in enumerate(names)]
    if all(_is_number(n.replace(decimal, ".")) for n in names):
        raise RecordingError(f"{path}: row 1 holds numbers where names are needed ({', '.join(names[:3])} ...); put a "
                             "header line t, q.<joint>, tau.<joint> on top, or name the columns there and map them "
                             "with --columns")
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise RecordingError(f"{path}: column {twice[0]} is there {names.count(twice[0])} times; every name may come "
                             "once")
    with warnings.catch_warnings():
        # Rows with more values than there are names would be cut off with a mere warning.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        frame = pd.read_csv(path, sep=separator, decimal=decimal, header=None, names=names, skiprows=1,
                            index_col=False, skipinitialspace=True, encoding="utf-8-sig", low_memory=False, comment="#")
    empty = [n for n in names if n.startswith("unnamed ") and bool(frame[n].isna().all())]
    return _frame_columns(frame.drop(columns=empty))


def _frame_columns(frame: pd.DataFrame) -> dict[str, np.ndarray]:
    """Columns of a frame; what is not a number by its type stays an array of objects."""
    columns = {}
    for name in frame.columns:
        values = frame[name]
        numeric = pd.api.types.is_numeric_dtype(values.dtype)
        columns[str(name).strip()] = values.to_numpy(float, na_value=np.nan) if numeric else values.to_numpy(object)
    return columns


def _npz_table(path: pathlib.Path, joint_names: tuple[str, ...]) -> dict[str, np.ndarray]:
    table = {}
    with np.load(path, allow_pickle=False) as file:
        for name in file.files:
            values = file[name]
            if values.ndim == 2 and values.shape[1] == len(joint_names):
                # q of shape (T, n) instead of n arrays: one column a joint, in the robot's order.
                table |= {f"{name}.{joint}": values[:, i] for i, joint in enumerate(joint_names)}
            elif values.ndim == 1:
                table[name] = values.astype(float) if values.dtype.kind in "fiub" else values.astype(object)
            elif values.ndim:
                raise RecordingError(f"{path}: array {name} has shape {values.shape}; allowed is (T,), or (T, "
                                     f"{len(joint_names)}) for all joints at once")
    return table


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
