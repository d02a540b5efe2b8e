"""Columns of the discrepancy and of nuisance parameters with stated prior widths, such as errors of the instrument."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from irb140_jax.effects import Scales
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import Prepared
from irb140_jax.mismatch.regression.discrepancy import Features, features
from irb140_jax.mismatch.regression.rows import margin, row_windows
from irb140_jax.mismatch.regression.servo import NAMES, common_columns, damping_of_scale, scale_width, servo_columns
from irb140_jax.mismatch.regression.tangent import Point, delayed, late
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.payload import distinct, inertials_per_metre
from irb140_jax.robot import Robot

# A joint's own columns with stated widths, in their order; those of a servo come after them.
FIXED = ("gain", "rotor", "smoothing", "bias")
DRIVE_KD, COMMAND_DELAY = (len(FIXED) + NAMES.index(name) for name in ("kd", "command"))  # of servos, after those
COMMON = 3  # nuisance parameters that all joints share, beside those of servos
# Groups of columns with stated widths: errors of the instrument, and those of a servo's drive, which models hold.
INSTRUMENT, DRIVE = -1, -2
# Blocks of a joint whose size is learned from the recordings.
SCALED = ("position", "speed", "smooth", "reversal", "slope")
# Those of them that would stand in the place of dry friction where a joint moves little or in few recordings.
BESIDE_FRICTION = ("smooth", "slope")


@dataclasses.dataclass(frozen=True)
class Nuisances:
    """Columns of one recording beside inertials and effects, low-passed rows as in `Stretch`, in prior units.

    Attributes:
        common: Torque scale, delay and smoothing of all joints, `COMMON` of them; where known payloads sit; and each
            joint's own delay, or of servos the times of commands: those of `common_columns`; shape (R, n, C).
        own: Of each joint, fixed widths first, then the blocks `SCALED`; shape (R, D_j) each.
        groups: Which block each own column belongs to: `INSTRUMENT`, `DRIVE` or an index into `SCALED`; (D_j,) each.
        units: What each own column's feature was multiplied by, shape (D_j,) each.
        dry: How much dry friction each own column holds beside that, shape (D_j,) each.
    """

    common: np.ndarray
    own: tuple[np.ndarray, ...]
    groups: tuple[np.ndarray, ...]
    units: tuple[np.ndarray, ...]
    dry: tuple[np.ndarray, ...]


def feature_coefficients(extra: Nuisances, own: Sequence[np.ndarray], joints: np.ndarray) -> np.ndarray:
    """Coefficients of the discrepancy's features themselves, zero but at some joints, shape (n, FEATURES).

    Args:
        extra: Of any recording.
        own: Coefficients of each joint's own columns.
        joints: At which joints, shape (n,).
    """
    out = []
    for use, v, g, u, dry in zip(joints, own, extra.groups, extra.units, extra.dry, strict=True):
        mine = (g >= 0) & (g < SCALED.index("slope"))
        out.append(np.append((v * u)[mine], dry[mine] @ v[mine]) * use)
    return np.stack(out)


def payload_columns(robot: Robot, along: Sequence[Prepared]) -> list[np.ndarray]:
    """Torque per standard deviation of where each known payload sits, along each recording, (T, n, 3 P) [N m or N].

    Args:
        robot: The nominal model.
        along: The recordings.  Those with the same payload carried the same body.
    """
    carried, out = distinct([a.recording.payload for a in along]), []
    for a in along:
        dphi = np.zeros((robot.n, 10, 3 * len(carried)))
        for p in (p for p in carried if p == a.recording.payload):
            at = 3 * carried.index(p)
            dphi[-1, :, at : at + 3] = settings.PAYLOAD_PLACED * inertials_per_metre(robot, p)
        out.append(a.torque_of(dphi.reshape(10 * robot.n, -1)))
    return out


def _low_passed(own: Features, j: int, band: Band, at: Point | None, dt: float) -> list[np.ndarray]:
    """Blocks of a joint's features, as late as the log has its torque, through the low-pass window by window."""
    parts = []
    for window in row_windows(band, len(own.x), margin(at, dt)):
        blocks = (late(at, x, np.full(x.shape[1], j), dt) for x in own.blocks(window.samples))
        parts.append([window.low_passed(x, band) for x in blocks])
    return [np.concatenate(x) for x in zip(*parts, strict=True)]


