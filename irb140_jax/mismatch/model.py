"""The corrected model: nominal robot, refitted inertials, and the named effects with their parameters."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from irb140_jax.effects import AbstractEffect
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from irb140_jax.mismatch.along import Columns, Loads, columns_along, prepared, seen_by
from irb140_jax.mismatch.candidates import Candidate, Library
from irb140_jax.mismatch.consistent import consistent
from irb140_jax.mismatch.regression.discrepancy import Discrepancy
from irb140_jax.mismatch.silent import SILENT
from irb140_jax.recordings.condition import Conditioned, condition
from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.low_pass import Band, filtered, kernels
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot, with_phi

SCHEMA = 2  # of model.json


@dataclasses.dataclass(frozen=True)
class Named:
    """A named effect with its numbers.

    Attributes:
        effect: The effect.
        joints: Indices of its joints.
        variant: Columns it uses.
        amplitudes: One per column used.
        shape: Shape parameters.
    """

    effect: AbstractEffect
    joints: tuple[int, ...]
    variant: tuple[int, ...]
    amplitudes: np.ndarray
    shape: np.ndarray

    def all_amplitudes(self) -> np.ndarray:
        """Amplitudes of every column of the effect, zero for those it doesn't use."""
        full = np.zeros(max(max(v) for v in self.effect.variants) + 1)
        full[list(self.variant)] = self.amplitudes
        return full


def scaled(n: int, named: Sequence[Named], scale: float) -> tuple[Named, ...]:
    """The effects where one scale of all torques is off: a torque gain on every joint.

    Friction was found in the torque that is logged; the model holds the real one, which the gain turns into it.

    Args:
        n: Number of joints.
        named: The effects.
        scale: Logged over real torque, less one.
    """
    if not scale:
        return tuple(named)
    gain, out = CATALOGUE["torque_gain"], []
    for one in named:
        if one.effect.friction:
            out.append(dataclasses.replace(one, amplitudes=one.amplitudes / (1.0 + scale)))
        elif one.effect is not gain:
            out.append(one)
    own = {m.joints[0]: m.amplitudes[0] for m in named if m.effect is gain}
    every = (np.array([scale + own.get(j, 0.0)]) for j in range(n))
    return (*out, *(Named(gain, (j,), (0,), w, np.zeros(0)) for j, w in enumerate(every)))


def as_named(robot: Robot, named: Sequence[Named]) -> Robot:
    """The robot with as much of the effects in its own numbers as those can hold."""
    for n in named:
        robot = n.effect.in_model(robot, n.joints, n.all_amplitudes(), n.shape)
    return robot


def better_known(robot: Robot, phi: np.ndarray, named: Sequence[Named]) -> Robot:
    """The robot whose slopes over position and speed shape the effects: refitted inertials, and the springs named.

    The load that effects see holds those springs; without them in the slopes, play would be taken out of a link that
    is softer or stiffer than its load says.  Links are possible bodies: what swings on a spring has a mass.

    Args:
        robot: The nominal model.
        phi: Inertial parameters, shape (n, 10).
        named: The effects.
    """
    sprung = as_named(robot, named)
    springs = lambda r: (r.stiffness, r.springref)  # noqa: E731
    possible = consistent(phi, np.asarray(robot.phi))
    return eqx.tree_at(springs, with_phi(robot, jnp.asarray(possible)), springs(sprung))


@dataclasses.dataclass(frozen=True)
class Torques:
    """Torques along a motion, each (T, n) [N m or N].

    Attributes:
        nominal: Of the model as given.
        refit: Of the rigid body with refitted inertials.
        loads: Of the corrected model: transmissions carry the corrected rigid body and all effects, but for friction
            and what only the log shows.
        corrected: What the controller logs: total, by its torque constants, when and as it was asked for.
    """

    nominal: np.ndarray
    refit: np.ndarray
    loads: Loads
    corrected: np.ndarray


