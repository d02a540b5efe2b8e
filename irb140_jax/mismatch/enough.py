"""Is there enough to decide?  Noise of the sensors, too few rows, and joints that the recordings can't decide."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax import dynamics
from irb140_jax.effects import AbstractEffect
from irb140_jax.mismatch.along import prepared, scales_of
from irb140_jax.mismatch.assemble import FEWEST_ROWS as FEWEST_OF_A_JOINT
from irb140_jax.mismatch.candidates import Candidate, library
from irb140_jax.mismatch.noise import ORDER
from irb140_jax.mismatch.prove import HeldOut
from irb140_jax.mismatch.testable import REFERENCE_SHARE, Site, reference
from irb140_jax.mismatch.undecided import UNKNOWN_NOISE, Column, Undecided
from irb140_jax.recordings.condition import Conditioned, choose_band, conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.repeats import with_motions_numbered
from irb140_jax.recordings.sensors import torque_scatter
from irb140_jax.robot import Robot

FEWEST_ROWS = 80  # low-passed rows of all recordings together, below which nothing can be said
FEWEST_OF_ONE = 16  # of one recording: fewer have no blocks to leave out, and no noise to measure
POSES = 100  # of a recording, over which the mass matrix is averaged
SECONDS = 3.0  # of motion that a joint must show: less is a few reversals, which any law fits
LARGE = 0.5  # of a joint's torque: an error this large may hide anything
UNLIKE = 3.0  # times the sensors' scatter that can't be called noise any more ...
NOT_SMALL = 0.1  # ... where it is more than this share of the joint's torque


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
        short = [k for k, count in enumerate(rows) if count < FEWEST_OF_ONE]
        if not short or len(short) == len(rows):
            return band, list(recordings), smooth, left_out + again
        left_out += [f"{smooth[k].source} is left out: {rows[k]} samples below {band.torque:.3g} Hz remain of it, and "
                     f"{FEWEST_OF_ONE} are needed." for k in short]  # fmt: skip
        recordings = [r for k, r in enumerate(recordings) if k not in short]


def usable_rows(smooth: Sequence[Conditioned], band: Band) -> np.ndarray:
    """Low-passed rows in which each joint moves and nothing is lost, over all recordings, shape (n,)."""
    return np.sum([r.usable[band.kept(len(r.t))].sum(axis=0) for r in smooth], axis=0)


def too_little(smooth: Sequence[Conditioned], band: Band) -> str:
    """Why no joint at all can be compared, and what to record; empty where one can."""
    rows = sum(len(band.kept(len(r.t))) for r in smooth)
    if rows < FEWEST_ROWS:
        return (
            f"Only {rows} samples below {band.torque:.3g} Hz can be compared with the model, and {FEWEST_ROWS} are "
            "needed: record at least 15 s in which every joint moves, with a dozen reversals"
        )
    most = int(usable_rows(smooth, band).max())
    if most < FEWEST_OF_A_JOINT:
        return (
            f"No joint moves for long enough: at most {most} samples of one can be compared with the model, and "
            f"{FEWEST_OF_A_JOINT} are needed: record at least 15 s in which every joint moves, with a dozen reversals"
        )
    return ""


def all_open(
    robot: Robot, effects: Sequence[AbstractEffect], smooth: Sequence[Conditioned], band: Band, uncertainty: float
) -> tuple[Undecided, dict[Site, tuple[float, int]]]:
    """What is open where nothing was compared: every effect at every site.

    Args:
        robot: The nominal model.
        effects: The library.
        smooth: The conditioned recordings, for the sizes of speeds and positions only.
        band: Of the comparison.
        uncertainty: Relative standard deviation of the inertials.

    Returns:
        The questions for the design of a motion, and how visible each effect was: not at all.
    """
    scales = scales_of([prepared(robot, r) for r in smooth])
    lib = library(robot, effects, scales)
    matters = reference(lib, scales, band.rate)
    shapes: dict[Site, list[Candidate]] = {}
    for c in lib.candidates:
        if not (c.effect.scouts and not matters.amplitudes[c.columns].any()):  # see `testable.visibility`
            shapes.setdefault((c.slug, c.joints), []).append(c)
    middle = [alike[len(alike) // 2] for alike in shapes.values()]
    columns = tuple(Column(c.slug, c.joints, tuple(map(float, c.shape)), c.variant) for c in middle)
    amplitudes = np.concatenate([c.columns for c in middle])
    typical = np.concatenate([np.full(len(c.columns), c.effect.typical) for c in middle])
    scale = typical / REFERENCE_SHARE * np.abs(matters.amplitudes[amplitudes])
    size = 10 * robot.n + len(amplitudes) + 1
    white = np.tile(np.eye(1, ORDER + 1), (robot.n, 1))
    questions = Undecided(
        columns, (), (), (), tuple(range(len(columns))), np.zeros((size, size)), scale,
        matters.in_prior_units(amplitudes, scale), uncertainty, white, UNKNOWN_NOISE * matters.torque, band, scales,
    )  # fmt: skip
    return questions, {site: (0.0, k) for k, site in enumerate(shapes)}


def sensor_scatter(
    robot: Robot, recordings: Sequence[Recording], smooth: Sequence[Conditioned], band: Band
) -> np.ndarray:
    """Standard deviation that torque and position sensors leave in the comparison, shape (n,) [N m or N].

    Torque noise as it is seen above the motion's frequencies, and encoder noise in the accelerations times the mass
    matrix.
    """
    return np.hypot(*scatter_by_sensor(robot, recordings, smooth, band))


def scatter_by_sensor(
    robot: Robot, recordings: Sequence[Recording], smooth: Sequence[Conditioned], band: Band
) -> tuple[np.ndarray, np.ndarray]:
    """The parts of `sensor_scatter` that come from the torque sensors and from the encoders, shape (n,) each."""
    by_torque, by_encoder = [], []
    for raw, r in zip(recordings, smooth, strict=True):
        poses = jnp.asarray(r.q[np.linspace(0, len(r.q) - 1, POSES).astype(int)])
        square = np.mean(np.asarray(_masses(robot, poses)) ** 2, axis=0)
        shaken = np.zeros(robot.n) if r.shaken is None else r.shaken
        by_torque.append(torque_scatter(raw, band) ** 2)
        by_encoder.append(square @ shaken**2)
    return np.sqrt(np.mean(by_torque, axis=0)), np.sqrt(np.mean(by_encoder, axis=0))


def coarse_positions(robot: Robot, by_torque: np.ndarray, by_encoder: np.ndarray, judged: np.ndarray) -> list[str]:
    """A note where the encoders, and not the torque sensors, limit what can be seen: `UNLIKE` times as loud.

    Args:
        robot: The nominal model.
        by_torque, by_encoder: From `scatter_by_sensor`, shape (n,) [N m or N].
        judged: Joints of which enough rows tell, shape (n,).
    """
    coarse = np.flatnonzero(judged & (by_encoder > UNLIKE * by_torque))
    if not len(coarse):
        return []
    each = ", ".join(
        f"{robot.joint_names[j]} ({by_encoder[j]:.2g} {'N' if robot.is_slide[j] else 'N m'} from positions, "
        f"{by_torque[j]:.2g} from torque)" for j in coarse
    )  # fmt: skip
    return [
        "Positions are coarse: their noise limits what can be seen more than the noise of the torque does, on "
        f"{each}. Log positions with more digits or a finer encoder; a friction, offset or inertia smaller than this "
        "noise stays hidden."
    ]


_masses = eqx.filter_jit(jax.vmap(dynamics.mass_matrix, in_axes=(None, 0)))


def torque_size(proof: HeldOut, torque: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviation of each joint's low-passed torque over the rows that count, shape (n,)."""
    out = np.zeros(len(proof.carried))
    for j in range(len(out)):
        values = np.concatenate([x[u[:, j], j] for x, u in zip(torque, proof.use, strict=True)])
        out[j] = np.std(values) if len(values) else 0.0
    return out


