"""What a person should know beside the verdict: repairs, assumptions, warnings, joints that were not judged."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch.explanation import Explanation
from irb140_jax.mismatch.prove import HeldOut
from irb140_jax.mismatch.regression.nuisances import SCALED
from irb140_jax.mismatch.selection.space import RARE
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot

SLOPE = SCALED.index("slope")
NOTABLE_GAP = 0.03  # of a joint's torque, by which corrected.xml may differ and nothing is said


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
            out.append(f"{name} is not judged: it moves in only {count} usable rows; record a motion of {name}.")
    out.append(f"The model's inertials are taken to be right to {100 * uncertainty:.3g} % (--inertial-uncertainty).")
    if not judged.any():
        return list(dict.fromkeys(out))
    out.append(
        f"Compared below {band.torque:.3g} Hz; positions were smoothed below {band.position:.3g} Hz and "
        "differentiated. Figures leave out rows in which the joint rests: dry friction is undetermined there."
    )
    return list(dict.fromkeys(out))


def gap_notes(robot: Robot, gap: np.ndarray | None, torque: np.ndarray, left_out: Sequence[str]) -> list[str]:
    """A note for every joint at which `corrected.xml` gives another torque than the corrected model.

    Args:
        robot: The nominal model.
        gap: The difference, shape (n,), or None where it isn't known.
        torque: Size of the joints' torque, shape (n,).
        left_out: Effects that MJCF can't hold, or not whole.
    """
    if gap is None:
        return ["corrected.xml could not be compared with the corrected model: MuJoCo has other joints."]
    reason = f"it lacks {', '.join(left_out)} in whole or in part" if left_out else (
        "a link of the model has inertials that are physically impossible, and keeps them in the file")
    return [
        f"On {name} the torque of corrected.xml differs from that of the corrected model by {g:.3g} "
        f"{'N' if slide else 'N m'} RMS ({100 * g / t:.0f} % of its torque): {reason}. Use `irb140 predict` instead."
        for name, slide, g, t in zip(robot.joint_names, robot.is_slide, gap, torque, strict=True)
        if g > NOTABLE_GAP * t > 0.0
    ]


def friction_notes(ex: Explanation, names: Sequence[str]) -> list[str]:
    """A note for every joint whose dry friction differs from recording to recording.

    Said where a level of friction of its own for each recording is more probable than one for all, against the odds of
    any rare effect.

    Args:
        ex: The explanation.
        names: Of the recordings.
    """
    out = []
    _, _, own = ex.prediction()
    for j, setting in enumerate(ex.settings):
        alike = (*ex.settings[:j], (*setting[:SLOPE], 0, *setting[SLOPE + 1 :]), *ex.settings[j + 1 :])
        gain = ex.space.log_evidence(ex.chosen, ex.settings) - ex.space.log_evidence(ex.chosen, alike)
        slopes = ex.extra[0].groups[j] == SLOPE
        if slopes.any() and gain > -np.log(RARE):
            unit = "N" if ex.lib.robot.is_slide[j] else "N m"
            each = (own[j] * ex.extra[0].units[j])[slopes]
            said = ", ".join(f"{x:+.3g} {unit} in {name}" for x, name in zip(each, names, strict=True))
            out.append(f"Friction of {ex.lib.robot.joint_names[j]} differs between the recordings: {said}.")
    return out


def discrepancy_notes(robot: Robot, proof: HeldOut) -> list[str]:
    """A note where the corrected model holds torque without a name."""
    joints = [name for name, carried in zip(robot.joint_names, proof.carried, strict=True) if carried]
    if not joints:
        return []
    return [
        f"On {', '.join(joints)} the corrected model adds a function of the joint's own motion that no effect names, "
        "because it makes the error on unseen motions smaller. `irb140 predict` holds it; corrected.xml and "
        "load_corrected do not."
    ]


def _sentence(note: str) -> str:
    note = note.strip()
    return note if note.endswith((".", "!", "?")) else f"{note}."