@dataclasses.dataclass(frozen=True)
class CorrectedModel:
    """What a diagnosis leaves behind for predictions.

    Attributes:
        robot: The nominal model.
        phi_refit: Inertial parameters refitted without effects, shape (n, 10).
        phi_corrected: Inertial parameters refitted with the effects, shape (n, 10).
        named: The effects.
        band: Of the comparison.
        rest_speed: Speed that the encoders of the recordings can't tell from rest [rad/s or m/s], shape (n,).
        known_joints: Every joint of the model's file, in its order, of which the robot may be a part: column maps
            number joints by it.
        discrepancy: What the laws leave without a name, where it helps on unseen motions.
        drive: Of the servos, where the recordings held commands in place of torque.
    """

    robot: Robot
    phi_refit: np.ndarray
    phi_corrected: np.ndarray
    named: tuple[Named, ...]
    band: Band
    rest_speed: np.ndarray
    known_joints: tuple[str, ...] = ()
    discrepancy: Discrepancy | None = None
    drive: Drive | None = None


def composed(
    lib: Library,
    along: Columns,
    candidates: Sequence[Candidate],
    amplitudes: Sequence[np.ndarray],
    dphi_refit: np.ndarray,
    dphi_corrected: np.ndarray,
) -> Torques:
    """Add up a model's torques along a recording.

    Args:
        lib: The library of the candidates.
        along: Regressor, nominal torque and columns.
        candidates: The effects.
        amplitudes: Amplitudes of each.
        dphi_refit, dphi_corrected: Shift of the inertial parameters in either model, shape (10 n,).
    """
    Y, nominal, inside, columns = along
    load = nominal + Y @ dphi_corrected
    friction, logged = np.zeros_like(load), np.zeros((2, *load.shape))
    for c, w in zip(candidates, amplitudes, strict=True):
        part = lib.torque(columns, c.columns, w)
        if c.effect.logged:
            logged[c.effect.logged - 1] += part
        elif c.effect.friction:
            friction += part
        else:
            load = load + part
            inside = inside + part if c.effect.transmission else inside
    total = load + friction
    scaled, corrected = total + np.cumsum(logged, axis=0)
    return Torques(nominal, nominal + Y @ dphi_refit, Loads(load, total, load - inside, scaled), corrected)


def library_of(robot: Robot, effects: Sequence[Named]) -> Library:
    """A library of nothing but these effects, in their order."""
    blocks, candidates, first = [], [], 0
    for named in effects:
        width = max(max(v) for v in named.effect.variants) + 1
        blocks.append((named.effect, np.array([named.joints]), named.shape[None, None, :], first))
        candidates.append(
            Candidate(named.effect, named.joints, named.shape, first + np.array(named.variant), named.variant,
                      np.full(len(named.variant), -np.inf), np.full(len(named.variant), np.inf))
        )  # fmt: skip
        first += width
    return Library(robot, tuple(candidates), tuple(blocks), first)


def torques_along(model: CorrectedModel, recording: Conditioned) -> Torques:
    """The model's torques along a conditioned recording, on its grid."""
    lib = library_of(model.robot, model.named)
    nominal_phi = np.asarray(model.robot.phi)
    shifts = [(phi - nominal_phi).ravel() for phi in (model.phi_refit, model.phi_corrected)]
    amplitudes = [named.amplitudes for named in model.named]
    along = seen_by(better_known(model.robot, model.phi_corrected, model.named), prepared(model.robot, recording))
    torques = composed(lib, columns_along(lib, along), lib.candidates, amplitudes, *shifts)
    if model.named:
        # Columns that depend on the load see the corrected one, as they did in the fit.
        torques = composed(lib, columns_along(lib, along, torques.loads), lib.candidates, amplitudes, *shifts)
    if model.discrepancy is None:
        return torques
    rest = model.discrepancy.along(recording, torques.loads.load)
    return dataclasses.replace(torques, corrected=torques.corrected + rest)


