"""Does this recording make sense in itself?  Times, motion, and whether speeds and positions speak of the same "
  "joint."""

import dataclasses
import pathlib

import numpy as np
from scipy.optimize import linear_sum_assignment

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.lost_channels import with_lost_torque_marked
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repair import longest_run
from irb140_jax.robot import Robot

MIN_SAMPLES = 200  # below, no filter has an inside and no statistics a sample
MIN_DURATION = 1.0  # s
RATES = (10.0, 50_000.0)  # Hz; slower can't be differentiated, faster is a wrong unit of time
LOW_RATE = 50.0  # Hz; worth a note: friction reversals blur
TIME_UNITS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
MIN_TRAVEL = (1e-3, 1e-4)  # [rad], [m]; a robot that moves less shows its noise only
MOVING = (0.02, 0.002)  # [rad], [m]; below, a joint counts as standing still
DEGREES = 180.0 / np.pi
FLAT_SHARE = 0.01  # of the samples at exactly the largest torque that makes it look clipped
LOST_SHARE, LONG_GAP = 0.005, 0.05  # share of the samples, and seconds, that make lost samples worth a note
JITTER = 0.05  # relative spread of the time steps worth a note
LIMIT_MARGIN = (0.1, 0.01)  # [rad], [m] beyond the model's limits worth a note


def check_times(t: np.ndarray, rows: np.ndarray, path: pathlib.Path | str, notes: list[str]) -> None:
    """Refuse times that do not rise, are in a wrong unit, or are too few; note jitter and lost samples.

    Args:
        t: Time, shape (T,) [s, if all is well].
        rows: Row numbers in the file, for messages, shape (T,).
        path: The file, for messages.
        notes: Sentences are appended here.
    """
    if not np.isfinite(t).all():
        row = rows[np.flatnonzero(~np.isfinite(t))[0]]
        raise RecordingError(f"{path}: column t, row {row}: the time is missing; every row needs a time, delete the "
                             "row")
    dt = np.diff(t)
    falling = np.flatnonzero(dt <= 0)
    if len(falling):
        i = falling[0]
        what = "stands still" if dt[i] == 0 else "goes back"
        more = f" ({len(falling)} such rows)" if len(falling) > 1 else ""
        raise RecordingError(f"{path}: column t, row {rows[i + 1]}: the time {what}, from {t[i]:.9g} to "
                             f"{t[i + 1]:.9g}{more}; it must rise from row to row: sort the rows, or cut the file "
                             "where a new run begins")
    if len(t) < MIN_SAMPLES:
        raise RecordingError(f"{path}: too short: {len(t)} samples; allowed is {MIN_SAMPLES} samples and "
                             f"{MIN_DURATION:g} s at least: record a longer motion")
    step = float(np.median(dt))
    if not 1 / RATES[1] <= step <= 1 / RATES[0]:
        fits = [name for name, unit in TIME_UNITS.items() if 1 / RATES[1] <= step * unit <= 1 / RATES[0]]
        guess = "give the time in seconds"
        if fits:
            unit = TIME_UNITS[fits[0]]
            guess = f"this looks like {fits[0]}: divide by {1 / unit:.0f}, or map it with --columns and [scale] "
            guess += f"t = {unit:g}"
        raise RecordingError(f"{path}: column t: the median step is {step:.6g}, so {1 / step:.4g} samples a second if "
                             f"these are seconds; allowed is {RATES[0]:g} to {RATES[1]:g}; {guess}")
    if t[-1] - t[0] < MIN_DURATION:
        raise RecordingError(f"{path}: too short: {t[-1] - t[0]:.3g} s; allowed is {MIN_DURATION:g} s at least: record "
                             "a longer motion, or check that t is in seconds")
    if step > 1 / LOW_RATE:
        notes.append(f"Only {1 / step:.3g} samples a second: what happens within {2000 * step:.0f} ms can't be seen")
    lost = int(np.sum(np.round(dt[dt > 1.5 * step] / step) - 1))
    i = int(np.argmax(dt))
    if lost > LOST_SHARE * len(t) or dt[i] > LONG_GAP:
        notes.append(f"About {lost} samples are missing ({lost / (lost + len(t)):.1%}); the longest gap is "
                     f"{1000 * dt[i]:.0f} ms after row {rows[i]}")
    spread = float(np.std(dt[dt < 1.5 * step]) / step)
    if spread > JITTER:
        notes.append(f"The time step jitters by {spread:.0%} about its median of {1000 * step:.3g} ms")


