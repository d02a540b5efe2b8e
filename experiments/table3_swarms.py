"""Table 3 and figures 6 to 9 of the study: every reading of its swarms, 30 seeds each, published beside ours.

    python experiments/table3_swarms.py                              # the study's arm, some 2300 readings
    python experiments/table3_swarms.py --robot arm.xml [--joints n] # any other arm, the usual readings
    python experiments/table3_swarms.py --devices 2                  # seeds shared among two devices
    python experiments/table3_swarms.py --smoke                      # seconds

Readings are appended to table3_swarms.jsonl as they are done, so an interrupted run goes on where it stopped.  Writes
table3_runs.parquet (one row a run) and table3_readings.parquet (one row a reading), the table (table3_swarms.json and
.md), the sets of the nearest pair of readings (table3_sets.json), and the figures of these.
"""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import dataclasses
import itertools
import json
import math
import pathlib
import time

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import tyro
from figures_swarms import draw
from jax.sharding import Mesh
from study_arm import StudyArm, StudyConfig
from study_provenance import made, store
from study_readings import (
    ITERATIONS,
    PARTICLES,
    PUBLISHED,
    SEEDS,
    Reading,
    all_readings,
    in_other_boxes,
    objective,
    rule,
    usual_readings,
)
from table3_report import READINGS, RUNS, page, pair_of, readings_of, runs_of, summary
from table3_report import judged as judged_readings

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
        few = [Reading(f, velocity_limit=v, place="anywhere") for f in PUBLISHED for v in (math.inf, 0.2, 0.02)]
        return few if self.smoke else list(all_readings() if arm.is_studys else usual_readings())


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
    x = arm.unknowns.full(found.x)
    com, inertia = arm.unknowns.mape(np.asarray(x))
    averaged = arm.unknowns.mape(np.asarray(x).mean(axis=0))
    curves = np.asarray(found.history.best)
    aim = objective(reading, arm)
    return {
        "reading": dataclasses.asdict(reading), "name": str(reading), "com": _round(com), "inertia": _round(inertia),
        "fitness": _round(found.fitness), "plateau_of_mean": identify.plateau(curves.mean(axis=0)),
        "plateau": [identify.plateau(c) for c in curves], "averaged": _round(np.array(averaged)),
        "at_wall": at_wall(np.asarray(found.x), aim).sum(axis=1).tolist(),
        "possible": np.asarray(consistent(x, arm.mass).pseudo_inertia).astype(int).tolist(),
    }  # fmt: skip


def at_wall(x: np.ndarray, aim: identify.ParameterDistance) -> np.ndarray:
    """Which unknowns (s, u) end at an end of their box, or beyond."""
    lower, upper = np.asarray(aim.lower), np.asarray(aim.upper)
    margin = 1e-9 * (upper - lower)  # round-off
    return (x <= lower + margin) | (x >= upper - margin)


def _round(values, digits: int = 5) -> list[float]:
    return [float(f"{v:.{digits}g}") for v in np.asarray(values)]


def run(config: Config, arm: StudyArm, readings: list[Reading]) -> list[dict]:
    """Judge the readings that the file of results lacks; all rows."""
    path = config.folder(arm) / "table3_swarms.jsonl"
    rows = _stored(path, config.size["seeds"])
    done, mesh, commit = {row["name"] for row in rows}, config.mesh, made(config.said())["commit"]
    started = time.perf_counter()
    for number, reading in enumerate(readings):
        if str(reading) in done:
            continue
        rows.append(judged(reading, arm, config.size, mesh) | {"commit": commit})
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
        if number % 100 == 0 or number == len(readings) - 1:
            print(f"{number + 1}/{len(readings)} readings, {time.perf_counter() - started:.0f} s", flush=True)
    return rows


def _stored(path: pathlib.Path, seeds: int) -> list[dict]:
    """Rows of an earlier run of this size; a last line that was cut off in the middle is cut off whole."""
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    return [row for row in map(json.loads, whole.splitlines()) if len(row["com"]) == seeds]


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
        com, inertia = arm.unknowns.mape(np.asarray(arm.unknowns.full(jax.block_until_ready(way()))))
        rows.append({"name": name, "com": float(com.max()), "inertia": float(inertia.max())})
    return rows


def _possible(aim: identify.ParameterDistance, starts, arm: StudyArm):
    """Descent in the log-Cholesky numbers, from the possible ones among the starts."""
    sought = arm.unknowns.place
    numbers = jax.vmap(identify.log_cholesky, (0, None))(arm.unknowns.full(starts), arm.mass)
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
        "arm": arm.name, "joints": [arm.whole.joint_names[i] for i in arm.links], "names": list(arm.unknowns.names),
        "reference": np.asarray(arm.x).tolist(), "searched": list(arm.unknowns.sought),
        "sets": {}, "runs": {}, "walls": {},
    }  # fmt: skip
    for family, name in pair.items():
        found = jax.block_until_ready(minima(by_name[name], arm, size))
        told["sets"][family.upper()] = [_round(row, 9) for row in np.asarray(arm.unknowns.full(found.x))]
        told["walls"][family.upper()] = at_wall(np.asarray(found.x), objective(by_name[name], arm)).sum(axis=0).tolist()
        told["runs"][family.upper()] = {
            "reading": name, "fitness": _round(found.fitness),
            "curves": [_round(curve, 3) for curve in np.asarray(found.history.best)],
        }  # fmt: skip
    return told


def write_table(config: Config, arm: StudyArm) -> dict:
    """The table, out of all runs, which are stored; the nearest pair once more in other boxes."""
    folder = config.folder(arm)
    readings = config.readings(arm)
    by_name = {str(reading): reading for reading in readings}
    rows = [row for row in run(config, arm, readings) if row["name"] in by_name]
    choices = readings_of(rows)
    pair = pair_of(judged_readings(runs_of(rows), choices))
    boxes = [other for row in pair.values() for other in in_other_boxes(by_name[row["reading"]])]
    names = {str(reading) for reading in boxes[:: 5 if config.smoke else 1]}
    in_boxes = [row for row in run(config, arm, boxes[:: 5 if config.smoke else 1]) if row["name"] in names]
    runs = runs_of(rows + in_boxes)
    choices = pd.concat([choices, readings_of(in_boxes)], ignore_index=True)
    store(runs, folder / RUNS)
    store(choices, folder / READINGS)
    # The readings may have been run at several times.
    own = made(config.said()) | {"commits": sorted(set(choices["commit"]))}
    head = {"made": own, "config": config.said(), "arm": arm.name}
    return head | summary(judged_readings(runs, choices), baselines(arm, few=config.smoke), folder)


def main(config: Config) -> None:
    """Table, sets and figures."""
    set_up_compilation_cache()
    arm = config.arm()
    result = write_table(config, arm)
    folder = config.folder(arm)
    (folder / "table3_swarms.json").write_text(json.dumps(result) + "\n", encoding="utf-8")
    (folder / "table3_swarms.md").write_text(page(result), encoding="utf-8")
    sets = pair_of_sets({f: row["name"] for f, row in result["nearest_pair"].items()}, arm, config.size)
    (folder / "table3_sets.json").write_text(json.dumps({"made": result["made"]} | sets) + "\n", encoding="utf-8")
    draw(sets, config.figure_folder(arm))
    print(page(result))


if __name__ == "__main__":
    main(tyro.cli(Config))
