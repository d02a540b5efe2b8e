"""Torque saturation: a servo asks for more torque than its motor gives, and no limit is stated."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.asked import PLACE, PRIOR, beyond, beyond_limit, finer, not_given
from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import geometric_grid
from irb140_jax.effects.records import Export, Law, Parameter, Shapes


def _law(asked, qd, shape):
    return beyond(asked.torque, -shape[0], shape[0])


def _columns(motion, joints, shape):
    """Asked less given: max(|tau| - limit, 0) sign(tau)."""
    return not_given(motion, joints, _law, shape)


def _grid(scales, joints):
    # A servo at its limit asks for the more the longer it is there: the RMS may be several times what it gives.
    usual = float(scales.torque[joints[0]])
    return geometric_grid(0.25 * usual, 4.0 * usual, 16)


def _in_servo(servo, joints, w, shape):
    limit = np.array(servo.limit)
    limit[joints[0]] = min(limit[joints[0]], float(shape[0]))
    return servo._replace(limit=limit)


EFFECT = Effect(
    slug="torque_saturation",
    title="a torque limit of the motor",
    needs="position errors so large that the motor is at its limit, in both directions",
    confused_with={
        "torque_gain": "motion at small and at large torque: a limit takes the peaks alone",
        "back_emf": "the same torque at low and at high speed",
    },
    where="where the servo asks for more than {limit}",
    law=Law(
        equation="max(|tau| - limit, 0) sign(tau)",
        source="MuJoCo, XML reference, forcerange of actuators, 2024",
        parameters=(Parameter("limit", "{tau}", low=1e-9),),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([shape[0]]),
        from_physical=lambda values: (np.ones(1), np.array([values["limit"]])),
        silent=lambda asked, qd, shape: beyond_limit(_law(asked, qd, shape)),
    ),
    place=PLACE,
    prior=PRIOR,
    shapes=Shapes(grid=_grid, finer=finer),
    export=Export(mjcf="forcerange of the servo", in_servo=_in_servo),
)
