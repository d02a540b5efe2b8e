"""A first look at a log: what each column probably is, in which unit, on which side, what is doubtful, and a map.

    look = inspect_recording("log.csv", load_robot("arm.xml"))
    print(look.map)
"""

import dataclasses
import pathlib
import re
import tempfile

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings import guess, repair
from irb140_jax.recordings.channel_health import TOLD, health, torque_scales
from irb140_jax.recordings.check import RATES
from irb140_jax.recordings.column_file import read_column_map
from irb140_jax.recordings.columns import ColumnMap, renamed
from irb140_jax.recordings.formats.options import Table
from irb140_jax.recordings.glance import glance
from irb140_jax.recordings.likely import Likely, likely_units
from irb140_jax.recordings.map_draft import drafted_map
from irb140_jax.recordings.read import as_numbers, read_recording, unchecked_recording
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.table import read_table
from irb140_jax.recordings.times import UNITS as TIME_FACTORS
from irb140_jax.recordings.times import seconds_of_text, seconds_since_start
from irb140_jax.recordings.torques import nominal_torques
from irb140_jax.recordings.units import UNITS
from irb140_jax.robot import Robot

NUMBER = re.compile(r"\d+")
ORDER = ("q", "qd", "qdd", "tau", "qdes")
SHORT = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


@dataclasses.dataclass(frozen=True)
class Channel:
    """A column of the file that speaks of a joint.

    Attributes:
        name: Contract name, "q.elbow".
        column: Name in the file.
        low, high: Range, in the file's unit.
        likely: Its unit, and what says so.
        doubts: Sentences.
        others: Columns that could be meant instead, best first.
    """

    name: str
    column: str
    low: float
    high: float
    likely: Likely
    doubts: tuple[str, ...]
    others: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Inspection:
    """What a first look found.

    Attributes:
        source: File name.
        format: What kind of file it is.
        rows: Samples.
        time: The time column, or "".
        time_unit: s, ms, us, ns, "text", or "" where nothing fits.
        rate, duration: [1/s], [s]; NaN where the time is not known.
        channels: In the contract's order.
        unused: Columns that speak of no joint.
        notes: What was guessed or repaired in reading.
        doubts: What looks wrong, sentences; those of channels are with them.
        map: A column map to start from, TOML.
        refusal: What reading says with this map, "" where it reads.
    """

    source: str
    format: str
    rows: int
    time: str
    time_unit: str
    rate: float
    duration: float
    channels: tuple[Channel, ...]
    unused: tuple[str, ...]
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    map: str
    refusal: str

    @property
    def names(self) -> set[str]:
        """Contract names of the channels that were found."""
        return {channel.name for channel in self.channels}


def inspect_recording(
    path: str | pathlib.Path, robot: Robot | None = None, columns: str | pathlib.Path | None = None
) -> Inspection:
    """Look at a recording of any names and units.

    Args:
        path: The file.
        robot: The nominal model, where there is one: names the joints, and tells units and sides by regression.
        columns: A column map to begin with; its names and its way to read the file are taken, its factors are not.

    Raises:
        RecordingError: The file is no table.
    """
    path, joints = pathlib.Path(path), robot.joint_names if robot is not None else ()
    given = ColumnMap() if columns is None else read_column_map(columns, joints)
    table = read_table(path, joints, given.options)
    mapped = {ours: str(theirs) for ours, theirs in given.values("columns").items()}
    units = table.units | {ours: table.units[theirs] for ours, theirs in mapped.items() if theirs in table.units}
    found = guess.channels(_names_by_map(table, given), units, joints)
    time = mapped.get("t") or guess.time_column(table.columns) or ""
    numbers, notes = as_numbers({name: values for name, values in table.columns.items() if name != time})
    meanings = _meanings(found, mapped, numbers, joints)
    t, unit, doubts = _seconds(table, time, given, path)
    likely, more = likely_units(t, {name: numbers[of[0].column] for name, of in meanings.items()},
                                {name: of[0].unit for name, of in meanings.items()}, robot)  # fmt: skip
    seen = tuple(_channel(name, of, numbers, likely[name], t) for name, of in meanings.items())
    doubts += more + _missing(meanings, joints) + _without_quantity(numbers, joints, meanings)
    draft = drafted_map(path.name, time, unit, {c.name: c for c in seen}, joints, given)
    refusal, read_notes = _tried(path, robot, columns, draft, meanings)
    used = {time, *(c.column for c in seen), *(other for c in seen for other in c.others)}
    return Inspection(
        source=path.name, format=table.format, rows=len(next(iter(table.columns.values()))), time=time, time_unit=unit,
        rate=float(1 / np.median(np.diff(t))) if t is not None else np.nan,
        duration=float(t[-1] - t[0]) if t is not None else np.nan, channels=seen,
        unused=tuple(name for name in table.columns if name not in used),
        notes=tuple(dict.fromkeys([*table.notes, *notes, *read_notes])), doubts=tuple(doubts), map=draft,
        refusal=refusal,
    )  # fmt: skip