def undecidable(
    robot: Robot, proof: HeldOut, torque: Sequence[np.ndarray], scatter: np.ndarray, band: Band
) -> dict[int, str]:
    """Joints of which these recordings can't tell whether anything is left out, each with a sentence why.

    Args:
        robot: The nominal model.
        proof: Errors on unseen data.
        torque: Logged torque, low-passed, one array (R, n) per recording.
        scatter: What the sensors leave, shape (n,).
        band: Of the comparison.
    """
    size, left = torque_size(proof, torque), proof.rmse(proof.corrected)
    seconds = np.sum([u.sum(axis=0) for u in proof.use], axis=0) * band.step / band.rate
    out = {}
    for j in np.flatnonzero(proof.judged):
        name, unit = robot.joint_names[j], "N" if robot.is_slide[j] else "N m"
        if seconds[j] < SECONDS:
            out[int(j)] = (
                f"{name} moves for only {seconds[j]:.2g} s: record at least {SECONDS:g} s in which it moves, better "
                "20 s with a dozen reversals"
            )
        elif left[j] > LARGE * size[j]:
            out[int(j)] = (
                f"the remaining error of {name}, {left[j]:.3g} {unit}, is {100 * left[j] / max(size[j], 1e-300):.0f} % "
                "of its torque and may hide anything: check its columns and units, and record faster or longer motion"
            )
        elif left[j] > max(NOT_SMALL * size[j], UNLIKE * scatter[j]):
            times, share = left[j] / max(scatter[j], 1e-300), 100 * left[j] / max(size[j], 1e-300)
            out[int(j)] = (
                f"the remaining error of {name}, {left[j]:.3g} {unit}, is {times:.2g} times the noise of the sensors "
                f"and {share:.0f} % of its torque: check its columns, and record longer motion"
            )
    return out
