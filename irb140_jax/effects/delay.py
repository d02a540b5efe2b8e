"""A clock's error: the logged torque belongs to another instant than the positions logged with it."""

import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.records import Export, Law, Parameter, Prior, Shapes

HALVES = tuple(0.001 * k for k in range(-16, 17))  # s: half of the delays that are tried first
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)  # on -1 to 1: slopes whose mean is that over the delay


def law(equation: str, columns) -> Law:
    """q_logged(t) = q(t - delay): the logged torque belongs to a later motion, tau(t + delay).

    tau(t + delay) - tau(t) is delay times the mean slope from t to t + delay; the shape is half of the time over which
    that is taken, and where that is not half the delay, it is right to first order.

    Args:
        equation: In plain text.
        columns: See `Law`.
    """
    return Law(
        equation=equation,
        source="Ljung, System Identification, 1999, ch. 4",
        parameters=(Parameter("delay", "s"),),
        columns=columns,
        from_physical=lambda values: (np.array([values["delay"]]), np.array([0.5 * values["delay"]])),
        to_log=_to_log,
    )


def _to_log(x, dt, w, shape):
    t, slope = dt * np.arange(len(x)), np.gradient(x, dt, axis=0)
    at = t + shape[0] * (1.0 + NODES[:, None])
    return w[0] * np.stack([0.5 * WEIGHTS @ np.interp(at, t, s) for s in slope.T], axis=1)


def _at_shape(shape):
    # The slope is taken over the delay itself, give or take the spacing of the delays that are tried.
    spacing = 2.0 * (HALVES[1] - HALVES[0])
    return 2.0 * shape - spacing, 2.0 * shape + spacing


def _grid(scales, joints):
    return np.array(HALVES)[:, None]


def _finer(grid, best):
    # The half of the delay found and no other: beside it the slope over another time would be a delay of its own.
    return np.broadcast_to(best, grid.shape)


PRIOR = Prior(at_shape=_at_shape)
SHAPES = Shapes(grid=_grid, finer=_finer, follows=lambda w, shape: 0.5 * w)
EXPORT = Export(
    not_in_mjcf="it belongs to the clocks of the log, not to the arm",
    history="is a shift between the clocks of the log, which pairs each torque with an earlier position",
)


def mean_slopes(t: jax.Array, rate: jax.Array, half: jax.Array) -> jax.Array:
    """Mean of rates over a delay from each instant on, shape (T, k).

    Args:
        t: Evenly spaced times [s], shape (T,), two at least.
        rate: Rates of k signals, shape (T, k).
        half: Half of the delay [s]; below zero the mean is over the time before.
    """
    later = half * (1.0 + NODES) / (t[1] - t[0])  # samples
    whole = jnp.floor(later)
    at = jnp.arange(len(t))[:, None] + whole.astype(int)
    before, after = (rate[jnp.clip(at + k, 0, len(t) - 1)] for k in (0, 1))
    part = (later - whole)[:, None]
    return jnp.einsum("i,tik->tk", 0.5 * WEIGHTS, (1.0 - part) * before + part * after)
