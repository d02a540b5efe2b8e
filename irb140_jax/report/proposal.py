"""A proposed motion in plain sentences: what it is made of, what it decides, and what not even it can."""

from collections.abc import Iterator

import numpy as np

from irb140_jax.effects.base import separating_motion
from irb140_jax.mismatch import Proposal, Undecided, settings
from irb140_jax.robot import Robot

SEPARATED = np.log(20.0)  # log odds at which one of two explanations has won


def proposal_sentences(robot: Robot, open_: Undecided, proposal: Proposal) -> list[str]:
    """What to tell the person who is going to play the motion.

    Args:
        robot: The robot of the diagnosis.
        open_: What it left open.
        proposal: The motion.
    """
    pieces = _listed([p.said(robot.joint_names) for p in proposal.pieces])
    lines = [f"{proposal.motion.t[-1]:.0f} s from rest to rest: {pieces}."]
    for k in range(len(open_.pairs)):
        lines.append(_pair(robot, open_, proposal, k))
    lines += _hidden(robot, open_, proposal)
    if not open_.pairs and not open_.hidden:
        lines.append("The diagnosis left no question open. Every effect would be visible along this motion.")
    unlimited = [n for n, v in zip(robot.joint_names, np.asarray(robot.velocity_limit), strict=True) if np.isinf(v)]
    if unlimited:
        lines.append(
            f"The model has no speed limit for {_listed(unlimited)}: the motion stays below twice the recorded speed."
        )
    return lines


def _pair(robot: Robot, open_: Undecided, proposal: Proposal, k: int) -> str:
    pair, effects = open_.pairs[k], open_.effects
    where = _listed([robot.joint_names[j] for j in pair.joints])
    one, other = effects[pair.named], effects[pair.rival]
    either, now, odds = f"On {where}, {one.title} or {other.title}", proposal.odds_now[k], proposal.odds[k]
    if odds > SEPARATED:
        return (
            f"{either}: with this motion the log odds of the true one should reach {odds:.3g} at least; the recordings "
            f"alone give {now:.3g}."
        )
    motion = separating_motion(one, other)
    better = f"; this may separate them: {motion}" if motion else ""
    return f"{either}: none of the motions tried separates them, because {_why(proposal, k)}{better}."


def _why(proposal: Proposal, k: int) -> str:
    """Why a motion does not separate two explanations."""
    if proposal.exact[k] > SEPARATED:
        return (
            f"their torques differ along this motion (log odds of {proposal.exact[k]:.3g} if both laws were exact), "
            "but by less than a real joint differs from either law"
        )
    played = f"along all {proposal.tried - proposal.too_strong} segments of motion within the limits"
    many = f" ({proposal.too_strong} others need more torque than the motors have)" if proposal.too_strong else ""
    return f"{played}{many}, either one can explain what the other one predicts"


def _hidden(robot: Robot, open_: Undecided, proposal: Proposal) -> Iterator[str]:
    """Effects that the recordings could not have shown: those that this motion shows, then the others."""
    shown: dict[bool, dict[str, list[str]]] = {True: {}, False: {}}
    for c, z in zip(open_.hidden, proposal.seen, strict=True):
        column = open_.columns[c]
        joints = "all joints" if column.effect.place.everywhere and len(column.joints) == robot.n else _listed(
            [robot.joint_names[j] for j in column.joints])
        shown[z >= settings.VISIBLE].setdefault(column.effect.title, []).append(joints)
    if shown[True]:
        yield f"This motion shows what the recordings could not have shown: {_titles(shown[True])}."
    if shown[False]:
        yield f"This motion does not show either: {_titles(shown[False])}."


def _titles(effects: dict[str, list[str]]) -> str:
    return "; ".join(f"{title} on {_listed(list(dict.fromkeys(joints)))}" for title, joints in effects.items())


def _listed(words: list[str]) -> str:
    words = list(dict.fromkeys(words))
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
