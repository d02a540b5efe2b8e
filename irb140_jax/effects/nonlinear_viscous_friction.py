"""Nonlinear viscous friction: lubricant that thins or thickens with speed."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import between_neighbours
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes


def _columns(motion, joints, shape):
    """tau = k |qd|^a sign(qd)."""
    # Powers of |qd| have no slope at rest: the rounded sign keeps them smooth.
    qd = of_site(motion.qd, joints)
    size = jnp.sqrt(qd**2 + 1e-4 * jnp.take(motion.rest_speed, joints) ** 2)
    return (size ** shape[0] * of_site(motion.direction, joints))[:, :, None]


def _grid(scales, joints):
    return np.array([0.4, 0.5, 0.65, 0.8, 1.3, 1.6, 1.9, 2.3, 3.0])[:, None]


def _finer(grid, best):
    # Of a law that bends more than any on the grid, dry or viscous friction would be left over.
    return between_neighbours(grid, best, beyond=1)


def _where(values, units):
    how = "less" if values["exponent"] < 1 else "more"
    return f"at all speeds; it grows {how} than linearly, as speed to the power {values['exponent']:.2g}"


EFFECT = Effect(
    slug="nonlinear_viscous_friction",
    title="nonlinear viscous friction",
    needs="constant speeds over the whole speed range",
    confused_with={
        "thermal_friction_drift": "the same move cold and warm",
        "stribeck_friction": "several constant speeds in the upper half of the speed range",
        "viscous_friction": "constant speeds over the whole speed range",
    },
    where=_where,
    law=Law(
        equation="k |qd|^a sign(qd)",
        source="Waiboer, Aarts, Jonker, Multibody System Dynamics 14, 2005; Bittencourt et al., IROS 2010",
        parameters=(
            Parameter("coefficient", "{tau} (s/{q})^a", low=0.0), Parameter("exponent", "1", low=0.4, high=3.0)
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[0], shape[0]]),
        from_physical=lambda values: (np.array([values["coefficient"]]), np.array([values["exponent"]])),
        contains=("viscous_friction",),
        absorbs=False,  # k |qd|^a + d qd has no exponent of its own
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=(0.0,), dissipative=True),
    shapes=Shapes(grid=_grid, finer=_finer),
    export=Export(not_in_mjcf="it is left out: joint damping is proportional to speed"),
)
