"""Table 3 and figures 6 to 9 of the study: every reading of its swarms, 30 seeds each, published beside ours.

    python experiments/table3_swarms.py [--smoke] [--out results] [--figures docs/figures]

Readings are appended to results/table3_swarms.jsonl as they are done, so an interrupted run goes on where it stopped.
Writes results/table3_swarms.json and .md, and the figures of the readings that come nearest.
"""

import dataclasses
import json
import math
import pathlib
import time

import jax
import jax.numpy as jnp
import numpy as np
import tyro
from figures_swarms import draw
from study_readings import (
    ITERATIONS,
    LINKS,
    PARTICLES,
    PUBLISHED,
    SEEDS,
    Reading,
    all_readings,
    objective,
    reference,
    rule,
)

from irb140_jax import identify, swarm
from irb140_jax.compilation_cache import set_up_compilation_cache


@dataclasses.dataclass(frozen=True)
class Config:
    """What to run and where to write.

    Attributes:
        out: Folder of the results.
        figures: Folder of the figures.
        smoke: A few readings with small swarms, to see that all works.
    """

    out: pathlib.Path = pathlib.Path("results")
    figures: pathlib.Path = pathlib.Path("docs/figures")
    smoke: bool = False

    @property
    def size(self) -> dict[str, int]:
        """Particles, iterations and seeds."""
        return dict(particles=12, iterations=10, seeds=3) if self.smoke else FULL

    def readings(self) -> list[Reading]:
        """What is tried."""
        everything = list(all_readings())
        return everything[:: len(everything) // 12] if self.smoke else everything


FULL = {"particles": PARTICLES, "iterations": ITERATIONS, "seeds": SEEDS}


def minima(reading: Reading, particles: int, iterations: int, seeds: int) -> swarm.Minima:
    """All seeds of a reading."""
    aim = objective(reading)
    keys = swarm.seed_keys(seeds)
    return swarm.minimise(
        aim, rule(reading), aim.lower, aim.upper, keys=keys, particles=particles, iterations=iterations
    )


consistent = jax.jit(jax.vmap(identify.consistency, (0, None)))


def judged(reading: Reading, size: dict[str, int]) -> dict:
    """One row: errors by equation 30, fitness, plateau, share of possible bodies."""
    robot, x = reference()
    found = jax.block_until_ready(minima(reading, **size))
    com, inertia = identify.mape(np.asarray(found.x), np.asarray(x))
    fitness, curves = np.asarray(found.fitness), np.asarray(found.history.best)
    possible = consistent(found.x, robot.mass[jnp.array(LINKS)])
    return {
        "reading": dataclasses.asdict(reading), "name": str(reading), "com": _round(com), "inertia": _round(inertia),
        "fitness": _round(fitness), "plateau": identify.plateau(curves.mean(axis=0)),
        "plateau_of_runs": float(np.median([identify.plateau(c) for c in curves])),
        "consistent": [float(np.mean(np.asarray(flag))) for flag in possible],
    }  # fmt: skip


def _round(values: np.ndarray) -> list[float]:
    return [float(f"{v:.5g}") for v in values]


def run(config: Config) -> list[dict]:
    """Judge the readings that the file of results lacks; all rows."""
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / ("table3_swarms_smoke.jsonl" if config.smoke else "table3_swarms.jsonl")
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done, readings = {row["name"] for row in rows}, config.readings()
    started = time.perf_counter()
    for number, reading in enumerate(readings):
        if str(reading) in done:
            continue
        rows.append(judged(reading, config.size))
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
        if number % 100 == 0 or number == len(readings) - 1:
            print(f"{number + 1}/{len(readings)} readings, {time.perf_counter() - started:.0f} s", flush=True)
    return rows


def distance(row: dict, family: str) -> float:
    """How far a row is from the published one: root mean square of the logarithms of ours over published."""
    published = PUBLISHED[family]
    logs = [math.log(max(np.mean(row[k]), 1e-12) / published[k]) for k in ("com", "inertia")]
    if "plateau" in published:
        logs.append(math.log(max(row["plateau"], 1) / published["plateau"]))
    return math.sqrt(float(np.mean(np.square(logs))))


def nearest(rows: list[dict]) -> dict:
    """Nearest row of each algorithm, and the nearest pair that reads everything both share alike."""
    of = lambda family: [r for r in rows if r["reading"]["algorithm"] == family]  # noqa: E731
    alone = {family: min(of(family), key=lambda r, f=family: distance(r, f)) for family in PUBLISHED}
    best: dict[tuple, dict] = {}
    for family in PUBLISHED:
        for row in of(family):
            problem = best.setdefault(Reading(**row["reading"]).problem, {})
            if family not in problem or distance(row, family) < distance(problem[family], family):
                problem[family] = row
    pairs = [pair for pair in best.values() if len(pair) == len(PUBLISHED)]
    far = lambda pair: sum(distance(row, family) ** 2 for family, row in pair.items())  # noqa: E731
    return {"alone": alone, "pair": min(pairs, key=far, default=alone)}


def fitness_distance(row: dict, family: str) -> float:
    """As `distance`, of the mean and the spread of the final fitness, which the errors have no part in."""
    published, fitness = PUBLISHED[family], np.array(row["fitness"])
    pairs = ((fitness.mean(), published["fitness"]), (fitness.std(ddof=1), published["fitness_sd"]))
    return math.sqrt(float(np.mean([math.log(max(ours, 1e-300) / theirs) ** 2 for ours, theirs in pairs])))


def baselines() -> list[dict]:
    """Equation 20 without a swarm: one linear solve, Levenberg-Marquardt, BFGS, from 10 random starts in the box."""
    robot, x = reference()
    aim = objective(Reading("pso"))
    starts = aim.lower + (aim.upper - aim.lower) * jax.random.uniform(jax.random.key(0), (10, len(x)))
    ways = {
        "linear solve": lambda: identify.newton_step(lambda y: aim(y, jnp.asarray(1.0)), starts[0])[None],
        "Levenberg-Marquardt": lambda: identify.descents(aim.residual, starts, scale=jnp.abs(x)).x,
        "BFGS": lambda: identify.descents(aim.residual, starts, "bfgs", scale=jnp.abs(x)).x,
        "Levenberg-Marquardt, possible bodies": lambda: _possible(aim, starts),
    }
    rows = []
    for name, way in ways.items():
        com, inertia = identify.mape(np.asarray(jax.block_until_ready(way())), np.asarray(x))
        rows.append({"name": name, "com": _round(com), "inertia": _round(inertia)})
    return rows


def _possible(aim: identify.ParameterDistance, starts):
    """Descent in the log-Cholesky numbers, from the possible ones among the starts."""
    mass = reference()[0].mass[jnp.array(LINKS)]
    numbers = jax.vmap(identify.log_cholesky, (0, None))(starts, mass)
    # Of impossible starts, none of which a body can have, the reference's numbers moved by half take the place.
    fallback = 0.5 * identify.log_cholesky(aim.reference, mass)
    numbers = jnp.where(jnp.isfinite(numbers).all(axis=1, keepdims=True), numbers, fallback)
    found = identify.descents(lambda theta: aim.residual(identify.consistent_parameters(theta, mass)), numbers)
    return jax.vmap(identify.consistent_parameters, (0, None))(found.x, mass)


def compared(pair: dict) -> dict:
    """Mann-Whitney and effect sizes, QPSO against PSO, of the pair's final fitness and errors."""
    keys = ("fitness", "com", "inertia")
    return {key: identify.compared(pair["qpso"][key], pair["pso"][key])._asdict() for key in keys}


def summary(rows: list[dict]) -> dict:
    """What is written: nearest readings, tests, baselines, who reaches what, and every row."""
    near = nearest(rows)
    reach = lambda row, com, inertia: np.mean(row["com"]) <= com and np.mean(row["inertia"]) <= inertia  # noqa: E731
    published = PUBLISHED["qpso"]
    of = lambda family: [r for r in rows if r["reading"]["algorithm"] == family]  # noqa: E731
    least = lambda some: min(some, key=lambda r: np.mean(r["com"] + r["inertia"]))  # noqa: E731
    by_fitness = {f: min(of(f), key=lambda r, f=f: fitness_distance(r, f)) for f in PUBLISHED}
    usual = [r for r in rows if Reading(**r["reading"]).family == "other" and r["reading"]["units"] == "normalised"]
    return {
        "published": PUBLISHED,
        "nearest": {f: short(r) | {"distance": distance(r, f)} for f, r in near["alone"].items()},
        "nearest_pair": {f: short(r) | {"distance": distance(r, f)} for f, r in near["pair"].items()},
        "nearest_in_fitness": {f: short(r) | {"distance": fitness_distance(r, f)} for f, r in by_fitness.items()},
        "comparison_of_the_pair": compared(near["pair"]),
        "qpso_at_most_published": [short(r) for r in of("qpso") if reach(r, published["com"], published["inertia"])],
        "best_pso": short(least(of("pso"))),
        "best_qpso": short(least(of("qpso"))),
        "best_swarm": short(least(rows)),
        "other_swarms": [short(r) for r in usual if r["reading"]["width"] == Reading("pso").width],
        "baselines": [short(r) for r in baselines()],
        "readings": [short(r) for r in rows],
    }


def short(row: dict) -> dict:
    """A row without its single runs."""
    means = {key: float(f"{np.mean(row[key]):.4g}") for key in ("com", "inertia")}
    if "fitness" not in row:
        return {"name": row["name"]} | means
    fitness = np.array(row["fitness"])
    return {
        "name": row["name"], **means, "com_sd": float(f"{np.std(row['com'], ddof=1):.3g}"),
        "inertia_sd": float(f"{np.std(row['inertia'], ddof=1):.3g}"), "fitness": float(f"{fitness.mean():.4g}"),
        "fitness_sd": float(f"{fitness.std(ddof=1):.3g}"), "plateau": row["plateau"],
        "plateau_of_runs": row["plateau_of_runs"], "consistent": round(row["consistent"][2], 3),
    }  # fmt: skip


def page(result: dict) -> str:
    """The table in Markdown, published beside ours beside the reading."""
    line = lambda who, r: (  # noqa: E731
        f"| {who} | {r['com']:.3g} | {r['inertia']:.3g} | {r.get('fitness', math.nan):.3g} | "
        f"{r.get('fitness_sd', math.nan):.3g} | {r.get('plateau', '')} | {r.get('consistent', '')} | "
        f"{r.get('name', '')} |"
    )
    rows = [line(f"{family} published", row) for family, row in result["published"].items()]
    rows += [line(f"{family} nearest", row) for family, row in result["nearest"].items()]
    rows += [line(f"{family}, nearest pair", row) for family, row in result["nearest_pair"].items()]
    rows += [line(f"{family} nearest in fitness", row) for family, row in result["nearest_in_fitness"].items()]
    rows += [line("other swarms", row) for row in result["other_swarms"]]
    rows += [line(f"best {name}", result[f"best_{name}"]) for name in ("pso", "qpso", "swarm")]
    rows += [line("no swarm", row) for row in result["baselines"]]
    head = "| | COM MAPE % | inertia MAPE % | fitness | sd | plateau | possible bodies | reading |\n" + "|---" * 8 + "|"
    test = result["comparison_of_the_pair"]["fitness"]
    return (
        f"# Table 3: swarms\n\n{len(result['readings'])} readings.\n\n{head}\n" + "\n".join(rows) + "\n\n"
        f"QPSO against PSO in the nearest pair, final fitness: Mann-Whitney p = {test['p_value']:.2g}, "
        f"QPSO lower in {100 * test['superiority']:.0f} % of the pairs of runs, d = {test['cohen_d']:.2f}.\n"
        f"{len(result['qpso_at_most_published'])} readings of the QPSO reach 0.43 % and 0.76 %.\n"
    )


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    rows = run(config)
    result = summary(rows)
    stem = "table3_swarms_smoke" if config.smoke else "table3_swarms"
    (config.out / f"{stem}.json").write_text(json.dumps(result) + "\n", encoding="utf-8")
    (config.out / f"{stem}.md").write_text(page(result), encoding="utf-8")
    pair = {family: Reading(**row["reading"]) for family, row in nearest(rows)["pair"].items()}
    draw({family: minima(reading, **config.size) for family, reading in pair.items()}, reference()[1], config.figures)
    print(page(result))


if __name__ == "__main__":
    main()
