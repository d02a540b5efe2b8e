"""The corrected model: nominal robot, refitted inertials, and the named effects with their parameters."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.effects import Effect
from irb140_jax.effects.catalogue import known
from irb140_jax.errors import InputError
from irb140_jax.mismatch.columns.along import all_prepared
from irb140_jax.mismatch.columns.torques import Named, Torques, better_known, torques_of
from irb140_jax.mismatch.regression.discrepancy import Discrepancy
from irb140_jax.mismatch.regression.tangent import late, point
from irb140_jax.recordings.condition import Conditioned, condition
from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.low_pass import Band, filtered, kernels
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot

SCHEMA = 5  # of model.json; an effect's amplitudes are those of its columns, so it changes where these do


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


def torques_along(model: CorrectedModel, recording: Conditioned) -> Torques:
    """The model's torques along a conditioned recording, on its grid."""
    nominal_phi = np.asarray(model.robot.phi)
    refit, corrected = ((phi - nominal_phi).ravel() for phi in (model.phi_refit, model.phi_corrected))
    better = better_known(model.robot, model.phi_corrected, model.named)
    (along,) = all_prepared(model.robot, [recording], better)
    torques = torques_of(model.robot, model.named, along, refit, corrected)
    if model.discrepancy is None:
        return torques
    rest = model.discrepancy.along(recording, torques.loads.load)
    at, dt = point(model.robot, corrected, model.named), float(np.mean(np.diff(recording.t)))
    rest = late(at, rest, np.arange(model.robot.n), dt)
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


def from_json(data: dict[str, Any], effects: Sequence[Effect] = ()) -> CorrectedModel:
    """The inverse of `to_json`; `effects` are those that are not in the catalogue.

    Raises:
        InputError: The model holds an effect that is neither among these nor in the catalogue.
    """
    robot = data["robot"]
    leaves = {k: on_device(np.array(_infinite(v), dtype=float)) for k, v in robot["leaves"].items()}
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
                known(e["effect"], effects), tuple(e["joints"]), tuple(e["variant"]),
                np.array(e["amplitudes"], dtype=float), np.array(e["shape"], dtype=float),
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
