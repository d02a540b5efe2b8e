"""Torque of logs that have none: what a position servo makes of its command and where the joint is.

    torque = Kp (qdes(t - delay) - q) + Kd (qddes - qd)

qddes is zero where it is not logged.  All of it may come later, by the lag of the drive.  Rows in which a drive is at
its limit are left out: there the torque says nothing of the command, and which part of the law was cut is not known.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import interpolate

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.delayed_commands import taken_up
from irb140_jax.recordings.drive import GAIN_WIDTH, PAYLOAD, ROWS_WIDTH, TIME_WIDTH, Drive, unknown_drive
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.servo_estimates import (
    KD_UNSTATED_WIDTH,
    Estimate,
    estimated_delay,
    estimated_gains,
    rows_of_joints,
)
from irb140_jax.robot import Robot

AT_LIMIT = 0.98  # of the torque limit: from here on a row is left out
KNOWN = 0.5  # relative standard deviation up to which an estimated Kp gives torque at all


def with_servo_torques(
    recordings: Sequence[Recording], robot: Robot, uncertainty: float
) -> tuple[list[Recording], list[str]]:
    """Recordings with the torque of their servos; those that logged torque stay as they are.

    Args:
        recordings: At least one.
        robot: The nominal model, which gives the scale where Kp is not stated.
        uncertainty: Relative standard deviation of its inertials.

    Returns:
        The recordings, whose drives have no unknown gain, and a note for each thing assumed or left out.

    Raises:
        RecordingError: Some logged torque and others did not.
    """
    servos = [r for r in recordings if r.is_servo_log]
    if not servos:
        return list(recordings), []
    if len(servos) < len(recordings):
        other = next(r for r in recordings if not r.is_servo_log)
        raise RecordingError(f"{servos[0].source}: holds commands (qdes) and no torque, while {other.source} holds "
                             "torque; give recordings of one kind")
    drives = [r.drive or unknown_drive(robot.n) for r in servos]
    unstated = not any(d.delay.any() for d in drives)
    delay, disagreement = estimated_delay(servos, drives, robot, uncertainty) if unstated else (0.0, 0.0)
    width = float(np.hypot(TIME_WIDTH, disagreement)) if unstated else 0.0
    rows = rows_of_joints(servos, drives, robot, (delay,))
    estimates: dict[int, Estimate] = {}
    for j in range(robot.n):
        if any(np.isnan(d.kp[j]) or np.isnan(d.kd[j]) for d in drives):
            found = estimated_gains(rows[j])
            estimates[j] = found._replace(spread=float(np.hypot(found.spread, uncertainty)))
    own = max(TIME_WIDTH, *(ROWS_WIDTH * float(np.median(np.diff(r.t))) for r in servos))
    drives = [dataclasses.replace(d, delay=d.delay + delay, common_delay_width=width, time_width=own) for d in drives]
    out = [with_torque(r, _completed(d, estimates)) for r, d in zip(servos, drives, strict=True)]
    return out, [*_gain_notes(robot, out, drives, estimates, uncertainty), *_saturation_notes(out)]


def with_torque(recording: Recording, drive: Drive) -> Recording:
    """A recording with the torque of drives whose gains are known; a joint of unknown Kp has lost its torque."""
    assert recording.qdes is not None
    error, qd = taken_up(recording, drive) - recording.q, speed(recording)
    against = qd if recording.qddes is None else qd - recording.qddes
    known = np.isfinite(drive.kp)
    kp, kd = np.where(known, drive.kp, 0.0), np.where(known, np.nan_to_num(drive.kd), 0.0)
    asked, tau = kp * error, kp * error - kd * against
    cut = (np.abs(asked) >= AT_LIMIT * drive.limit) | (np.abs(tau) >= AT_LIMIT * drive.limit)
    lost = cut | ~known
    tau = np.clip(tau, -drive.limit, drive.limit)
    if drive.lag:
        t = recording.t - drive.lag
        tau, lost = (np.stack([np.interp(t, recording.t, x) for x in of.T], axis=1) for of in (tau, 1.0 * lost))
        lost = lost > 0.0
    return dataclasses.replace(recording, tau=tau, drive=drive, torque_lost=lost if lost.any() else None)


def speed(recording: Recording) -> np.ndarray:
    """Derivative of the positions at the rows, shape (T, n): what the comparison's low-pass leaves of it is exact."""
    return interpolate.CubicSpline(recording.t, recording.q)(recording.t, 1)


