"""Files to named columns, by the module for their format.  Nothing here knows what a column means."""

import pathlib

from irb140_jax.errors import InputError, RecordingError
from irb140_jax.recordings.formats.arrays import mat_table, npz_table
from irb140_jax.recordings.formats.opened import check_regular, said
from irb140_jax.recordings.formats.options import FileOptions, Table
from irb140_jax.recordings.formats.parquet import parquet_table
from irb140_jax.recordings.formats.ros import SUFFIXES as ROS_SUFFIXES
from irb140_jax.recordings.formats.ros import is_bag_folder, ros_table
from irb140_jax.recordings.formats.text import text_table

TEXT = (".csv", ".txt", ".tsv", ".dat", ".log", ".asc")
PACKED = (".gz", ".bz2", ".xz", ".zip")
ALLOWED = ".csv (also packed: .csv.gz, .csv.zip ...), .parquet, .npz, .mat, .bag, .mcap, or a ROS 2 bag's folder"


def read_table(path: pathlib.Path, joint_names: tuple[str, ...], options: FileOptions = FileOptions()) -> Table:  # noqa: B008
    """The columns of a file by name, each of shape (T,) and any type, and notes on what was guessed.

    Raises:
        RecordingError: The file is missing, empty, of unknown type, not a table, or holds a column twice.
    """
    kind = _kind(path)
    if kind != "ROS" or not path.is_dir():
        check_regular(path)
    try:
        table = {
            "NPZ": lambda: npz_table(path, joint_names), "Parquet": lambda: parquet_table(path, options),
            "MAT": lambda: mat_table(path, joint_names), "ROS": lambda: ros_table(path, joint_names, options),
            "CSV": lambda: text_table(path, options),
        }[kind]()  # fmt: skip
    except InputError:
        raise
    except Exception as error:  # whatever a library makes of bytes that are not what the file's name says
        raise RecordingError(f"{path}: can't read this as {kind}: {said(error)}; save it again, one row a sample and "
                             "as many values in each row as names in the header") from error
    _check_lengths(table, path)
    return table


def _kind(path: pathlib.Path) -> str:
    suffixes = [suffix.lower() for suffix in path.suffixes[-2:]]
    last = suffixes[-1] if suffixes else ""
    if last in PACKED:
        inner = suffixes[0] if len(suffixes) == 2 else ""
        if inner in TEXT or inner not in (".parquet", ".npz", ".mat", ".tar", *ROS_SUFFIXES):
            return "CSV"
        raise RecordingError(f"{path}: a packed {inner} is not read; unpack it first")
    kinds = dict.fromkeys(TEXT, "CSV") | dict.fromkeys(ROS_SUFFIXES, "ROS")
    kinds |= {".parquet": "Parquet", ".npz": "NPZ", ".mat": "MAT"}
    if is_bag_folder(path):
        return "ROS"
    if last not in kinds:
        if path.is_dir():
            check_regular(path)  # says what to give instead
        raise RecordingError(f"{path}: can't tell the format from '{path.suffix}'; allowed is {ALLOWED}")
    return kinds[last]


def _check_lengths(table: Table, path: pathlib.Path) -> None:
    lengths = {name: len(values) for name, values in table.columns.items()}
    if not lengths or not max(lengths.values()):
        raise RecordingError(f"{path}: this file holds no samples; give a recording with a header and one row a sample")
    if len(set(lengths.values())) > 1:
        short, long = min(lengths, key=lambda k: lengths[k]), max(lengths, key=lambda k: lengths[k])
        raise RecordingError(f"{path}: columns differ in length: {short} has {lengths[short]} values, {long} has "
                             f"{lengths[long]}; every column needs one value a sample")
