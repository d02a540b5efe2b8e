"""Position-dependent friction: friction that is higher in a part of the joint's range."""

import itertools

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.coulomb_friction import dry_friction_columns
from irb140_jax.effects.grids import top_of_parabola
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.native import adds_to
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes

CENTRES, WIDTHS = 8, 3  # grid points of the two shape parameters


def _columns(motion, joints, shape):
    """tau = Fc (1 + depth exp(-((q - centre)/width)^2)) sign(qd)."""
    bump = jnp.exp(-(((of_site(motion.q, joints) - shape[0]) / shape[1]) ** 2))
    return dry_friction_columns(motion, joints, bump * of_site(motion.direction, joints))


def _to_physical(w, shape):
    return jnp.stack([w[0], w[1] / jnp.where(w[0] == 0.0, 1.0, w[0]), shape[0], shape[1]])


def _from_physical(values):
    coulomb = values["coulomb"]
    return np.array([coulomb, coulomb * values["depth"]]), np.array([values["centre"], values["width"]])


def _grid(scales, joints):
    low, high = float(scales.low[joints[0]]), float(scales.high[joints[0]])
    span = max(high - low, 1e-9)
    centres = low + span * np.linspace(0.05, 0.95, CENTRES)
    return np.array(list(itertools.product(centres, span * np.geomspace(0.06, 0.3, WIDTHS))))


def _peak(grid, best, odds):
    # Widths are few and far apart: the top of a parabola through three points in each direction.
    centres, widths = grid[::WIDTHS, 0], np.log(grid[:WIDTHS, 1])
    i, k = _nearest(centres, best[0]), _nearest(widths, np.log(best[1]))
    odds = odds.reshape(CENTRES, WIDTHS)
    return np.array([_top(centres, odds[:, k], i), np.exp(_top(widths, odds[i], k))])


def _finer(grid, best):
    centres, widths = grid[::WIDTHS, 0], np.log(grid[:WIDTHS, 1])
    # Far apart, widths are told from centres badly: wide enough that the next grid's end shows where to go.
    near = best[0] + 0.25 * (centres[1] - centres[0]) * np.arange(-(CENTRES // 2), CENTRES - CENTRES // 2)
    wide = best[1] * np.exp(0.5 * (widths[1] - widths[0]) * np.linspace(-1.0, 1.0, WIDTHS))
    return np.array(list(itertools.product(near, wide)))


def _nearest(values, x):
    return int(np.argmin(np.abs(values - x)))


def _top(values, odds, at):
    """Where odds at equally spaced values are best, to a fraction of a step, about the best of them."""
    near = odds[max(at - 1, 0) : at + 2]
    if len(near) < 3 or not np.all(np.isfinite(near)):
        return values[at]
    return values[at] + top_of_parabola(*near) * (values[1] - values[0])


EFFECT = Effect(
    slug="position_dependent_friction",
    title="friction that depends on position",
    needs="motion in both directions over the whole range of the joint",
    confused_with={
        "load_dependent_friction": "the same positions with another payload",
        "torque_ripple": "the same path in both directions: friction changes sign, ripple does not",
    },
    where="friction of {coulomb} changes by {depth:%} around {centre}",
    law=Law(
        equation="Fc (1 + depth exp(-((q - centre)/width)^2)) sign(qd)",
        source="Armstrong, Friction: experimental determination, modeling and compensation, ICRA 1988",
        parameters=(
            Parameter("coulomb", "{tau}", low=0.0),
            Parameter("depth", "1", low=-1.0),
            Parameter("centre", "{q}"),
            Parameter("width", "{q}", low=0.0),
        ),
        columns=_columns,
        to_physical=_to_physical,
        from_physical=_from_physical,
        variants=((0, 1),),
        contains=("coulomb_friction",),
        empirical=True,
    ),
    place=Place(At.FRICTION),
    prior=Prior(lowest=("frictionloss", -np.inf), adds_up=True, dissipative=True),
    shapes=Shapes(grid=_grid, finer=_finer, peak=_peak),
    export=Export(
        mjcf="joint frictionloss, for its constant part",
        not_in_mjcf="the change along the range is left out: frictionloss does not depend on position",
        in_model=adds_to("frictionloss"),
    ),
)
