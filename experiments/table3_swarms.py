"""Table 3 and figures 6 to 9 of the study: every reading of its swarms, 30 seeds each, published beside ours.

    python experiments/table3_swarms.py                              # the study's arm, some 2300 readings
    python experiments/table3_swarms.py --robot arm.xml [--joints n] # any other arm, the usual readings
    python experiments/table3_swarms.py --devices 2                  # seeds shared among two devices
    python experiments/table3_swarms.py --smoke                      # seconds

Readings are appended to table3_swarms.jsonl as they are done, so an interrupted run goes on where it stopped.  Writes
table3_swarms.json and .md, the runs of the nearest pair of readings (table3_sets.json), and the figures of these runs.
"""

import dataclasses
import itertools
import json
import pathlib
import time

import jax
import jax.numpy as jnp
import numpy as np
import tyro
from figures_swarms import draw
from jax.sharding import Mesh
from study_arm import StudyArm, StudyConfig
from study_readings import ITERATIONS, PARTICLES, SEEDS, Reading, all_readings, objective, rule, usual_readings
from table3_report import page, summary

from irb140_jax import identify, swarm
from irb140_jax.compilation_cache import set_up_compilation_cache


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """Which arm, and where to write."""

    @property
    def size(self) -> dict[str, int]:
        """Particles, iterations and seeds."""
        return dict(particles=12, iterations=10, seeds=3) if self.smoke else FULL

    def readings(self, arm: StudyArm) -> list[Reading]:
        """What is tried."""
        everything = list(all_readings() if arm.is_studys else usual_readings())
        return everything[:: len(everything) // 4] if self.smoke else everything


FULL = {"particles": PARTICLES, "iterations": ITERATIONS, "seeds": SEEDS}


def minima(reading: Reading, arm: StudyArm, size: dict[str, int], mesh: Mesh | None = None) -> swarm.Minima:
    """All seeds of a reading; x holds the unknowns."""
    aim = objective(reading, arm)
    return swarm.minimise(
        aim, rule(reading), aim.lower, aim.upper, keys=swarm.seed_keys(size["seeds"]), particles=size["particles"],
        iterations=size["iterations"], mesh=mesh,
    )  # fmt: skip


consistent = jax.jit(jax.vmap(identify.consistency, (0, None)))


def judged(reading: Reading, arm: StudyArm, size: dict[str, int], mesh: Mesh | None = None) -> dict:
    """One row: errors by equation 30, fitness, plateau, share of possible bodies."""
    found = jax.device_get(minima(reading, arm, size, mesh))
    x = arm.full(found.x)
    com, inertia = arm.mape(np.asarray(x))
    fitness, curves = np.asarray(found.fitness), np.asarray(found.history.best)
    possible = consistent(x, arm.mass)
    return {
        "reading": dataclasses.asdict(reading), "name": str(reading), "com": _round(com), "inertia": _round(inertia),
        "fitness": _round(fitness), "plateau": identify.plateau(curves.mean(axis=0)),
        "plateau_of_runs": float(np.median([identify.plateau(c) for c in curves])),
        "consistent": [float(np.mean(np.asarray(flag))) for flag in possible],
    }  # fmt: skip


def _round(values: np.ndarray) -> list[float]:
    return [float(f"{v:.5g}") for v in values]


def run(config: Config, arm: StudyArm) -> list[dict]:
    """Judge the readings that the file of results lacks; all rows."""
    path = config.folder(arm) / "table3_swarms.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done, readings, mesh = {row["name"] for row in rows}, config.readings(arm), config.mesh
    started = time.perf_counter()
    for number, reading in enumerate(readings):
        if str(reading) in done:
            continue
        rows.append(judged(reading, arm, config.size, mesh))
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
        if number % 100 == 0 or number == len(readings) - 1:
            print(f"{number + 1}/{len(readings)} readings, {time.perf_counter() - started:.0f} s", flush=True)
    return rows


def baselines(arm: StudyArm, few: bool) -> list[dict]:
    """Equation 20 without a swarm: one linear solve, Levenberg-Marquardt, BFGS, from 10 random starts in the box."""
    aim = objective(Reading("pso"), arm)
    starts = aim.lower + (aim.upper - aim.lower) * jax.random.uniform(jax.random.key(0), (10, len(aim.lower)))
    scale = jnp.abs(aim.reference)
    ways = {
        "linear solve": lambda: identify.newton_step(lambda y: aim(y, jnp.asarray(1.0)), starts[0])[None],
        "Levenberg-Marquardt": lambda: identify.descents(aim.residual, starts, scale=scale).x,
        "BFGS": lambda: identify.descents(aim.residual, starts, "bfgs", scale=scale).x,
        "Levenberg-Marquardt, possible bodies": lambda: _possible(aim, starts, arm),
    }
    rows = []
    for name, way in itertools.islice(ways.items(), 2 if few else None):
        com, inertia = arm.mape(np.asarray(arm.full(jax.block_until_ready(way()))))
        rows.append({"name": name, "com": _round(com), "inertia": _round(inertia)})
    return rows


def _possible(aim: identify.ParameterDistance, starts, arm: StudyArm):
    """Descent in the log-Cholesky numbers, from the possible ones among the starts."""
    sought = jnp.asarray(np.flatnonzero(arm.searched))
    numbers = jax.vmap(identify.log_cholesky, (0, None))(arm.full(starts), arm.mass)
    # Of impossible starts, none of which a body can have, the reference's numbers moved by half take the place.
    fallback = 0.5 * identify.log_cholesky(arm.x, arm.mass)
    numbers = jnp.where(jnp.isfinite(numbers).all(axis=1, keepdims=True), numbers, fallback)
    unknowns = lambda theta: identify.consistent_parameters(theta, arm.mass)[sought]  # noqa: E731
    found = identify.descents(lambda theta: aim.residual(unknowns(theta)), numbers)
    return jax.vmap(unknowns)(found.x)


def pair_of_sets(pair: dict[str, str], arm: StudyArm, size: dict[str, int]) -> dict:
    """All that the nearest pair of readings found: the sets that the control takes, and what figures 6 to 9 show."""
    by_name = {str(reading): reading for reading in (*all_readings(), *usual_readings())}
    told = {
        "arm": arm.name, "joints": list(arm.whole.joint_names[: len(arm.links)]), "names": list(arm.names),
        "reference": np.asarray(arm.x).tolist(), "searched": arm.searched.tolist(), "sets": {}, "runs": {},
    }  # fmt: skip
    for family, name in pair.items():
        found = jax.block_until_ready(minima(by_name[name], arm, size))
        x = np.asarray(arm.full(found.x))
        com, inertia = arm.mape(x)
        told["sets"][family.upper()] = x.tolist()
        told["runs"][family.upper()] = {
            "reading": name, "com": _round(com), "inertia": _round(inertia), "fitness": _round(found.fitness),
            "curves": [_round(curve) for curve in np.asarray(found.history.best)],
        }  # fmt: skip
    return told


def write_sets(config: Config, arm: StudyArm, result: dict) -> pathlib.Path:
    """The sets of the nearest pair, stored, and the figures of them."""
    sets = pair_of_sets({family: row["name"] for family, row in result["nearest_pair"].items()}, arm, config.size)
    path = config.folder(arm) / "table3_sets.json"
    path.write_text(json.dumps(sets) + "\n", encoding="utf-8")
    draw(sets, config.figure_folder(arm))
    return path


def main(config: Config) -> None:
    """Table, sets and figures."""
    set_up_compilation_cache()
    arm = config.arm()
    result = {"config": config.said(), "arm": arm.name} | summary(run(config, arm), baselines(arm, few=config.smoke))
    folder = config.folder(arm)
    (folder / "table3_swarms.json").write_text(json.dumps(result) + "\n", encoding="utf-8")
    (folder / "table3_swarms.md").write_text(page(result), encoding="utf-8")
    write_sets(config, arm, result)
    print(page(result))


if __name__ == "__main__":
    main(tyro.cli(Config))
