"""The column map as a TOML file: read, spread over the joints, and every line of it checked."""

import codecs
import dataclasses
import math
import pathlib
import re
import tomllib
from collections.abc import Callable, Iterable
from typing import Any, TypeGuard

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.columns import MOTIONS, POSITIONS, QUANTITIES, ColumnMap, Coupling, Line, closest
from irb140_jax.recordings.formats.opened import check_regular
from irb140_jax.recordings.formats.options import FileOptions
from irb140_jax.recordings.units import CURRENTS, SHARES, UNITS, known_unit

# What reads a value: the value, the joint if the line speaks of every joint, and where it stands, for messages.
Reader = Callable[[Any, str | None, str], Any]
LARGEST = 2**20  # bytes of a map
# Sections of numbers, and the channels that a joint's bare name stands for there.
SECTIONS = {"scale": (), "offset": (), "gear_ratio": QUANTITIES, "torque_constant": ("tau",), "rated_torque": ("tau",),
            "sign": QUANTITIES, "zero": POSITIONS, "kp": ("qdes",), "kd": ("qdes",), "torque_limit": ("qdes",),
            "command_delay": ("qdes",)}  # fmt: skip
DRIVE = ("kp", "kd", "torque_limit", "command_delay")  # sections that speak of the drive, not of a channel
SETTINGS = ("rate", "from", "to", "first_number", "joints", "encoding", "separator", "decimal", "comment",
            "time_format", "topic", "episode")  # fmt: skip


def read_column_map(
    path: str | pathlib.Path, joint_names: Iterable[str], known: Iterable[str] | None = None
) -> ColumnMap:
    """Read a column map for a robot with these joints.

    Args:
        path: The file.
        joint_names: The joints that are read.
        known: Every joint of the model, in its order, those that are held included: what the map says of them is left
            aside, and {n} counts them.  By default those that are read, and those that the map lists.

    Raises:
        RecordingError: The file is missing, is not TOML, or names a section, quantity, joint or unit there is not.
    """
    path, read = pathlib.Path(path), tuple(joint_names)
    content = _content(path)
    listed = content.get("joints")
    # Without being told, whoever lists the joints knows which there are.
    more = [name for name in listed if isinstance(name, str)] if isinstance(listed, list) else []
    joints = tuple(dict.fromkeys([*read, *more])) if known is None else tuple(known)
    for key in content:
        if key not in (*SECTIONS, *SETTINGS, "columns", "coupling"):
            raise RecordingError(f"{path}: unknown section '{key}'{closest(key, [*SECTIONS, *SETTINGS])}; allowed are "
                                 f"[columns], [coupling], {', '.join(f'[{s}]' for s in SECTIONS)}, and above them "
                                 f"{', '.join(SETTINGS)}")
    setting = lambda key, allowed, words: _setting(content, key, allowed, words, path)  # noqa: E731
    finite = lambda x: _is_number(x) and math.isfinite(x)  # noqa: E731
    whole = lambda x: isinstance(x, int) and not isinstance(x, bool) and x >= 0  # noqa: E731
    rate = setting("rate", lambda x: finite(x) and x > 0, "a positive number of samples a second")
    start = setting("from", finite, "seconds after the first row")
    end = setting("to", finite, "seconds after the first row")
    if start is not None and end is not None and end <= start:
        raise RecordingError(f"{path}: from = {start:g} is not before to = {end:g}; both are seconds after the first "
                             "row")
    first = setting("first_number", whole, "a whole number, mostly 0 or 1")
    order = _joint_list(content.get("joints"), joints, f"{path}: joints") if "joints" in content else joints
    numbers = {joint: i + (1 if first is None else first) for i, joint in enumerate(order)}
    sections = {section: _lines(content, section, joints, path, _number(section)) for section in SECTIONS}
    coupling = _coupling(content.get("coupling"), joints, path)
    if coupling is not None and not set(coupling.joints) <= set(read):
        coupling = None if not set(coupling.joints) & set(read) else coupling
    held = set(joints) - set(read)
    own = lambda lines: tuple(line for line in (_without(line, held) for line in lines) if line.values)  # noqa: E731
    return ColumnMap(
        names=own(_names(content, joints, numbers, path)),
        numbers={section: own(lines) for section, lines in sections.items() if own(lines)},
        coupling=coupling, numbered=_is_numbered(content), rate=rate,
        start=-np.inf if start is None else start, end=np.inf if end is None else end,
        options=_options(content, path), source=str(path),
    )  # fmt: skip


def _without(line: Line, held: set[str]) -> Line:
    """The line without what it says of joints that are held."""
    kept = {channel: value for channel, value in line.values.items() if channel.partition(".")[2] not in held}
    return dataclasses.replace(line, values=kept)


