"""What to do after a diagnosis, with commands that can be copied."""

import shlex
from collections.abc import Iterator
from typing import NamedTuple

from irb140_jax.mismatch.result import Diagnosis


class Step(NamedTuple):
    """One thing to do.

    Attributes:
        say: What it is for, one sentence.
        code: Lines for a terminal, or of Python; may be empty.
    """

    say: str
    code: tuple[str, ...] = ()


def next_steps(diagnosis: Diagnosis, folder: str) -> list[Step]:
    """What this diagnosis leaves to be done, most useful first.

    Args:
        diagnosis: The diagnosis.
        folder: Where it lies.
    """
    here = shlex.quote(folder)
    steps = list(_recording(diagnosis, folder))
    if diagnosis.findings or diagnosis.verdict == "parameters_only":
        steps.append(Step(
            "Check the corrected model on a new motion: this writes the torque of all three models, row by row.",
            (f"irb140 predict {here} another.csv --out torque.csv",),
        ))  # fmt: skip
        steps.append(Step(
            f"Use the corrected model: {folder}/corrected.xml is for MuJoCo (corrected.md says what it lacks); the "
            "model in JAX is complete.",
            ("import irb140_jax as irb", f'robot = irb.load_corrected("{folder}")'),
        ))  # fmt: skip
    elif diagnosis.verdict == "no_mismatch":
        steps.append(Step(
            "The model needs no change. To check this further, compare it with another kind of motion.",
            (f"irb140 predict {here} another.csv --out torque.csv",),
        ))  # fmt: skip
    if diagnosis.unexplained:
        joints = ", ".join(dict.fromkeys(joint for rest in diagnosis.unexplained for joint in rest.joints))
        steps.append(Step(
            f"Look at {joints} under “Motion and torque” below: torque over position and over speed may show the "
            "cause of the unexplained part."
        ))  # fmt: skip
    return steps


def _recording(diagnosis: Diagnosis, folder: str) -> Iterator[Step]:
    """What to record, where something is open."""
    undecided = diagnosis.verdict == "undecided"
    rivals = any(finding.alternatives for finding in diagnosis.findings)
    if not (undecided or rivals or diagnosis.not_testable):
        return
    why = (
        "Record more: this motion is designed to show what these recordings could not."
        if undecided
        else "Let the robot perform the motion that best separates the alternatives" + (
            " and shows what could not be tested." if diagnosis.not_testable else ".")
        if rivals
        else "Let the robot perform a motion that shows what these recordings could not."
    )  # fmt: skip
    yield Step(why, (f"irb140 excite {shlex.quote(folder)} --out motion.csv",))
    yield Step("Record this motion, and diagnose old and new recordings together.", (_again(diagnosis, folder),))


def _again(diagnosis: Diagnosis, folder: str) -> str:
    """The command of this diagnosis with one recording more."""
    words = shlex.split(diagnosis.provenance.command)
    words.insert(2 + len(diagnosis.provenance.recordings), "recorded.csv")
    if "--out" in words:
        at = words.index("--out")
        del words[at : at + 2]
    return shlex.join([*words, "--out", f"{folder.rstrip('/')}-2"])
