"""Table 3 out of what table3_swarms.py stored: which readings come nearest, tests, the table; runs no swarm."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false
# ruff: noqa: E501  sentences read better whole

import itertools
import math
import pathlib

import numpy as np
import pandas as pd
from study_readings import PUBLISHED, Reading, literal_readings
from study_statistics import Test, said, tested

RUNS, READINGS = "table3_runs.parquet", "table3_readings.parquet"
FIELDS = tuple(Reading.__dataclass_fields__)
PROBLEM = ["inertia_weight", "units", "width", "place", "penalty", "box"]


def runs_of(rows: list[dict]) -> pd.DataFrame:
    """One row a run; five digits of each number, as many as are shown."""
    columns = {"com": "float32", "inertia": "float32", "fitness": "float32", "plateau": "uint8", "at_wall": "uint8",
               "possible": "uint8"}  # fmt: skip
    told = {key: np.concatenate([row[key] for row in rows]) for key in columns}
    counts = [len(row["com"]) for row in rows]
    head = {"reading": np.repeat([row["name"] for row in rows], counts)}
    head["seed"] = np.concatenate([np.arange(n, dtype=np.uint8) for n in counts])
    frame = pd.DataFrame(head | told)
    return frame.astype({key: kind for key, kind in columns.items()})


def readings_of(rows: list[dict]) -> pd.DataFrame:
    """One row a reading: its choices, what only all its seeds together have, and the commit that ran it."""
    told = [{k: v for k, v in row["reading"].items() if k != "inertia"} for row in rows]
    frame = pd.DataFrame(told).assign(
        inertia_weight=[row["reading"]["inertia"] for row in rows], reading=[row["name"] for row in rows],
        plateau_of_mean=[row["plateau_of_mean"] for row in rows],
        averaged_com=[row["averaged"][0] for row in rows], averaged_inertia=[row["averaged"][1] for row in rows],
        commit=[row["commit"] for row in rows],
    )  # fmt: skip
    literal = {str(reading) for reading in literal_readings()}
    return frame.assign(literal=frame["reading"].isin(literal))


def judged(runs: pd.DataFrame, readings: pd.DataFrame) -> pd.DataFrame:
    """The readings with means and spreads of their runs."""
    by = runs.astype({k: float for k in ("com", "inertia", "fitness")}).groupby("reading", sort=False)
    told = pd.DataFrame({key: by[key].mean() for key in ("com", "inertia", "fitness", "at_wall", "possible")})
    told = told.assign(**{f"{key}_sd": by[key].std() for key in ("com", "inertia", "fitness")})
    told = told.assign(plateau=by["plateau"].median(), outliers=by["fitness"].apply(outliers),
                       fitness_iqr=by["fitness"].quantile(0.75) - by["fitness"].quantile(0.25))  # fmt: skip
    return readings.merge(told, left_on="reading", right_index=True, validate="one_to_one")


def outliers(values: pd.Series) -> int:
    """How many lie beyond 1.5 interquartile ranges, as a box plot marks them."""
    low, high = values.quantile(0.25), values.quantile(0.75)
    return int(((values < low - 1.5 * (high - low)) | (values > high + 1.5 * (high - low))).sum())


def distance(row: dict, family: str) -> float:
    """How far a row is from the published one: root mean square of the logarithms of ours over published."""
    published = PUBLISHED[family]
    known = [k for k in ("com", "inertia") if math.isfinite(row[k])]  # of centres that are all zero there is no error
    logs = [math.log(max(row[k], 1e-12) / published[k]) for k in known]
    if "plateau" in published:
        logs.append(math.log(max(row["plateau_of_mean"], 1) / published["plateau"]))
    return math.sqrt(float(np.mean(np.square(logs))))


def fitness_distance(row: dict, family: str) -> float:
    """As `distance`, of the mean and the spread of the final fitness, which the errors have no part in."""
    pairs = [(row[key], PUBLISHED[family][key]) for key in ("fitness", "fitness_sd")]
    return math.sqrt(float(np.mean([math.log(max(ours, 1e-300) / theirs) ** 2 for ours, theirs in pairs])))


def normalised_distance(pair: dict) -> float:
    """As `distance`, of what no common factor changes: the ratio of the mean fitnesses, and spreads over means."""
    of = lambda rows: (rows["qpso"]["fitness"] / rows["pso"]["fitness"],  # noqa: E731
                       *(rows[f]["fitness_sd"] / rows[f]["fitness"] for f in PUBLISHED))  # fmt: skip
    ours, theirs = of(pair), of(PUBLISHED)
    logs = [math.log(max(a, 1e-300) / b) for a, b in zip(ours, theirs, strict=True)]
    return math.sqrt(float(np.mean(np.square(logs))))


def nearest_pair(told: pd.DataFrame, far) -> dict[str, dict]:
    """Of each algorithm the reading that with the other's is nearest, everything alike that both share."""
    best, least = {}, math.inf
    for _, problem in told[told["box"] == 0].groupby(PROBLEM):
        sides = [problem[problem["algorithm"] == f].to_dict("records") for f in PUBLISHED]
        for pair in itertools.product(*sides):
            rows = dict(zip(PUBLISHED, pair, strict=True))
            apart = far(rows)
            if apart < least:
                best, least = rows, apart
    return best


