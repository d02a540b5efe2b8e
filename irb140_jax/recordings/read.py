"""A file to a checked `Recording`: the way in for everything a user measured."""

import dataclasses
import os
import pathlib
import re
from typing import Literal

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings import repair
from irb140_jax.recordings.check import check_motion, check_times
from irb140_jax.recordings.check_model import check_against_model
from irb140_jax.recordings.column_file import read_column_map
from irb140_jax.recordings.columns import ColumnMap, closest, renamed, scaled, what_came
from irb140_jax.recordings.commands import check_commands
from irb140_jax.recordings.drive import Drive, drive_of_map
from irb140_jax.recordings.formats.opened import checksum
from irb140_jax.recordings.glance import glance
from irb140_jax.recordings.payload import Payload, carrying
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.table import read_table
from irb140_jax.recordings.times import seconds_of_text, seconds_since_start
from irb140_jax.recordings.units import stated_unit
from irb140_jax.robot import Robot


def read_recording(
    path: str | pathlib.Path, robot: Robot, columns: str | pathlib.Path | None = None, *,
    torque: Literal["required", "optional"] = "required", known_joints: tuple[str, ...] | None = None,
    drive: Drive | None = None, payload: Payload | None = None,
) -> Recording:
    """Read a recording of this robot, in any format of `recordings.table`, and check it.

    Args:
        path: The file; its columns are t, q.<joint>, tau.<joint> and where logged qd.<joint>, qdd.<joint>, SI units.
        robot: The model of the robot that was recorded; gives the joints' names and what torque is plausible.
        columns: A TOML file that maps other names, units and sides, see `docs/columns.md`.
        torque: Whether columns tau.<joint>, or qdes.<joint> in their place, have to be there; a planned motion has
            none, and its `tau` is NaN.
        known_joints: Every joint that the model has, in its order, where the robot is a part of it: the map may speak
            of the others, too.
        drive: What the model says of the drives, for logs of commands; the map's own words beat it.
        payload: A body of known mass that the tool carried and the model does not hold.

    Returns:
        The recording.  Repairs that are safe are made and stated in its `notes`.

    Raises:
        RecordingError: It can't be used; the message says file, column, row (counted from 1 below the header), what is
            wrong and what would mend it.
    """
    named, path = os.fspath(path), pathlib.Path(path)
    recording = unchecked_recording(path, robot.joint_names, columns, torque=torque, known_joints=known_joints)
    if recording.is_servo_log and (drive is not None or recording.drive is None):
        stated = ColumnMap() if columns is None else read_column_map(columns, robot.joint_names, known_joints)
        recording = dataclasses.replace(recording, drive=drive_of_map(stated, robot.joint_names, drive))
    recording = repair.without_glitches(repair.unwrapped(recording, robot.is_slide))
    recording, robot = dataclasses.replace(recording, payload=payload), carrying(robot, payload)
    seen = glance(recording)
    recording = check_motion(recording, seen, robot)
    if recording.has_torque:
        recording = check_against_model(recording, seen, robot)
    if recording.is_servo_log:
        check_commands(recording, robot)
    return dataclasses.replace(recording, source=path.name, sha256=checksum(path), path=named)


