"""From a raw log to smooth, evenly spaced motion: resampling, despiking, differentiation, bandwidth.

Both sides of the torque equation later pass the same low-pass (`Band.low_pass`), so that what it removes is removed
from measurement and model alike.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import interpolate, ndimage

from irb140_jax.recordings.delayed_commands import taken_up
from irb140_jax.recordings.direction import REST, direction_of
from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.low_pass import Band, convolved, filtered, kernels
from irb140_jax.recordings.payload import Payload
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.smooth import white_density, without_noise

CREEPING = 1e-3  # of a joint's highest speed in any recording: slower, what holds it may be dry friction that gives way
OUTLIER = 10.0  # times what a torque usually differs by from its neighbours: a spike of the log ...
LONE = 3.0  # ... if as many times what those differ by among themselves
INEXACT = 0.1  # of what is not known of a servo's Kp: how far its law may be from the torque that it makes


@dataclasses.dataclass(frozen=True)
class Commanded:
    """What a servo was told, on an even grid: what its torque errs by depends on it.

    Attributes:
        drive: Its gains, none unknown but of joints that are not judged.
        command: Commanded positions when they are taken up [rad or m], shape (T, n).
        command_rate: Derivative of the commanded positions, anti-aliased as the torque [rad/s or m/s], shape (T, n).
        asked_speed: Commanded speeds [rad/s or m/s], shape (T, n).
        lag_width: Standard deviation of how much later the torque comes than this says, never earlier [s].
    """

    drive: Drive
    command: np.ndarray
    command_rate: np.ndarray
    asked_speed: np.ndarray
    lag_width: float

    @property
    def inexact(self) -> np.ndarray:
        """Share of the torque by which the law of each servo may be wrong, shape (n,)."""
        return INEXACT * np.nan_to_num(self.drive.kp_width)


@dataclasses.dataclass(frozen=True)
class Conditioned:
    """A recording on an even grid, smoothed and differentiated.

    Attributes:
        source: The recording's name.
        t: Time [s], shape (T,).
        q, qd, qdd: Smoothed motion, shape (T, n).
        tau: Logged torque without spikes, anti-aliased to the grid [N m or N], shape (T, n).
        recorded: False where samples are missing or a torque channel shows nothing, shape (T, n).
        usable: The same, and False where a joint rests: dry friction is undetermined there, shape (T, n).
        rest_speed: Speed that encoder noise can't tell from rest, shape (n,).
        q_noise: Standard deviation of the logged positions' white noise [rad or m], shape (n,).
        direction: sign(qd), and what stands for it near rest (see `direction_of`), anti-aliased as the torque, shape
            (T, n).
        unsure: Standard deviation of the low-passed torque that the samples leave open, shape (T, n): see `_between`.
        notes: Repairs, as sentences.
        began: Time of the log's first row [s]; the smoother leaves out the first samples.
        motion: Number of the motion, the same for recordings of one programme; -1: its own.
        repeats: How many recordings there are of that motion.
        shaken: Standard deviation of what encoder noise leaves in qdd in the band of the comparison [rad/s^2 or
            m/s^2], shape (n,).
        servo: What the servos were told, where their torque was not logged but made; else None.
        payload: A body of known mass on the tool, which the model does not hold; else None.
    """

    source: str
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    recorded: np.ndarray
    usable: np.ndarray
    rest_speed: np.ndarray
    q_noise: np.ndarray
    direction: np.ndarray
    unsure: np.ndarray
    notes: tuple[str, ...]
    began: float = 0.0
    shaken: np.ndarray | None = None
    motion: int = -1
    repeats: int = 1
    servo: Commanded | None = None
    payload: Payload | None = None


def conditioned(recordings: Sequence[Recording], band: Band) -> list[Conditioned]:
    """Recordings that are compared with one model; see `condition`.

    Where a joint is held by dry friction it still creeps, as friction gives way before it slips, and encoders may be
    fine enough to see it.  Beside recordings in which the joint moves, such rows are no motion.
    """
    smooth = [condition(r, band) for r in recordings]
    fastest = np.max([np.abs(r.qd).max(axis=0, initial=0.0) for r in smooth], axis=0)
    creeping = [_held(np.abs(r.qd) < CREEPING * fastest, band.rate) for r in smooth]
    usable = [r.usable & ~_widened(c, band.rate) for r, c in zip(smooth, creeping, strict=True)]
    return [dataclasses.replace(r, usable=u) for r, u in zip(smooth, usable, strict=True)]


def condition(recording: Recording, band: Band, *, pad: bool = False) -> Conditioned:
    """Even grid, despiked torque, smoothed and differentiated motion.

    Args:
        recording: The raw log.
        band: From `choose_band`.
        pad: Extend the ends by reflection instead of leaving out what the filter can't fill (for predictions, which
            owe a value to every row).

    Returns:
        The conditioned recording, without the ends that the smoother can't fill unless `pad`.
    """
    has_torque = recording.has_torque
    if not has_torque:  # the motion alone: filters would spread the NaN
        recording = dataclasses.replace(recording, tau=np.zeros_like(recording.q))
    tau, spikes = (recording.tau, 0) if recording.is_servo_log else _despiked(recording.tau)  # commands may jump
    # Before samples are moved, which would make two of one.
    t, q, tau, missing = even(dataclasses.replace(recording, tau=tau))
    raw_rate = (len(t) - 1) / (t[-1] - t[0])
    h, h1, h2 = kernels(band.position, raw_rate)
    half = (len(h) - 1) // 2
    anti_alias = kernels(min(0.4 * band.rate, 0.45 * raw_rate), raw_rate)[0]
    white = white_density(recording, raw_rate)
    compared = np.convolve(h2, kernels(min(band.torque, 0.45 * raw_rate), raw_rate)[0])  # as accelerations are
    q, (speed_noise, shaken) = without_noise(q, white, raw_rate, (h1, compared), resampled=t is not recording.t)
    keep = slice(None) if pad else slice(half, len(t) - half)
    grid = np.arange(t[keep][0], t[keep][-1] + 1e-9, 1.0 / band.rate)
    hidden, of_joints = np.maximum(3.0 * speed_noise, 1e-6), []
    for j in range(q.shape[1]):  # one at a time: an hour's samples of all joints, some dozen times, fill the memory
        one = slice(j, j + 1)
        smoothed, torque = [convolved(q[:, one], k) for k in (h, h1, h2)], tau[:, one]
        series = (*smoothed, filtered(torque, anti_alias), _between(torque, band, raw_rate))
        on_grid = [_at(grid, t, x) for x in series]
        rest = np.maximum(hidden[one], 0.003 * np.abs(on_grid[1]).max(axis=0, initial=0.0))
        direction = filtered(direction_of(smoothed[1], smoothed[2], hidden[one], rest, raw_rate), anti_alias)
        of_joints.append((*on_grid, _at(grid, t, direction), rest[None]))
    q, qd, qdd, torque, unsure, direction, (rest_speed,) = (
        np.concatenate(x, axis=1) for x in zip(*of_joints, strict=True)
    )
    tau = torque if has_torque else np.full_like(torque, np.nan)
    stuck = _at(grid, recording.t, _within_a_step(recording).astype(float))
    resting = _widened(np.maximum(_held(np.abs(qd) < rest_speed, band.rate), stuck), band.rate)
    # A gap spoils what the smoother and, later, the low-pass reach from it; half their length holds most of that.
    reach = (int(np.ceil(half / raw_rate * band.rate)) + (len(band.low_pass()) - 1) // 2) // 2
    lost = ndimage.maximum_filter1d((np.interp(grid, t, missing.astype(float)) > 0).astype(int), 2 * reach + 1) > 0
    frozen = _lost_torque(recording, grid, reach)
    notes = list(recording.notes)
    if spikes:
        what = "torque spike was" if spikes == 1 else "torque spikes were"
        notes.append(f"{spikes} {what} replaced by the mean of the samples beside")
    recorded, began = ~lost[:, None] & ~frozen, float(recording.t[0])
    moving = (recording.source, grid, q, qd, qdd, tau, recorded, recorded & ~resting)
    q_noise = np.sqrt(0.5 * raw_rate * white)
    servo = _commanded(recording, t, anti_alias, grid) if has_torque else None
    if servo is not None:
        unsure = np.hypot(unsure, servo.inexact * np.abs(filtered(tau, band.low_pass())))
    rest = (rest_speed, q_noise, direction, unsure, tuple(notes), began, shaken)
    return Conditioned(*moving, *rest, servo=servo, payload=recording.payload)


def _commanded(
    recording: Recording, t: np.ndarray, anti_alias: np.ndarray, grid: np.ndarray
) -> Commanded | None:
    """The commands through the filters that the torque passes, or None where there are none."""
    if recording.qdes is None or recording.drive is None:
        return None
    command = taken_up(recording, recording.drive)
    wanted = filtered(_at(t, recording.t, command), anti_alias)
    rate = np.gradient(wanted, t, axis=0)
    speed = np.zeros_like(wanted) if recording.qddes is None else filtered(
        _at(t, recording.t, recording.qddes), anti_alias)  # fmt: skip
    command, rate, speed = (_at(grid, at, x) for at, x in ((recording.t, command), (t, rate), (t, speed)))
    return Commanded(recording.drive, command, rate, speed, recording.drive.time_width)


def _lost_torque(recording: Recording, grid: np.ndarray, reach: int) -> np.ndarray:
    """Where a torque channel is dead or frozen, and what the filters spread of it, shape (len(grid), n)."""
    if recording.torque_lost is None:
        return np.zeros((len(grid), recording.tau.shape[1]), dtype=bool)
    lost = _at(grid, recording.t, recording.torque_lost.astype(float)) > 0.0
    return ndimage.maximum_filter1d(lost.astype(np.uint8), 2 * reach + 1, axis=0) > 0


def _between(tau: np.ndarray, band: Band, rate: float) -> np.ndarray:
    """Standard deviation of the low-passed torque for steps that came between two samples, shape of tau.

    A step may have come at any time between them: on average it is an impulse early or late, of its height times half
    the time between samples, over the root of three.  Steps are what second differences see, and each of them
    twice; what these always see is the sensor's noise.
    """
    bend = np.pad(np.diff(tau, 2, axis=0), ((1, 1), (0, 0)))
    variance = filtered(bend**2 / 24.0, kernels(band.torque, rate)[0] ** 2)
    return np.sqrt(np.maximum(variance - np.median(variance, axis=0), 0.0))


def _held(slow: np.ndarray, rate: float) -> np.ndarray:
    """Where a joint is slow for as long as `REST`, the middle of that, from 0 to 1, shape (T, n)."""
    return ndimage.minimum_filter1d(slow.astype(float), int(REST * rate) | 1, axis=0)


def _widened(held: np.ndarray, rate: float) -> np.ndarray:
    """That, and as much again about it, shape (T, n)."""
    return ndimage.maximum_filter1d(held, int(2 * REST * rate) | 1, axis=0) > 0.5


def _within_a_step(recording: Recording) -> np.ndarray:
    """Rows around which a joint's position stays within one step of its encoder for `REST`, shape (T, n).

    A joint that sticks while its encoder flickers between two counts would otherwise seem to move back and forth.
    """
    step = np.array([np.min(d[d > 0], initial=np.inf) for d in np.abs(np.diff(recording.q, axis=0)).T])
    window = int(REST / np.median(np.diff(recording.t))) | 1
    span = ndimage.maximum_filter1d(recording.q, window, axis=0) - ndimage.minimum_filter1d(recording.q, window, axis=0)
    return span < 1.5 * step


def even(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """t (T,), q and tau (T, n) of a recording on an even grid, and which rows lie in a gap, (T,)."""
    t, dt = recording.t, np.diff(recording.t)
    step = float(np.median(dt))
    if np.max(np.abs(dt - step)) < 0.02 * step:
        return t, recording.q, recording.tau, np.zeros(len(t), dtype=bool)
    rate_step = (t[-1] - t[0]) / max(round((t[-1] - t[0]) / step), 1)
    grid = t[0] + rate_step * np.arange(round((t[-1] - t[0]) / rate_step) + 1)
    grid[-1] = t[-1]
    q = interpolate.CubicSpline(t, recording.q)(grid)
    tau = _at(grid, t, recording.tau)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    return grid, q, tau, dt[after - 1] > max(5 * step, 0.02)


def _at(grid: np.ndarray, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    return interpolate.make_interp_spline(t, x, k=1)(grid)


def _despiked(tau: np.ndarray) -> tuple[np.ndarray, int]:
    """Replace single samples that stand out of neighbours that agree by the mean of the two beside them.

    What several samples or several joints show is no error of the log: a gear's blow lasts 10 to 30 ms and shakes the
    arm.  Rows of nothing but zeros are.
    """
    spike, middle = np.zeros(tau.shape, dtype=bool), np.empty_like(tau)
    for j, own in enumerate(tau.T):
        padded = np.pad(own, 2, mode="edge")
        near = np.stack([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
        middle[:, j] = 0.5 * (near[1] + near[2])
        off = np.abs(own - middle[:, j])
        # Of a coarse channel most samples equal their neighbours, which makes no spike of its least step.
        usual = 1.4826 * np.median(off[off > 0.0]) if off.any() else 0.0
        spike[:, j] = (off > OUTLIER * usual) & (off > LONE * np.ptp(near, axis=0))
    spike &= (spike.sum(axis=1, keepdims=True) == 1) | ~tau.any(axis=1, keepdims=True)
    return np.where(spike, middle, tau), int(spike.sum())
