"""Back-EMF: the faster a motor turns, the less torque its voltage can still make in the direction of motion."""

import itertools

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.asked import PLACE, PRIOR, beyond, beyond_limit, finer, not_given
from irb140_jax.effects.base import Effect
from irb140_jax.effects.records import Export, Law, Parameter, Shapes

TORQUES, SPEEDS = 8, 5  # grid points of the two shape parameters


def _law(asked, qd, shape):
    slower = jnp.clip(qd / shape[1], -1.0, 1.0)
    return beyond(asked.torque, -shape[0] * (1.0 + slower), shape[0] * (1.0 - slower))


def _columns(motion, joints, shape):
    """Asked less given: what is beyond -stall_torque (1 + qd/no_load_speed) and stall_torque (1 - qd/no_load_speed)."""
    return not_given(motion, joints, _law, shape)


def _grid(scales, joints):
    j = joints[0]
    torques, fastest = scales.torque[j] * np.geomspace(0.25, 4.0, TORQUES), max(float(scales.speed[j]), 1e-9)
    return np.array(list(itertools.product(torques, fastest * np.geomspace(1.0, 4.0, SPEEDS))))


def _finer(grid, best):
    axes = (np.unique(x)[:, None] for x in grid.T)
    return np.array(list(itertools.product(*(finer(axis, best[[k]])[:, 0] for k, axis in enumerate(axes)))))


EFFECT = Effect(
    slug="back_emf",
    title="torque that a motor lacks at speed",
    needs="large torque at high speed, and the same torque at low speed",
    confused_with={
        "torque_saturation": "the same torque at low and at high speed",
        "viscous_friction": "the same speed at small and at large torque",
    },
    where="the motor gives at most {stall_torque}, and less in proportion to its speed: nothing at {no_load_speed}",
    law=Law(
        equation="what of tau is beyond stall_torque (+-1 - qd/no_load_speed)",
        source="Hughes and Drury, Electric Motors and Drives, 5th ed., 2019, ch. 3",
        parameters=(
            Parameter("stall_torque", "{tau}", low=1e-9),
            Parameter("no_load_speed", "{q}/s", low=1e-9),
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([shape[0], shape[1]]),
        from_physical=lambda values: (np.ones(1), np.array([values["stall_torque"], values["no_load_speed"]])),
        silent=lambda asked, qd, shape: beyond_limit(_law(asked, qd, shape)),
        contains=("torque_saturation",),
    ),
    place=PLACE,
    prior=PRIOR,
    shapes=Shapes(grid=_grid, finer=_finer),
    export=Export(not_in_mjcf="it is left out: forcerange does not depend on speed"),
)
