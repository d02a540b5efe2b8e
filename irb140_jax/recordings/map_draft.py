"""A column map to start from, as commented TOML: what was guessed, why, and what to replace."""

import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from irb140_jax.recordings.columns import ColumnMap
from irb140_jax.recordings.units import CURRENTS, SHARES, UNITS

if TYPE_CHECKING:
    from irb140_jax.recordings.inspection import Channel

QUANTITIES = ("q", "qd", "qdd", "tau", "qdes")
ESTIMATED = ("estimated with the nominal model: put the data sheet's value here.  What is estimated so hides a wrong",
             "mass or motor constant: a diagnosis can't find it any more.")  # fmt: skip


def drafted_map(
    source: str, time: str, time_unit: str, channels: Mapping[str, "Channel"], joints: Sequence[str], given: ColumnMap
) -> str:
    """The text of the map.

    Args:
        source: Name of the recording.
        time: Its time column, or "".
        time_unit: s, ms, us, ns, "text" or "".
        channels: Contract name -> channel.
        joints: Of the robot, in its order; empty where there is none.
        given: The map that was used for a start: how the file is read is taken from it.
    """
    first, names = _names(channels, joints)
    lines = [f"# Column map for {source}, guessed from names and numbers: check every line.  See docs/columns.md.", ""]
    numbered = any("{n" in line for line in names)
    lines += _settings(given, first if numbered else 1, joints if numbered else ())
    if not time:
        lines += ["# No time column was found.", "# rate = 250.0               # samples a second", ""]
    lines += ["[columns]"]
    if time and time != "t":
        lines += [f"t = {_quoted(time)}"]
    lines += [*names, ""]
    scale = [f't = "{time_unit}"'] if time_unit in ("ms", "us", "ns") else []
    for quantity in QUANTITIES:
        scale += _starred(quantity, {n: c.likely.unit for n, c in channels.items() if _needs_scale(n, c)}, channels)
    own = {name: c.likely.constants["scale"] for name, c in channels.items() if "scale" in c.likely.constants}
    scale += [line for name, value in own.items() for line in
              (f"# {name}: {channels[name].likely.why}; {ESTIMATED[0]}", f"# {ESTIMATED[1]}",
               f"{_quoted(name)} = {value:.4g}")]  # fmt: skip
    lines += ["[scale]", *scale, ""] if scale else []
    for section in ("torque_constant", "rated_torque", "gear_ratio"):
        lines += _constants(section, channels)
    lines += [f"# {name}: {doubt}" for name, c in channels.items() for doubt in c.doubts]
    return "\n".join(lines).rstrip() + "\n"


def _settings(given: ColumnMap, first: int, joints: Sequence[str]) -> list[str]:
    options = {name: value for name, value in dataclasses.asdict(given.options).items() if value is not None}
    if given.rate is not None:
        options["rate"] = given.rate
    if first != 1:
        options["first_number"] = first
    if joints:
        options["joints"] = json.dumps(list(joints), ensure_ascii=False)
    quoted = {name: value if name == "joints" else _quoted(value) if isinstance(value, str) else value
              for name, value in options.items()}  # fmt: skip
    lines = [f"{name} = {value}" for name, value in quoted.items()]
    return [*lines, ""] if lines else []


def _names(channels: Mapping[str, "Channel"], joints: Sequence[str]) -> tuple[int, list[str]]:
    """The lines of [columns], shortened with * or {n} where all joints are named alike, and the first number."""
    first, lines = 1, []
    for quantity in QUANTITIES:
        own = {name: c for name, c in channels.items() if name.partition(".")[0] == quantity}
        if not own or all(name == c.column for name, c in own.items()):
            continue
        pattern, start = _pattern(own, joints)
        if pattern is not None:
            first = start if "{n" in pattern else first
            lines.append(f"{_quoted(quantity + '.*')} = {_quoted(pattern)}")
        else:
            lines += [f"{_quoted(name)} = {_quoted(c.column)}" for name, c in own.items()]
        others = sorted({other for c in own.values() for other in c.others})
        if others:
            lines.append(f"# or: {', '.join(others[:8])}{' ...' if len(others) > 8 else ''}")
    return first, lines


def _pattern(own: Mapping[str, "Channel"], joints: Sequence[str]) -> tuple[str | None, int]:
    """The one name that stands for all joints' columns, if there is one."""
    of = {name.partition(".")[2]: c.column for name, c in own.items()}
    if not joints or list(of) != list(joints) or len(of) < 2:
        return None, 1
    stars = {column.replace(joint, "*") for joint, column in of.items() if joint in column and "*" not in column}
    if len(stars) == 1 and len([1 for joint, column in of.items() if joint in column]) == len(of):
        pattern = stars.pop()
        if all(pattern.replace("*", joint) == column for joint, column in of.items()):
            return pattern, 1
    for number in re.finditer(r"\d+", next(iter(of.values()))):
        column, start = next(iter(of.values())), int(number[0])
        digits = f":0{len(number[0])}" if number[0].startswith("0") and len(number[0]) > 1 else ""
        pattern = column[: number.start()] + "{n" + digits + "}" + column[number.end() :]
        width = len(number[0]) if digits else 0
        expected = [column[: number.start()] + str(start + i).zfill(width) + column[number.end() :]
                    for i in range(len(of))]  # fmt: skip
        if expected == list(of.values()) and "*" not in column and start in (0, 1):
            return pattern, start
    return None, 1


def _needs_scale(name: str, channel: "Channel") -> bool:
    unit = channel.likely.unit
    return unit in CURRENTS or unit in SHARES or (unit in UNITS and UNITS[unit] != 1.0)


def _starred(quantity: str, units: Mapping[str, str], channels: Mapping[str, "Channel"]) -> list[str]:
    """One line for all joints where their units are the same, else a line each; with what says so."""
    own = {name: unit for name, unit in units.items() if name.partition(".")[0] == quantity}
    if not own:
        return []
    everyone = [name for name in channels if name.partition(".")[0] == quantity]
    why = {channels[name].likely.why for name in own}
    if len(own) == len(everyone) and len(set(own.values())) == 1:
        said = f"  # {next(iter(why))}" if len(why) == 1 else ""
        return [f"{_quoted(quantity + '.*')} = {_quoted(next(iter(own.values())))}{said}"]
    return [f"{_quoted(name)} = {_quoted(unit)}  # {channels[name].likely.why}" for name, unit in own.items()]


def _constants(section: str, channels: Mapping[str, "Channel"]) -> list[str]:
    """The estimated constants of a section, or a line to fill in where nothing tells them."""
    values = {name: c for name, c in channels.items() if section in c.likely.constants}
    kinds = {"torque_constant": CURRENTS, "rated_torque": SHARES, "gear_ratio": {}}
    empty = [name for name, c in channels.items() if c.likely.unit in kinds[section] and name not in values]
    if not values and not empty:
        return []
    unit = {"torque_constant": "N m/A of the motor, times the gear ratio", "rated_torque": "N m at the joint",
            "gear_ratio": "motor turns per turn of the joint"}[section]  # fmt: skip
    lines = [f"[{section}]  # {unit}"] + ([f"# {line}" for line in ESTIMATED] if values else [])
    lines += [f"{_quoted(name)} = {c.likely.constants[section]:.4g}  # {c.likely.why}" for name, c in values.items()]
    return lines + [f"# {_quoted(name)} =   # fill in" for name in empty] + [""]


def _quoted(text: str) -> str:
    """A TOML string: its escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
