"""The corrected model as MJCF, as far as MuJoCo expresses the physics natively, and what it can't."""

import dataclasses
import pathlib
from collections.abc import Sequence

import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.mismatch.columns.torques import Named, as_named
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.inertials.consistent import consistent, is_body, of_bodies_or_nominal
from irb140_jax.oracle.mujoco import inverse_dynamics_along, oracle_model
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.drive import Drive
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot, robot_mjcf, with_phi
from irb140_jax.robot.drive import ServoGains

XML, NOTES = "corrected.xml", "corrected.md"


def native_robot(model: CorrectedModel) -> Robot:
    """The corrected model as a `Robot`: refitted inertials, made possible, and of every effect what fits its numbers.

    Its torque of a motion is the joint's; the controller's log shows that torque times `model.robot.gear` over its own
    gear, which holds the torque constants found wrong.
    """
    nominal = np.asarray(model.robot.phi)
    phi = of_bodies_or_nominal(model.phi_corrected, nominal)
    robot = as_named(with_phi(model.robot, on_device(phi)), model.named)
    # Mass and moments of a payload are fitted one by one: with it, a link may be no body any more.
    with_effects = np.asarray(robot.phi)
    bodies = np.array([is_body(p) or not is_body(old) for p, old in zip(with_effects, nominal, strict=True)])
    return with_phi(robot, on_device(np.where(bodies[:, None], with_effects, consistent(with_effects, nominal))))


def save_native(model: CorrectedModel, folder: pathlib.Path) -> None:
    """Write the corrected model as MJCF, and a page on what it holds, into an existing folder."""
    (folder / XML).write_text(native_mjcf(model), encoding="utf-8")
    (folder / NOTES).write_text(_page(model), encoding="utf-8")


def native_mjcf(model: CorrectedModel) -> str:
    """Text of corrected.xml."""
    robot = native_robot(model)
    return robot_mjcf(robot, servos=_servos(model, robot))


def _servos(model: CorrectedModel, native: Robot) -> ServoGains | None:
    """Servos of the file: with the torque constants found wrong, their gains are those of the torque on the joints."""
    if model.drive is None:
        return None
    d, gear = limited(model, model.drive), np.asarray(native.gear) / np.asarray(model.robot.gear)
    return ServoGains(gear * d.kp, gear * d.kd, gear * d.limit, d.low, d.high)


def limited(model: CorrectedModel, drive: Drive) -> Drive:
    """A drive with what was found of servos, as far as gains and limits can hold it."""
    gains = ServoGains(drive.kp, drive.kd, drive.limit, drive.low, drive.high)
    for n in model.named:
        if n.effect.export.in_servo:
            gains = n.effect.export.in_servo(gains, n.joints, n.all_amplitudes(), n.shape)
    return dataclasses.replace(drive, **gains._asdict())


def beyond_file(
    model: CorrectedModel, recordings: Sequence[Conditioned], torques: Sequence[np.ndarray]
) -> list[np.ndarray] | None:
    """What `corrected.xml` lacks of the corrected model's torque along recordings, each (T, n) [N m or N].

    By MuJoCo's own inverse dynamics of the text that is written.

    Args:
        model: The corrected model.
        recordings: Conditioned.
        torques: Of the corrected model along each, as the controller logs them, (T, n).

    Returns:
        The difference along each; None where MuJoCo has other joints than the model.
    """
    robot, others = native_robot(model), tuple(n for n in model.named if not n.effect.export.in_servo)
    if len(others) < len(model.named):
        # What the file's servos hold, they are asked for and don't give, as in the model.
        bare = dataclasses.replace(model, named=others, discrepancy=None)
        torques = [torques_along(bare, r).corrected for r in recordings]
    native = oracle_model(robot_mjcf(robot))
    if native.nv != model.robot.n:
        return None
    gear = np.asarray(model.robot.gear) / np.asarray(robot.gear)
    rigid = [inverse_dynamics_along(native, r.q, r.qd, r.qdd) for r in recordings]
    whole = [tau + native.dof_frictionloss * r.direction for tau, r in zip(rigid, recordings, strict=True)]
    return [torque - tau * gear for torque, tau in zip(torques, whole, strict=True)]


def native_gap(beyond: Sequence[np.ndarray], band: Band) -> np.ndarray:
    """Root mean square (n,) [N m or N] of what the file lacks along recordings, within the comparison's band."""
    return np.sqrt(np.mean(np.concatenate([band.apply(x) for x in beyond]) ** 2, axis=0))


def _page(model: CorrectedModel) -> str:
    whole = [n for n in model.named if not n.effect.export.not_in_mjcf]
    partly = [n for n in model.named if n.effect.export.not_in_mjcf and n.effect.export.mjcf]
    without = [n for n in model.named if n.effect.export.not_in_mjcf and not n.effect.export.mjcf]
    lines = [
        f"# {XML}: {model.robot.name}, corrected",
        "",
        "The inertial parameters are those refitted together with the findings, or the nearest physically possible",
        "ones. The file has no visual or collision geometry; copy it from your own model.",
        "The control of a motor is the torque that the controller commands, so a corrected torque constant is in the",
        "gear of that motor." if model.drive is None else "gear of that motor. Where gains are known, joints have "
        "position servos, controlled by commanded positions.",
    ]
    if model.drive is not None and model.drive.delay.any():
        each = zip(model.drive.delay, model.robot.joint_names, strict=True)
        late = ", ".join(f"{1e3 * x:.3g} ms on {joint}" for x, joint in each)
        lines += ["", f"Commands act later than they are given, which is for you to do: by {late}."]
    if not model.named:
        lines += ["", "The diagnosis names no effect, so only inertial parameters differ from the model as given."]
    for title, part in (("In the file", whole), ("In the file in part", partly), ("Not in the file", without)):
        if part:
            lines += ["", f"## {title}", "", *(_line(model, n) for n in part)]
    if partly or without:
        lines += [
            "", "For what the file lacks, use `irb140_jax.load_corrected` on this folder, or `irb140 predict`.",
            "In a simulation by MuJoCo, laws of friction and of servos act by `irb140_jax.CorrectedMujoco`.",
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _line(model: CorrectedModel, named: Named) -> str:
    effect = named.effect
    joints = ", ".join(model.robot.joint_names[j] for j in named.joints)
    words = [w for w in (effect.export.mjcf, effect.export.not_in_mjcf) if w]
    return f"- {effect.title} on {joints}: {'; '.join(words)}."