def nuisances(
    robot: Robot,
    along: Sequence[Prepared],
    torques: Sequence[tuple[np.ndarray, np.ndarray]],
    band: Band,
    scales: Scales,
    at: Point | None = None,
) -> list[Nuisances]:
    """Columns of all recordings; features of the discrepancy have the RMS of the joint's torque over all of them.

    Where the log was found to be late, these columns are as late as its torque.

    Args:
        robot: The nominal model.
        along: The recordings with what the rigid body does along them.
        torques: Of the model as corrected so far along each: without friction, and all of it, (T, n) [N m or N].
            A torque scale multiplies the former: friction is stated in the torque that was logged.
        band: Of the comparison.
        scales: Sizes over all recordings.
        at: Of the last explanation, if there is one.
    """
    n, count = robot.n, len(along)
    raw: list[list[list[np.ndarray]]] = []  # recording, joint, block
    turned: list[np.ndarray] = []  # recording
    commons, placed = [], payload_columns(robot, along)
    for r, (a, (load, total)) in enumerate(zip(along, torques, strict=True)):
        motion, dt = a.recording, float(np.mean(np.diff(a.recording.t)))
        rate = delayed(at, total, dt)
        # What each recording has beside the mean of all; of one recording there is nothing beside it.
        own = (np.arange(count) == r) - 1.0 / count if count > 1 else np.zeros(0)
        early = motion.servo.lag_width if motion.servo else settings.DELAY_COMMON
        bend = settings.SMOOTHED * np.gradient(np.gradient(total, dt, axis=0), dt, axis=0)
        rotor = settings.ROTOR_ERROR * np.asarray(robot.armature) * motion.qdd
        bias = settings.BIAS * scales.torque * (1.0 - np.abs(motion.direction))
        gain, bend, rotor, bias = (late(at, x, np.arange(n), dt) for x in (load, bend, rotor, bias))
        held = [late(at, x, np.arange(n), dt)[..., None] for x in np.moveaxis(placed[r], -1, 0)]
        gain = gain + damping_of_scale(motion)
        common = np.stack([settings.GAIN_COMMON * gain, early * rate, 2.0 * bend], axis=-1)
        common = band.apply(np.concatenate([common, *held, common_columns(motion, own)], axis=-1))
        if motion.servo is None:
            of_one = settings.DELAY_JOINT / settings.DELAY_COMMON * common[:, :, 1]
            common = np.concatenate([common, of_one[:, :, None] * np.eye(n)], axis=-1)
        commons.append(common)
        joints = []
        turned.append(band.apply(late(at, motion.direction, np.arange(n), dt)))
        for j in range(n):
            wide = np.hypot(settings.GAIN_JOINT, scale_width(motion, j))
            fixed = (wide * gain[:, j], rotor[:, j], bend[:, j], bias[:, j])
            fixed = np.concatenate([np.stack(fixed, axis=1), servo_columns(motion, j)], axis=1)
            fast = motion.qd[:, [j]] / scales.speed[j]  # levels of dry and viscous friction about a law's
            slope = np.concatenate([motion.direction[:, [j]] * own, fast * own], axis=1)
            slope = band.apply(late(at, slope, np.full(slope.shape[1], j), dt))
            blocks = _low_passed(features(motion, load, scales, j), j, band, at, dt)
            joints.append([band.apply(fixed), *blocks, slope])
        raw.append(joints)
    out: list[tuple[list[np.ndarray], list[np.ndarray]]] = [([], []) for _ in along]
    units, dry = [], []
    for j in range(n):
        factors, parts = [np.ones(raw[0][j][0].shape[1])], [np.zeros(raw[0][j][0].shape[1])]
        moved = sum(float(x[:, j] @ x[:, j]) for x in turned)
        for block, name in enumerate(SCALED, 1):
            power = sum(np.sum(raw[r][j][block] ** 2, axis=0) for r in range(count))
            rows = sum(len(raw[r][j][block]) for r in range(count))
            rms = np.sqrt(power / rows)
            gone = rms < 1e-9 * np.max(rms, initial=1e-300)
            width = max(raw[0][j][block].shape[1], 1)
            # Slopes are shares of a friction level; a discrepancy of size one is as large as the torque.
            level = name == "slope"
            size = scales.torque[j] / (1.0 if level else np.sqrt(width))
            factor = np.where(gone, 0.0, size / np.where(gone, 1.0, 1.0 if level else rms))
            factors.append(factor)
            parts.append(np.zeros(len(factor)))
            if name in BESIDE_FRICTION:
                alike = sum(x[:, j] @ raw[r][j][block] for r, x in enumerate(turned))
                parts[-1] = -alike * factor / max(moved, 1e-300)
            for r in range(count):
                raw[r][j][block] = raw[r][j][block] * factor + turned[r][:, [j]] * parts[-1]
        units.append(np.concatenate(factors))
        dry.append(np.concatenate(parts))
        group = np.repeat(np.arange(INSTRUMENT, len(SCALED)), [b.shape[1] for b in raw[0][j]])
        group[len(FIXED) : raw[0][j][0].shape[1]] = DRIVE
        for r in range(count):
            out[r][0].append(np.concatenate(raw[r][j], axis=1))
            raw[r][j].clear()
            out[r][1].append(group)
    return [
        Nuisances(c, tuple(own), tuple(g), tuple(units), tuple(dry)) for c, (own, g) in zip(commons, out, strict=True)
    ]
