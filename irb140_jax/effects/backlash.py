"""Backlash: a dead zone between motor and link; positions are the motor's."""

import itertools

import jax.numpy as jnp
import numpy as np
from jax import lax

from irb140_jax.effects.base import ALIKE, Effect
from irb140_jax.effects.grids import NOISES
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes

CROSSINGS = (0.03, 0.3)  # s the link takes through the dead zone: less is not seen below 20 Hz, more is no gear
RATIO = 1.12  # of neighbouring gaps in the first scan: a tenth more and the link hits the flank too late
POINTS = 4  # gaps in the search, each with two flanks
FLANKS = (0.5, 2.0)  # in the first grid, over that of the scan
DAMPINGS = (0.12, 0.35, 1.0)  # in the first grid: a link bounces, or hardly does
DAMPED = (0.03, 2.0)  # between which it is looked for
MODE = 35.0  # Hz of the link on a flank, to begin with: above what is compared, so it only times the blows
LEAST_GIVE = 0.05  # of the gap, by which a flank gives way under the joint's usual torque, at most
FLANK_DAMPING = 0.3  # of the link on a flank, relative to critical, in the first scan
SCANNED = round(3.0 * np.log(CROSSINGS[1] / CROSSINGS[0]) / np.log(RATIO))
STEPS = 4  # of the simulation per sample


def _columns(motion, joints, shape):
    """q_link = q - u: the link moves freely through the gap until an elastic flank stops it.

    M d2u/dt2 + (d tau/dqd) du/dt + (d tau/dq) u = tau - flank(u), tau what the link would need on the motor's path and
    flank(u) zero within +-gap/2.  u is simulated along the motion for a gap, a flank and its damping on the grid; its
    amplitude is one where the grid has the right gap.  A spring of the model pulls at the link, and so does what it is
    wrong by: a second column, k (q - u), nothing where there is none.
    """
    rigid, dt = motion.rigid, motion.t[1] - motion.t[0]
    at = lambda x: jnp.take(x, joints, axis=2)[:, :, 0]  # noqa: E731
    own = lambda x: jnp.take(at(x), joints, axis=1)[:, 0]  # noqa: E731
    load = jnp.take(motion.carried, joints, axis=1)[:, 0]
    link_side = load, own(rigid.mass), own(rigid.by_qd), own(rigid.by_q)
    u = _flight(*link_side, shape[0], shape[1], shape[2], dt)
    # Differences hold the blows on the flanks as well.
    held = jnp.concatenate([u[:1], u, u[-1:]])
    rate, curve = (held[2:] - held[:-2]) / (2.0 * dt), (held[2:] - 2.0 * u + held[:-2]) / dt**2
    link = jnp.take(motion.q, joints, axis=1)[:, 0] - u
    spring = jnp.zeros_like(motion.q).at[:, joints[0]].set(jnp.take(rigid.spring, joints)[0] * link)
    u, rate, curve = (x[:, None] for x in (u, rate, curve))
    play = -(at(rigid.by_q) * u + at(rigid.by_qd) * rate + at(rigid.mass) * curve)
    return jnp.stack([play, spring], axis=-1)


def _from_physical(values):
    return np.array([1.0, 0.0]), np.array([values[k] for k in ("gap", "flank_stiffness", "flank_damping")])


