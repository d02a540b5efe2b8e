"""PSO and the swarm of qubit angles, replayed step by step in NumPy from the study's equations and the same draws."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from irb140_jax import swarm
from irb140_jax.swarm import Draws

PARTICLES, ITERATIONS, UNKNOWNS = 7, 25, 4
LOWER, UPPER = np.array([-1.0, 0.0, 2.0, -5.0]), np.array([1.0, 3.0, 2.5, 5.0])
AIM = np.array([0.3, 1.0, 2.4, -1.0])
C1, C2 = 2.5, 1.5


def fitness_of(x):
    """A bowl, by column of x."""
    return np.sum((x - AIM[:, None]) ** 2, axis=0)


def drawn(iteration: int, slot: int, shape: tuple[int, ...]) -> np.ndarray:
    """The numbers that the library draws there."""
    return np.asarray(Draws(swarm.seed_keys(1)[0], jnp.asarray(iteration)).uniforms(slot, shape))


def replayed(start, move, decode):
    """Algorithms 1 and 2: place, evaluate, remember, and so on; best fitness after each iteration."""
    x, v = start
    candidates = decode(x)
    fitness = fitness_of(LOWER[:, None] + (UPPER - LOWER)[:, None] * candidates)
    pbest, pbest_fitness = x.copy(), fitness.copy()
    gbest, gbest_fitness = x[:, fitness.argmin()].copy(), fitness.min()
    best, stalled = [gbest_fitness], 0
    for t in range(1, ITERATIONS + 1):
        x, v, stalled = move(t, x, v, pbest, gbest[:, None], stalled)
        fitness = fitness_of(LOWER[:, None] + (UPPER - LOWER)[:, None] * decode(x))
        for i in range(PARTICLES):
            if fitness[i] < pbest_fitness[i]:
                pbest[:, i], pbest_fitness[i] = x[:, i], fitness[i]
        stalled += 1
        if fitness.min() < gbest_fitness:
            gbest, gbest_fitness, stalled = x[:, fitness.argmin()].copy(), fitness.min(), 0
        best.append(gbest_fitness)
    return np.array(best), pbest


def pulled(t, w, x, v, pbest, gbest, limit):
    """Equations 17 and 26."""
    r1, r2 = drawn(t, 0, x.shape), drawn(t, 1, x.shape)
    return np.clip(w(t) * v + C1 * r1 * (pbest - x) + C2 * r2 * (gbest - x), -limit, limit)


def by_library(rule):
    aim = swarm.Steady(lambda x: jnp.sum((x - AIM) ** 2))
    settings = {"particles": PARTICLES, "iterations": ITERATIONS, "keys": swarm.seed_keys(1)}
    return jax.device_get(swarm.minimise(aim, rule, jnp.asarray(LOWER), jnp.asarray(UPPER), **settings))


WEIGHTS = {
    "constant": (swarm.constant(0.99), lambda t: 0.99),
    "falling": (swarm.linear(0.99, 0.4), lambda t: 0.99 - 0.59 * t / ITERATIONS),
    "damped": (swarm.damped(1.0, 0.99), lambda t: 0.99 ** (t - 1)),
}


@pytest.mark.parametrize("weight", WEIGHTS)
@pytest.mark.parametrize(("limit", "walls", "start_speed"), [(np.inf, True, 0.0), (0.2, False, 0.0), (0.2, True, 0.5)])
def test_pso_is_algorithm_1_step_by_step(weight, limit, walls, start_speed):
    schedule, w = WEIGHTS[weight]
    own = swarm.Pso(inertia=schedule, velocity_limit=limit, outside=0.0 if walls else np.inf, start_speed=start_speed)

    def move(t, x, v, pbest, gbest, stalled):
        v = pulled(t, w, x, v, pbest, gbest, limit)
        return np.clip(x + v, 0.0, 1.0) if walls else x + v, v, stalled

    shape = (UNKNOWNS, PARTICLES)
    start = drawn(0, 0, shape), start_speed * (2.0 * drawn(0, 1, shape) - 1.0)
    best, pbest = replayed(start, move, lambda x: x)
    found = by_library(own)
    np.testing.assert_allclose(found.history.best[0], best, rtol=1e-9)
    np.testing.assert_allclose(found.swarm.pbest[0], pbest, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("weight", WEIGHTS)
@pytest.mark.parametrize(("limit", "walls", "patience"), [(np.inf, True, np.inf), (0.1, False, 3), (0.05, True, 2)])
def test_qpso_of_angles_is_algorithm_2_step_by_step(weight, limit, walls, patience):
    schedule, w = WEIGHTS[weight]
    low, high = (0.0, 0.5 * np.pi) if walls else (-np.inf, np.inf)
    own = swarm.QubitPso(inertia=schedule, velocity_limit=limit, lowest=low, highest=high, patience=patience)

    def move(t, theta, v, pbest, gbest, stalled):
        v = pulled(t, w, theta, v, pbest, gbest, limit)
        stuck = stalled >= patience
        thrown = drawn(t, 3, (PARTICLES,)) < 0.2
        throw = 0.05 * (2.0 * drawn(t, 2, theta.shape) - 1.0)
        moved = theta + v + (throw * thrown if stuck else 0.0)
        return np.clip(moved, low, high), v, 0 if stuck else stalled

    theta = 0.5 * np.pi * drawn(0, 0, (UNKNOWNS, PARTICLES))
    best, pbest = replayed((theta, 0.0 * theta), move, lambda x: np.sin(x) ** 2)
    found = by_library(own)
    np.testing.assert_allclose(found.history.best[0], best, rtol=1e-9)
    np.testing.assert_allclose(found.swarm.pbest[0], pbest, rtol=1e-7, atol=1e-9)


def test_bits_that_choose_find_the_bottom_of_a_bowl():
    for both in (False, True):
        found = by_library(swarm.TwoAttractorsQpso(both=both, velocity_limit=0.2))
        assert found.fitness[0] < 0.2 * found.history.best[0, 0]
