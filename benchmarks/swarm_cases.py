# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
"""Swarm sweeps, 30 seeds x 120 particles x 150 iterations of 27 unknowns, against pyswarms and evosax."""

import timing  # noqa: I001  first: it sets the number of threads

import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax import identify, swarm
from irb140_jax.compiler import QUICK
from irb140_jax.dynamics import inverse_dynamics_batch
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import Robot
from irb140_jax.swarm.draws import mixed
from irb140_jax.trajectory import Trajectory

SEEDS, PARTICLES, ITERATIONS = 30, 120, 150
ROUNDS = 5
LINKS = (0, 1, 2)
# Coefficients that make a swarm converge, so that both can be asked for the answer.
W, C1, C2 = 0.729, 1.494, 1.494
RULES = {
    "pso": swarm.Pso(inertia=swarm.linear(0.99, 0.4)),
    "qpso": swarm.QubitPso(inertia=swarm.linear(0.99, 0.4), velocity_limit=0.05),
}


def swarms(robot: Robot) -> dict[str, float]:
    """Both of the study's sweeps on its objective; the same sweep by the peers; torque instead of known answers."""
    reference = identify.link_parameters(robot, LINKS)
    lower, upper = identify.box(reference, 0.5)
    distance = identify.parameter_distance(reference, lower, upper)
    torque = _torque_fit(robot)
    keys = swarm.seed_keys(SEEDS)
    box = {"lower": lower, "upper": upper, "keys": keys, "particles": PARTICLES, "iterations": ITERATIONS}
    ours: dict[str, timing.Case] = {
        name: lambda r=rule: swarm.minimise(distance, r, **box) for name, rule in RULES.items()
    }
    ours["torque"] = lambda: swarm.minimise(torque, RULES["pso"], **box)
    first = {name: timing.seconds(case) for name, case in ours.items()}
    plain = lambda: swarm.minimise(distance, swarm.Pso(swarm.constant(W), C1, C2), **box).fitness  # noqa: E731
    theirs = {
        "pyswarms": lambda: _pyswarms(reference, lower, upper), "evosax": _evosax(distance, lower, upper),
        "bare": _bare(distance, lower, upper, {}), "bare_quick": _bare(distance, lower, upper, QUICK),
    }  # fmt: skip
    first |= {name: timing.seconds(case) for name, case in theirs.items()}
    for name, result in {"ours": plain(), **{name: case() for name, case in theirs.items()}}.items():
        if not float(np.median(np.asarray(result))) < 0.1:  # 2.25 of random places in the box
            raise AssertionError(f"the swarm of {name} found nothing: {np.median(np.asarray(result)):.3g}")
    median = timing.medians(ours | theirs, ROUNDS)
    stages = timing.stages(lambda keys: swarm.minimise(distance, RULES["pso"], **box | {"keys": keys}), box["keys"])
    return {
        "swarms_run_s": median["pso"] + median["qpso"],
        "swarms_with_compile_s": first["pso"] + first["qpso"],
        "swarm_pso_run_s": median["pso"],
        "swarm_qpso_run_s": median["qpso"],
        "swarm_pyswarms_ratio": median["pyswarms"] / median["pso"],
        "swarm_evosax_ratio": median["evosax"] / median["pso"],
        "swarm_evosax_with_compile_ratio": first["evosax"] / first["pso"],
        "swarm_bare_evosax_ratio": median["evosax"] / median["bare"],
        "swarm_bare_evosax_with_compile_ratio": first["evosax"] / first["bare"],
        "swarm_bare_quick_evosax_ratio": median["evosax"] / median["bare_quick"],
        "swarm_bare_quick_evosax_with_compile_ratio": first["evosax"] / first["bare_quick"],
        "swarm_torque_over_distance": median["torque"] / median["pso"],
        "swarm_pso_fifth_of_evosax_s": first["evosax"] / 5.0,
        **{f"swarm_pso_{stage}_s": seconds for stage, seconds in stages.items()},
    }