def _names_by_map(table: Table, given: ColumnMap) -> list[str]:
    return list(renamed(table.columns, dataclasses.replace(given, numbers={})))


def _meanings(
    found: dict, mapped: dict[str, str], numbers: dict[str, np.ndarray], joints: tuple[str, ...]
) -> dict[str, list[guess.Meaning]]:
    """Contract name -> candidates by their names in the file, in the contract's order; text is left out."""
    result = {}
    for quantity in ORDER:
        named = found.get(quantity, {})
        for joint in [joint for joint in joints if joint in named] if joints else list(named):
            candidates = [dataclasses.replace(m, column=mapped.get(m.column, m.column)) for m in named[joint]]
            if candidates := [m for m in candidates if m.column in numbers]:
                result[f"{quantity}.{joint}"] = candidates
    return result


def _seconds(
    table: Table, time: str, given: ColumnMap, path: pathlib.Path
) -> tuple[np.ndarray | None, str, list[str]]:
    """Times in seconds after the first, their unit in the file, and doubts; None where they can't be told."""
    rows = len(next(iter(table.columns.values())))
    if not time:
        if given.rate is not None:
            return np.arange(rows) / given.rate, "", []
        return None, "", ["No column is the time: give rate = samples a second in the map, if they are even"]
    values = table.columns[time]
    if values.dtype == object:
        numbers, bad = as_numbers({time: values})[0].get(time), None
        if numbers is None:
            try:
                return seconds_of_text(values, given.options.time_format, path), "text", []
            except RecordingError as error:
                bad = str(error)
            return None, "text", [bad or ""]
        values = numbers
    since = seconds_since_start(values, [])
    if since is not values:
        return since, "s", []
    good = values[np.isfinite(values)]
    step = float(np.median(np.diff(good))) if len(good) > 2 else 0.0
    if step == 0.0 and len(good) > 2:  # a coarse clock: several rows a tick
        step = float(good[-1] - good[0]) / (len(good) - 1)
    stated = table.units.get(time)
    if stated in SHORT:
        return values * UNITS[stated], stated, []
    fits = [short for short, name in SHORT.items() if 1 / RATES[1] <= step * TIME_FACTORS[name] <= 1 / RATES[0]]
    if not fits:
        return None, "", [f"Column {time} can't be the time in any unit: its median step is {step:.4g}"]
    # Where several fit, the rate nearest to 250 a second: robots log between 20 and 5000.
    best = min(fits, key=lambda short: abs(np.log(step * TIME_FACTORS[SHORT[short]] * 250)))
    best = "s" if "s" in fits and 10 <= 1 / step <= 5000 else best
    t = values * TIME_FACTORS[SHORT[best]]
    return repair.with_coarse_times_spread({"t": t}, [])["t"], best, []


def _channel(
    name: str, meanings: list[guess.Meaning], numbers: dict[str, np.ndarray], likely: Likely, t: np.ndarray | None
) -> Channel:
    values = numbers[meanings[0].column]
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)
    return Channel(name, meanings[0].column, low, high, likely, tuple(likely.doubts) + _doubts(name, values, t),
                   tuple(m.column for m in meanings[1:]))  # fmt: skip


