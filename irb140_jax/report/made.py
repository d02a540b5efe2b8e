"""Which files a command has made itself: only those may it replace."""

import hashlib
import json
import pathlib
import re
from collections.abc import Mapping

import numpy as np
import pandas as pd

MANIFEST = "manifest.json"
DIAGNOSIS = "diagnosis.json"
# How `write_table` writes a row.  No other program writes numbers just so, so that it is also the mark of our tables.
_ROW = re.compile(r"-?\d+\.\d{9}(,[+-]\d\.\d{9}e[+-]\d{2,3})+\n")


def checksum(path: pathlib.Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_manifest(folder: pathlib.Path, command: str) -> None:
    """Write beside the files in a folder which they are and what is in them, so that later they are known as ours."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    sums = {path.relative_to(folder).as_posix(): checksum(path) for path in files}
    text = json.dumps({"schema": 1, "command": command, "files": sums}, indent=1)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


def read_manifest(folder: pathlib.Path) -> tuple[str, dict[str, str]] | None:
    """The command that wrote this folder, and the checksum of each of its files; None if none did."""
    try:
        data = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        command, files = data["command"], data["files"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    names = isinstance(files, dict) and all(_below(name) and isinstance(sum_, str) for name, sum_ in files.items())
    return (str(command), files) if names and data.get("schema") == 1 else None


def holds_a_diagnosis(folder: pathlib.Path) -> bool:
    """Whether there is a `diagnosis.json` of a diagnosis, and not of something else that is called so."""
    try:
        data = json.loads((folder / DIAGNOSIS).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(data, dict) and {"schema", "verdict", "findings", "fit"} <= data.keys()


def write_table(columns: Mapping[str, np.ndarray], path: pathlib.Path) -> None:
    """Write columns as CSV: t in seconds to nine places, all else to ten digits."""
    table = pd.DataFrame(dict(columns))
    table["t"] = [f"{t:.9f}" for t in table["t"]]
    table.to_csv(path, index=False, float_format="%+.9e", lineterminator="\n")


def is_our_table(path: pathlib.Path, starts: tuple[str, ...]) -> bool:
    """Whether a file is a whole table by `write_table`: t, and columns whose names begin with one of `starts`."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            t, *names = file.readline().rstrip("\n").split(",")
            return t == "t" and all(n.startswith(starts) for n in names) and all(_ROW.fullmatch(row) for row in file)
    except (OSError, UnicodeDecodeError):
        return False


def _below(name: str) -> bool:
    """Whether a name in a manifest is of a file in or below its folder; what else may be written there is not ours."""
    path = pathlib.PurePosixPath(name)
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts and path.parts != (MANIFEST,)
