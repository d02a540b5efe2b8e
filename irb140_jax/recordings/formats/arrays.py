"""Files of named arrays: NPZ of NumPy, MAT of MATLAB before and since version 7.3."""

import math
import pathlib
import zipfile
from typing import Any

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.extra import library
from irb140_jax.recordings.formats.opened import refuse_encrypted
from irb140_jax.recordings.formats.options import MAX_BYTES, MAX_VALUES, Table

MAX_MEMBERS, MAX_DEPTH = 10_000, 8  # arrays of a file; structs in structs
HDF5 = b"\x89HDF\r\n\x1a\n"


def npz_table(path: pathlib.Path, joint_names: tuple[str, ...]) -> Table:
    """Read NPZ: arrays of shape (T,), or (T, n) with one column a joint.

    Raises:
        RecordingError: It is no NPZ, or an array declares more than it holds, holds objects or has another shape.
    """
    with path.open("rb") as file:
        if file.read(6) == b"\x93NUMPY":
            raise RecordingError(f"{path}: this is one array (.npy) under the name of an NPZ file; save all columns "
                                 "with numpy.savez(path, t=..., q=..., tau=...)")
    arrays = {}
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        refuse_encrypted(members, path)
        if len(members) > MAX_MEMBERS or sum(info.file_size for info in members) > MAX_BYTES:
            raise RecordingError(f"{path}: unpacks to {len(members)} arrays and "
                                 f"{sum(info.file_size for info in members) / 2**20:.0f} MB; allowed are {MAX_MEMBERS} "
                                 f"and {MAX_BYTES // 2**20} MB: cut it into shorter recordings")
        for info in members:
            name = info.filename.removesuffix(".npy")
            if name == info.filename:
                raise RecordingError(f"{path}: holds '{name}', which is no array; save the columns with numpy.savez")
            arrays[name] = _npz_array(archive, info, f"{path}: array {name}")
    return array_columns(arrays, joint_names, path, "NPZ")


def _npz_array(archive: zipfile.ZipFile, info: zipfile.ZipInfo, where: str) -> np.ndarray:
    """An array, after its header was compared with the bytes there are."""
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}.get(version)
        if read is None:
            raise RecordingError(f"{where} has version {version} of the NPY format; save it with numpy.savez")
        shape, _, dtype = read(file)
    if dtype.hasobject:
        raise RecordingError(f"{where} holds Python objects, which are not read because they may run code; save plain "
                             "numbers")
    if math.prod(shape) * dtype.itemsize > info.file_size:
        raise RecordingError(f"{where} declares {math.prod(shape):.3g} values, the file holds {info.file_size} bytes "
                             "of it; it is damaged or cut off: save or copy it again")
    with archive.open(info) as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def mat_table(path: pathlib.Path, joint_names: tuple[str, ...]) -> Table:
    """Read MAT: vectors, matrices with one column a joint, and structs of these, named `struct.field`."""
    with path.open("rb") as file:
        since_73 = HDF5 in file.read(1024)
    arrays, notes = _hdf5_arrays(path) if since_73 else _mat_arrays(path)
    longest = max((max(a.shape) for a in arrays.values()), default=0)
    # MATLAB's vectors are matrices of one row or column, and its logs may lie.
    upright = {name: a.T if a.ndim == 2 and a.shape[1] == longest > a.shape[0] else a for name, a in arrays.items()}
    columns = {name: a[:, 0] if a.ndim == 2 and a.shape[1] == 1 else a for name, a in upright.items()}
    samples = {name: a for name, a in columns.items() if len(a) == longest}
    if left := sorted(columns.keys() - samples.keys()):
        notes.append(f"Left out what has no value a sample: {', '.join(left[:6])}{' ...' if len(left) > 6 else ''}")
    table = array_columns(samples, joint_names, path, "MAT")
    return Table(table.columns, notes + table.notes, format="MAT")


def _mat_arrays(path: pathlib.Path) -> tuple[dict[str, np.ndarray], list[str]]:
    from scipy import io

    declared = sum(math.prod(shape) for _, shape, _ in io.whosmat(path))
    if declared > MAX_VALUES:
        raise RecordingError(f"{path}: declares {declared:.3g} values; allowed are {MAX_VALUES:.0g}: it is damaged, or "
                             "has to be cut into shorter recordings")
    content = io.loadmat(path, squeeze_me=False, struct_as_record=False)
    return _flat({name: value for name, value in content.items() if not name.startswith("__")})


def _flat(content: dict[str, Any], before: str = "", depth: int = 0) -> tuple[dict[str, np.ndarray], list[str]]:
    """Arrays of numbers in structs within structs, and a note on what is none."""
    arrays, notes = {}, []
    for name, value in content.items():
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim == 2 and value.size:
            arrays[before + name] = value
            continue
        inner = value.flat[0] if isinstance(value, np.ndarray) and value.dtype == object and value.size == 1 else value
        fields = getattr(inner, "_fieldnames", None)
        if fields and depth < MAX_DEPTH:
            more = _flat({field: getattr(inner, field) for field in fields}, f"{before}{name}.", depth + 1)
            arrays, notes = arrays | more[0], notes + more[1]
        else:
            notes.append(f"'{before}{name}' is no array of numbers and is left out")
    return arrays, notes


def _hdf5_arrays(path: pathlib.Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Numbers of a MAT file since version 7.3, which is HDF5 and holds matrices transposed."""
    h5py = library("h5py", f"{path}: a MAT file of version 7.3 needs h5py")
    arrays: dict[str, np.ndarray] = {}
    with h5py.File(path, "r") as file:
        found = []
        file.visititems(lambda name, item: found.append((name, item)) if isinstance(item, h5py.Dataset) else None)
        if sum(math.prod(item.shape or (0,)) for _, item in found) > MAX_VALUES or len(found) > MAX_MEMBERS:
            raise RecordingError(f"{path}: declares more than {MAX_VALUES:.0g} values; it is damaged, or has to be cut "
                                 "into shorter recordings")
        for name, item in found:
            if item.dtype.kind in "fiub" and len(item.shape or ()) in (1, 2) and not name.startswith("#"):
                values = np.asarray(item[()])
                arrays[name.replace("/", ".")] = values[:, None] if values.ndim == 1 else values.T
    return arrays, []


def array_columns(
    arrays: dict[str, np.ndarray], joint_names: tuple[str, ...], path: pathlib.Path, kind: str
) -> Table:
    """Arrays as columns; (T, n) becomes one column a joint in the robot's order, other matrices name[0], name[1] ..."""
    columns = {}
    for name, values in arrays.items():
        if values.ndim == 2 and values.shape[1] == len(joint_names):
            columns |= {f"{name}.{joint}": _numbers(values[:, i]) for i, joint in enumerate(joint_names)}
        elif values.ndim == 2:
            columns |= {f"{name}[{i}]": _numbers(values[:, i]) for i in range(min(values.shape[1], MAX_MEMBERS))}
        elif values.ndim == 1:
            columns[name] = _numbers(values)
        elif values.ndim:
            raise RecordingError(f"{path}: array {name} has shape {values.shape}; allowed is (T,), or (T, "
                                 f"{len(joint_names)}) for all joints at once")
    return Table(columns, format=kind)


def _numbers(values: np.ndarray) -> np.ndarray:
    return values.astype(float) if values.dtype.kind in "fiub" else values.astype(object)
