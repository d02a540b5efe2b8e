"""Motions, joints and values on which effects are tried."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import random_robot

from irb140_jax.effects import Asked, Motion, RigidBody, Scales
from irb140_jax.effects.catalogue import CATALOGUE

every_effect = pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE.keys())
KINDS = "SHSH"  # slides and hinges, two of each
RESTING = 1e-9  # [rad/s or m/s]: sign(qd) is then rounded off nowhere along `motion`
SCALES = Scales(
    speed=np.array([0.4, 2.0, 0.5, 3.0]), rest_speed=np.array([1e-3, 2e-3, 1e-3, 1e-2]),
    torque=np.array([50.0, 9.0, 20.0, 1.0]), duration=20.0,
    low=np.array([-0.3, -2.0, -0.2, -1.0]), high=np.array([0.4, 1.0, 0.5, 2.0]),
    inertia=np.array([20.0, 1.0, 3.0, 0.1]), q_noise=np.full(4, 1e-5),
)  # fmt: skip


def rigid_body(rng, samples):
    """Random sensitivities: columns must be right for any."""
    n = len(KINDS)
    across, _ = np.linalg.qr(rng.normal(size=(3, 2)))
    shapes = ((samples, n, 3), (), None, (samples, n, 10), (samples, n, n), (samples, n, n), (n,), (samples, n, n),
              (samples, 3), (samples, n, 6))  # fmt: skip
    body = RigidBody(*(jnp.asarray(across.T if s is None else rng.normal(size=s)) for s in shapes))
    # A link without inertia, or pushed away by its own motion, is no machine.
    return eqx.tree_at(lambda r: (r.mass, r.by_qd, r.by_q), body, (
        jnp.abs(body.mass) + 0.5, 0.1 * body.by_qd, 0.1 * body.by_q))


def motion(seed=0, samples=60, rest_speed=RESTING):
    """Random motion, no joint slower than 0.01."""
    rng = np.random.default_rng(seed)
    q, qd, qdd, load, total, *more = rng.normal(size=(7, samples, len(KINDS)))
    qd += 0.01 * np.sign(qd)
    arrays = [jnp.asarray(x) for x in (q, qd, qdd, 9 * load, 10 * total, *more)]
    rigid = rigid_body(rng, samples)
    speeds = jnp.full(len(KINDS), rest_speed)
    direction = jnp.tanh(arrays[1] / speeds)
    near_rest = {"rest_speed": speeds, "direction": direction}
    torque, error = (jnp.asarray(x) for x in rng.normal(size=(2, samples, len(KINDS))))
    asked = Asked(4.0 * torque, error, jnp.asarray(rng.uniform(1.0, 9.0, len(KINDS))))
    return Motion(jnp.arange(samples) / 20.0, *arrays, rigid=rigid, **near_rest, recording=jnp.array(0.0), asked=asked)


def robot():
    return random_robot(KINDS, 1)[0]


def a_shape(effect, joints=0):
    """A shape in the middle of the grid."""
    site = effect.place.sites(robot())[joints]
    grid = effect.shapes.grid(SCALES, site)
    return jnp.asarray(site), jnp.asarray(grid[len(grid) // 2])


def some_values(effect, seed=0):
    """Physical parameters away from zero, from one and from each other."""
    rng = np.random.default_rng(seed)
    between = lambda p: float(rng.uniform(max(p.low, 0.3) + 0.02, min(p.high, 2.0) - 0.02))  # noqa: E731
    values = {p.name: between(p) for p in effect.law.parameters}
    return values | ({"recording": 1.0} if "recording" in values else {})  # the one that `motion` is
