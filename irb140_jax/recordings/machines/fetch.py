"""`python -m irb140_jax.recordings.machines.fetch FOLDER`: download the published recordings, checked by SHA-256."""

import hashlib
import pathlib
import sys
import urllib.request

from irb140_jax.errors import InputError, RecordingError
from irb140_jax.recordings.machines.sources import SOURCES


def fetch(folder: pathlib.Path) -> None:
    """Download into FOLDER/<machine>/ what is not there yet.

    Raises:
        RecordingError: A download fails or does not have the published content.
    """
    for machine, source in SOURCES.items():
        for name, (_, sha256) in source.files.items():
            path = folder / machine / name
            if path.exists():
                continue
            try:
                with urllib.request.urlopen(source.url(name), timeout=60) as answer:
                    content = answer.read()
            except OSError as error:
                raise RecordingError(f"can't download {source.url(name)}: {error}; fetch it by other means to "
                                     f"{path}") from error
            if hashlib.sha256(content).hexdigest() != sha256:
                raise RecordingError(f"{source.url(name)}: not the published content (SHA-256 differs); nothing was "
                                     "written")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m irb140_jax.recordings.machines.fetch FOLDER")
    try:
        fetch(pathlib.Path(sys.argv[1]))
    except InputError as problem:
        print(problem, file=sys.stderr)
        sys.exit(2)