def unchecked_recording(
    path: pathlib.Path, joint_names: tuple[str, ...], columns: str | pathlib.Path | None = None, *,
    torque: Literal["required", "optional"] = "required", known_joints: tuple[str, ...] | None = None,
) -> Recording:
    """The numbers of a file as a `Recording`: complete, finite, in rising time; motion and torque are not checked."""
    column_map = ColumnMap(source=str(path)) if columns is None else read_column_map(
        columns, joint_names, known_joints
    )
    file = read_table(path, joint_names, column_map.options)
    table, notes = renamed(file.columns, column_map), file.notes
    stated = _stated(table, file.units, column_map)
    # All of the torques or none: some of them missing is more likely a wrong name than a planned motion.
    logged = lambda kind: any(f"{kind}.{joint}" in table for joint in joint_names)  # noqa: E731
    commanded = logged("qdes") and not logged("tau")
    has_torque = not commanded and (torque == "required" or logged("tau"))
    signals = ("q", "qdes") if commanded else ("q", "tau") if has_torque else ("q",)
    wanted = [*([] if column_map.rate and "t" not in table else ["t"]),
              *(f"{kind}.{joint}" for kind in signals for joint in joint_names)]
    _require(table, wanted, path)
    kinds = ("qd", "qdd", "qddes") if commanded else ("qd", "qdd")
    optional = {kind: [f"{kind}.{joint}" for joint in joint_names] for kind in kinds}
    complete = {kind: names for kind, names in optional.items() if all(name in table for name in names)}
    for kind in optional.keys() - complete.keys():
        missing = [name for name in optional[kind] if name not in table]
        if len(missing) < len(joint_names):
            instead = "it is taken to be zero" if kind == "qddes" else "it is derived from q"
            notes.append(f"{kind} is not there for every joint ({missing[0]} is missing), so {instead}")
    used = [*wanted, *(name for names in complete.values() for name in names)]
    if "t" in table and table["t"].dtype == object and _as_floats(table["t"])[1] is not None:
        table["t"] = seconds_of_text(table["t"], column_map.options.time_format, path)
    table = scaled(_numbers(table, used, path, notes), column_map, stated, notes)
    table["t"] = seconds_since_start(table["t"], notes)
    if "t" not in used:
        used.insert(0, "t")
    rows = np.arange(1, len(table["t"]) + 1)
    table, rows = _cut(table, rows, column_map)
    file_t = table["t"]
    table, rows = repair.without_repeated_rows(table, rows, notes)
    table = repair.without_absurd_values(table, used)
    table, rows = repair.without_missing_ends(table, used, rows, notes)
    table = repair.with_coarse_times_spread(table, notes)
    check_times(table["t"], rows, path, notes)
    for kind in sorted(complete):
        # Velocities that are full of holes are worth less than those derived from q.
        if any(not repair.few_missing(table[name]) for name in complete[kind]):
            notes.append(f"{kind} has too many missing values; it is derived from q instead")
            del complete[kind]
    used = [*wanted, *(name for names in complete.values() for name in names)]
    table = repair.with_gaps_filled(table, used, rows, path, notes)
    stacked = lambda names: np.stack([table[name] for name in names], axis=1)  # noqa: E731
    kept = {"t", *wanted, *(name for names in complete.values() for name in names)}
    return Recording(
        t=table["t"], joint_names=joint_names, source=str(path), notes=tuple(notes),
        q=stacked([f"q.{joint}" for joint in joint_names]),
        tau=(stacked([f"tau.{joint}" for joint in joint_names]) if has_torque
             else np.full((len(table["t"]), len(joint_names)), np.nan)),
        qdes=stacked([f"qdes.{joint}" for joint in joint_names]) if commanded else None,
        **{kind: stacked(names) for kind, names in complete.items()},  # pyright: ignore[reportArgumentType]
        extras={name: values for name, values in table.items() if name not in kept},
        file_t=file_t if len(file_t) > len(table["t"]) else None,
    )


def recorded_joints(
    path: str | pathlib.Path, columns: str | pathlib.Path | None, known_joint_names: tuple[str, ...]
) -> tuple[str, ...]:
    """Those of the known joints which a file holds, in the order in which they are known.

    A joint is held by a file that has its position and, if it has any torque or else any command, that too.

    Args:
        path: The recording.
        columns: The TOML file that maps its columns, or None.
        known_joint_names: Every joint that the model has.

    Raises:
        RecordingError: The file or the map can't be read.
    """
    table, column_map = named_columns(path, columns, known_joint_names)
    moved = [joint for joint in known_joint_names if f"q.{joint}" in table]
    driven = ([joint for joint in moved if f"tau.{joint}" in table]
              or [joint for joint in moved if f"qdes.{joint}" in table])
    found = tuple(driven or moved)
    if column_map.numbered and found != known_joint_names[: len(found)]:
        raise RecordingError(f"{column_map.source}: joints are found by their number {{n}}, and the recording holds "
                             f"{', '.join(found)} of {', '.join(known_joint_names)}: say whose numbers they are with "
                             "joints = [\"...\", ...] in the map")
    return found


