"""Where results may go: checked before the work, so that nothing is lost by it or after it."""

import contextlib
import os
import pathlib
from collections.abc import Callable, Iterable, Iterator, Mapping

from irb140_jax.errors import InputError, MisplacedResultError
from irb140_jax.report.made import DIAGNOSIS, MANIFEST, checksum, holds_a_diagnosis, read_manifest
from irb140_jax.report.results import SCRATCH, Results, said

Ours = Callable[[pathlib.Path], bool]


@contextlib.contextmanager
def results_folder(out: pathlib.Path, command: str, inputs: Iterable[pathlib.Path] = ()) -> Iterator[Results]:
    """Room for the files of a command in a folder, checked and taken before the work.

    Files of a former run of the same command are replaced, if they still are what that run wrote; whatever else is
    there stays, under another name where it stands in the way.

    Args:
        out: The folder: new, empty, or of a former run.
        command: What writes, as people call it.
        inputs: Files and folders that the command reads.

    Raises:
        InputError: Nothing can or may be written there.
        MisplacedResultError: At the end of the block, if the result had to be left elsewhere.
    """
    real = _real(out)
    if real.exists() and not real.is_dir():
        raise InputError(f"--out {out}: this is a file; name a folder to write into")
    for given in inputs:
        if _real(given).is_relative_to(real):
            raise InputError(f"--out {out}: {given} is an input and lies in there; name a folder without inputs in it")
    _check_not_in(out, real, inputs)
    _check_former(out, real, command)
    with _room(out, real, _of_manifest, command) as results:
        yield results


@contextlib.contextmanager
def results_file(
    out: pathlib.Path, ours: Ours, inputs: Iterable[pathlib.Path] = (), beside: Mapping[str, Ours] | None = None
) -> Iterator[Results]:
    """Room for a file, checked and taken before the work; the writer writes it by the name of `out`.

    Args:
        out: The file: new, empty, or of a former run.
        ours: Whether an existing file was written by the same command, so that it may be replaced.
        inputs: Files and folders that the command reads.
        beside: Endings of further files, each named like `out` without its own ending, with what `ours` is for them.

    Raises:
        InputError: Nothing can or may be written there.
        MisplacedResultError: At the end of the block, if the result had to be left elsewhere.
    """
    real = _real(out)
    if real.is_dir():
        raise InputError(f"--out {out}: this is a folder; name a file, for example {out / 'result.csv'}")
    files = {real: ours} | {real.with_name(real.stem + end): own for end, own in (beside or {}).items()}
    for path, own in files.items():
        _real(path)  # a name beside may be too long where that of `out` is not
        _check_file(out if path == real else path, path, own, inputs)
    _check_not_in(out, real, inputs)

    def owned(_: pathlib.Path) -> dict[str, str]:
        return {path.name: checksum(path) for path, own in files.items() if path.exists() and _replaceable(path, own)}

    with _room(out, real.parent, owned, names=[path.name for path in files]) as results:
        yield results


def _check_file(out: pathlib.Path, real: pathlib.Path, ours: Ours, inputs: Iterable[pathlib.Path]) -> None:
    if any(_same(real, given) for given in inputs):
        raise InputError(f"--out {out}: this is an input, which would be overwritten; name another file")
    if os.path.lexists(real) and not _replaceable(real, ours):
        raise InputError(
            f"--out {out}: this file is there and is no former result of this command, so it is not overwritten; name "
            "another file, or move it away"
        )


def _replaceable(path: pathlib.Path, ours: Ours) -> bool:
    return path.is_file() and (path.stat().st_size == 0 or ours(path))


def _check_not_in(out: pathlib.Path, real: pathlib.Path, inputs: Iterable[pathlib.Path]) -> None:
    for given in inputs:
        if _real(given).is_dir() and real.is_relative_to(_real(given)):
            raise InputError(f"--out {out}: this lies in {given}, which is an input; name a place outside of it")


def _check_former(out: pathlib.Path, folder: pathlib.Path, command: str) -> None:
    """A folder that holds anything has to be one that the same command wrote."""
    try:
        names = sorted(p.name for p in folder.iterdir() if not p.name.startswith(SCRATCH)) if folder.exists() else []
    except OSError as error:
        raise InputError(f"--out {out}: can't look into this folder ({said(error)}); name another place") from None
    former = read_manifest(folder)
    if former and former[0] != command:
        raise InputError(
            f"--out {out}: this folder was written by `{former[0]}`, whose results `{command}` doesn't replace; name "
            "another folder"
        )
    if names and not former and not holds_a_diagnosis(folder):
        raise InputError(
            f"--out {out}: the folder isn't empty ({names[0]!r} is in it) and holds no former {DIAGNOSIS}; name a new "
            "folder, so that nothing of yours is overwritten"
        )


def _of_manifest(folder: pathlib.Path) -> dict[str, str]:
    """Files of a former run by its manifest, which is one of them."""
    former = read_manifest(folder)
    return former[1] | {MANIFEST: checksum(folder / MANIFEST)} if former else {}


@contextlib.contextmanager
def _room(
    out: pathlib.Path, folder: pathlib.Path, owned: Callable[[pathlib.Path], dict[str, str]], command: str = "",
    names: Iterable[str] = (),
) -> Iterator[Results]:  # fmt: skip
    """The folder made, if it isn't there, and room in it; without a result nothing of that is left."""
    made: list[pathlib.Path] = []
    try:
        for path in reversed([folder, *folder.parents]):
            if not path.exists():
                path.mkdir()
                made.append(path)
        results = Results(folder, owned, command, names)
    except OSError as error:
        _remove(made)
        raise InputError(
            f"--out {_short(out)}: nothing can be written there ({said(error)}); name another place"
        ) from None
    except InputError as error:
        _remove(made)
        raise InputError(f"--out {out}: {error}") from None
    try:
        yield results
    finally:
        results.close()
        _remove(made)
    if results.misplaced:
        raise MisplacedResultError(results.misplaced)


def _real(path: pathlib.Path) -> pathlib.Path:
    """Where a path leads to, links followed."""
    try:
        path = path.expanduser()
        for link in (path, *path.parents):
            if link.is_symlink() and not link.exists():
                raise InputError(f"{link}: this link leads to {link.resolve()}, which is not there; name another place")
        real = path.resolve()
        real.exists()
        return real
    except (OSError, RuntimeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{_short(path)}: this can't be a path here ({said(error)}); name another place") from None


def _same(real: pathlib.Path, given: pathlib.Path) -> bool:
    """Whether two paths are one file, hard links included."""
    given = _real(given)
    return real == given or (real.exists() and given.exists() and real.samefile(given))


def _remove(folders: list[pathlib.Path]) -> None:
    """Remove folders, the last first, as far as they are empty."""
    for folder in reversed(folders):
        with contextlib.suppress(OSError):
            folder.rmdir()


def _short(path: pathlib.Path) -> str:
    text = ascii(str(path))
    return text if len(text) < 80 else f"{text[:60]}...'"