def predict(model: CorrectedModel, recording: Recording) -> dict[str, np.ndarray]:
    """Torques of the diagnosed models along a new recording, one row a row of its file.

    They hold no frequencies above those of the smoothed positions.  Where friction jumps, so does the acceleration, and
    the torque does not: a sharp jump beside a rounded one would leave their difference.

    Returns:
        "nominal", "refit" and "corrected", each (rows, n) [N m or N], at the times `prediction_times`.

    Raises:
        InputError: The recording has other joints than the model.
    """
    if tuple(recording.joint_names) != model.robot.joint_names:
        raise InputError(
            f"{recording.source}: holds joints {', '.join(recording.joint_names)}; the diagnosis is of a robot with "
            f"joints {', '.join(model.robot.joint_names)}"
        )
    smooth = condition(recording, model.band, pad=True)
    torques = torques_along(model, smooth)
    t, out = prediction_times(recording), {}
    taps = kernels(model.band.position, model.band.rate)[0]
    for name in ("nominal", "refit", "corrected"):
        values = filtered(getattr(torques, name), taps)
        out[name] = np.stack([np.interp(t, smooth.t, values[:, j]) for j in range(values.shape[1])], axis=1)
    return out


def prediction_times(recording: Recording) -> np.ndarray:
    """Times at which `predict` gives torques [s]: one for every row of the file, repeated rows included."""
    return recording.t if recording.file_t is None else recording.file_t


def to_json(model: CorrectedModel) -> dict[str, Any]:
    """Everything of a model as JSON."""
    arrays, static = eqx.partition(model.robot, eqx.is_array)
    leaves = {f.name: np.asarray(getattr(arrays, f.name)).tolist() for f in dataclasses.fields(Robot)
              if eqx.is_array(getattr(arrays, f.name))}  # fmt: skip
    return {
        "schema": SCHEMA,
        "robot": {
            "leaves": _finite(leaves), "joint_names": static.joint_names, "is_slide": static.is_slide,
            "name": static.name, "parent": static.parent,
        },
        "phi_refit": model.phi_refit.tolist(),
        "phi_corrected": model.phi_corrected.tolist(),
        "band": dataclasses.asdict(model.band),
        "rest_speed": model.rest_speed.tolist(),
        "known_joints": list(model.known_joints or model.robot.joint_names),
        "effects": [
            {
                "effect": n.effect.slug, "joints": list(n.joints), "variant": list(n.variant),
                "amplitudes": n.amplitudes.tolist(), "shape": n.shape.tolist(),
            }
            for n in model.named
        ],
        "discrepancy": model.discrepancy.to_json() if model.discrepancy else None,
    } | ({"drive": model.drive.to_json()} if model.drive else {})  # fmt: skip


def from_json(data: dict[str, Any]) -> CorrectedModel:
    """The inverse of `to_json`."""
    robot = data["robot"]
    leaves = {k: jnp.asarray(np.array(_infinite(v), dtype=float)) for k, v in robot["leaves"].items()}
    known = CATALOGUE | SILENT
    return CorrectedModel(
        Robot(
            **leaves,  # pyright: ignore[reportArgumentType]: arrays only, static fields are named below
            joint_names=tuple(robot["joint_names"]), is_slide=tuple(robot["is_slide"]), name=robot["name"],
            parent=tuple(robot.get("parent", ())),
        ),
        np.array(data["phi_refit"]),
        np.array(data["phi_corrected"]),
        tuple(
            Named(
                known[e["effect"]], tuple(e["joints"]), tuple(e["variant"]), np.array(e["amplitudes"], dtype=float),
                np.array(e["shape"], dtype=float),
            )
            for e in data["effects"]
        ),
        Band(**data["band"]),
        np.array(data["rest_speed"], dtype=float),
        tuple(data.get("known_joints", robot["joint_names"])),
        Discrepancy.from_json(data["discrepancy"]) if data["discrepancy"] else None,
        Drive.from_json(data["drive"]) if data.get("drive") else None,
    )  # fmt: skip


def _finite(x: Any) -> Any:
    """JSON has no infinity: limits that a model lacks are written as the words "inf" and "-inf"."""
    if isinstance(x, dict):
        return {k: _finite(v) for k, v in x.items()}
    if isinstance(x, list):
        return [_finite(v) for v in x]
    return x if np.isfinite(x) else str(x)


def _infinite(x: Any) -> Any:
    return [_infinite(v) for v in x] if isinstance(x, list) else float(x)
