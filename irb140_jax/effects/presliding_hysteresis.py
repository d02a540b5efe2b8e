"""Presliding hysteresis: bristles that bend like springs before they slip."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from irb140_jax.effects.base import Effect
from irb140_jax.effects.grids import between_neighbours, geometric_grid
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes


def _columns(motion, joints, shape):
    """Dahl: tau = Fc z, dz = (stiffness/Fc) dq (1 - z sign(dq)).

    Over a step dq in one direction z goes towards sign(dq) by the factor exp(-|dq|/d), d = Fc/stiffness: a linear
    recurrence, which an associative scan solves exactly.
    """
    q, before = of_site(motion.q, joints), 0
    if motion.turned is not None:
        q, before = jnp.concatenate([of_site(motion.turned, joints), q]), len(motion.turned)
    dq = jnp.diff(q, axis=0, prepend=q[:1])
    keep = jnp.exp(-jnp.abs(dq) / shape[0])
    _, z = lax.associative_scan(lambda a, b: (a[0] * b[0], a[1] * b[0] + b[1]), (keep, jnp.sign(dq) * (1.0 - keep)))
    return z[before:, :, None]


def _from_physical(values):
    return np.array([values["coulomb"]]), np.array([values["coulomb"] / values["stiffness"]])


def _grid(scales, joints):
    span = max(float(scales.high[joints[0]] - scales.low[joints[0]]), 1e-9)
    return geometric_grid(0.0015 * span, 0.05 * span, 7)


def _step(memory, q, tau, w, shape, dt):
    before, z = jnp.split(memory, 2)
    keep = jnp.exp(-jnp.abs(q - before) / shape[0])
    z = keep * z + (1.0 - keep) * jnp.sign(q - before)
    return z[:, None], tau, jnp.concatenate([q, z])


EFFECT = Effect(
    slug="presliding_hysteresis",
    title="presliding hysteresis",
    needs="very small motions: slow reversals in which the joint turns by less than a degree",
    confused_with={
        "backlash": "reversals under several preloads",
        "stribeck_friction": "very small motions: before it slips, presliding friction acts like a spring",
        "coulomb_friction": "very small motions around a reversal",
    },
    where="after each reversal friction rises to {coulomb} like a spring of {stiffness}",
    law=Law(
        equation="Fc z, dz/dt = (stiffness/Fc) qd (1 - z sign(qd))",
        source="P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158, 1968",
        parameters=(Parameter("coulomb", "{tau}", low=0.0), Parameter("stiffness", "{tau}/{q}", low=0.0)),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([w[0], w[0] / shape[0]]),
        from_physical=_from_physical,
        contains=("coulomb_friction",),
        absorbs=False,  # what slips at once beside what is springy first is neither alone
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=(0.0,)),
    shapes=Shapes(grid=_grid, finer=between_neighbours),
    export=Export(
        mjcf="joint frictionloss, for the level once it slips",
        not_in_mjcf="the elastic part before it slips is left out: frictionloss has none",
        in_model=adds_to("frictionloss"),
        history="depends on how far the joint has moved since its last reversal",
        memory=lambda q, tau: jnp.concatenate([q, jnp.zeros_like(q)]),
        step=_step,
    ),
)
