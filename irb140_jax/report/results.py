"""Results are written whole or not at all, and cost nobody a file that is not a former result."""

import contextlib
import errno
import os
import pathlib
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator

from irb140_jax.errors import InputError
from irb140_jax.report.made import DIAGNOSIS, MANIFEST, checksum, write_manifest

ROOM = 32 * 2**20  # [bytes] taken before the work: more than any report of seven joints has needed
SCRATCH = ".irb140-"  # begins the name of the folder in which results are made
KEPT = ".kept"  # ends the name of a user's file that stood in the way of a result


class Results:
    """Room on the disk for what a command is going to write, see `results_folder` and `results_file`.

    Args:
        folder: Where the files shall be.
        owned: Files of a former run in a folder, by name, with their checksums.
        command: What writes, for the manifest; without one there is none.
        names: Of the files, where they are known before the work; the first is `name`.

    Attributes:
        folder: Where the files shall be.
        name: Of the file, where it is one, links followed; else empty.
        workspace: An empty folder for intermediate files; it is removed at the end.
        kept: Files of the user that stood in the way, and what they are called now.
        misplaced: Why and where the result is elsewhere; None if all is well.
    """

    def __init__(
        self, folder: pathlib.Path, owned: Callable[[pathlib.Path], dict[str, str]], command: str = "",
        names: Iterable[str] = (),
    ):  # fmt: skip
        names = list(names)
        name = names[0] if names else ""
        self.folder, self.name, self._owned, self._command = folder, name, owned, command
        self._scratch = pathlib.Path(tempfile.mkdtemp(prefix=SCRATCH, dir=folder))
        self.workspace = self._scratch / "workspace"
        self.kept: list[tuple[pathlib.Path, pathlib.Path]] = []
        self.misplaced: str | None = None
        self._stuck = False  # whether files of a former run could not be put back
        try:
            self.workspace.mkdir()
            for file in names:
                _rehearse(folder / file, self.workspace)
            self._reserve = _reserved(self._scratch)
        except BaseException:
            shutil.rmtree(self._scratch, ignore_errors=True)
            raise

    def write(self, writer: Callable[[pathlib.Path], object]) -> pathlib.Path:
        """Let `writer` write files into an empty folder, then put them in their place.

        Returns:
            The folder where they are in the end: `folder`, or another one if that has become impossible.
        """
        self._reserve.close()
        fresh = self._scratch / "new"
        try:
            self._written(writer, fresh)
        except OSError as error:
            return self._elsewhere(writer, error)
        try:
            with _undisturbed():
                self._put(fresh)
        except OSError as error:
            return self._set_aside(fresh, error)
        return self.folder

    def close(self) -> None:
        """Remove what was needed meanwhile."""
        self._reserve.close()
        if not self._stuck:
            shutil.rmtree(self._scratch, ignore_errors=True)

    def _written(self, writer: Callable[[pathlib.Path], object], fresh: pathlib.Path) -> None:
        fresh.mkdir()
        writer(fresh)
        if self._command:
            write_manifest(fresh, self._command)
        for name in _files(fresh):
            with (fresh / name).open("r+b") as file:
                os.fsync(file.fileno())  # a full disk may show up only here

    def _put(self, fresh: pathlib.Path) -> None:
        """Former results out, new ones in; all moves are taken back if one fails."""
        done: list[tuple[pathlib.Path, pathlib.Path]] = []
        kept: list[tuple[pathlib.Path, pathlib.Path]] = []

        def move(old: pathlib.Path, new: pathlib.Path) -> None:
            new.parent.mkdir(parents=True, exist_ok=True)
            old.rename(new)
            done.append((old, new))

        try:
            names, owned = _files(fresh), self._owned(self.folder)
            for name in sorted({*names, *owned}, key=_key_file_first):
                there = self.folder / name
                if name in owned and there.is_file() and not there.is_symlink() and checksum(there) == owned[name]:
                    move(there, self._scratch / "former" / name)
                elif name in names and os.path.lexists(there):
                    kept.append((there, _free(there)))
                    move(*kept[-1])
            for name in sorted(names, key=_key_file_first, reverse=True):
                move(fresh / name, self.folder / name)
        except BaseException:
            for old, new in reversed(done):
                try:
                    new.rename(old)
                except OSError:
                    self._stuck = True
            raise
        self.kept += kept
        for name in owned:
            _remove_empty((self.folder / name).parent, self.folder)

    def _elsewhere(self, writer: Callable[[pathlib.Path], object], error: OSError) -> pathlib.Path:
        """The result in the folder for temporary files, as there is no writing where it should be."""
        other = pathlib.Path(tempfile.mkdtemp(prefix="irb140-result-"))
        self._written(writer, other / "result")
        self.misplaced = f"can't write to {self.folder} ({said(error)}); the result is in {other / 'result'}"
        return other / "result"

    def _set_aside(self, fresh: pathlib.Path, error: OSError) -> pathlib.Path:
        """The result under a name of its own, as it can't take the one it should have."""
        other = pathlib.Path(tempfile.mkdtemp(prefix="irb140-result-", dir=self.folder))
        fresh.rename(other / "result")
        self.misplaced = f"can't put the result into {self.folder} ({said(error)}); it is in {other / 'result'}"
        if self._stuck:
            self.misplaced += f"; what was there before is in {self._scratch / 'former'}"
        return other / "result"


def _rehearse(file: pathlib.Path, workspace: pathlib.Path) -> None:
    """Raise if no file can have this name, or if the file that has it can't be moved out of the way."""
    trial = workspace / file.name
    trial.touch()
    trial.unlink()
    if file.is_file() and not file.is_symlink():
        try:
            os.link(file, trial)
            trial.unlink()
        except OSError as error:
            if error.errno == errno.EXDEV:  # other errors come from file systems that have no links
                raise InputError(f"{file.name} is a mount point, which no result can replace; name another") from None


def _reserved(folder: pathlib.Path):
    """A file without a name that keeps `ROOM` bytes until it is closed, or dies with the process."""
    file = tempfile.TemporaryFile(dir=folder)
    try:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, ROOM)
        elif shutil.disk_usage(folder).free < ROOM:
            raise OSError("the disk is full")
    except OSError as error:
        file.close()
        raise InputError(f"no room for {ROOM // 2**20} MB ({said(error)}); make room, or name another disk") from None
    return file


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Interrupts wait until the block has ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []
    wait = lambda number, _: waiting.append(number)  # noqa: E731
    former = {number: signal.signal(number, wait) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler or signal.SIG_DFL)
        for number in waiting[:1]:
            signal.raise_signal(number)


def _files(folder: pathlib.Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]


def _key_file_first(name: str) -> tuple[bool, bool, str]:
    """Without its diagnosis a folder is none, so that goes first and comes last."""
    return name != DIAGNOSIS, name != MANIFEST, name


def _free(path: pathlib.Path) -> pathlib.Path:
    """A name beside `path` under which it can be kept."""
    names = (path.with_name(f"{path.name}{KEPT}{k or ''}") for k in range(10**6))
    return next(name for name in names if not os.path.lexists(name))


def _remove_empty(folder: pathlib.Path, top: pathlib.Path) -> None:
    with contextlib.suppress(OSError):
        while folder != top:
            folder.rmdir()
            folder = folder.parent


def said(error: BaseException) -> str:
    """An error of the operating system in its own words."""
    return getattr(error, "strerror", None) or str(error)
