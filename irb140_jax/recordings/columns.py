"""Which column of a file is which quantity: the `--columns FILE.toml` of the command line.

    rate = 5000.0                # only where the file has no time column [Hz]

    [columns]                    # our name = name in the file; * stands for every joint's name
    "t" = "time"
    "q.shoulder" = "pos_meas1"
    "tau.*" = "torque_*"

    [scale]                      # ours = scale * file + offset; a number or a unit
    "q.*" = "deg"
    "tau.shoulder" = -1.0

    [offset]
    "q.shoulder" = 1.5708
"""

import dataclasses
import difflib
import math
import pathlib
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from irb140_jax.errors import RecordingError

# Factors to SI, by the word one may write instead of the number.
UNITS = {
    "deg": math.pi / 180, "rad": 1.0, "rev": 2 * math.pi, "rpm": 2 * math.pi / 60, "deg/s": math.pi / 180,
    "mrad": 1e-3, "mm": 1e-3, "m": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "mN m": 1e-3, "N m": 1.0,
}
QUANTITIES = ("q", "qd", "qdd", "tau")


@dataclasses.dataclass(frozen=True)
class ColumnMap:
    """Names, scales and offsets that turn a file's columns into the contract's; see the module's head.

    Attributes:
        names: Contract name -> name in the file.
        scale: Contract name -> factor to SI.
        offset: Contract name -> what is added after scaling, SI.
        rate: Sampling rate [Hz] of a file without time column, else None.
        source: File name, for messages.
    """

    names: Mapping[str, str] = dataclasses.field(default_factory=dict)
    scale: Mapping[str, float] = dataclasses.field(default_factory=dict)
    offset: Mapping[str, float] = dataclasses.field(default_factory=dict)
    rate: float | None = None
    source: str = "columns"


def read_column_map(path: str | pathlib.Path, joint_names: Iterable[str]) -> ColumnMap:
    """Read a column map for a robot with these joints.

    Raises:
        RecordingError: The file is missing, is not TOML, or names a section, quantity, joint or unit there is not.
    """
    path, joints = pathlib.Path(path), tuple(joint_names)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: can't read this column map: {_reason(error)}; give a TOML file with a [columns] "
                             "section") from error
    except tomllib.TOMLDecodeError as error:
        raise RecordingError(f"{path}: this column map is not TOML: {error}; quote names that hold a dot, as in "
                             '"q.joint_1" = "pos1"') from error
    for section in content:
        if section not in ("columns", "scale", "offset", "rate"):
            raise RecordingError(f"{path}: unknown section '{section}'; allowed are [columns], [scale], [offset] and "
                                 "rate")
    rate = content.get("rate")
    if rate is not None and not (isinstance(rate, int | float) and rate > 0):
        raise RecordingError(f"{path}: rate is {rate!r}; allowed is a positive number of samples a second")
    names = _expanded(content.get("columns", {}), joints, f"{path}: [columns]")
    for name, source in names.items():
        if not isinstance(source, str):
            raise RecordingError(f"{path}: [columns] {name} = {source!r}; allowed is the name of a column, in quotes")
    factor = lambda section: {  # noqa: E731
        name: _factor(value, f"{path}: [{section}] {name}")
        for name, value in _expanded(content.get(section, {}), joints, f"{path}: [{section}]").items()
    }
    return ColumnMap(names, factor("scale"), factor("offset"), rate, str(path))


def renamed(table: Mapping[str, np.ndarray], columns: ColumnMap) -> dict[str, np.ndarray]:
    """The table under the contract's names; columns the map does not name keep theirs.

    Raises:
        RecordingError: The map names a column the table has not.
    """
    for name, source in columns.names.items():
        if source not in table:
            raise RecordingError(f"{columns.source}: [columns] {name} = '{source}', but the recording has no such "
                                 f"column; {what_came(table)}{closest(source, table)}")
    taken = set(columns.names.values())
    # All at once, so that a map may exchange two columns.
    result = {name: table[source] for name, source in columns.names.items()}
    return result | {name: values for name, values in table.items() if name not in taken and name not in result}


def scaled(table: Mapping[str, np.ndarray], columns: ColumnMap) -> dict[str, np.ndarray]:
    """The table in SI units, ours = scale * theirs + offset, with a time column where the map gives a rate instead."""
    result = dict(table)
    for name in {*columns.scale, *columns.offset} & set(result):
        result[name] = result[name] * columns.scale.get(name, 1.0) + columns.offset.get(name, 0.0)
    if columns.rate is not None and "t" not in result and result:
        result["t"] = np.arange(len(next(iter(result.values())))) / columns.rate
    return result


def what_came(names: Iterable[str], most: int = 14) -> str:
    """ "the columns are a, b, c ..." for messages, at most `most` names."""
    names = list(names)
    return f"the columns are {', '.join(names[:most])}{', ...' if len(names) > most else ''}"


def closest(name: str, names: Iterable[str]) -> str:
    """ "; did you mean 'x'?" for messages, empty where nothing is near."""
    plain = {other.casefold().strip(): other for other in names}
    near = difflib.get_close_matches(name.casefold(), plain, n=1, cutoff=0.6)
    return f"; did you mean '{plain[near[0]]}'?" if near else ""


def _expanded(section: Any, joints: tuple[str, ...], where: str) -> dict[str, Any]:
    """The section with * replaced by each joint's name; a joint's own line beats the star's."""
    if not isinstance(section, dict):
        raise RecordingError(f"{where} is {section!r}; allowed is a section of lines \"name\" = value")
    result: dict[str, Any] = {}
    for name, value in section.items():
        if isinstance(value, dict):
            raise RecordingError(f"{where} {name}: a name with a dot must be quoted, as in "
                                 f"\"{name}.{next(iter(value), '')}\" = ...")
        if name.endswith(".*"):
            for joint in joints:
                filled = value.replace("*", joint) if isinstance(value, str) else value
                result.setdefault(name[:-1] + joint, filled)
    for name, value in section.items():
        if name.endswith(".*"):
            continue
        quantity, _, joint = name.partition(".")
        if quantity in QUANTITIES and joint and joint not in joints:
            raise RecordingError(f"{where} {name}: the robot has no joint '{joint}'; its joints are "
                                 f"{', '.join(joints)}")
        result[name] = value
    return result


def _factor(value: Any, where: str) -> float:
    if isinstance(value, str) and value in UNITS:
        return UNITS[value]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RecordingError(f"{where} = {value!r}; allowed is a number or one of {', '.join(UNITS)}")
    return float(value)


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else "it is not text in UTF-8"
