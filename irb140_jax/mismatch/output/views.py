"""Where recording and model part: over position and speed, in time, in frequency, link by link.  Data for people."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import signal

from irb140_jax.mismatch.output.inertials import LinkShift
from irb140_jax.mismatch.records import digits, plain
from irb140_jax.mismatch.regression.rows import Stretch
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.competitors import Axis
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.unexplained import Structure
from irb140_jax.robot import Robot

BINS = 14  # a side of the heat maps
FEW = 4  # rows below which a bin stays empty
TRACE_POINTS = 900  # of a joint along a recording: more than a figure can show
FEWEST_POINTS = 150  # below which a motion of half a minute can't be recognised
MOST_NUMBERS = 30_000  # points of all joints and recordings together: some 1.5 MB in the report
MOST_RANKED = 25
MODELS = ("nominal", "refit", "corrected")
Grid = list[list[float | None]]
Curves = dict[str, list[float | None]]  # by what they are of, for example "measured" or "corrected"
Spectrum = dict[str, list[float]]


@dataclasses.dataclass(frozen=True)
class Maps:
    """Mean residual of a joint over position (rows) and speed (columns); None where the motion never was.

    Attributes:
        q_edges: Of the bins of position [rad or m].
        qd_edges: Of the bins of speed [rad/s or m/s].
        nominal: Residual of the model as given, in `unit`.
        corrected: Of the corrected model, in `unit`.
        unit: "N m" or "N".
    """

    q_edges: list[float]
    qd_edges: list[float]
    nominal: Grid
    corrected: Grid
    unit: str


@dataclasses.dataclass(frozen=True)
class Traces:
    """A recording over time.

    Attributes:
        recording: Its name.
        t: Time [s].
        joints: By joint: "q" [rad or m], "qd", and the torques "measured" and of each model [N m or N].
    """

    recording: str
    t: list[float]
    joints: dict[str, Curves]


@dataclasses.dataclass(frozen=True)
class Ranked:
    """A candidate by its evidence.

    Attributes:
        effect: Its slug.
        joints: Names of its joints.
        delta_bic: Twice the log odds of the data with it.
        probability: 1 if it is among the findings, else 0.
        chosen: Whether it is.
        stage: "alone": over nothing but the inertials.
    """

    effect: str
    joints: tuple[str, ...]
    delta_bic: float
    probability: float
    chosen: bool
    stage: str


@dataclasses.dataclass(frozen=True)
class UnexplainedTorque:
    """What no effect explains of a joint's torque, over what it depends on, on data that the fit did not see.

    Attributes:
        joint: Its name.
        over: Label of the horizontal axis, with its unit.
        unit: Of the torque: "N m" or "N".
        forward: Values on that axis, and torques, of some rows in which the joint moves forward, (R,) each.
        backward: Likewise backward.
    """

    joint: str
    over: str
    unit: str
    forward: tuple[list[float], list[float]]
    backward: tuple[list[float], list[float]]


@dataclasses.dataclass(frozen=True)
class Views:
    """What the report draws.

    Attributes:
        joints: Their names.
        recordings: Their names.
        maps: Residuals over position and speed, by joint.
        motions: The recordings over time.
        ranking: Candidates, the strongest first.
        residual_spectrum: By joint: frequencies "f" [Hz], and residuals of each model [N m/sqrt(Hz)].
        unexplained: What has no name, a joint each.
        inertials: What refitting did to each link.
        notes: Those of the diagnosis.
        motion: What motion.json holds; None where nothing was simulated.
    """

    joints: tuple[str, ...]
    recordings: tuple[str, ...]
    maps: dict[str, Maps] = dataclasses.field(default_factory=dict)
    motions: tuple[Traces, ...] = ()
    ranking: tuple[Ranked, ...] = ()
    residual_spectrum: dict[str, Spectrum] = dataclasses.field(default_factory=dict)
    unexplained: tuple[UnexplainedTorque, ...] = ()
    inertials: tuple[LinkShift, ...] = ()
    notes: tuple[str, ...] = ()
    motion: dict[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        """The contents of views.json."""
        return {name: value for name, value in plain(self).items() if name != "motion"}


def heat_map(q: np.ndarray, qd: np.ndarray, edges: tuple[np.ndarray, np.ndarray], r: np.ndarray) -> Grid:
    """Mean residual by position (rows) and speed (columns); None where the motion never was."""
    count, _, _ = np.histogram2d(q, qd, bins=edges)
    total, _, _ = np.histogram2d(q, qd, bins=edges, weights=r)
    mean = total / np.maximum(count, 1)
    return [
        [None if c < FEW else float(m) for m, c in zip(ms, cs, strict=True)] for ms, cs in zip(mean, count, strict=True)
    ]


def maps(robot: Robot, ex: Explanation, proof: HeldOut) -> dict[str, Maps]:
    """Residual of nominal and corrected model over position and speed of each joint."""
    out = {}
    for j, name in enumerate(robot.joint_names):
        use = [s.use[:, j] for s in ex.data.stretches]
        q = np.concatenate([s.q[u, j] for s, u in zip(ex.data.stretches, use, strict=True)])
        qd = np.concatenate([s.qd[u, j] for s, u in zip(ex.data.stretches, use, strict=True)])
        if len(q) < 50:
            continue
        top = np.max(np.abs(qd))
        edges = (np.linspace(q.min(), q.max() + 1e-12, BINS + 1), np.linspace(-top, top, BINS + 1))
        nominal, corrected = (
            heat_map(q, qd, edges, np.concatenate([r[u, j] for r, u in zip(x, use, strict=True)]))
            for x in (proof.nominal, proof.corrected)
        )
        out[name] = Maps(edges[0].tolist(), edges[1].tolist(), nominal, corrected, robot.torque_units[j])
    return out


def motions(robot: Robot, ex: Explanation, proof: HeldOut, names: Sequence[str]) -> tuple[Traces, ...]:
    """Position, speed, measured and modelled torque of every joint along every recording, on data the fit did not see.

    Thinned evenly, so that a report of many recordings and joints stays a file that opens at once.
    """
    points = int(np.clip(MOST_NUMBERS / (len(names) * robot.n), FEWEST_POINTS, TRACE_POINTS))
    out = []
    for r, (source, s) in enumerate(zip(names, ex.data.stretches, strict=True)):
        rows = slice(0, None, -(-len(s.t) // points))
        joints = {}
        for j, name in enumerate(robot.joint_names):
            measured = s.tau[rows, j]
            joints[name] = {
                "q": s.q[rows, j].tolist(), "qd": s.qd[rows, j].tolist(), "measured": measured.tolist(),
                **{k: (measured - getattr(proof, k)[r][rows, j]).tolist() for k in MODELS},
            }  # fmt: skip
        out.append(Traces(source, s.t[rows].tolist(), joints))
    return tuple(out)


def spectra(robot: Robot, ex: Explanation, proof: HeldOut) -> dict[str, Spectrum]:
    """Amplitude spectral density of the residuals of each joint [N m/sqrt(Hz)], averaged over the recordings."""
    out = {}
    length = min(256, *(len(s.t) for s in ex.data.stretches))
    for j, name in enumerate(robot.joint_names):
        out[name] = {}
        for kind in MODELS:
            density = []
            for s, r in zip(ex.data.stretches, getattr(proof, kind), strict=True):
                rate = (len(s.t) - 1) / (s.t[-1] - s.t[0])
                f, p = signal.welch(np.where(s.use[:, j], r[:, j], 0.0), rate, nperseg=length)
                density.append(p)
            out[name]["f"] = f.tolist()
            out[name][kind] = np.sqrt(np.mean(density, axis=0)).tolist()
    return out


def unexplained_torques(
    robot: Robot, ex: Explanation, proof: HeldOut, rest: Sequence[Structure]
) -> tuple[UnexplainedTorque, ...]:
    """What has no name, over the variable that its sentence says it depends on."""
    out = []
    for s in rest:
        rows = [(x.use[:, s.joint], x, y[:, s.joint]) for x, y in zip(ex.data.stretches, proof.left, strict=True)]
        place = np.concatenate([_along(x, s.axis)[use] for use, x, _ in rows])
        torque, qd = (np.concatenate(v) for v in zip(*((y[u], x.qd[u, s.joint]) for u, x, y in rows), strict=True))
        few = np.arange(len(place)) % -(-len(place) // TRACE_POINTS) == 0
        ways = ((place[way].tolist(), torque[way].tolist()) for way in (few & (qd > 0.0), few & (qd < 0.0)))
        name, unit = robot.joint_names[s.joint], robot.torque_units[s.joint]
        out.append(UnexplainedTorque(name, _label(robot, s.axis), unit, *ways))
    return tuple(out)


def _along(s: Stretch, axis: Axis) -> np.ndarray:
    return s.t - s.begin if axis.quantity == "t" else getattr(s, axis.quantity)[:, axis.joint]


def _label(robot: Robot, axis: Axis) -> str:
    """What an axis shows, in words and with its unit."""
    words, unit = _words_and_unit(robot, axis)
    return f"{words} [{unit}]"


def range_of(robot: Robot, axis: Axis, begin: float, end: float) -> str:
    """A part of an axis in words."""
    words, unit = _words_and_unit(robot, axis)
    return f"{words} from {digits(begin)} to {digits(end)} {unit}"


def _words_and_unit(robot: Robot, axis: Axis) -> tuple[str, str]:
    name, torque = robot.joint_names[axis.joint], robot.torque_units[axis.joint]
    length = "m" if robot.is_slide[axis.joint] else "rad"
    return {
        "q": (f"position of {name}", length), "qd": (f"speed of {name}", f"{length}/s"),
        "qdd": (f"acceleration of {name}", f"{length}/s²"), "nominal": (f"load of {name}", torque),
        "tau": (f"torque of {name}", torque), "t": ("time since the recording began", "s"),
    }[axis.quantity]  # fmt: skip


def ranking(robot: Robot, ex: Explanation) -> tuple[Ranked, ...]:
    """Candidates by evidence, each alone, the strongest first."""
    rows = []
    chosen = {(ex.data.candidates[c].slug, ex.data.candidates[c].joints) for c in ex.chosen}
    # Alone: over nothing but the inertials, with noise and discrepancy of the final model.
    chi = ex.gains((), range(len(ex.data.candidates))) - ex.space.log_prior - ex.space.kinds.one_more(())
    best: dict[tuple[str, tuple[int, ...]], float] = {}
    for c, gain in zip(ex.data.candidates, chi, strict=True):
        best[c.slug, c.joints] = max(best.get((c.slug, c.joints), -np.inf), float(gain))
    possible = [(key, gain) for key, gain in best.items() if np.isfinite(gain)]
    for (slug, joints), gain in sorted(possible, key=lambda item: -item[1])[:MOST_RANKED]:
        named, among = tuple(robot.joint_names[j] for j in joints), (slug, joints) in chosen
        rows.append(Ranked(slug, named, 2.0 * gain, float(among), among, "alone"))
    return tuple(rows)
