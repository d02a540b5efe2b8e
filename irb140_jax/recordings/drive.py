"""What is stated of the drives of a robot that logs commands instead of torque."""

import dataclasses
import pathlib
from typing import Any

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.columns import ColumnMap
from irb140_jax.robot import servos_of

GAIN_WIDTH = 0.10  # relative standard deviation of a stated Kp or Kd: of a torque constant that nobody measured
# s by which commands of all joints may act at another time than the first estimate says: a sample of a controller at
# 1 kHz.  Those of one joint may beside all others, and the torque of all may come late, by that or by so many rows,
# whichever is more: a slow bus carries a slow log.  Judgements.
TIME_WIDTH, ROWS_WIDTH = 1e-3, 0.1
ARRAYS = ("kp", "kd", "limit", "low", "high", "delay", "kp_width", "kd_width")  # of a drive, one number a joint each
PAYLOAD = "payload"  # where gains come from that a known payload shows
SECTIONS = ("kp", "kd", "torque_limit", "command_delay")  # of the column map


@dataclasses.dataclass(frozen=True)
class Times:
    """When drives act, as a fit found it.

    Attributes:
        delay: By how much commands are taken up later than was given [s].
        lag: Of all torques behind what commands and positions say [s].
        phases: By how much later those of each recording are taken up than those of all [s]; empty for one recording.
    """

    delay: float = 0.0
    lag: float = 0.0
    phases: tuple[float, ...] = ()


@dataclasses.dataclass(frozen=True)
class Drive:
    """Position servos: torque = Kp (qdes(t - delay) - q) + Kd (qddes - qd), within +- limit, and `lag` later.

    Attributes:
        kp: Torque per position error [N m/rad or N/m], NaN where it is not known, shape (n,).
        kd: Torque per speed error [N m s/rad or N s/m], NaN where it is not known, shape (n,).
        limit: Largest torque [N m or N], inf where none is stated, shape (n,).
        low, high: Range to which commands are cut [rad or m], shape (n,).
        delay: Time after its row at which a command is taken up [s], shape (n,).
        kp_width: Relative standard deviation of kp, shape (n,).
        kd_width: Standard deviation of kd [N m s/rad or N s/m], shape (n,).
        said: Where each joint's gains come from, in the order of the joints: "model", "map", "payload", "estimate", "".
        common_delay_width: Standard deviation of the delay that all share [s]; zero where it was stated.
        time_width: Standard deviation of the time at which commands of one joint are taken up beside all others', and
            of how much later the torque of all comes [s].
        lag: Time by which the torque of all joints comes later than the law says [s].
    """

    kp: np.ndarray
    kd: np.ndarray
    limit: np.ndarray
    low: np.ndarray
    high: np.ndarray
    delay: np.ndarray
    kp_width: np.ndarray
    kd_width: np.ndarray
    said: tuple[str, ...]
    common_delay_width: float = 0.0
    time_width: float = TIME_WIDTH
    lag: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """What the controller is, as JSON, where infinity and what is unknown are words."""
        word = lambda x: x if np.isfinite(x) else str(x)  # noqa: E731
        lists = {name: [word(x) for x in getattr(self, name).tolist()] for name in ARRAYS}
        return {**lists, "said": list(self.said), "lag": self.lag}

    @property
    def is_known(self) -> bool:
        """Whether the law of every servo is: gains that are stated, and no worse than stated gains are."""
        kp, kd = self.kp_width <= GAIN_WIDTH, self.kd_width <= GAIN_WIDTH * np.abs(self.kd)
        return all(word in ("model", "map", PAYLOAD) for word in self.said) and bool(np.all(kp & kd))

    @property
    def phase_width(self) -> float:
        """Standard deviation of the time at which one recording's commands are taken up beside all others' [s].

        A log begins at any moment of a controller's cycle of a millisecond.  None where the delay was stated.
        """
        return float(min(self.common_delay_width, TIME_WIDTH) / np.sqrt(12.0))

    def found(self, times: Times, later: float | np.ndarray = 0.0, kd: float | np.ndarray = 0.0) -> "Drive":
        """The drive as a fit found it, without the phase of any recording.

        Args:
            times: When it acts.
            later: Beyond that, of all or by joint [s].
            kd: Real less stated Kd in standard deviations, of all or by joint.
        """
        damping = np.maximum(self.kd + kd * self.kd_width, 0.0)
        return dataclasses.replace(self, delay=self.delay + times.delay + later, lag=times.lag, kd=damping)

    @staticmethod
    def from_json(data: dict[str, Any]) -> "Drive":
        """The inverse of `to_json`."""
        arrays: dict[str, Any] = {name: np.array([float(x) for x in data[name]]) for name in ARRAYS}
        return Drive(**arrays, said=tuple(data["said"]), lag=float(data.get("lag", 0.0)))


