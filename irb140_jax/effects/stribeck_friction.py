"""Stribeck friction: dry friction that is higher at very low speed."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.grids import between_neighbours, geometric_grid
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes


def _columns(motion, joints, shape):
    """tau = (Fc + (Fs - Fc) exp(-(qd/vs)^2)) sign(qd)."""
    s = of_site(motion.direction, joints)
    return dry_friction_columns(motion, joints, jnp.exp(-((of_site(motion.qd, joints) / shape[0]) ** 2)) * s)


def _from_physical(values):
    coulomb, static = values["coulomb"], values["static"]
    return np.array([coulomb, static - coulomb]), np.array([values["stribeck_velocity"]])


def _grid(scales, joints):
    speed, rest = float(scales.speed[joints[0]]), float(scales.rest_speed[joints[0]])
    return geometric_grid(max(2.0 * rest, 0.003 * speed), 0.5 * speed, 12)


EFFECT = Effect(
    slug="stribeck_friction",
    title="Stribeck friction",
    needs="slow motion at constant speeds, below and above the Stribeck speed",
    confused_with={
        "coulomb_friction": "a series of constant speeds from very slow to fast, in both directions",
        "nonlinear_viscous_friction": "several constant speeds in the upper half of the speed range",
        "presliding_hysteresis": "very small motions: before it slips, presliding friction acts like a spring",
    },
    where="below about {stribeck_velocity} friction rises from {coulomb:.3g} to {static}",
    law=Law(
        equation="(Fc + (Fs - Fc) exp(-(qd/vs)^2)) sign(qd)",
        source="R. Stribeck, VDI-Zeitschrift 46, 1902; Armstrong-Helouvry et al., Automatica 30(7), 1994",
        parameters=(
            Parameter("coulomb", "{tau}", low=0.0),
            Parameter("static", "{tau}", low=0.0),
            Parameter("stribeck_velocity", "{q}/s", low=1e-6),
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[0], w[0] + w[1], shape[0]]),
        from_physical=_from_physical,
        variants=((0, 1),),
        contains=("coulomb_friction",),
        falls=True,
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=("frictionloss", 0.0), dissipative=True),
    shapes=Shapes(grid=_grid, finer=between_neighbours),
    export=Export(
        mjcf="joint frictionloss, for its constant part",
        not_in_mjcf="the rise at low speed is left out: frictionloss does not depend on speed",
        in_model=adds_to("frictionloss"),
    ),
)
