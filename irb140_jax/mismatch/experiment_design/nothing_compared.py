"""The open questions of a diagnosis that could compare no joint: every effect at every site is undecided."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import prepared, scales_of
from irb140_jax.mismatch.columns.candidates import Candidate, library
from irb140_jax.mismatch.experiment_design.undecided import Column, Undecided
from irb140_jax.mismatch.regression.noise import ORDER
from irb140_jax.mismatch.validation.testable import Seen, Site, reference
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot


def all_open(
    robot: Robot, effects: Sequence[Effect], smooth: Sequence[Conditioned], band: Band, uncertainty: float
) -> tuple[Undecided, Seen]:
    """What is open where nothing was compared: every effect at every site.

    Args:
        robot: The nominal model.
        effects: The library.
        smooth: The conditioned recordings, for the sizes of speeds and positions only.
        band: Of the comparison.
        uncertainty: Relative standard deviation of the inertials.

    Returns:
        The questions for the design of a motion, and how visible each effect was: not at all.
    """
    scales = scales_of([prepared(robot, r) for r in smooth])
    lib = library(robot, effects, scales)
    matters = reference(lib, scales, band.rate)
    shapes: dict[Site, list[Candidate]] = {}
    for c in lib.candidates:
        if not (c.effect.shapes.proposal and not matters.amplitudes[c.columns].any()):  # see `testable.visibility`
            shapes.setdefault((c.slug, c.joints), []).append(c)
    middle = [alike[len(alike) // 2] for alike in shapes.values()]
    columns = tuple(Column(c.effect, c.joints, tuple(map(float, c.shape)), c.variant) for c in middle)
    amplitudes = np.concatenate([c.columns for c in middle])
    typical = np.concatenate([np.full(len(c.columns), c.effect.prior.typical) for c in middle])
    scale = typical / settings.REFERENCE_SHARE * np.abs(matters.amplitudes[amplitudes])
    size = 10 * robot.n + len(amplitudes) + 1
    white = np.tile(np.eye(1, ORDER + 1), (robot.n, 1))
    questions = Undecided(
        columns, (), (), (), tuple(range(len(columns))), np.zeros((size, size)), scale,
        matters.in_prior_units(amplitudes, scale), uncertainty, white, settings.UNKNOWN_NOISE * matters.torque, band,
        scales,
    )  # fmt: skip
    return questions, {site: (0.0, k) for k, site in enumerate(shapes)}
