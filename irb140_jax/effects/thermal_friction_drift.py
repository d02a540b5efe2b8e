"""Thermal friction drift: friction that changes as the joint warms up."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import between_neighbours, geometric_grid
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import with_joint
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes

FASTEST = 10.0  # s: no gear warms faster; what settles sooner is something else


def _columns(motion, joints, shape):
    """tau = (cold exp(-t/T) + warm (1 - exp(-t/T))) qd, t since the recording began, cold; neither is below zero."""
    qd = of_site(motion.qd, joints)
    cold = jnp.exp(-motion.t / shape[0])[:, None]
    return jnp.stack([cold * qd, (1.0 - cold) * qd], axis=-1)


def _from_physical(values):
    cold = values["viscous_cold"]
    return np.array([cold, cold * (1.0 - values["relative_drop"])]), np.array([values["time_constant"]])


def _grid(scales, joints):
    duration = max(scales.duration, 1.0)
    return geometric_grid(max(0.05 * duration, FASTEST), max(2.0 * duration, 2.0 * FASTEST), 6)


EFFECT = Effect(
    slug="thermal_friction_drift",
    title="friction that changes as the joint warms up",
    needs="the same motion repeated from cold until warm",
    confused_with={
        "nonlinear_viscous_friction": "the same move cold and warm",
        "viscous_friction": "the same move cold and warm",
    },
    where=(
        "{viscous_cold} at the start of a recording, {relative_drop:%} less once warm, with a time constant of "
        "{time_constant}"
    ),
    law=Law(
        equation="Fv (1 - drop (1 - exp(-t/T))) qd",
        source="Bittencourt et al., IROS 2010; Simoni et al., Robotics and CIM 31, 2015",
        parameters=(
            Parameter("viscous_cold", "{tau} s/{q}", low=0.0),
            Parameter("relative_drop", "1", low=-2.0, high=1.0),
            Parameter("time_constant", "s", low=0.0),
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[0], 1.0 - w[1] / jnp.where(w[0] == 0.0, 1.0, w[0]), shape[0]]),
        from_physical=_from_physical,
        variants=((0, 1),),
        contains=("viscous_friction",),
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=(0.0, 0.0), dissipative=True),
    shapes=Shapes(grid=_grid, finer=between_neighbours),
    export=Export(
        mjcf="joint damping, as it is once warm",
        not_in_mjcf="the change is left out: damping does not depend on time",
        in_model=lambda robot, joints, w, shape: with_joint(robot, "damping", joints[0], w[1]),
    ),
)
