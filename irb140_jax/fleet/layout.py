"""Which units a folder holds: robots, days or recordings, each with what belongs to it."""

import dataclasses
import pathlib
import re
from collections.abc import Iterable

from irb140_jax.errors import InputError

TABLES = (".csv", ".tsv", ".parquet", ".npz", ".mat", ".bag", ".mcap", ".db3")
PACKED = (".gz", ".bz2", ".xz", ".zip")
MODELS = (".xml", ".urdf")
MAPS = (".toml",)
BAG = "metadata.yaml"  # in the folder that is a ROS 2 bag


@dataclasses.dataclass(frozen=True)
class Unit:
    """One row of the table: recordings that are diagnosed together.

    Attributes:
        name: Of its folder, or of its file without the ending.
        recordings: Files, in the order of their names.
        robot: The model; None is the IRB 140.
        columns: The map of the recordings' columns, or None.
        problem: Why it can't be diagnosed; empty where nothing is wrong so far.
    """

    name: str
    recordings: tuple[pathlib.Path, ...] = ()
    robot: pathlib.Path | None = None
    columns: pathlib.Path | None = None
    problem: str = ""

    @property
    def files(self) -> tuple[pathlib.Path, ...]:
        """Everything that it is made of."""
        return (*self.recordings, *(path for path in (self.robot, self.columns) if path))


def units_in(
    folder: pathlib.Path, robot: pathlib.Path | None = None, columns: pathlib.Path | None = None
) -> list[Unit]:
    """The units of a folder, by name.

    Each folder in it is a unit of all recordings in that folder, and each recording beside those folders is a unit of
    its own.  A model (.xml, .urdf) or a column map (.toml) in a unit's folder is for that unit, one in `folder` is for
    all that have none of their own.

    Args:
        folder: The folder.
        robot: Model for units without one, rather than that in `folder`.
        columns: Column map likewise.

    Raises:
        InputError: It is no folder, holds no unit, or two units have one name.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: this is no folder; name one that holds a folder for each robot, or recordings")
    inside = [path for path in sorted(folder.iterdir()) if path.name[0] not in "._"]
    robot = robot or _only(inside, MODELS, folder, "--robot")
    columns = columns or _only(inside, MAPS, folder, "--columns")
    units = [
        unit_of(path, robot, columns) for path in inside if _is_recording(path) or path.is_dir() and not _is_other(path)
    ]
    units.sort(key=lambda unit: unit.name)
    for one, next_ in zip(units, units[1:], strict=False):
        if one.name.casefold() == next_.name.casefold():
            raise InputError(f"{folder}: two units are called {one.name!r}; rename the file or the folder of one")
    if not units:
        raise InputError(f"{folder}: holds no recording ({', '.join(TABLES)}) and no folder with one; put the "
                         "recordings of each robot into a folder of its own in there")  # fmt: skip
    return units


def shard_of(units: Iterable[Unit], words: str) -> list[Unit]:
    """Every N-th unit, from the i-th on, of "i/N".

    Raises:
        InputError: Not of this form, or i is not in 1 ... N.
    """
    found = re.fullmatch(r"(\d+)/(\d+)", words)
    i, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= i <= count:
        raise InputError(f"--shard {words}: allowed is i/N with i from 1 to N, as in --shard 2/8")
    return [unit for k, unit in enumerate(units) if k % count == i - 1]


def unit_of(path: pathlib.Path, robot: pathlib.Path | None = None, columns: pathlib.Path | None = None) -> Unit:
    """The unit of a recording, or of a folder of recordings.

    Args:
        path: The recording or the folder.
        robot: Model where the folder holds none.
        columns: Column map likewise.
    """
    if not path.is_dir():
        return Unit(_stem(path), (path,), robot, columns)
    if (path / BAG).is_file():
        return Unit(path.name, (path,), robot, columns)
    try:
        inside = sorted(inner for inner in path.iterdir() if inner.name[0] not in "._")
        robot = _only(inside, MODELS, path, "") or robot
        columns = _only(inside, MAPS, path, "") or columns
    except (OSError, InputError) as error:
        return Unit(path.name, problem=str(error))
    recordings = tuple(inner for inner in inside if _is_recording(inner))
    problem = "" if recordings else f"{path}: holds no recording ({', '.join(TABLES)}); put some in, or remove it"
    return Unit(path.name, recordings, robot, columns, problem)


def _only(inside: Iterable[pathlib.Path], endings: tuple[str, ...], folder: pathlib.Path, option: str):
    """The file with one of these endings; None if there is none."""
    found = [path for path in inside if path.suffix.lower() in endings and path.is_file()]
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        say = f", or say which with {option} FILE" if option else ""
        raise InputError(f"{folder}: holds {len(found)} files of which one is wanted ({names}); leave one{say}")
    return found[0] if found else None


def _is_recording(path: pathlib.Path) -> bool:
    if path.is_dir():
        return (path / BAG).is_file()
    table = path.with_suffix("") if path.suffix.lower() in PACKED else path
    return table.suffix.lower() in TABLES and path.is_file()


def _is_other(path: pathlib.Path) -> bool:
    """Whether a folder holds files, and none of a unit's, such as meshes."""
    try:
        inside = list(path.iterdir())
    except OSError:
        return False
    ours = any(inner.suffix.lower() in (*MODELS, *MAPS) or _is_recording(inner) for inner in inside)
    return any(inner.is_file() for inner in inside) and not ours


def _stem(path: pathlib.Path) -> str:
    return (path.with_suffix("") if path.suffix.lower() in PACKED else path).stem
