"""Everything a person should know beside the verdict: repairs, assumptions, warnings, joints that were not judged."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot


def notes(
    robot: Robot, smooth: Sequence[Conditioned], band: Band, uncertainty: float, rows: np.ndarray, judged: np.ndarray
) -> list[str]:
    """The contract's `notes`, a sentence each.

    Args:
        robot: The nominal model, whose reader has notes of its own.
        smooth: The conditioned recordings with theirs.
        band: Of the comparison.
        uncertainty: Relative standard deviation of the inertials.
        rows: Rows in which each joint moves, shape (n,).
        judged: Joints of which enough rows tell, shape (n,).
    """
    out = [f"Model {robot.name}: {_sentence(note)}" for note in robot.notes]
    out += [f"{r.source}: {_sentence(note)}" for r in smooth for note in r.notes]
    for name, count, enough in zip(robot.joint_names, rows, judged, strict=True):
        if not enough:
            out.append(f"{name} is not judged: {count} rows in which it moves can be used; record a motion of {name}.")
    out.append(f"The model's inertials are taken to be right to {100 * uncertainty:.3g} % (--inertial-uncertainty).")
    out.append(
        f"Compared below {band.torque:.3g} Hz; positions were smoothed below {band.position:.3g} Hz and "
        "differentiated. Figures leave out rows in which the joint rests: dry friction is undetermined there."
    )
    return list(dict.fromkeys(out))


def _sentence(note: str) -> str:
    note = note.strip()
    return note if note.endswith((".", "!", "?")) else f"{note}."