def alone(told: pd.DataFrame, far) -> dict[str, dict]:
    """The nearest reading of each algorithm for itself."""
    rows = {f: told[(told["algorithm"] == f) & (told["box"] == 0)].to_dict("records") for f in PUBLISHED}
    return {f: min(rows[f], key=lambda row, f=f: far(row, f)) for f in PUBLISHED}


def pair_of(told: pd.DataFrame) -> dict[str, dict]:
    """The pair of readings that comes nearest to the published errors and plateau."""
    return nearest_pair(told, lambda pair: sum(distance(row, f) ** 2 for f, row in pair.items()))


def pairs_of_readings(told: pd.DataFrame, column: str) -> dict[str, float]:
    """In what share of all pairs of readings of one problem QPSO's mean is lower or higher than PSO's."""
    lower = higher = count = 0
    for _, problem in told[(told["box"] == 0) & told[column].notna()].groupby(PROBLEM):
        pso, qpso = (problem.loc[problem["algorithm"] == f, column].to_numpy() for f in PUBLISHED)
        apart = qpso[:, None] - pso[None]
        lower, higher, count = lower + int((apart < 0).sum()), higher + int((apart > 0).sum()), count + apart.size
    return {"lower": lower / max(count, 1), "higher": higher / max(count, 1), "pairs": count}


def shares_of_pairs(told: pd.DataFrame, holds) -> tuple[float, int]:
    """Share of all pairs of readings of one problem in which holds(PSO's rows, QPSO's rows) is true, and their number."""
    yes = count = 0
    for _, problem in told[told["box"] == 0].groupby(PROBLEM):
        pso, qpso = ({c: problem.loc[problem["algorithm"] == f, c].to_numpy() for c in problem} for f in PUBLISHED)
        found = holds({c: v[None] for c, v in pso.items()}, {c: v[:, None] for c, v in qpso.items()})
        yes, count = yes + int(found.sum()), count + found.size
    return yes / max(count, 1), count


def tests_of(pair: dict[str, dict]) -> list[Test]:
    """QPSO against PSO in this pair; Table 5's first rows."""
    of = lambda f: (("reading", pair[f]["reading"]),)  # noqa: E731
    lower = [Test("identification", f"{key}: QPSO lower than PSO", RUNS, key, of("qpso"), of("pso"))
             for key in ("com", "inertia", "fitness")]  # fmt: skip
    return [*lower, Test("identification", "plateau: PSO earlier than QPSO", RUNS, "plateau", of("pso"), of("qpso"))]