def check_motion(recording: Recording, seen: Glance, robot: Robot) -> Recording:
    """Refuse motion and torque that contradict themselves; note what is odd but may be so.

    Returns:
        The recording with notes added.

    Raises:
        RecordingError: Nothing moves, no moving joint has a torque that changes, or logged speeds belong to another
            unit, sign or joint than the positions.
    """
    least = lambda pair: np.where(robot.is_slide, pair[1], pair[0])  # noqa: E731
    names, source = recording.joint_names, recording.source
    if np.all(seen.travel < least(MIN_TRAVEL)):
        raise RecordingError(f"{source}: the robot does not move: no q.* changes by more than {seen.travel.max():.1e}; "
                             "record a motion, or map the columns that hold the measured positions with --columns "
                             "FILE.toml")
    moving = seen.travel > least(MOVING)
    if recording.has_torque:
        recording = with_lost_torque_marked(recording, least(MOVING), robot)
        if moving.any() and not np.ptp(recording.tau[:, moving], axis=0).any():
            raise RecordingError(f"{source}: no moving joint has a torque that changes: columns "
                                 f"{', '.join('tau.' + names[j] for j in np.flatnonzero(moving))} are dead channels; "
                                 "log motor torques or currents, or map the columns that hold them with --columns "
                                 "FILE.toml")
    if seen.logged_qd is not None:
        _check_derivative(recording, seen.qd, seen.logged_qd, moving, ("qd", "q"))
    if seen.logged_qdd is not None:
        _check_derivative(recording, seen.qdd, seen.logged_qdd, moving, ("qdd", "q twice"))
    dead = False if recording.torque_lost is None else recording.torque_lost.all(axis=0)
    notes = [*recording.notes, *(f"Joint {names[j]} stands still: what depends on its motion can't be seen"
                                 for j in np.flatnonzero(~moving & ~dead))]
    for j, name in enumerate(names):
        if recording.has_torque:
            notes += _clipping_note(recording.tau[:, j], name)
        lower, upper = float(robot.lower[j]), float(robot.upper[j])
        beyond = max(np.max(recording.q[:, j]) - upper, lower - np.min(recording.q[:, j]))
        if beyond > least(LIMIT_MARGIN)[j]:
            unit = "m" if robot.is_slide[j] else "rad"
            notes.append(f"Joint {name} goes {beyond:.2g} {unit} beyond the limits in the model ({lower:.3g} to "
                         f"{upper:.3g} {unit}): its zero or the model's limits may be wrong")
    return dataclasses.replace(recording, notes=tuple(notes))


