"""What drives of servos were found to be off by: in the corrected model it is theirs, or the joint's friction."""

import dataclasses
from typing import NamedTuple

import numpy as np

from irb140_jax.effects.viscous_friction import EFFECT as VISCOUS
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.recordings.condition import Commanded


class Off(NamedTuple):
    """What drives are off by.

    Attributes:
        kd: Real less stated Kd in standard deviations, shape (n,).
        delay: By how much commands of each joint are taken up later than those of all [s], shape (n,).
    """

    kd: np.ndarray
    delay: np.ndarray


def with_drives(model: CorrectedModel, servo: Commanded, drives: np.ndarray) -> tuple[CorrectedModel, Off]:
    """The model with the damping that no Kd makes, and what is left to its drives.

    Kd and viscous friction are one class: only their sum is known.  Every joint has friction, and a Kd out of a
    drive's settings is a number: what damps more than the stated Kd is the joint's.  Where less damps, the Kd is less.

    Args:
        model: The corrected model.
        servo: Commands and drives as they were given.
        drives: From `Explanation.of_drives`.
    """
    kd, late = drives.T
    width, named, left = servo.drive.kd_width, [], np.array(kd)
    found = {n.joints[0]: n for n in model.named if n.effect.slug == VISCOUS.slug}
    for j in np.flatnonzero(width > 0.0).tolist():
        if servo.asked_speed[:, j].any():
            continue  # commanded speeds tell the two apart
        damping = width[j] * kd[j] + (found[j].amplitudes[0] if j in found else 0.0)
        if damping > 0.0:
            named.append(Named(VISCOUS, (j,), (0,), np.array([damping]), np.zeros(0)))
            left[j] = 0.0
    mine = {n.joints[0] for n in named}
    others = (n for n in model.named if not (n.effect.slug == VISCOUS.slug and n.joints[0] in mine))
    return dataclasses.replace(model, named=(*others, *named)), Off(left, servo.own_delay_width * late)