def summary(told: pd.DataFrame, baselines: list[dict], folder: pathlib.Path) -> dict:
    """What is written: nearest readings, tests, baselines, and who reaches what."""
    of = lambda family: told[told["algorithm"] == family]  # noqa: E731
    least = lambda some: some.loc[some[["com", "inertia"]].sum(axis=1).idxmin()].to_dict()  # noqa: E731
    pair = pair_of(told)
    usual = ~told["algorithm"].isin(list(PUBLISHED)) & (told["units"] == "normalised") & (told["width"] == 0.5)
    boxes = told[told["box"] > 0]
    return {
        "published": PUBLISHED, "count": len(told), "count_of": told["algorithm"].value_counts().to_dict(),
        "literal": {f: _span(of(f)[of(f)["literal"]]) for f in PUBLISHED},
        "nearest": {f: short(r) | {"distance": distance(r, f)} for f, r in alone(told, distance).items()},
        "nearest_pair": {f: short(r) | {"distance": distance(r, f)} for f, r in pair.items()},
        "nearest_in_fitness": {f: short(r) for f, r in alone(told, fitness_distance).items()},
        "nearest_normalised": {f: short(r) for f, r in nearest_pair(told, normalised_distance).items()},
        "tests": tested(tests_of(pair), folder),
        "other_boxes": {f: _span(boxes[boxes["algorithm"] == f]) for f in PUBLISHED} if len(boxes) else {},
        "over_pairs": {k: pairs_of_readings(told, k) for k in ("com", "fitness", "plateau", "outliers")},
        "best_pso": short(least(of("pso"))), "best_qpso": short(least(of("qpso"))), "best_swarm": short(least(told)),
        "other_swarms": [short(r) for r in told[usual].to_dict("records")], "baselines": baselines,
    }  # fmt: skip


def _span(rows: pd.DataFrame) -> dict:
    """Lowest and highest mean errors of some readings."""
    ends = lambda key: [float(rows[key].min()), float(rows[key].max())]  # noqa: E731
    keys = ("com", "inertia", "averaged_com", "averaged_inertia", "fitness", "plateau")
    return {"readings": len(rows)} | {key: ends(key) for key in keys}


def short(row: dict) -> dict:
    """What is told of a reading."""
    keys = ("com", "com_sd", "inertia", "inertia_sd", "averaged_com", "averaged_inertia", "fitness", "fitness_sd",
            "plateau", "plateau_of_mean", "at_wall", "possible", "outliers")  # fmt: skip
    # An error that is not defined for an arm, of centres that are all zero, is left empty.
    told = {key: float(f"{row[key]:.5g}") if math.isfinite(row[key]) else None for key in keys}
    return {"name": row["reading"]} | told


def page(result: dict) -> str:
    """The table in Markdown, published beside ours beside the reading."""
    line = lambda who, r: (  # noqa: E731
        f"| {who} | {r['com']:.3g} | {r['inertia']:.3g} | {r.get('fitness', math.nan):.3g} | "
        f"{r.get('fitness_sd', math.nan):.3g} | {r.get('plateau_of_mean', r.get('plateau', ''))} | "
        f"{r.get('possible', '')} | {r.get('name', '')} |"
    ).replace("nan", "")
    rows = [line(f"{family} published", row) for family, row in result["published"].items()]
    for key in ("nearest", "nearest_pair", "nearest_in_fitness", "nearest_normalised"):
        rows += [line(f"{family}, {key.replace('_', ' ')}", row) for family, row in result[key].items()]
    rows += [line("other swarms", row) for row in result["other_swarms"]]
    rows += [line(f"best {name}", result[f"best_{name}"]) for name in ("pso", "qpso", "swarm")]
    rows += [line("no swarm", row) for row in result["baselines"]]
    head = "| | COM MAPE % | inertia MAPE % | fitness | sd | plateau | possible bodies | reading |\n" + "|---" * 8 + "|"
    tests = "\n".join(f"- {row['name']}: {said(row)}" for row in result["tests"])
    return f"# Table 3: swarms\n\n{result['count']} readings.\n\n{head}\n" + "\n".join(rows) + f"\n\n{tests}\n"
