"""Files to bytes: only regular files are opened, and nothing is unpacked beyond what a recording may hold."""

import bz2
import gzip
import hashlib
import lzma
import pathlib
import stat
import zipfile
from typing import IO

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.options import MAX_BYTES

PIECE = 2**22  # bytes read at a time, so that a bomb is noticed before it has filled the memory


def check_regular(path: pathlib.Path) -> None:
    """Refuse what is no file with contents, before it is opened: opening a pipe would wait for ever.

    Raises:
        RecordingError: It is not there, can't be opened, is empty, or is a folder, pipe or device.
    """
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise RecordingError(f"{path}: this is a folder; give the files of the recordings in it" + _inside(path))
        if not stat.S_ISREG(status.st_mode):
            raise RecordingError(f"{path}: this is a pipe, socket or device; save the recording as a file first")
        with path.open("rb"):
            pass
    except (OSError, ValueError) as error:
        if isinstance(error, RecordingError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{path}: can't open this file: {reason}; check the path") from error
    if status.st_size == 0:
        raise RecordingError(f"{path}: this file is empty; give a recording with a header and one row a sample")


def checksum(path: pathlib.Path) -> str:
    """SHA-256 of a file; of a folder, as ROS 2 bags are, that of the names and checksums of its files."""
    if path.is_dir():
        inside = sorted(inner for inner in path.iterdir() if inner.is_file())
        lines = "".join(f"{checksum(inner)}  {inner.name}\n" for inner in inside)
        return hashlib.sha256(lines.encode()).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def unpacked(path: pathlib.Path) -> bytes:
    """The bytes of a text file, unpacked where it is gzip, bzip2, xz or a zip of one file, by its first bytes.

    Raises:
        RecordingError: It holds more than `MAX_BYTES`, or the archive can't be read.
    """
    with path.open("rb") as file:
        head = file.read(6)
    try:
        if head[:2] == b"PK":
            return _unzipped(path)
        opener = {b"\x1f\x8b": gzip.open, b"BZ": bz2.open, b"\xfd7": lzma.open}.get(head[:2], open)
        if opener is bz2.open and head[:3] != b"BZh":
            opener = open
        with opener(path, "rb") as file:
            return _bounded(file, path)
    except RecordingError:
        raise
    except Exception as error:  # whatever an unpacker makes of a broken archive
        raise RecordingError(f"{path}: can't unpack this file: {said(error)}; save or copy it again") from error


def _unzipped(path: pathlib.Path) -> bytes:
    with zipfile.ZipFile(path) as archive:
        members = [info for info in archive.infolist() if not info.is_dir()]
        if len(members) != 1:
            names = ", ".join(info.filename for info in members[:4]) + (" ..." if len(members) > 4 else "")
            raise RecordingError(f"{path}: this archive holds {len(members)} files ({names}); allowed is one table: "
                                 "unpack it and give the file")
        refuse_encrypted(members, path)
        with archive.open(members[0]) as file:
            return _bounded(file, path)


def refuse_encrypted(members: list[zipfile.ZipInfo], path: pathlib.Path) -> None:
    """Refuse an archive with a password."""
    if any(info.flag_bits & 1 for info in members):
        raise RecordingError(f"{path}: this archive is encrypted; save it without a password")


def _bounded(file: IO[bytes], path: pathlib.Path) -> bytes:
    pieces, size = [], 0
    while piece := file.read(PIECE):
        size += len(piece)
        if size > MAX_BYTES:
            raise RecordingError(f"{path}: holds more than {MAX_BYTES // 2**20} MB of text; cut it into shorter "
                                 "recordings, or save it as Parquet")
        pieces.append(piece)
    return b"".join(pieces)


def _inside(path: pathlib.Path) -> str:
    """What one probably meant by this folder."""
    if (path / "meta" / "info.json").is_file():
        return ", of a LeRobot dataset its data/chunk-000/*.parquet"
    return ""


def said(error: Exception) -> str:
    """What a library said, in one short line."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 200 else text[:197] + "..."
