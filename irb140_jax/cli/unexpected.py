"""The last net: an error that nobody foresaw ends with one line, and a file that tells the authors the rest."""

import datetime
import importlib.metadata
import pathlib
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Sequence

PACKAGES = ("irb140_jax", "jax", "jaxlib", "mujoco", "numpy", "scipy", "pandas", "pyarrow")


def report(error: Exception, words: Sequence[str]) -> str:
    """Write what the authors need to know of an error into a file.

    Args:
        error: What was raised.
        words: Of the command line.

    Returns:
        A line for the person at the terminal: what went wrong, and what to send.
    """
    what = " ".join(f"{type(error).__name__}: {error}".split())
    what = what if len(what) < 200 else f"{what[:200]} ..."
    path = _written(_text(error, words))
    if path is None:
        traceback.print_exception(error)  # there is no disk to write it to
        return f"an unexpected error ({what}); please send the lines above to the authors"
    return (
        f"an unexpected error ({what}); none of your files was changed; please send {path} to the authors, and the "
        "input files if you may"
    )


def _text(error: Exception, words: Sequence[str]) -> str:
    lines = [
        f"irb140 {shlex.join(map(str, words))}",
        f"{datetime.datetime.now().astimezone().isoformat(timespec='seconds')}, Python {sys.version.split()[0]}, "
        f"{platform.platform()}",
        ", ".join(f"{name} {_version(name)}" for name in PACKAGES),
        "",
    ]
    return "\n".join(lines) + "\n" + "".join(traceback.format_exception(error))


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _written(text: str) -> pathlib.Path | None:
    """The file, in the current folder or else in that for temporary files; None if neither can be written to."""
    stamp = f"{datetime.datetime.now():%Y%m%d-%H%M%S}"
    for folder in (pathlib.Path(), pathlib.Path(tempfile.gettempdir())):
        for name in (f"irb140-error-{stamp}.txt", *(f"irb140-error-{stamp}-{k}.txt" for k in range(2, 100))):
            try:
                with (folder / name).open("x", encoding="utf-8", errors="backslashreplace") as file:
                    file.write(text)
                return folder / name
            except FileExistsError:
                continue
            except OSError:
                break
    return None