def _is_numbered(content: dict[str, Any]) -> bool:
    """Whether joints are found by their number in the robot's own order."""
    return "joints" not in content and any("{n" in str(name) for name in dict(content.get("columns", {})).values())


def _content(path: pathlib.Path) -> dict[str, Any]:
    try:
        check_regular(path)
        if path.stat().st_size > LARGEST:
            raise RecordingError(f"{path}: this is no column map, it is longer than a million letters")
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except RecordingError as error:
        if "empty" in str(error):
            return {}
        raise RecordingError(f"{error} (a column map is a TOML file with a [columns] section)") from error
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text in UTF-8"
        raise RecordingError(f"{path}: can't read this column map: {reason}; give a TOML file with a [columns] "
                             "section") from error
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise RecordingError(f"{path}: this column map is not TOML: {error}; quote names that hold a dot, as in "
                             '"q.joint_1" = "pos1"') from error


def _setting(content: dict, key: str, allowed: Callable[[Any], bool], words: str, path: pathlib.Path) -> Any:
    value = content.get(key)
    if value is not None and not allowed(value):
        raise RecordingError(f"{path}: {key} is {value!r}; allowed is {words}")
    return value


def _options(content: dict, path: pathlib.Path) -> FileOptions:
    text = lambda x: isinstance(x, str) and bool(x)  # noqa: E731
    setting = lambda key, allowed, words: _setting(content, key, allowed, words, path)  # noqa: E731
    encoding = setting("encoding", lambda x: text(x) and _is_encoding(x),
                       "a name such as \"utf-8\", \"utf-16\", \"latin-1\", \"cp1252\"")  # fmt: skip
    one = lambda x: text(x) and (len(x) == 1 or x == "blanks") and x not in '"\r\n'  # noqa: E731
    episode = setting("episode", lambda x: isinstance(x, int) and not isinstance(x, bool) and x >= 0, "a whole number")
    return FileOptions(
        encoding=encoding, separator=setting("separator", one, "one sign such as \";\", or \"blanks\""),
        decimal=setting("decimal", lambda x: x in (".", ","), "\".\" or \",\""),
        comment=setting("comment", lambda x: text(x) and len(x) == 1, "one sign such as \"#\""),
        time_format=setting("time_format", text, "a format of strptime such as \"%d.%m.%Y %H:%M:%S.%f\""),
        topic=setting("topic", text, "the name of a topic such as \"/joint_states\""), episode=episode,
    )  # fmt: skip


def _is_encoding(name: str) -> bool:
    try:
        return codecs.lookup(name)._is_text_encoding  # pyright: ignore[reportAttributeAccessIssue]
    except (LookupError, ValueError):
        return False


def _names(content: dict, joints: tuple[str, ...], numbers: dict[str, int], path: pathlib.Path) -> tuple[Line, ...]:
    """Lines of [columns], * and {n} filled in for every joint."""

    def name(value: Any, joint: str | None, where: str) -> str:
        if not isinstance(value, str) or not value:
            raise RecordingError(f"{where} = {value!r}; allowed is the name of a column, in quotes")
        if joint is None:
            return value
        if re.search(r"\{n[:}]", value) and joint not in numbers:
            return ""  # has no number, so no column
        filled = re.sub(r"\{n(?::(0?\d))?\}", lambda m: format(numbers[joint], (m[1] or "") + "d"), value)
        return filled.replace("*", joint)

    return _lines(content, "columns", joints, path, name)


def _lines(
    content: dict, section: str, joints: tuple[str, ...], path: pathlib.Path, read: Reader
) -> tuple[Line, ...]:
    """The lines of a section, each spread over the channels that it speaks of."""
    where = f"{path}: [{section}]"
    if not isinstance(content.get(section, {}), dict):
        raise RecordingError(f"{where} is {content[section]!r}; allowed is a section of lines \"name\" = value")
    return tuple(_line(name, value, SECTIONS.get(section, ()), joints, where, read)
                 for name, value in content.get(section, {}).items())  # fmt: skip


