"""Torque ripple: torque that is periodic in position, from motor cogging or gear mesh."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Shapes

POINTS = 10  # cycle numbers in the search at once
FEWEST_PERIODS = 2.0  # in the range of the joint: less than that is any curve, and repeats nothing
OVERSAMPLING = 4  # points per resolvable line of the spectrum over position


def _columns(motion, joints, shape):
    """tau = A sin(2 pi n q + phase), in a sine and a cosine."""
    angle = 2.0 * jnp.pi * shape[0] * of_site(motion.q, joints)
    return jnp.stack([jnp.sin(angle), jnp.cos(angle)], axis=-1)


def _from_physical(values):
    phase = values.get("phase", 0.0)
    return values["amplitude"] * np.array([np.cos(phase), np.sin(phase)]), np.array([values["cycles_per_rad"]])


def _finer(grid, best):
    # Neighbouring cycle numbers are one line of the spectrum apart at first, a tenth of it after each round.
    values = np.sort(np.unique(grid[:, 0]))
    step = np.min(np.diff(values)) if len(values) > 1 else 0.1 * best[0]
    return np.maximum(best[0] + min(step, 0.2 * best[0]) * np.linspace(-1.0, 1.0, POINTS), 1e-6)[:, None]


def _proposal(left, scales, joints):
    use = left.weight[:, joints[0]] > 0
    q, residual = left.q[use, joints[0]], left.residual[use, joints[0]]
    span = _span(scales, joints)
    step = 1.0 / (OVERSAMPLING * span)
    # As many cycles as the samples can resolve where the joint is fastest.
    n = np.arange(FEWEST_PERIODS / span, min(400 * step, len(q) / (4 * span)), step)
    if len(q) < 50 or len(n) < 5:
        return None
    # Powers of one turn: an exponential of every pair of n and q would take ten times as long.
    turn = np.vander(np.exp(-2j * np.pi * step * q), len(n), increasing=True)
    power = np.abs(turn.T @ (np.exp(-2j * np.pi * n[0] * q) * (residual - residual.mean()))) ** 2
    best = n[np.argmax(power)]
    return (best + step * np.linspace(-1.0, 1.0, POINTS))[:, None]


def _span(scales, joints):
    return max(float(scales.high[joints[0]] - scales.low[joints[0]]), 1e-9)


def _where(values, units):
    return (
        f"{values['amplitude']:.3g} {units['amplitude']} of amplitude, repeating every "
        f"{1 / values['cycles_per_rad']:.3g} {units['cycles_per_rad'][2:]} of position"
    )


EFFECT = Effect(
    slug="torque_ripple",
    title="torque ripple",
    needs="slow motion through the whole range of the joint",
    confused_with={
        "position_dependent_friction": "the same path in both directions: friction changes sign, ripple does not"
    },
    where=_where,
    law=Law(
        equation="A sin(2 pi n q + phase)",
        source="Holtz and Springob, IEEE Trans. Ind. Electronics 43(2), 1996",
        parameters=(Parameter("amplitude", "{tau}", low=0.0), Parameter("cycles_per_rad", "1/{q}", low=0.0)),
        columns=_columns,
        to_physical=lambda w, shape: jnp.stack([jnp.hypot(w[0], w[1]), shape[0]]),
        from_physical=_from_physical,
        variants=((0, 1),),
    ),
    place=Place(At.DRIVE),
    shapes=Shapes(
        grid=lambda scales, joints: np.geomspace(FEWEST_PERIODS, 30.0, POINTS)[:, None] / _span(scales, joints),
        finer=_finer, proposal=_proposal, scanned=100,
    ),
    export=Export(not_in_mjcf="it is left out: MJCF has no joint torque that is periodic in position"),
)
