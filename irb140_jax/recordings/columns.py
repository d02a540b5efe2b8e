"""Which column of a file is which quantity, in which unit, on which side of the gear: a map, and what it does.

A channel is made in this order, and `docs/columns.md` has an example of every line:

    x = column of the file
    x = scale x                           unit, or a factor of one's own
    x = torque_constant x, rated_torque x A, % of rated
    x = x / gear_ratio, tau gear_ratio    from the motor to the joint
    q = C q_motor, tau = C^-T tau_motor   coupling
    x = sign (x - zero) + offset          zero for positions only
"""

import dataclasses
import difflib
from collections.abc import Iterable, Mapping

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.formats.options import FileOptions
from irb140_jax.recordings.units import CURRENTS, SHARES, UNITS

POSITIONS = ("q", "qdes")
MOTIONS = (*POSITIONS, "qd", "qddes", "qdd")
QUANTITIES = (*MOTIONS, "tau")


@dataclasses.dataclass(frozen=True)
class Line:
    """A line of the map.

    Attributes:
        text: As it stands in the file, for messages.
        star: Whether it speaks of every joint.
        values: Channel, by its contract name -> value.
    """

    text: str
    star: bool
    values: Mapping[str, float | str]


@dataclasses.dataclass(frozen=True)
class Coupling:
    """Joints that several motors move together: q = C q_motor, tau = C^-T tau_motor.

    Attributes:
        joints: Whose columns hold the motors', in the order of the matrix.
        matrix: C, shape (len(joints), len(joints)).
        channels: Quantities that are on the motors' side; None: all that the file has.
    """

    joints: tuple[str, ...]
    matrix: np.ndarray
    channels: tuple[str, ...] | None = None


@dataclasses.dataclass(frozen=True)
class ColumnMap:
    """What turns a file's columns into the contract's; see the module's head.

    Attributes:
        names: Lines of [columns]: contract name -> name in the file.
        numbers: Lines of the other sections, by the section's name.
        coupling: Or None.
        numbered: Whether joints are found by their number in the robot's own order.
        rate: Sampling rate [Hz] of a file without time column, else None.
        start, end: What part of the recording is used, in seconds after its first row.
        options: How the file itself is read.
        source: File name, for messages.
    """

    names: tuple[Line, ...] = ()
    numbers: Mapping[str, tuple[Line, ...]] = dataclasses.field(default_factory=dict)
    coupling: Coupling | None = None
    numbered: bool = False
    rate: float | None = None
    start: float = -np.inf
    end: float = np.inf
    options: FileOptions = FileOptions()
    source: str = "columns"

    def values(self, section: str) -> dict[str, float | str]:
        """Channel -> value of a section; a joint's own line beats the star's."""
        lines = self.names if section == "columns" else self.numbers.get(section, ())
        return {channel: value for line in sorted(lines, key=lambda line: not line.star)
                for channel, value in line.values.items()}  # fmt: skip


def renamed(table: Mapping[str, np.ndarray], columns: ColumnMap) -> dict[str, np.ndarray]:
    """The table under the contract's names; columns the map does not name keep theirs.

    Raises:
        RecordingError: The map names a column the table has not, or one column for two channels, or a line of it
            matches nothing.
    """
    names = _present(table, columns)
    _refuse_twice(names, columns)
    taken = set(names.values())
    # All at once, so that a map may exchange two columns.
    result = {name: table[source] for name, source in names.items()}
    result |= {name: values for name, values in table.items() if name not in taken and name not in result}
    for section, lines in columns.numbers.items():
        for line in lines:
            if not set(line.values) & set(result) and not (columns.rate and set(line.values) == {"t"}):
                first = next(iter(line.values), "")
                raise RecordingError(f"{columns.source}: [{section}] {line.text} matches no column of the recording; "
                                     f"{what_came(result)}{closest(first, result)}")
    return result


def _present(table: Mapping[str, np.ndarray], columns: ColumnMap) -> dict[str, str]:
    """Contract name -> name in the file, for those that are there; a star line may miss some joints, not all."""
    own = {name for line in columns.names if not line.star for name in line.values}
    found: dict[str, str] = {}
    for line in columns.names:
        wanted = {name: str(source) for name, source in line.values.items() if not line.star or name not in own}
        here = {name: source for name, source in wanted.items() if source in table}
        missing = next((source for source in wanted.values() if source not in table), None)
        if missing is not None and not (line.star and here):
            name = next(name for name, source in wanted.items() if source == missing)
            means = f", for {name} '{missing}'," if line.star else ","
            raise RecordingError(f"{columns.source}: [columns] {line.text}{means} but the recording has no such "
                                 f"column; {what_came(table)}{closest(missing, table)}")
        found |= here
    return found


def _refuse_twice(names: Mapping[str, str], columns: ColumnMap) -> None:
    """Refuse one column of the file for several channels, unless a coupling tells them apart."""
    coupled = columns.coupling.joints if columns.coupling else ()
    first: dict[str, str] = {}
    for name, source in names.items():
        if source in first and not (name.partition(".")[2] in coupled and first[source].partition(".")[2] in coupled):
            raise RecordingError(f"{columns.source}: [columns] gives column '{source}' to {first[source]} and to "
                                 f"{name}; every channel needs a column of its own: in a line for every joint "
                                 "write * for the joint's name or {n} for its number, as in \"q.*\" = \"pos_*\"")
        first.setdefault(source, name)


