"""Reads a MAT file in a process of its own: `python mat_worker.py FILE.mat OUT.npz LARGEST`.

The libraries for it crash the whole process on some damaged files (a bus error in scipy's reader, say), so another one
has to bear it.  It imports nothing of this package, which would take longer than the reading.  OUT.npz gets the arrays
of numbers, each of two dimensions, as "array NAME"; standard output a note a line on what is left out.
"""

import contextlib
import math
import sys
from typing import Any

import numpy as np

MAX_DEPTH = 8  # structs in structs
MAX_MEMORY = 8 * 2**30  # bytes; a damaged size must not fill the machine
HDF5 = b"\x89HDF\r\n\x1a\n"


def mat_arrays(path: str, largest: int) -> tuple[dict[str, np.ndarray], list[str]]:
    """Arrays of a MAT file up to version 7."""
    from scipy import io

    _check(sum(math.prod(shape) for _, shape, _ in io.whosmat(path)), largest)
    content = io.loadmat(path, squeeze_me=False, struct_as_record=False)
    return _flat({name: value for name, value in content.items() if not name.startswith("__")})


def _check(declared: int, largest: int) -> None:
    if not 0 <= declared <= largest:
        raise ValueError(f"declares {declared:.3g} values, allowed are {largest:.0g}: it is damaged, or has to be cut "
                         "into shorter recordings")  # fmt: skip


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


def hdf5_arrays(path: str, largest: int) -> tuple[dict[str, np.ndarray], list[str]]:
    """Arrays of a MAT file since version 7.3, which is HDF5 and holds matrices transposed."""
    import h5py

    arrays: dict[str, np.ndarray] = {}
    with h5py.File(path, "r") as file:
        found: list[tuple[str, Any]] = []
        file.visititems(lambda name, item: found.append((name, item)) if isinstance(item, h5py.Dataset) else None)
        _check(sum(math.prod(item.shape or (0,)) for _, item in found), largest)
        for name, item in found:
            if item.dtype.kind in "fiub" and len(item.shape or ()) in (1, 2) and not name.startswith("#"):
                values = np.asarray(item[()])
                arrays[name.replace("/", ".")] = values[:, None] if values.ndim == 1 else values.T
    return arrays, []


def main(path: str, out: str, largest: int) -> None:
    """Read, write, and say what was left out."""
    with contextlib.suppress(ImportError, ValueError, OSError):  # not on every system
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with open(path, "rb") as file:
        since_73 = HDF5 in file.read(1024)
    arrays, notes = (hdf5_arrays if since_73 else mat_arrays)(path, largest)
    plain = {f"array {name}": values.astype(float) for name, values in arrays.items()}
    np.savez(out, **plain)  # pyright: ignore[reportArgumentType]
    print("\n".join(notes))


if __name__ == "__main__":
    try:
        main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    except Exception as error:  # noqa: BLE001
        print(" ".join(str(error).split()) or type(error).__name__, file=sys.stderr)
        sys.exit(3)
