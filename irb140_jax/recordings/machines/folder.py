"""Where the published recordings lie on this computer, and how to get them."""

import hashlib
import os
import pathlib

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.machines.sources import DERIVED, SOURCES

VARIABLE = "IRB140_RECORDINGS"


def recordings_folder(machine: str) -> pathlib.Path:
    """The folder with a machine's published files: $IRB140_RECORDINGS/<machine>, else ../shared/recordings/<machine>.

    Raises:
        RecordingError: It is in neither place; the message says how to get the files.
    """
    known = SOURCES | DERIVED
    if machine not in known:
        raise RecordingError(f"no published recordings of '{machine}' are known; allowed is {', '.join(known)}")
    checkout = pathlib.Path(__file__).resolve().parents[3]
    named = os.environ.get(VARIABLE)
    places = [pathlib.Path(named)] if named else [checkout.parent / "shared" / "recordings"]
    for place in places:
        if (place / machine).is_dir():
            return place / machine
    if machine in DERIVED:
        source = DERIVED[machine]
        raise RecordingError(
            f"the recordings of {machine} are not in {places[0]}; they were made from github.com/{source.repository}, "
            f"commit {source.commit[:10]}, as docs/recordings.md says; put them there, or set {VARIABLE}=FOLDER")
    source = SOURCES[machine]
    raise RecordingError(
        f"the published recordings of {machine} are not in {places[0]}; fetch them with `python -m "
        f"irb140_jax.recordings.machines.fetch FOLDER` (from github.com/{source.repository}, commit "
        f"{source.commit[:10]}; docs/recordings.md says more) and set {VARIABLE}=FOLDER")


def published_file(machine: str, name: str, folder: pathlib.Path | None = None) -> pathlib.Path:
    """A published file, checked against its SHA-256, so that figures made from it mean the same everywhere.

    Raises:
        RecordingError: It is missing or differs from the published one.
    """
    path = (folder or recordings_folder(machine)) / name
    source = (SOURCES | DERIVED)[machine]
    repository_path, sha256 = source.files[name]
    if not path.is_file():
        raise RecordingError(f"{path}: missing; it is {repository_path} of github.com/{source.repository} at "
                             f"commit {source.commit}: {source.url(name)}")
    came = hashlib.sha256(path.read_bytes()).hexdigest()
    if came != sha256:
        raise RecordingError(f"{path}: its SHA-256 is {came[:12]}..., the published file's is {sha256[:12]}...; fetch "
                             f"it again from {source.url(name)}")
    return path
