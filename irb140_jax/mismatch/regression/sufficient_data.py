"""What is compared: recordings that are long enough, conditioned, and whether any joint moves enough in them."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.recordings.band import choose_band
from irb140_jax.recordings.check import MOVING, checked_numbers
from irb140_jax.recordings.condition import Commanded, Conditioned, conditioned
from irb140_jax.recordings.drive import Times
from irb140_jax.recordings.lost_channels import with_lost_torque_marked
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.payload import Payload, carrying
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repeats import with_motions_numbered, without_copies
from irb140_jax.recordings.servo import with_servo_torques, with_torque
from irb140_jax.recordings.torques import nominal_torques
from irb140_jax.robot import Robot

MORE = "record at least 15 s in which every joint moves, with a dozen reversals"


@dataclasses.dataclass(frozen=True)
class Comparison:
    """A model and what it is compared with.

    Attributes:
        robot: The nominal model.
        recordings: With torque, as far as they are long enough.
        smooth: The same, conditioned.
        band: Of the comparison.
        servo_notes: What was assumed of servos, a sentence each.
        notes: What was left out or counts only once, a sentence each.
    """

    robot: Robot
    recordings: list[Recording]
    smooth: list[Conditioned]
    band: Band
    servo_notes: list[str]
    notes: list[str]

    @property
    def names(self) -> list[str]:
        """Of the recordings."""
        return [r.source for r in self.recordings]

    @property
    def seconds(self) -> float:
        """How long all of them are together."""
        return sum(float(r.t[-1] - r.t[0]) for r in self.smooth)

    @property
    def servo(self) -> Commanded | None:
        """Commands and drive, where the recordings held these in place of torque."""
        return self.smooth[0].servo

    @property
    def rows(self) -> np.ndarray:
        """Low-passed rows in which each joint moves and nothing is lost, over all recordings, shape (n,)."""
        return usable_rows(self.smooth, self.band)

    def placed(self, payloads: Sequence[Payload | None]) -> "Comparison":
        """The same with what the tool carried in each recording where it was found to sit."""
        recordings = [dataclasses.replace(r, payload=p) for r, p in zip(self.recordings, payloads, strict=True)]
        smooth = [dataclasses.replace(r, payload=p) for r, p in zip(self.smooth, payloads, strict=True)]
        return dataclasses.replace(self, recordings=recordings, smooth=smooth)

    def later(self, times: Times, own: float | np.ndarray = 0.0, kd: float | np.ndarray = 0.0) -> "Comparison":
        """The same with the torque of drives as they were found, see `Drive.found`: logs of commands alone."""
        phases = times.phases or (0.0,) * len(self.recordings)
        recordings = [_later(r, times, own + p, kd) for r, p in zip(self.recordings, phases, strict=True)]
        smooth, _ = with_motions_numbered(conditioned(recordings, self.band), recordings)
        free = times.lag > 0.0
        servos = [r.servo and dataclasses.replace(r.servo, lag_width=free * r.servo.drive.time_width) for r in smooth]
        smooth = [dataclasses.replace(r, servo=servo) for r, servo in zip(smooth, servos, strict=True)]
        return dataclasses.replace(self, recordings=recordings, smooth=smooth)


def payloads_taken_off(data: Comparison) -> Comparison:
    """The same as if nothing had been carried: without what the model says that known payloads take."""
    out = []
    for r in data.smooth:
        both = data.robot, carrying(data.robot, r.payload)
        bare, loaded = (nominal_torques(robot, r.q, r.qd, r.qdd).total for robot in both)
        out.append(dataclasses.replace(r, tau=r.tau - (loaded - bare), payload=None))
    return dataclasses.replace(data, smooth=out)


def comparison(
    robot: Robot, recordings: Sequence[Recording], uncertainty: float, progress: Callable[[str], None]
) -> Comparison:
    """Prepare recordings for the comparison.

    Args:
        robot: The nominal model.
        recordings: At least one, of this robot.
        uncertainty: Relative standard deviation of its inertials.
        progress: Told what is being done.

    Raises:
        RecordingError: A recording is too short for any filter, or holds what is no number.
    """
    moves = np.where(robot.is_slide, MOVING[1], MOVING[0])
    recordings, servo_notes = with_servo_torques(recordings, robot, uncertainty)
    recordings = [with_lost_torque_marked(checked_numbers(r), moves, carrying(robot, r.payload)) for r in recordings]
    recordings, twice = without_copies(recordings)
    progress("smoothing and differentiating the positions")
    band, recordings, smooth, again = comparable(robot, recordings)
    return Comparison(robot, recordings, smooth, band, servo_notes, twice + again)


def comparable(
    robot: Robot, recordings: Sequence[Recording]
) -> tuple[Band, list[Recording], list[Conditioned], list[str]]:
    """The recordings that are long enough to be compared, or all of them where none is.

    Args:
        robot: The nominal model.
        recordings: At least one.

    Returns:
        The band of the comparison, the recordings, the same conditioned, and a note for each recording that is left
        out or that repeats another one.
    """
    left_out: list[str] = []
    while True:
        band = choose_band(list(recordings), robot)
        smooth, again = with_motions_numbered(conditioned(recordings, band), recordings)
        rows = [len(band.kept(len(r.t))) for r in smooth]
        short = [k for k, count in enumerate(rows) if count < settings.FEWEST_ROWS_OF_RECORDING]
        if not short or len(short) == len(rows):
            return band, list(recordings), smooth, left_out + again
        left_out += [f"{smooth[k].source} is left out: {rows[k]} samples below {band.torque:.3g} Hz remain of it, and "
                     f"{settings.FEWEST_ROWS_OF_RECORDING} are needed." for k in short]  # fmt: skip
        recordings = [r for k, r in enumerate(recordings) if k not in short]


def _later(recording: Recording, times: Times, own: float | np.ndarray, kd: float | np.ndarray) -> Recording:
    assert recording.drive is not None
    drive = recording.drive.found(times, own, kd)
    return dataclasses.replace(with_torque(recording, drive), torque_lost=recording.torque_lost)


def usable_rows(smooth: Sequence[Conditioned], band: Band) -> np.ndarray:
    """Low-passed rows in which each joint moves and nothing is lost, over all recordings, shape (n,)."""
    return np.sum([r.usable[band.kept(len(r.t))].sum(axis=0) for r in smooth], axis=0)


def mostly_lost(smooth: Sequence[Conditioned]) -> np.ndarray:
    """Whether dead or frozen channels and gaps took most rows of each joint, shape (n,)."""
    return np.concatenate([r.recorded for r in smooth]).mean(axis=0) < 0.5


def too_little(smooth: Sequence[Conditioned], band: Band) -> str:
    """Why no joint at all can be compared, and what to record; empty where one can."""
    rows = sum(len(band.kept(len(r.t))) for r in smooth)
    if rows < settings.FEWEST_ROWS:
        return (
            f"Only {rows} samples below {band.torque:.3g} Hz can be compared with the model, and "
            f"{settings.FEWEST_ROWS} are needed: {MORE}"
        )
    most = int(usable_rows(smooth, band).max())
    if most < settings.FEWEST_ROWS_OF_JOINT:
        what = "Dead or frozen channels spoil every joint" if mostly_lost(smooth).all() else (
            "No joint moves for long enough")
        return (
            f"{what}: at most {most} samples of one can be compared with the model, and "
            f"{settings.FEWEST_ROWS_OF_JOINT} are needed: {MORE}"
        )
    return ""