def _doubts(name: str, values: np.ndarray, t: np.ndarray | None) -> tuple[str, ...]:
    found, says = health(values), []
    if found.missing == 1.0:
        return ("holds no value",)
    if found.dead:
        return (f"dead: {values[np.isfinite(values)][0] + 0.0:g} in every row",)
    if name.startswith("qdes."):
        return ()  # commands rest and step as they please
    if name.startswith(("tau.", "qd.")) and np.nanmin(values) >= 0:
        says.append("never negative: its sign is not logged")
    if found.frozen:
        start, length = found.frozen
        when = f"{length} rows from row {start + 1}" if t is None else f"{length / len(values) * (t[-1] - t[0]):.3g} s"
        says.append(f"frozen: one value for {when} ({length / len(values):.0%} of the rows)")
    if found.saturated:
        says.append(f"saturated? at the end of its range in {found.saturated:.1%} of the rows")
    if found.step:
        says.append(f"coarse: comes in steps of {found.step:.3g}")
    if found.missing > 0:
        says.append(f"{found.missing:.2%} missing")
    return tuple(says)


def _missing(meanings: dict, joints: tuple[str, ...]) -> list[str]:
    lost = [j for j in joints if f"q.{j}" not in meanings]
    if len(lost) == len(joints):
        found = not joints and any(name.startswith("q.") for name in meanings)
        return [] if found else ["No column looks like a joint's position"]
    says = [f"No position is found for {', '.join(lost)}"] if lost else []
    no_torque = [name[2:] for name in meanings if name.startswith("q.") and f"tau.{name[2:]}" not in meanings]
    return says + ([f"No torque or current is found for {', '.join(no_torque)}"] if no_torque else [])


def _without_quantity(numbers: dict[str, np.ndarray], joints: tuple[str, ...], meanings: dict) -> list[str]:
    """Columns that name a joint and nothing else, as where each quantity has a file of its own."""
    if any(name.startswith("q.") for name in meanings):
        return []
    bare = [name for name in numbers if name in joints or re.fullmatch(r"(?i)(joint|axis|j|a|motor)?[ _.]*\d+", name)]
    return [f"Columns {', '.join(bare[:8])} name joints and no quantity: say in [columns] what they are, as in "
            f"\"q.*\" = \"{NUMBER.sub('{n}', bare[0])}\""] if bare else []  # fmt: skip


def _tried(
    path: pathlib.Path, robot: Robot | None, columns: str | pathlib.Path | None, draft: str, meanings: dict
) -> tuple[str, tuple[str, ...]]:
    """What reading says with the map that was given, else with the drafted one: its refusal, or its notes."""
    joints = tuple(name[2:] for name in meanings if name.startswith("q."))
    if not joints:
        return "no position is known yet", ()
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "map.toml" if columns is None else pathlib.Path(columns)
        if columns is None:
            file.write_text(draft, encoding="utf-8")
        try:
            recording = _read(path, robot, joints, file)
        except RecordingError as error:
            return str(error).replace(str(file), "map.toml").removeprefix(f"{path}: "), ()
    return "", (*recording.notes, *_agreement(recording, robot))


def _agreement(recording: Recording, robot: Robot | None) -> list[str]:
    """How large the torque is beside the nominal model's, once it is read: far from 1 where a constant is wrong."""
    if robot is None or not recording.has_torque:
        return []
    look = glance(recording)
    scales = torque_scales(look, nominal_torques(robot, look.q, look.qd, look.qdd))
    said = [f"{scale.value:.2g} on {joint}" for joint, scale in zip(recording.joint_names, scales, strict=True)
            if scale.told > TOLD]  # fmt: skip
    return [f"With this map, torque is so many times the nominal model's: {', '.join(said)}"] if said else []


def _read(path: pathlib.Path, robot: Robot | None, joints: tuple[str, ...], file: pathlib.Path) -> Recording:
    if robot is not None:
        return read_recording(path, robot, file, torque="optional")
    return unchecked_recording(path, joints, file, torque="optional")
