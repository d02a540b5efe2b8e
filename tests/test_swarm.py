"""Swarms: known optima, fitness that is no number, seeds in company, boxes, bits, random numbers."""

import os
import pathlib
import subprocess
import sys
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from scipy import stats

from irb140_jax import swarm
from irb140_jax.errors import InputError
from irb140_jax.swarm.draws import Draws
from irb140_jax.swarm.qubit_pso import squared_sine

D = 6
LOWER, UPPER = -jnp.ones(D), 3.0 * jnp.ones(D)
# Off the box's middle, where the mean of the first swarm lies, by 30 % of its half-width and more.
OPTIMUM = jnp.array([0.3, 2.0, 0.1, 1.7, 2.5, -0.5])
SETTINGS: dict[str, Any] = {"particles": 40, "iterations": 80}

RULES = {
    "pso": swarm.Pso(inertia=swarm.linear(0.9, 0.4), c1=1.5, c2=1.5),
    "constricted": swarm.ConstrictedPso(),
    "qubit": swarm.QubitPso(inertia=swarm.linear(0.9, 0.4), c1=1.5, c2=1.5, velocity_limit=0.3),
    "bits": swarm.QubitPso(decode=swarm.Bits(8), inertia=swarm.linear(0.99, 0.4), velocity_limit=0.5, collapse=True),
    "delta well": swarm.DeltaWellQpso(),
    "adaptive attractor": swarm.AdaptiveAttractorQpso(),
    "noise resilient": swarm.NoiseResilientQpso(),
    "self tuning": swarm.SelfTuningQpso(),
}  # fmt: skip
# Bits end on a grid of 4/255 and random measurements have to hit it in six unknowns at once; the rest converge.
REACHED = {"bits": 0.3}


def sphere(x: Float[Array, " d"]) -> Float[Array, ""]:
    return jnp.sum((x - OPTIMUM) ** 2)


def rosenbrock(x: Float[Array, " d"]) -> Float[Array, ""]:
    y = x[:3] + 0.7  # the minimum, at y = 1, lies away from the box's middle
    return jnp.sum(100.0 * (y[1:] - y[:-1] ** 2) ** 2 + (1.0 - y[:-1]) ** 2)


class Problem(eqx.Module):
    """A sphere; or NaN wherever the first unknown is below 0.5, so that the optimum lies among them; or a slope.

    Flags are numbers, so that one program per rule serves them all.
    """

    broken: Float[Array, ""]
    slope: Float[Array, ""]

    def __call__(self, x: Float[Array, " d"], progress: Float[Array, ""]) -> Float[Array, ""]:
        value = jnp.where(self.slope > 0, jnp.sum(x), sphere(x))
        return jnp.where((self.broken > 0) & (x[0] < 0.5), jnp.nan, value)


NO, YES = jnp.asarray(0.0), jnp.asarray(1.0)
SPHERE, BROKEN, SLOPE = Problem(NO, NO), Problem(YES, NO), Problem(NO, YES)


def found(
    rule: swarm.Rule, objective: swarm.Objective = SPHERE, seeds: int = 4, first: int = 0, **changes: Any
) -> swarm.Minima:
    keys = swarm.seed_keys(seeds, first)
    return swarm.minimise(objective, rule, LOWER, UPPER, keys=keys, **(SETTINGS | changes))


@pytest.fixture(scope="module")
def runs() -> dict[str, swarm.Minima]:
    return {name: found(rule) for name, rule in RULES.items()}


@pytest.mark.parametrize("name", RULES)
def test_every_rule_finds_the_minimum_of_a_sphere(runs, name):
    assert np.abs(runs[name].x - OPTIMUM).max() < REACHED.get(name, 1e-2)  # of a box of width 4


def test_the_delta_well_swarm_follows_a_bent_valley():
    result = found(swarm.DeltaWellQpso(), swarm.Steady(rosenbrock), iterations=600)
    assert float(rosenbrock(0.5 * (LOWER + UPPER))) > 100.0
    assert np.median(result.fitness) < 1e-2