def named_columns(
    path: str | pathlib.Path, columns: str | pathlib.Path | None, known_joint_names: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], ColumnMap]:
    """The columns of a file under the contract's names, as they are in the file otherwise, and the map used."""
    column_map = ColumnMap() if columns is None else read_column_map(columns, known_joint_names)
    file = read_table(pathlib.Path(path), known_joint_names, column_map.options)
    table = renamed(file.columns, column_map)
    _stated(table, file.units, column_map)
    return table, column_map


def _stated(table: dict[str, np.ndarray], units: dict[str, str], column_map: ColumnMap) -> dict[str, str]:
    """Channel -> unit by the file's own words; a name such as "q.elbow [deg]" loses its bracket in the table."""
    for name in list(table):
        bare = re.sub(r"\s*[\[(][^\[(]*$", "", name) if stated_unit(name) else name
        if bare != name and bare not in table:
            table[bare] = table.pop(name)
            units = units | {bare: units.get(name, str(stated_unit(name)))}
    theirs = column_map.values("columns")
    return {name: units[str(theirs.get(name, name))] for name in table if theirs.get(name, name) in units}


def _cut(
    table: dict[str, np.ndarray], rows: np.ndarray, column_map: ColumnMap
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The part of the recording that the map asks for."""
    if np.isinf(column_map.start) and np.isinf(column_map.end):
        return table, rows
    since = table["t"] - table["t"][np.isfinite(table["t"])][:1].sum()
    inside = ~((since < column_map.start) | (since > column_map.end))
    if not inside.any():
        raise RecordingError(f"{column_map.source}: from = {column_map.start:g} to = {column_map.end:g} leaves no row; "
                             f"the recording lasts {np.nanmax(since):.4g} s")
    return {name: values[inside] for name, values in table.items()}, rows[inside]


def _require(table: dict[str, np.ndarray], wanted: list[str], path: pathlib.Path) -> None:
    missing = [name for name in wanted if name not in table]
    if missing:
        names = ", ".join(missing[:8]) + (f" and {len(missing) - 8} more" if len(missing) > 8 else "")
        raise RecordingError(f"{path}: missing column{'s' if len(missing) > 1 else ''} {names}; "
                             f"{what_came(table)}{closest(missing[0], set(table) - set(wanted))}; rename them, or map "
                             "them with --columns FILE.toml")


def _numbers(
    table: dict[str, np.ndarray], used: list[str], path: pathlib.Path, notes: list[str]
) -> dict[str, np.ndarray]:
    """Every column as floats, empty cells as NaN; a text in a column that is needed is an error, elsewhere a note."""
    numbers = {}
    for name, values in table.items():
        if values.dtype != object:
            numbers[name] = np.asarray(values, dtype=float)
            continue
        converted, bad = _as_floats(values)
        if bad is None:
            numbers[name] = converted
        elif name in used:
            raise RecordingError(f"{path}: column {name}, row {bad + 1}: '{values[bad]}' is not a number; write a "
                                 "decimal number in SI units there, or delete the row")
        else:
            notes.append(f"Column {name} holds text and is left out")
    return numbers


def as_numbers(table: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], list[str]]:
    """The columns that hold numbers, as floats, and a note on each that does not."""
    notes: list[str] = []
    return _numbers(table, [], pathlib.Path(), notes), notes


def _as_floats(values: np.ndarray) -> tuple[np.ndarray, int | None]:
    """Floats of an array of objects, and the index of the first that is none."""
    converted = np.full(len(values), np.nan)
    for i, value in enumerate(values):
        if value is None or value != value or (isinstance(value, str) and not value.strip()):
            continue
        try:
            converted[i] = float(value)
        except (TypeError, ValueError):
            return converted, i
    return converted, None
