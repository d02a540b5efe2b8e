"""The corrected model as MJCF, as far as MuJoCo expresses the physics natively, and what it can't."""

import pathlib

import jax.numpy as jnp
import numpy as np

from irb140_jax.mismatch.consistent import consistent
from irb140_jax.mismatch.model import CorrectedModel, Named, as_named
from irb140_jax.robot import Robot, robot_mjcf, with_phi

XML, NOTES = "corrected.xml", "corrected.md"


def native_robot(model: CorrectedModel) -> Robot:
    """The corrected model as a `Robot`: refitted inertials, made possible, and of every effect what fits its numbers.

    Its torque of a motion is the joint's; the controller's log shows that torque times `model.robot.gear` over its own
    gear, which holds the torque constants found wrong.
    """
    phi = consistent(model.phi_corrected, np.asarray(model.robot.phi))
    return as_named(with_phi(model.robot, jnp.asarray(phi)), model.named)


def save_native(model: CorrectedModel, folder: pathlib.Path) -> None:
    """Write the corrected model as MJCF, and a page on what it holds, into an existing folder."""
    (folder / XML).write_text(robot_mjcf(native_robot(model)), encoding="utf-8")
    (folder / NOTES).write_text(_page(model), encoding="utf-8")


def _page(model: CorrectedModel) -> str:
    whole = [n for n in model.named if not n.effect.not_in_mjcf]
    partly = [n for n in model.named if n.effect.not_in_mjcf and n.effect.mjcf]
    without = [n for n in model.named if n.effect.not_in_mjcf and not n.effect.mjcf]
    lines = [
        f"# {XML}: {model.robot.name}, corrected",
        "",
        "Inertials as refitted together with the findings, moved by as little as it takes to be those of a possible",
        "body. Shapes to draw or to touch are not in it; copy them from your own model. A motor's control is what the",
        "controller asks for, so a torque constant found wrong is in its gear.",
    ]
    if not model.named:
        lines += ["", "Nothing was named: only inertials differ from the model as given."]
    for title, part in (("In it", whole), ("In it in part", partly), ("Not in it", without)):
        if part:
            lines += ["", f"## {title}", "", *(_line(model, n) for n in part)]
    if partly or without:
        lines += ["", "For what is not in it, use `irb140_jax.load_corrected` on this folder, or `irb140 predict`."]
    return "\n".join(lines) + "\n"


def _line(model: CorrectedModel, named: Named) -> str:
    effect = named.effect
    joints = ", ".join(model.robot.joint_names[j] for j in named.joints)
    words = [w for w in (effect.mjcf, effect.not_in_mjcf) if w]
    return f"- {effect.title} on {joints}: {'; '.join(words)}."