def _grid(scales, joints):
    middle = _scan(scales, joints)
    return _around(middle[len(middle) // 2])


def _scan(scales, joints):
    # Through the zone by a torque that grows at three times its size a second: gap = rate t^3 / (6 M).
    torque, inertia, low, high = (
        float(x[joints[0]]) for x in (scales.torque, scales.inertia, scales.low, scales.high)
    )
    # A link without inertia follows at once: then the way that the motor goes is the limit.
    largest = max(min(0.5 * torque / inertia * CROSSINGS[1] ** 3, high - low), 1e-12)
    gaps = largest * np.geomspace((CROSSINGS[0] / CROSSINGS[1]) ** 3, 1.0, SCANNED)
    gaps = np.maximum(gaps, NOISES * float(scales.q_noise[joints[0]]))
    flanks = np.maximum(inertia * (2.0 * np.pi * MODE) ** 2, torque / (LEAST_GIVE * gaps))
    return np.stack([gaps, flanks, np.full(SCANNED, FLANK_DAMPING)], axis=1)


def _around(best, ratio=RATIO, flanks=FLANKS, dampings=DAMPINGS):
    gaps = best[0] * np.geomspace(1.0 / ratio, ratio, POINTS)
    return np.array(list(itertools.product(gaps, best[1] * np.asarray(flanks), dampings)))


def _finer(grid, best):
    gaps, flanks, dampings = (np.unique(column) for column in grid.T)
    nearer = np.array([-0.25, 0.25]), np.array([-0.5, 0.0, 0.5])
    flanks, dampings = ((x[1] / x[0]) ** step for x, step in zip((flanks, dampings), nearer, strict=True))
    return _around(best, float(np.min(gaps[1:] / gaps[:-1])), flanks, np.clip(best[2] * dampings, *DAMPED))


def _flight(load, mass, damping, spring, gap, flank, flank_damping, dt):
    """Displacement u (T,) of a link with springy flanks at +-gap/2, beginning on the one that the load presses on."""
    h, half = dt / STEPS, 0.5 * gap

    def sample(state, now):
        start, end, m, d, k = now

        def step(i, state):
            u, before = state
            inertia, rise = m / h**2, (end - start) / STEPS
            known, stay = inertia * (2.0 * u - before) + d / h * u, inertia + d / h + k
            # A second difference is of the middle of its three steps and a spring's bend of the last: so is their load.
            load_at = lambda all_: start + rise * (i + 1.0 - inertia / all_)  # noqa: E731
            free = (known + load_at(stay)) / stay
            touch = jnp.abs(free) > half
            # Within the flank the step is solved again with its spring and damper.
            drag = 2.0 * flank_damping * jnp.sqrt(flank * m) / h
            held = stay + flank + drag
            pressed = (known + load_at(held) + flank * half * jnp.sign(free) + drag * u) / held
            return jnp.where(touch, pressed, free), u

        state = lax.fori_loop(0, STEPS, step, state, unroll=True)
        return state, state[0]

    u = half * jnp.sign(load[0]) + load[0] / (flank + spring[0])
    ahead = jnp.concatenate([load[:1], load[:-1]])
    return lax.scan(sample, (u, u), (ahead, load, mass, damping, spring))[1]


EFFECT = Effect(
    slug="backlash",
    title="backlash between motor and link",
    needs="a load on this joint that changes sign, both slowly and quickly",
    confused_with={
        "presliding_hysteresis": "reversals under several preloads",
        "joint_elasticity": "load reversals of several sizes: a gap is crossed whole, a spring bends with the load",
        "coulomb_friction": "motion in which the load changes sign and the speed does not",
        "time_delay": "slow reversals of the load",
        "actuator_lag": "slow reversals of the load",
    },
    where="wherever its load changes sign; a gap of {gap}",
    law=Law(
        equation="-(d tau/dq_j u + d tau/dqd_j du/dt + M_j d2u/dt2), the link free within |u| <= gap/2",
        source="Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38, 2002",
        parameters=(
            Parameter("gap", "{q}", low=0.0),
            Parameter("flank_stiffness", "{tau}/{q}", low=0.0),
            Parameter("flank_damping", "1", low=0.0),
        ),
        columns=_columns,
        to_physical=lambda w, shape: shape,
        from_physical=_from_physical,
        variants=((0, 1),),
        own=(0,),
    ),
    place=Place(At.DRIVE, everywhere=True),
    prior=Prior(lowest=(0.0, -1.0), highest=(ALIKE, np.inf), of_rigid_body=True),
    shapes=Shapes(
        grid=_grid, finer=_finer, scan=_scan, around=_around, scanned=SCANNED,
        beside=("torque_offset",),  # the middle of the gap need not be where the model has no load
        settled=0.6,  # the shape holds the gap, so the amplitude is one but for the grid; less is another law's shadow
    ),
    export=Export(
        not_in_mjcf="it is left out: backlash needs a second joint in the model",
        history="depends on where the link is in the gap, which is a state of its own",
    ),
)
