"""External wrench: someone or something pushes the last link for a while, at the tool or beside it."""

import itertools

import jax.numpy as jnp
import numpy as np
from scipy import optimize

from irb140_jax.effects.base import Effect
from irb140_jax.effects.records import Export, Law, Parameter, Place, Shapes, all_joints

RISES = (0.01, 0.05)  # s in which a push begins and ends, in the first grid: a blow, or somebody leaning on the tool
SHARPEST, SOFTEST = 0.004, 0.1  # between which it is looked for; what is sharper is beyond the low-pass
BLUR = 0.96  # of its rise: standard deviation of when a push begins; a ramp as spread begins pi/2 rises earlier
EDGES = 32  # instants per recording at which a push may begin or end in the first scan
LONGEST = 0.4  # of a recording; what lasts longer is no event
SHORTEST = 0.2  # s; what lasts less is a blow, or a misfit
THIN = 2  # every second row in the scan; the grid of the search then sees all
NEAR = (-1.0, 0.0, 1.0)  # grid around the best start and end, in steps
STEP = 0.05  # s, first step of that grid
LEVER = 0.1  # [m] at which moments about the tool count like forces
LEVERS = np.repeat([1.0, LEVER], 3)
FORCE, WRENCH = (0, 1, 2), (0, 1, 2, 3, 4, 5)  # columns of a push at the tool, and of one anywhere
UNFELT = 1e-3  # of the strongest direction of the tool's Jacobian: forces along it move no joint


def _columns(motion, joints, shape):
    """tau = -J^T [f, m] on the motors, while t0 < t < t1 of one recording: a constant wrench at the tool."""
    here = jnp.where(motion.recording + 1.0 == shape[2], 1.0, 0.0)
    jacobian = motion.rigid.tool_jacobian * jnp.array(LEVERS)
    return -here * _window(motion.t, shape[0], shape[1], shape[3], jnp)[:, None, None] * jacobian


def _from_physical(values):
    shape = [values[k] for k in ("t0", "t1", "recording", "rise")]
    moment = [values.get(f"moment_{k}", 0.0) / LEVER for k in "xyz"]
    return np.array([*(values[f"force_{k}"] for k in "xyz"), *moment]), np.array(shape)


def _grid(scales, joints):
    starts = max(scales.duration, 1.0) * np.linspace(0.1, 0.8, len(NEAR) ** 2)
    spans = np.stack([starts, starts + 0.1 * max(scales.duration, 1.0), np.ones_like(starts)], axis=1)
    return np.concatenate([np.insert(spans, 3, rise, axis=1) for rise in RISES])


def _finer(grid, best):
    at, rises = np.sort(np.unique(np.abs(grid[:, 0] - best[0]))), np.unique(grid[:, 3])
    apart = (rises[-1] / rises[0]) ** 0.25
    return _around(best[:3], 0.5 * (at[1] if len(at) > 1 else STEP), best[3] * np.array([1 / apart, apart]))


def _around(span, step, rises):
    rises = np.clip(rises, SHARPEST, SOFTEST)
    at = np.array([[*(span + step * np.array([a, b, 0])), r] for a, b, r in itertools.product(NEAR, NEAR, rises)])
    at[:, 1] = np.maximum(at[:, 1], at[:, 0] + SHORTEST)
    return at


