"""Files of named arrays: NPZ of NumPy, MAT of MATLAB before and since version 7.3."""

import math
import pathlib
import subprocess
import sys
import tempfile
import zipfile

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats import mat_worker
from irb140_jax.recordings.formats.extra import library
from irb140_jax.recordings.formats.opened import refuse_encrypted
from irb140_jax.recordings.formats.options import MAX_BYTES, MAX_VALUES, Table

MAX_MEMBERS = 10_000  # arrays of a file
MAX_SECONDS = 300  # for a MAT file; the largest allowed takes a tenth of it
HDF5 = mat_worker.HDF5


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
    arrays, notes = _mat_arrays(path)
    longest = max((max(a.shape) for a in arrays.values()), default=0)
    # MATLAB's vectors are matrices of one row or column, and its logs may lie.
    upright = {name: a.T if a.shape[1] == longest > a.shape[0] else a for name, a in arrays.items()}
    columns = {name: a[:, 0] if a.shape[1] == 1 else a for name, a in upright.items()}
    samples = {name: a for name, a in columns.items() if len(a) == longest}
    if left := sorted(columns.keys() - samples.keys()):
        notes.append(f"Left out what has no value a sample: {', '.join(left[:6])}{' ...' if len(left) > 6 else ''}")
    table = array_columns(samples, joint_names, path, "MAT")
    return Table(table.columns, notes + table.notes, format="MAT")


def _mat_arrays(path: pathlib.Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Arrays of a MAT file, each of two dimensions, read by a process of its own: see `mat_worker`."""
    with path.open("rb") as file:
        if HDF5 in file.read(1024):
            library("h5py", f"{path}: a MAT file of version 7.3 needs h5py")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "arrays.npz"
        command = [sys.executable, mat_worker.__file__, str(path.resolve()), str(out), str(MAX_VALUES)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=MAX_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise RecordingError(f"{path}: can't be read within {MAX_SECONDS} s; it is damaged: save it again, or as "
                                 "Parquet or NPZ") from None
        if done.returncode:
            reason = (done.stderr.strip().splitlines() or ["it is damaged"])[-1] if done.returncode > 0 else (
                "it is damaged in a way that its reader does not survive")  # fmt: skip
            raise RecordingError(f"{path}: can't read this as MAT: {reason[:200]}; save it again, or as Parquet or NPZ")
        with np.load(out) as arrays:
            return {name.removeprefix("array "): arrays[name] for name in arrays.files}, done.stdout.splitlines()


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
