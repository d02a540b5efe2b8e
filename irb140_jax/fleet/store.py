"""The folder that stores the results of many units, so that a run killed at any moment can be resumed.

OUT/diagnoses/<unit>/   a whole diagnosis, moved there in one step
OUT/rows/<unit>.json    its row, written after that
OUT/table.parquet, OUT/index.html    all rows
OUT/.irb140-*           unfinished results of a run; the next run removes those of a killed one
"""

import contextlib
import hashlib
import json
import os
import pathlib
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from irb140_jax.errors import InputError
from irb140_jax.fleet.layout import Unit
from irb140_jax.recordings.formats.opened import checksum
from irb140_jax.report import results_folder
from irb140_jax.report.made import DIAGNOSIS, MANIFEST, read_manifest
from irb140_jax.report.results import KEPT, SCRATCH

try:
    import fcntl
except ImportError:  # not on Windows, where two runs in one folder are not told apart
    fcntl = None

COMMAND = "irb140 diagnose-many"
SCHEMA = 1  # of a row; rows of another are made anew
FORMER, LOCK = "former-", f"{SCRATCH}lock"
LONG_AGO = 60.0  # [s]


class ResultsStore:
    """The folder of the results of many units while a run has it open, see `results_store`.

    Attributes:
        out: The folder.
        workspace: Folder for unfinished results; removed at the end, or by the next run after a kill.
        settings: Whatever else than its files a row depends on.
    """

    def __init__(self, out: pathlib.Path, workspace: pathlib.Path, settings: Mapping[str, Any]):
        self.out, self.workspace = out, workspace
        self.settings = _digest(json.dumps({"schema": SCHEMA, **settings}, sort_keys=True))

    def key(self, unit: Unit) -> str:
        """What the row of a unit was made from: settings, names and contents of its files."""
        said = [self.settings, unit.problem]
        for path in unit.files:
            with contextlib.suppress(OSError):  # then the diagnosis says what is wrong with it
                said.append(f"{path.name} {checksum(path)}")
        return _digest("\n".join(said))

    def folder(self, name: str) -> pathlib.Path:
        """Where the diagnosis of a unit lies."""
        return self.out / "diagnoses" / name

    def row(self, name: str) -> dict[str, Any] | None:
        """The row of a unit under the same settings; None if there is none."""
        try:
            row = json.loads(self._row_file(name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return row if isinstance(row, dict) and row.get("settings") == self.settings else None

    def done(self, unit: Unit) -> bool:
        """Whether nothing is left to do for a unit; what failed unexpectedly is tried again."""
        row = self.row(unit.name)
        if row is None or row["status"] == "failed" or row["key"] != self.key(unit):
            return False
        return row["status"] != "diagnosed" or (self.folder(unit.name) / DIAGNOSIS).is_file()

    def put(self, unit: Unit, key: str, row: Mapping[str, Any], fresh: pathlib.Path | None = None) -> None:
        """Put the row of a unit into its place, and before that its diagnosis, where there is one.

        Args:
            unit: The unit.
            key: Its key before it was diagnosed.
            row: The row.
            fresh: Folder of the diagnosis, in the workspace.
        """
        place, former = self.folder(unit.name), self.workspace / f"{FORMER}{unit.name}"
        self._row_file(unit.name).unlink(missing_ok=True)  # of a former diagnosis, which is about to go
        if place.exists():
            fresh = fresh or self.workspace / "kept"
            fresh.mkdir(exist_ok=True)
            _keep_foreign(place, fresh)
            place.rename(former)
        if fresh is not None and any(fresh.iterdir()):
            fresh.rename(place)
        shutil.rmtree(former, ignore_errors=True)
        whole = {"settings": self.settings, "key": key, **row}
        text = json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
        _write_whole(self._row_file(unit.name), text, self.workspace)

    def _row_file(self, name: str) -> pathlib.Path:
        return self.out / "rows" / f"{name}.json"


@contextlib.contextmanager
def results_store(
    out: pathlib.Path, part: str, settings: Mapping[str, Any], inputs: Iterable[pathlib.Path] = ()
) -> Iterator[ResultsStore]:
    """Open a folder of results for one part of the units.

    Args:
        out: The folder: new, empty, or of a former run.
        part: Name of the part; two runs can't work on one part at a time.
        settings: Whatever else than its files a row depends on.
        inputs: Files and folders that are read.

    Raises:
        InputError: Nothing can or may be written there, or another run works on this part.
    """
    with results_folder(out, COMMAND, inputs) as results:
        if read_manifest(results.folder) is None:
            results.write(lambda folder: None)  # only the mark that the folder is ours
    out = results.folder
    workspace = out / f"{SCRATCH}part-{part.replace('/', '-of-')}"
    for left in out.glob(f"{SCRATCH}part-*"):
        with _locked(left) as free:
            if free:
                _clear(left, out / "diagnoses")
    _sweep(out)
    for folder in (out / "diagnoses", out / "rows", workspace):
        folder.mkdir(exist_ok=True)
    with _locked(workspace) as free:
        if not free:
            raise InputError(f"--out {out}: another run works on part {part} there; wait for it, or stop it")
        try:
            yield ResultsStore(out, workspace, settings)
        finally:
            shutil.rmtree(workspace, ignore_errors=True)


@contextlib.contextmanager
def only_writer(out: pathlib.Path) -> Iterator[None]:
    """Wait until no other run writes the table, and let none meanwhile."""
    lock = out / LOCK
    lock.touch()
    with _locked(lock, wait=True):
        _sweep(out)
        yield


@contextlib.contextmanager
def _locked(path: pathlib.Path, *, wait: bool = False) -> Iterator[bool]:
    """Hold the lock of a file or folder, which ends with the process; False if another process holds it."""
    if fcntl is None:
        yield True
        return
    number = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        yield True
    except BlockingIOError:
        yield False
    finally:
        os.close(number)


def _write_whole(path: pathlib.Path, text: str, workspace: pathlib.Path) -> None:
    fresh = workspace / path.name
    fresh.write_text(text, encoding="utf-8")
    os.replace(fresh, path)


def _clear(workspace: pathlib.Path, diagnoses: pathlib.Path) -> None:
    """Remove what a killed run left; a former diagnosis that it was about to replace goes back."""
    for former in workspace.glob(f"{FORMER}*"):
        place = diagnoses / former.name.removeprefix(FORMER)
        if not place.exists():
            former.rename(place)
    shutil.rmtree(workspace, ignore_errors=True)


def _sweep(out: pathlib.Path) -> None:
    """Remove what a run left that was killed while it wrote the table, which takes less than a second."""
    for left in out.glob(f"{SCRATCH}*"):
        used = left.name == LOCK or left.name.startswith(f"{SCRATCH}part-")
        with contextlib.suppress(OSError):
            if not used and time.time() - left.stat().st_mtime > LONG_AGO:
                shutil.rmtree(left, ignore_errors=True)


def _keep_foreign(former: pathlib.Path, fresh: pathlib.Path) -> None:
    """Copy what a user put into a former diagnosis, or changed there, to the new one."""
    manifest = read_manifest(former)
    owned = manifest[1] if manifest else {}
    for path in [path for path in former.rglob("*") if path.is_file() and path != former / MANIFEST]:
        name = path.relative_to(former)
        if owned.get(name.as_posix()) != checksum(path):
            place = fresh / name
            place = place if not place.exists() else place.with_name(place.name + KEPT)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, place)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