def scaled(
    table: Mapping[str, np.ndarray], columns: ColumnMap, stated: Mapping[str, str], notes: list[str]
) -> dict[str, np.ndarray]:
    """The table in SI units on the joint side, with a time column where the map gives a rate instead.

    Args:
        table: Numbers under the contract's names.
        columns: The map.
        stated: Channel -> unit, where the file itself states it; the map's own word beats it.
        notes: What was taken from the file's own words is appended here.
    """
    result = dict(table)
    scale = columns.values("scale")
    converted: dict[str, list[str]] = {}
    for channel in result:
        unit = scale.get(channel, stated.get(channel) if channel in _judged(result) else None)
        if channel not in scale and isinstance(unit, str) and UNITS.get(unit) != 1.0:
            converted.setdefault(unit, []).append(channel)
        with np.errstate(over="ignore", invalid="ignore"):  # broken numbers are found later, with their row
            factor = _factor(channel, unit, columns)
            result[channel] = result[channel] if factor == 1.0 else result[channel] * factor
    notes += [f"Converted from {unit}, by the file's own header: {', '.join(channels)}"
              for unit, channels in converted.items()]
    _to_joint_side(result, columns)
    if columns.coupling is not None:
        _uncouple(result, columns.coupling, columns.source)
    sign, zero, offset = (columns.values(section) for section in ("sign", "zero", "offset"))
    for channel in set(result) & {*sign, *zero, *offset}:
        x = result[channel] - float(zero.get(channel, 0.0))
        result[channel] = float(sign.get(channel, 1.0)) * x + float(offset.get(channel, 0.0))
    if columns.rate is not None and "t" not in result and result:
        result["t"] = np.arange(len(next(iter(result.values())))) / columns.rate
    return result


def _judged(table: Iterable[str]) -> set[str]:
    return {name for name in table if name == "t" or name.partition(".")[0] in QUANTITIES and "." in name}


def _factor(channel: str, unit: float | str | None, columns: ColumnMap) -> float:
    """What makes SI of a channel's numbers, at the side at which they were measured."""
    constant, rated = (columns.values(section).get(channel) for section in ("torque_constant", "rated_torque"))
    where = f"{columns.source}: {channel}"
    if unit in SHARES:
        if rated is None:
            raise RecordingError(f"{where} is in {unit}; give the torque that is 100 %, [rated_torque] \"{channel}\" = "
                                 "N m in the column map, from the motor's data sheet")
        return SHARES[str(unit)] * float(rated)
    if rated is not None:
        raise RecordingError(f"{where} has a rated_torque but its unit is no share of it; write [scale] \"{channel}\" "
                             "= \"% of rated\" or \"per mille of rated\"")
    if unit in CURRENTS:
        if constant is None:
            raise RecordingError(f"{where} is a current in {unit}; give what makes torque of it, [torque_constant] "
                                 f"\"{channel}\" = N m/A in the column map, from the motor's data sheet")
        return CURRENTS[str(unit)] * float(constant)
    if constant is not None and isinstance(unit, str):
        raise RecordingError(f"{where} has a torque_constant but is in {unit}; leave one of them out")
    return (UNITS[unit] if isinstance(unit, str) else 1.0 if unit is None else unit) * float(
        1.0 if constant is None else constant
    )


def _to_joint_side(table: dict[str, np.ndarray], columns: ColumnMap) -> None:
    for channel, ratio in columns.values("gear_ratio").items():
        if channel in table:
            ratio = float(ratio)
            table[channel] = table[channel] * (ratio if channel.startswith("tau.") else 1.0 / ratio)


def _uncouple(table: dict[str, np.ndarray], coupling: Coupling, source: str) -> None:
    """Motors' channels to joints': motion by C, torque by the inverse of its transpose, since power is the same."""
    for quantity in coupling.channels or QUANTITIES:
        channels = [f"{quantity}.{joint}" for joint in coupling.joints]
        missing = [channel for channel in channels if channel not in table]
        if len(missing) == len(channels) and coupling.channels is None:
            continue
        if missing:
            raise RecordingError(f"{source}: [coupling] needs {missing[0]}, which the recording has not; give it in "
                                 "[columns], or name in channels = [...] what is on the motors' side")
        C = coupling.matrix if quantity != "tau" else np.linalg.inv(coupling.matrix).T
        joints = np.stack([table[channel] for channel in channels], axis=1) @ C.T
        table.update({channel: joints[:, i] for i, channel in enumerate(channels)})


def what_came(names: Iterable[str], most: int = 14) -> str:
    """ "the columns are a, b, c ..." for messages, at most `most` names."""
    names = list(names)
    return f"the columns are {', '.join(names[:most])}{', ...' if len(names) > most else ''}"


def closest(name: str, names: Iterable[str]) -> str:
    """ "; did you mean 'x'?" for messages, empty where nothing is near."""
    plain = {other.casefold().strip(): other for other in names}
    near = difflib.get_close_matches(name.casefold(), plain, n=1, cutoff=0.6)
    return f"; did you mean '{plain[near[0]]}'?" if near else ""
