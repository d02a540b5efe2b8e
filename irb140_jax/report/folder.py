"""Results reach the disk whole or not at all."""

import contextlib
import os
import pathlib
import shutil
import tempfile
from collections.abc import Iterator

from irb140_jax.errors import InputError

DIAGNOSIS = "diagnosis.json"


def check_folder(out: pathlib.Path) -> None:
    """Raise an `InputError` unless `out` is new, empty, or holds a former diagnosis (which may be replaced)."""
    if out.is_dir():
        names = sorted(path.name for path in out.iterdir())
        if names and DIAGNOSIS not in names:
            raise InputError(
                f"--out {out}: the folder isn't empty ({names[0]!r} is in it) and holds no former {DIAGNOSIS}; "
                "name a new folder, so that nothing of yours is overwritten"
            )
    elif out.exists():
        raise InputError(f"--out {out}: this is a file; name a folder to write the diagnosis into")
    _check_parent(out)


def check_file(out: pathlib.Path) -> None:
    """Raise an `InputError` unless a file can be written at `out`."""
    if out.is_dir():
        raise InputError(f"--out {out}: this is a folder; name a file, for example {out / 'predicted.csv'}")
    _check_parent(out)


def _check_parent(out: pathlib.Path) -> None:
    """The nearest folder above that exists must be one we may write in."""
    parent = out.absolute().parent
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir():
        raise InputError(f"--out {out}: {parent} is a file, so nothing can be written below it; name another place")
    if not os.access(parent, os.W_OK):
        raise InputError(f"--out {out}: no permission to write in {parent}; name another place")


@contextlib.contextmanager
def whole_folder(out: pathlib.Path) -> Iterator[pathlib.Path]:
    """A new folder beside `out` to write into; it takes the place of `out` if the block ends well, and else vanishes.

    Args:
        out: Where the results shall be; new, empty or a former diagnosis.

    Raises:
        InputError: `out` holds something else (see `check_folder`).
    """
    check_folder(out)
    parent = out.absolute().parent
    parent.mkdir(parents=True, exist_ok=True)
    # Beside `out`, because a rename is atomic within one file system only.
    scratch = pathlib.Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=parent))
    try:
        fresh = scratch / "new"
        fresh.mkdir()
        yield fresh
        if out.exists():
            out.rename(scratch / "former")
        fresh.rename(out)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


@contextlib.contextmanager
def whole_file(out: pathlib.Path) -> Iterator[pathlib.Path]:
    """A path beside `out` to write to; it takes the place of `out` when the block ends, and only if it ends well."""
    check_file(out)
    out.absolute().parent.mkdir(parents=True, exist_ok=True)
    scratch = out.absolute().with_name(f".{out.name}.part")
    try:
        yield scratch
        os.replace(scratch, out)
    finally:
        scratch.unlink(missing_ok=True)
