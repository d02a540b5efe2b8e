"""Table 3 out of what table3_swarms.py stored: which readings come nearest, tests, the table; runs no swarm."""

import math

import numpy as np
from study_readings import PUBLISHED, Reading
from study_statistics import difference


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


def compared(pair: dict) -> dict:
    """QPSO against PSO: tests, effect sizes and intervals of the pair's final fitness and errors."""
    keys = ("fitness", "com", "inertia")
    return {key: difference(pair["qpso"][key], pair["pso"][key]) for key in keys}


def summary(rows: list[dict], baselines: list[dict]) -> dict:
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
        "baselines": [short(r) for r in baselines],
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