def _completed(drive: Drive, estimates: dict[int, Estimate]) -> Drive:
    """The drive with estimates where nothing is stated."""
    kp, kd, kp_width, kd_width = (x.copy() for x in (drive.kp, drive.kd, drive.kp_width, drive.kd_width))
    said = list(drive.said)
    for j, e in estimates.items():
        if np.isnan(kp[j]) and e.spread < KNOWN:
            kp[j], kp_width[j], said[j] = e.kp, e.spread, "estimate"
        if np.isnan(drive.kd[j]):
            kd[j], kd_width[j] = e.kd, KD_UNSTATED_WIDTH * e.kd
    return dataclasses.replace(drive, kp=kp, kd=kd, kp_width=kp_width, kd_width=kd_width, said=tuple(said))


def _gain_notes(
    robot: Robot, recordings: Sequence[Recording], stated: Sequence[Drive], estimates: dict[int, Estimate],
    uncertainty: float,
) -> list[str]:  # fmt: skip
    """Where the torque comes from, and in which unit what follows from it is known."""
    drives = [r.drive for r in recordings if r.is_servo_log and r.drive is not None]
    first, out = drives[0], []
    names = np.array(robot.joint_names)
    said = np.array(first.said)
    alike = all(np.array_equal(d.kp, first.kp, equal_nan=True) for d in drives)
    gains = lambda js: ", ".join(  # noqa: E731
        f"{names[j]} {first.kp[j]:.4g} and {first.kd[j]:.3g}" for j in js) + also
    also = "" if alike else ", in the first recording"
    head = "The log holds commands and no torque: torque is Kp (qdes - q) - Kd qd of the servos"
    for origin, words in (("model", "gains of the model's actuators"), ("map", "gains stated for the drive")):
        own = np.flatnonzero(said == origin)
        if len(own):
            out.append(f"{head}, by {words}: Kp and Kd of {gains(own)}. Each Kp is taken to be right to "
                       f"{100 * first.kp_width[own].max():.2g} %, and a stated Kd to {100 * GAIN_WIDTH:.2g} %")
    if len(shown := np.flatnonzero(said == PAYLOAD)):
        out.append(f"{head}, by the Kp that the known payload shows: Kp and Kd of {gains(shown)}")
    guessed = np.flatnonzero(said == "estimate")
    if len(guessed):
        each = ", ".join(
            f"{estimates[int(j)].kp:.3g} +- {estimates[int(j)].kp * estimates[int(j)].spread:.2g} "
            f"{'N/m' if robot.is_slide[j] else 'N m/rad'} on {names[j]}" for j in guessed
        )  # fmt: skip
        out.append(
            f"{head}. No Kp is stated; by the model's nominal inertials it is {each}, of which "
            f"{100 * uncertainty:.3g} % are the inertials' own uncertainty. Torque and friction are "
            "known in units of that Kp only. A known mass hung on the robot, the "
            "same motion at two gains, or an unpowered drop would fix the scale"
        )
    if lost := [str(name) for name, word in zip(names, said, strict=True) if not word]:
        out.append(
            f"Not judged: {', '.join(lost)}. No Kp is stated there, and the model's torque does not show clearly "
            "enough in qdes - q to give one; state [kp] in the map (--columns)"
        )
    if dampers := [j for j in estimates if said[j] and any(np.isnan(d.kd[j]) for d in stated)]:
        each = ", ".join(f"{first.kd[j]:.3g} on {names[j]}" for j in dampers)
        out.append(
            f"No Kd is stated: {each} stand for it and for the joint's own viscous friction together, which these "
            "recordings can't tell apart; state [kd] in the map"
        )
    return [f"{note}." for note in out]


def _saturation_notes(recordings: Sequence[Recording]) -> list[str]:
    """How many rows a drive's limit took."""
    out = []
    for r in recordings:
        if not r.is_servo_log or r.torque_lost is None or r.drive is None:
            continue
        known = np.isfinite(r.drive.kp)
        for j in np.flatnonzero(known & r.torque_lost.any(axis=0)):
            out.append(f"{r.source}: {int(r.torque_lost[:, j].sum())} of {len(r.t)} rows of {r.joint_names[j]} are "
                       f"left out: the drive is at its torque limit of {r.drive.limit[j]:.4g} there.")
    return out