def _line(
    name: str, value: Any, bare: tuple[str, ...], joints: tuple[str, ...], where: str, read: Reader
) -> Line:
    if isinstance(value, dict):
        raise RecordingError(f"{where} {name}: a name with a dot must be quoted, as in "
                             f"\"{name}.{next(iter(value), '')}\" = ...")
    quantity, _, joint = name.rpartition(".") if name.endswith(".*") else name.partition(".")
    if bare and (name == "*" or name in joints):
        quantities, joint = bare, name
    elif bare and quantity not in bare:
        raise RecordingError(f"{where} {name}: allowed is a joint, * for every joint, or one channel such as "
                             f"\"{bare[-1]}.{joints[0]}\"; the joints are {', '.join(joints)}")
    else:
        quantities = (quantity,)
    if quantity in QUANTITIES and joint and joint != "*" and joint not in joints:
        raise RecordingError(f"{where} {name}: the robot has no joint '{joint}'; its joints are {', '.join(joints)}"
                             f"{closest(joint, joints)}")
    said = f"{name} = {value!r}" if not isinstance(value, str) else f"{name} = '{value}'"
    spot = f"{where} {name}"
    if joint == "*":
        channels = {f"{q}.{j}": read(value, j, spot) for q in quantities for j in joints}
        return Line(said, True, {channel: v for channel, v in channels.items() if v != ""})
    if name in joints and bare:
        return Line(said, False, {f"{q}.{name}": read(value, None, spot) for q in quantities})
    return Line(said, False, {name: read(value, None, spot)})


def _number(section: str) -> Reader:
    """What reads a value of this section."""

    def scale(value: Any, joint: str | None, where: str) -> float | str:
        unit = known_unit(value) if isinstance(value, str) else None
        if unit is not None:
            return unit
        if not _is_number(value) or not math.isfinite(value) or value == 0:
            raise RecordingError(f"{where} = {value!r}; allowed is a number, not 0, or one of "
                                 f"{', '.join((*UNITS, *CURRENTS, *SHARES))}")
        return float(value)

    def length(value: Any, joint: str | None, where: str) -> float:
        """A number in our unit, or with its own: "90 deg"."""
        parts = value.split(maxsplit=1) if isinstance(value, str) else ()
        if len(parts) == 2 and _float(parts[0]) is not None and known_unit(parts[1]) in UNITS:
            return float(parts[0]) * UNITS[str(known_unit(parts[1]))]
        if not _is_number(value) or not math.isfinite(value):
            raise RecordingError(f"{where} = {value!r}; allowed is a number in SI units, or one with its unit such as "
                                 "\"90 deg\"")
        return float(value)

    def sign(value: Any, joint: str | None, where: str) -> float:
        if not _is_number(value) or value not in (1, -1):
            raise RecordingError(f"{where} = {value!r}; allowed is 1 or -1")
        return float(value)

    def ratio(value: Any, joint: str | None, where: str) -> float:
        if not _is_number(value) or not math.isfinite(value) or value == 0:
            raise RecordingError(f"{where} = {value!r}; allowed is a number, not 0; a negative one turns the direction "
                                 "round")
        return float(value)

    def gain(value: Any, joint: str | None, where: str) -> float:
        if not _is_number(value) or not math.isfinite(value) or value < 0:
            raise RecordingError(f"{where} = {value!r}; allowed is a number not below 0, in SI units on the joint side")
        return float(value)

    readers: dict[str, Reader] = {"scale": scale, "offset": length, "zero": length, "sign": sign}
    return readers.get(section, gain if section in DRIVE else ratio)


def _coupling(section: Any, joints: tuple[str, ...], path: pathlib.Path) -> Coupling | None:
    if section is None:
        return None
    where = f"{path}: [coupling]"
    if not isinstance(section, dict) or not {"joints", "matrix"} <= set(section) <= {"joints", "matrix", "channels"}:
        raise RecordingError(f"{where} needs joints = [names] and matrix = [[rows]], and may have channels = "
                             "[quantities]")
    names = _joint_list(section["joints"], joints, f"{where} joints")
    try:
        matrix = np.array(section["matrix"], dtype=float)
    except (TypeError, ValueError):
        matrix = np.zeros((0, 0))
    if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all():
        raise RecordingError(f"{where} matrix has to be {len(names)} rows of {len(names)} numbers, one row a joint and "
                             "one column a motor")
    if np.linalg.cond(matrix) > 1e6:
        raise RecordingError(f"{where} matrix can't be inverted, so no torque follows from it; check its rows")
    channels = section.get("channels")
    if channels is not None and not (isinstance(channels, list) and channels and set(map(str, channels)) <= {
            *QUANTITIES}):  # fmt: skip
        raise RecordingError(f"{where} channels is {channels!r}; allowed are {', '.join((*MOTIONS, 'tau'))}")
    return Coupling(names, matrix, None if channels is None else tuple(channels))


def _joint_list(value: Any, joints: tuple[str, ...], where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or len({str(v) for v in value}) != len(value) or not set(
            map(str, value)) <= set(joints):  # fmt: skip
        raise RecordingError(f"{where} is {value!r}; allowed is a list of different joints, of {', '.join(joints)}")
    return tuple(value)


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _float(text: str) -> float | None:
    try:
        return float(text) if math.isfinite(float(text)) else None
    except ValueError:
        return None