@pytest.mark.parametrize("name", RULES)
def test_the_reported_fitness_is_that_of_the_reported_candidate(runs, name):
    again = jax.vmap(sphere)(runs[name].x)
    # The means of the noise-resilient swarm are of equal numbers here; sums differ in the last digits.
    np.testing.assert_allclose(runs[name].fitness, again, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("name", RULES)
def test_the_best_fitness_never_rises(runs, name):
    best = np.asarray(runs[name].history.best)
    assert np.all(np.diff(best, axis=1) <= 1e-15 * best[:, :-1])  # a mean of equal numbers may round up
    np.testing.assert_array_equal(best[:, -1], runs[name].fitness)


@pytest.mark.parametrize("name", RULES)
def test_the_history_has_an_entry_for_the_start_and_each_iteration(runs, name):
    for record in runs[name].history:
        assert record.shape == (4, SETTINGS["iterations"] + 1)
        assert np.isfinite(record).all()


@pytest.mark.parametrize("name", [n for n in RULES if n not in ("qubit", "bits")])
def test_the_diversity_falls_as_the_swarm_agrees(runs, name):
    spread = runs[name].history.diversity
    # Uniform in a box of width 1 the standard deviation is 1/sqrt(12); 30 numbers a coordinate leave 10 % of chance.
    np.testing.assert_allclose(spread[:, 0], 12**-0.5, rtol=0.1)
    assert np.all(spread[:, -1] < 0.2 * spread[:, 0])


@pytest.mark.parametrize("name", RULES)
def test_several_seeds_at_once_are_the_same_seeds_one_by_one(runs, name):
    for seed in (0, 3):
        alone = found(RULES[name], seeds=1, first=seed)
        np.testing.assert_array_equal(alone.x[0], runs[name].x[seed])
        np.testing.assert_array_equal(alone.history.best[0], runs[name].history.best[seed])


def test_different_seeds_take_different_ways(runs):
    assert len(np.unique(np.asarray(runs["pso"].history.best[:, 3]))) == 4


@pytest.mark.parametrize("name", RULES)
def test_a_fitness_that_is_no_number_never_becomes_a_best(name):
    result = found(RULES[name], BROKEN)
    assert np.isfinite(result.fitness).all()
    assert np.all(result.x[:, 0] >= 0.5)
    assert np.isfinite(result.history.best[:, -1]).all()


def test_where_every_fitness_is_nan_the_best_is_infinite():
    result = found(swarm.Pso(), swarm.Steady(lambda x: jnp.nan * x[0]), iterations=3)
    assert np.all(np.isinf(result.fitness))


@pytest.mark.parametrize("name", [n for n in RULES if n not in ("qubit", "bits")])
def test_a_swarm_stays_in_its_box(runs, name):
    position = found(RULES[name], SLOPE).swarm.position  # downhill is out through the lower ends
    assert float(position.min()) >= 0.0
    assert float(position.max()) <= 1.0


@pytest.mark.parametrize("name", ["qubit", "bits"])
def test_angles_always_decode_into_the_box(runs, name):
    corner = found(RULES[name], SLOPE).x
    assert np.all((corner >= LOWER) & (corner <= UPPER))


def test_a_swarm_that_may_leave_its_box_does():
    assert float(found(swarm.Pso(outside=jnp.inf), SLOPE).x.min()) < -1.5


def test_the_velocity_clamp_is_respected():
    result = found(swarm.Pso(velocity_limit=0.05))
    assert float(jnp.abs(result.swarm.velocity).max()) <= 0.05
    assert float(jnp.abs(found(swarm.Pso()).swarm.velocity).max()) > 0.05  # it would have been broken


def test_bits_read_as_binary_numbers_of_the_highest_bit_first():
    draws = Draws(jax.random.key(0), jnp.asarray(1))
    sure = jnp.array([[0.0, 1.0, 1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]]).T
    np.testing.assert_allclose(swarm.Bits(3)(sure, draws), np.array([[3 / 7, 4 / 7], [1.0, 0.0]]).T, rtol=1e-15)
    assert swarm.Bits(3).angles(27) == 81


def test_one_qubit_an_unknown_knows_two_values_only():
    result = found(swarm.QubitPso(decode=swarm.Bits(1)), iterations=5)
    assert set(np.unique(np.asarray(result.x))) <= {-1.0, 3.0}


def test_collapsed_qubits_are_those_of_the_candidate():
    draws = Draws(jax.random.key(0), jnp.asarray(1))
    candidates = swarm.Bits(12)(jnp.full((60, 20), 0.5), draws)
    np.testing.assert_array_equal(swarm.Bits(12)(1.0 * swarm.Bits(12).measured(candidates), draws), candidates)


def test_a_qubit_is_measured_as_one_as_often_as_its_amplitude_says():
    theta = jnp.full((1, 40_000), 0.6)
    bits = swarm.QubitPso(decode=swarm.Bits(1)).candidates(theta, Draws(jax.random.key(3), jnp.asarray(0)))
    assert abs(float(bits.mean()) - np.sin(0.6) ** 2) < 5 * 0.5 / 200  # five standard errors at most


def test_the_other_orientation_swaps_ones_and_zeros():
    theta = jnp.linspace(0.0, 1.5, 7)[None]
    draws = Draws(jax.random.key(3), jnp.asarray(0))
    sine, cosine = (swarm.QubitPso(one_is_beta=flag).candidates(theta, draws) for flag in (True, False))
    np.testing.assert_allclose(sine + cosine, 1.0, rtol=1e-15)
    np.testing.assert_allclose(cosine, np.cos(theta) ** 2, rtol=1e-13, atol=1e-16)


def test_the_own_sine_is_the_library_s():
    theta = np.random.default_rng(0).uniform(-1e4, 1e4, 10_000)
    np.testing.assert_allclose(squared_sine(jnp.asarray(theta)), np.sin(theta) ** 2, atol=1e-15)


def test_a_stalled_swarm_is_thrown_apart():
    still = {"inertia": swarm.constant(0.0), "c1": 0.0, "c2": 0.0}  # nothing moves but by perturbation
    thrown, kept = (
        found(swarm.QubitPso(**still, patience=p, perturbation=1.0, share=1.0)).swarm.position for p in (3, jnp.inf)
    )
    start, _ = swarm.QubitPso().start(40, D, Draws(swarm.seed_keys(1)[0], jnp.asarray(0)))
    np.testing.assert_array_equal(kept[0], start)
    assert float(jnp.abs(thrown[0] - start).max()) > 0.5


def test_the_inertia_weight_follows_each_reading():
    at = lambda schedule, t: float(schedule(swarm.Clock(t, 150)))  # noqa: E731
    assert [at(swarm.constant(0.99), t) for t in (1, 150)] == [0.99, 0.99]
    np.testing.assert_allclose([at(swarm.linear(0.99, 0.4), t) for t in (75, 150)], [0.695, 0.4], rtol=1e-15)
    np.testing.assert_allclose([at(swarm.damped(1.0, 0.99), t) for t in (1, 3)], [1.0, 0.9801], rtol=1e-15)


def test_resampling_beats_greed_under_noise():
    class Noisy(eqx.Module):
        """A sphere with noise that is new in every iteration and for every candidate."""

        size: float = 0.5

        def __call__(self, x, progress):
            bits = jax.lax.bitcast_convert_type(jnp.sum(x * jnp.arange(1.0, D + 1)) + 1e-3 * progress, jnp.int64)
            key = jax.random.fold_in(
                jax.random.fold_in(jax.random.key(7), bits & 0x7FFFFFFF), (progress * 1e6).astype(int)
            )
            return sphere(x) + self.size * jax.random.normal(key)

    true = {
        name: np.asarray(jax.vmap(sphere)(found(RULES[name], Noisy(), seeds=12).x))
        for name in ("delta well", "noise resilient")
    }
    assert np.median(true["noise resilient"]) < np.median(true["delta well"])


def test_new_numbers_need_no_new_program():
    traces = []

    class Counted(eqx.Module):
        centre: Float[Array, ""]

        def __call__(self, x, progress):
            traces.append(1)
            return jnp.sum((x - self.centre) ** 2)

    def go(rule, centre, first, scale):
        keys = swarm.seed_keys(2, first)
        return swarm.minimise(
            Counted(jnp.asarray(centre)), rule, scale * LOWER, UPPER, keys=keys, iterations=4, particles=5
        )

    go(swarm.Pso(), 0.5, 0, 1.0)
    once = len(traces)
    go(swarm.Pso(inertia=swarm.damped(1.0, 0.99), c1=1.0, velocity_limit=0.1, outside=jnp.inf), 0.7, 9, 2.0)
    assert once > 0
    assert len(traces) == once


def test_threefry_finds_the_same_minimum_by_another_way():
    result = found(swarm.DeltaWellQpso(), generator="threefry")
    assert np.abs(result.x - OPTIMUM).max() < 1e-2
    assert not np.array_equal(result.x, found(swarm.DeltaWellQpso()).x)


@pytest.mark.parametrize("generator", ["hash", "threefry"])
def test_random_numbers_are_uniform_and_independent(generator):
    draw = lambda seed, t, slot: np.asarray(  # noqa: E731
        Draws(jax.random.key(seed), jnp.asarray(t), generator).uniforms(slot, (200, 100))
    )
    first = draw(0, 1, 0)
    assert first.min() > 0.0
    assert first.max() < 1.0
    assert stats.kstest(first.ravel(), "uniform").pvalue > 1e-3
    others = (draw(1, 1, 0), draw(0, 2, 0), draw(0, 1, 1), np.roll(first, 1, axis=0), np.roll(first, 1, axis=1))
    for other in others:
        correlation = np.corrcoef(first.ravel(), other.ravel())[0, 1]
        assert abs(correlation) < 4.5 / np.sqrt(first.size)  # in standard errors


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lower": jnp.zeros(3), "upper": jnp.ones(4)}, r"\(3,\) and upper \(4,\)"),
        ({"lower": jnp.ones(2), "upper": jnp.array([2.0, 1.0])}, "unknown 1"),
        ({"lower": jnp.array([-jnp.inf]), "upper": jnp.ones(1)}, "finite bounds"),
        ({"particles": 1}, "at least 2 particles"),
    ],
)
def test_a_box_or_swarm_that_makes_no_sense_is_refused(change, words):
    given: dict[str, Any] = {"lower": LOWER, "upper": UPPER, "particles": 5} | change
    with pytest.raises(InputError, match=words):
        swarm.minimise(SPHERE, swarm.Pso(), keys=swarm.seed_keys(1), **given)


def test_a_number_of_qubits_that_no_float_holds_is_refused():
    with pytest.raises(InputError, match="1 to 52"):
        swarm.Bits(60)


def test_shared_among_devices_the_result_is_the_same():
    code = """
import irb140_jax, jax, jax.numpy as jnp, numpy as np
from irb140_jax import swarm
assert len(jax.devices()) == 2
sphere = swarm.Steady(lambda x: jnp.sum((x - 0.3) ** 2))
go = lambda mesh, seeds: swarm.minimise(sphere, swarm.Pso(), -jnp.ones(3), jnp.ones(3), keys=swarm.seed_keys(seeds),
                                        particles=10, iterations=20, mesh=mesh)
mesh = jax.make_mesh((2,), ("seeds",))
one, two = go(None, 4), go(mesh, 4)
assert len(two.x.sharding.device_set) == 2
np.testing.assert_array_equal(one.x, two.x)
np.testing.assert_array_equal(one.history.best, two.history.best)
np.testing.assert_array_equal(go(None, 3).x, go(mesh, 3).x)  # padded to a multiple of the devices
print("the same")
"""
    env = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2", "JAX_PLATFORMS": "cpu"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=120,
        cwd=pathlib.Path(__file__).parents[1],
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "the same" in done.stdout