def _proposal(left, scales, joints):
    best, gain, left = None, -np.inf, left.every(THIN)
    for recording in np.unique(left.recording):
        rows = left.recording == recording
        t, J = left.t[rows], left.tool_jacobian[rows] * LEVERS
        edges = np.linspace(t[0], t[-1], EDGES)
        spans = np.array([
            s for s in itertools.combinations(edges, 2) if SHORTEST < s[1] - s[0] < LONGEST * (t[-1] - t[0])
        ])  # fmt: skip
        if len(spans) == 0:
            continue
        first, last = np.searchsorted(t, spans.T)
        start = spans[np.argmax(left.gains_within(-J, first, last, rows))]
        column = lambda span: -_window(t, span[0], span[1], RISES[-1], np)[:, None, None] * J  # noqa: B023, E731
        # A short simplex search moves both ends off the coarse grid.
        simplex = np.add(start, [[0, 0], [0.3, 0], [0, 0.3]])
        at = optimize.minimize(
            lambda s: -left.gains(column(s)[None], rows)[0][0] if s[1] > s[0] + SHORTEST else 0.0,  # noqa: B023
            start, method="Nelder-Mead", options={"maxfev": 60, "initial_simplex": simplex},
        )  # fmt: skip
        if -at.fun > gain:
            best, gain = np.array([*at.x, recording + 1.0]), -at.fun
    return None if best is None else _around(best, STEP, np.array(RISES))


def _alike(left, w, shape):
    # Each by itself: how far a force and a moment may stand in for each other is in their intervals.
    unfelt = []
    for columns in (slice(0, 3), slice(3, 6)):
        _, size, axes = np.linalg.svd(left.tool_jacobian[..., columns].reshape(-1, 3), full_matrices=False)
        for axis in axes[size < UNFELT * max(size[0], 1e-300)] * np.linalg.norm(w[columns]):
            unfelt.append(np.zeros(6))
            unfelt[-1][columns] = axis
    forces = [LEVERS * (w + s * a) for a in unfelt for s in (-1.0, 1.0)]
    return np.array([[*shape[:3], *f, *shape[3:]] for f in forces]).reshape(-1, 10)


def _blur(shape):
    edge = BLUR * float(shape[3])
    return np.array([edge, edge, *(0.0,) * 7, edge])


def _where(values, units):
    force, moment = (np.array([values[f"{of}_{k}"] for k in "xyz"]) for of in ("force", "moment"))
    beside = f" and a moment of {np.linalg.norm(moment):.3g} N m about it" if moment.any() else ""
    return (
        f"from {values['t0']:.3g} to {values['t1']:.3g} s of recording {values['recording']:.0f}, a force "
        f"of {np.linalg.norm(force):.3g} N at the tool{beside}"
    )


def _window(t, t0, t1, rise, xp):
    """1 between t0 and t1, 0 outside, with soft edges, shape (T,)."""
    return 0.5 * (xp.tanh((t - t0) / rise) - xp.tanh((t - t1) / rise))


EFFECT = Effect(
    slug="external_wrench",
    title="a push on the tool for a while",
    needs="no special motion: any push during a recording is visible",
    confused_with={
        "contact": "the same path again: a wall acts again, a push does not",
        "payload": "the same path again, without the push",
        "torque_offset": "the same path again, without the push",
    },
    where=_where,
    law=Law(
        equation="-J_tool(q)^T [f, m], t0 < t < t1",
        source="De Luca, Albu-Schaeffer, Haddadin, Hirzinger, IROS 2006; scan: Siegmund, Sequential Analysis, 1985",
        parameters=(
            Parameter("t0", "s"),
            Parameter("t1", "s"),
            Parameter("recording", "1", low=1.0),
            Parameter("force_x", "N"),
            Parameter("force_y", "N"),
            Parameter("force_z", "N"),
            Parameter("moment_x", "N m"),
            Parameter("moment_y", "N m"),
            Parameter("moment_z", "N m"),
            Parameter("rise", "s", low=0.0),
        ),
        columns=_columns,
        to_physical=lambda w, shape: jnp.concatenate([shape[:3], w * jnp.array(LEVERS), shape[3:]]),
        from_physical=_from_physical,
        variants=(FORCE, WRENCH),
        own=WRENCH,
    ),
    place=Place(sites=all_joints, everywhere=True),
    shapes=Shapes(
        grid=_grid, finer=_finer, proposal=_proposal, scanned=EDGES**2, alike=_alike, blur=_blur,
        during=lambda shape: (round(float(shape[2])) - 1, float(shape[0]), float(shape[1])),
    ),
    export=Export(not_in_mjcf="it is left out: it happened once and is no part of the machine"),
)
