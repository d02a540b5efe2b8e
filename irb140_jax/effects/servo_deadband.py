"""Servo dead band: position errors below some size are none to a servo, and larger ones that much smaller."""

from functools import partial

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.asked import PLACE, PRIOR, not_given
from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import NOISES, between_neighbours, geometric_grid
from irb140_jax.effects.records import Export, Law, Parameter, Shapes


def _columns(motion, joints, shape):
    """Asked less given: Kp times the error, as far as that is within the band."""
    law = lambda asked, qd, shape: asked.kp * jnp.clip(asked.error, -shape[0], shape[0])  # noqa: E731
    return not_given(motion, joints, law, shape)


def _grid(scales, joints):
    # From a step of an encoder of 14 bits to where a servo is of little use, of the range that the joint was moved; a
    # band that is no wider than the encoder's noise would explain this noise.
    j = joints[0]
    span = max(float(scales.high[j] - scales.low[j]), 1e-9)
    return geometric_grid(max(3e-4 * span, NOISES * float(scales.q_noise[j])), 3e-2 * span, 12)


EFFECT = Effect(
    slug="servo_deadband",
    title="a dead band of the servo",
    needs="position errors that change sign while the joint moves one way, as gravity makes them",
    confused_with={
        "coulomb_friction": "motion that gravity drives: friction goes with the speed, a dead band with the error",
        "torque_offset": "postures in which gravity pulls either way",
    },
    where="position errors count from {width} on",
    law=Law(
        equation="Kp clip(qdes - q, -width, width)",
        source="Feetech, STS3215 memory table, CW and CCW dead zone, 2021",
        parameters=(Parameter("width", "{q}", low=1e-9),),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([shape[0]]),
        from_physical=lambda values: (np.ones(1), np.array([values["width"]])),
        silent=lambda asked, qd, shape: (np.abs(asked.error) < shape[0], float(2.0 * asked.kp[0] * shape[0])),
    ),
    place=PLACE,
    prior=PRIOR,
    shapes=Shapes(grid=_grid, finer=partial(between_neighbours, reach=2)),
    export=Export(not_in_mjcf="it is left out: MuJoCo's servos have no dead band"),
)