def unknown_drive(n: int) -> Drive:
    """Drives of which nothing is stated."""
    missing, none, free = np.full(n, np.nan), np.zeros(n), np.full(n, np.inf)
    return Drive(missing, missing, free, -free, free, none, none, none, ("",) * n)


def stated_drive(kp: np.ndarray, kd: np.ndarray, limit: float | np.ndarray = np.inf, said: str = "map") -> Drive:
    """Drives with these gains.

    Args:
        kp: [N m/rad or N/m], shape (n,).
        kd: [N m s/rad or N s/m], shape (n,).
        limit: Largest torque [N m or N].
        said: Where they come from.
    """
    n = len(kp)
    return _with_widths(dataclasses.replace(
        unknown_drive(n), kp=np.array(kp, dtype=float), kd=np.array(kd, dtype=float),
        limit=np.broadcast_to(np.asarray(limit, dtype=float), (n,)).copy(), said=(said,) * n,
    ))  # fmt: skip


def drive_of_model(path: str | pathlib.Path, joints: tuple[str, ...]) -> Drive:
    """Drives by a model file's actuators, unknown at joints where those are no servos."""
    gains = servos_of(path, joints)
    said = tuple("" if np.isnan(kp) else "model" for kp in gains.kp)
    unknown = unknown_drive(len(joints))
    return _with_widths(dataclasses.replace(unknown, **gains._asdict(), said=said))


def drive_of_map(columns: ColumnMap, joints: tuple[str, ...], otherwise: Drive | None = None) -> Drive:
    """Drives by the sections [kp], [kd], [torque_limit] and [command_delay] of a column map.

    Args:
        columns: The map.
        joints: Names of the joints.
        otherwise: What the model says, where the map says nothing.

    Raises:
        RecordingError: A gain or limit of zero.
    """
    drive = otherwise or unknown_drive(len(joints))
    given = {section: columns.values(section) for section in SECTIONS}
    if not any(given.values()):
        return drive
    for section, values in given.items():
        for channel, value in values.items():
            if float(value) == 0.0 and section in ("kp", "torque_limit"):
                raise RecordingError(f"{columns.source}: [{section}] {channel.partition('.')[2]} = 0; allowed is a "
                                     "positive number in SI units on the joint side")

    def at(section: str, old: np.ndarray) -> np.ndarray:
        new = [given[section].get(f"qdes.{joint}") for joint in joints]
        return np.array([float(x if y is None else y) for x, y in zip(old, new, strict=True)])

    mapped = lambda joint: f"qdes.{joint}" in given["kp"]  # noqa: E731
    said = tuple("map" if mapped(joint) else old for joint, old in zip(joints, drive.said, strict=True))
    return _with_widths(dataclasses.replace(
        drive, kp=at("kp", drive.kp), kd=at("kd", drive.kd), limit=at("torque_limit", drive.limit),
        delay=at("command_delay", drive.delay), said=said,
    ))  # fmt: skip


def _with_widths(drive: Drive) -> Drive:
    """The drives with the widths that stated gains are taken to have."""
    kp_width = np.where(np.isnan(drive.kp), 0.0, GAIN_WIDTH)
    kd_width = np.where(np.isnan(drive.kd), 0.0, GAIN_WIDTH * np.abs(drive.kd))
    return dataclasses.replace(drive, kp_width=kp_width, kd_width=kd_width)