def _check_derivative(
    recording: Recording, derived: np.ndarray, logged: np.ndarray, moving: np.ndarray, kind: tuple[str, str]
) -> None:
    """Compare a logged derivative with that of q: the same joint, unit and sign?"""
    (name, of), names, source = kind, recording.joint_names, recording.source
    correlation = _correlation(derived, logged)
    # Another joint's speed: the best pairing is not the given one, and it is far better for every joint it moves.
    _, best = linear_sum_assignment(-np.abs(correlation))
    own = np.abs(np.diag(correlation))
    swapped = [j for j, k in enumerate(best) if k != j and moving[j]]
    if swapped and all(abs(correlation[j, best[j]]) > 0.9 and own[j] < 0.5 for j in swapped):
        pairs = ", ".join(f"{name}.{names[best[j]]} follows q.{names[j]}" for j in swapped)
        raise RecordingError(f"{source}: columns of {name} and q belong to different joints: {pairs}; put the columns "
                             "in order, or exchange them with --columns FILE.toml")
    for j in np.flatnonzero(moving):
        if own[j] < 0.9:
            continue
        ratio = float(np.std(derived[:, j]) / np.std(logged[:, j]))
        if correlation[j, j] < 0:
            raise RecordingError(f"{source}: column {name}.{names[j]} has the opposite sign of the derivative of "
                                 f"q.{names[j]}; one of them is reversed: map it with --columns and [scale] "
                                 f"\"{name}.{names[j]}\" = -1")
        for factor, text in ((DEGREES, f"q.{names[j]} is in degrees and {name}.{names[j]} in radians"),
                             (1 / DEGREES, f"q.{names[j]} is in radians and {name}.{names[j]} in degrees")):
            if abs(ratio / factor - 1) < 0.2:
                wrong = f"q.{names[j]}" if factor > 1 else f"{name}.{names[j]}"
                raise RecordingError(f"{source}: {text}: the derivative of {of} is {ratio:.3g} times {name}; radians "
                                     f"are wanted: convert it, or map it with --columns and [scale] \"{wrong}\" = "
                                     "\"deg\"")
        for unit, factor in TIME_UNITS.items():
            if abs(ratio / factor - 1) < 0.2:
                raise RecordingError(f"{source}: the derivative of {of} is {ratio:.3g} times {name}.{names[j]}: t "
                                     f"looks like {unit}; map it with --columns and [scale] t = {factor:g}")
        if not 0.5 < ratio < 2.0:
            raise RecordingError(f"{source}: column {name}.{names[j]} does not fit q.{names[j]}: the derivative of "
                                 f"{of} is {ratio:.3g} times it; both are wanted in SI units on the joint side: "
                                 f"convert one of them, or leave {name} out to have it derived")


def _correlation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Correlation of every column of a with every column of b, 0 where one of them is constant."""
    unit = lambda x: (x - x.mean(0)) / np.maximum(np.linalg.norm(x - x.mean(0), axis=0), 1e-300)  # noqa: E731
    return np.where((np.ptp(a, axis=0) > 0)[:, None] & (np.ptp(b, axis=0) > 0)[None, :], unit(a).T @ unit(b), 0.0)


def _clipping_note(tau: np.ndarray, name: str) -> list[str]:
    """A note when the torque rests at its largest value, as a limited drive does."""
    for end, word in ((tau.max(), "highest"), (tau.min(), "lowest")):
        flat = np.abs(tau - end) <= 1e-9 * abs(end)
        if np.ptp(tau) > 0 and flat.mean() > FLAT_SHARE and longest_run(flat)[0] >= 5:
            return [f"tau.{name} rests at its {word} value {end:.4g} in {flat.mean():.1%} of the samples: the drive "
                    "looks saturated there"]
    return []


def checked_numbers(recording: Recording) -> Recording:
    """The recording, if it is made of numbers, and of as many as a file must hold.

    Raises:
        RecordingError: It isn't.
    """
    if len(recording.t) < MIN_SAMPLES:
        raise RecordingError(
            f"{recording.source}: too short: {len(recording.t)} samples; allowed is {MIN_SAMPLES} samples at least: "
            "record a longer motion"
        )
    for name in ("t", "q", "tau"):
        bad = np.argwhere(~np.isfinite(getattr(recording, name)))
        if len(bad):
            column = name if name == "t" else f"{name}.{recording.joint_names[bad[0][1]]}"
            raise RecordingError(
                f"{recording.source}: {column}, sample {bad[0][0] + 1}: not a finite number; a diagnosis needs time, "
                "positions and torque in every sample: read the file with read_recording, which mends a few gaps"
            )
    return recording