def _torque_fit(robot: Robot) -> identify.LinearFit:
    """Torque RMSE of 2000 samples through the triangular factor."""
    played = fourier_motion(robot, duration=20.0, rate=100.0, seed=0)
    q, qd, qdd = (jnp.asarray(x) for x in (played.q, played.qd, played.qdd))
    tau = inverse_dynamics_batch(robot, q, qd, qdd)
    return identify.linear_fit(robot, LINKS, Trajectory(jnp.asarray(played.t), q, qd, qdd, tau))


def _pyswarms(reference, lower, upper) -> list[float]:
    """pyswarms, which has no batch of seeds: one after the other."""
    import logging

    from pyswarms.single import GlobalBestPSO

    logging.disable(logging.INFO)
    x, low, high = (np.asarray(a) for a in (reference, lower, upper))
    distance = lambda p: np.sum((p / x - 1.0) ** 2, axis=1)  # noqa: E731
    found = []
    for seed in range(SEEDS):
        np.random.seed(seed)
        optimizer = GlobalBestPSO(PARTICLES, len(x), {"w": W, "c1": C1, "c2": C2}, bounds=(low, high))
        found.append(optimizer.optimize(distance, ITERATIONS, verbose=False)[0])
    return found


def _evosax(distance, lower, upper):
    """evosax with its seeds vmapped; it draws two numbers a particle where the study draws two an unknown."""
    from evosax.algorithms import PSO

    fitness = jax.vmap(lambda u: distance(lower + (upper - lower) * u, jnp.asarray(1.0)))
    algorithm = PSO(population_size=PARTICLES, solution=jnp.zeros(len(lower)))
    params = algorithm.default_params.replace(inertia_coeff=W, cognitive_coeff=C1, social_coeff=C2)

    def one(key):
        key, placing = jax.random.split(key)
        start = jax.random.uniform(placing, (PARTICLES, len(lower)))
        state = algorithm.init(key, start, fitness(start), params)

        def step(carry, _):
            state, key = carry
            key, ask, tell = jax.random.split(key, 3)
            x, state = algorithm.ask(ask, state, params)
            state, _ = algorithm.tell(tell, x, fitness(x), state, params)
            return (state, key), state.best_fitness

        (state, _), best = jax.lax.scan(step, (state, key), None, ITERATIONS)
        return jnp.min(best)

    run = jax.jit(jax.vmap(one))
    keys = jax.random.split(jax.random.key(0), SEEDS)
    return lambda: run(keys)


def _bare(distance, lower, upper, options):
    """The least a swarm can be: equations 17 to 19 and nothing kept of the way, with cheaper random numbers than ours.

    Bounds what compiling and running ours could come down to.
    """

    def uniforms(stream):
        bits = mixed(jnp.arange(len(lower) * PARTICLES, dtype=jnp.uint32).reshape(-1, PARTICLES) + stream)
        return jax.lax.bitcast_convert_type(bits, jnp.int32).astype(float) * 2.0**-32 + 0.5

    def one(key, lower, upper):
        def step(state, iteration):
            x, v, best_x, best, leader, least = state
            stream = mixed(key[0] + iteration * jnp.uint32(0x9E3779B9)) + key[1]
            own, social = uniforms(stream), uniforms(mixed(stream))
            v = W * v + C1 * own * (best_x - x) + C2 * social * (leader[:, None] - x)
            x = jnp.clip(x + v, 0.0, 1.0)
            f = jax.vmap(distance, (1, None))(lower[:, None] + (upper - lower)[:, None] * x, 1.0)
            i, better = jnp.argmin(f), f < best
            leader, least = jnp.where(f[i] < least, x[:, i], leader), jnp.minimum(f[i], least)
            return (x, v, jnp.where(better, x, best_x), jnp.where(better, f, best), leader, least), least

        x = uniforms(key[0] ^ key[1])
        state = (x, jnp.zeros_like(x), x, jnp.full(PARTICLES, jnp.inf), x[:, 0], jnp.inf)
        return jax.lax.scan(step, state, jnp.arange(ITERATIONS, dtype=jnp.uint32))[0][-1]

    run = jax.jit(jax.vmap(one, (0, None, None)), compiler_options=options)
    keys = jax.vmap(jax.random.key_data)(swarm.seed_keys(SEEDS))
    return lambda: run(keys, lower, upper)
