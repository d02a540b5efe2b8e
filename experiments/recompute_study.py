"""Tables 3 and 4 of the study and every p-value once more, out of the single runs that are stored; pandas alone.

    python experiments/recompute_study.py [results]

Knows nothing of irb140_jax and of the other scripts: it reads the Parquet files, computes means, spreads,
Mann-Whitney's p and Holm's correction itself, and compares them with what the JSON files state.  Exit code 1
where one differs.
"""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import json
import math
import pathlib
import sys
from collections.abc import Iterator

import pandas as pd

MODELS, CONDITIONS = ("reference", "PSO", "QPSO"), ("nominal", "disturbed")
LEVEL = 1e-8  # share to which values that agree are level: round-off
# Quantity of Table 4: column, factor.
QUANTITIES = {
    "rise time of arm 3 [s]": ("rise", 1.0), "settling time of arm 3 [s]": ("settling", 1.0),
    "overshoot of arm 3 [%]": ("overshoot", 1.0), "steady-state error of arm 3 [mrad]": ("steady", 1e3),
    "tracking error, all joints [mrad]": ("tracking", 1e3), "tracking error of the tool [mm]": ("tool", 1e3),
    "torque away from the reference's, all joints [N m]": ("torque_apart", 1.0),
    "torque roughness, all joints [N m/s]": ("roughness", 1.0), "energy, absolute [J]": ("energy", 1.0),
    "energy, signed [J]": ("signed_energy", 1.0), "energy of the first 2 s [J]": ("energy_early", 1.0),
    "energy's distance from the reference's, end less third [J]": ("energy_drift", 1.0),
}  # fmt: skip


def mann_whitney(x: pd.Series, y: pd.Series) -> float:
    """Two-sided p by the normal approximation, ties and continuity corrected."""
    both = pd.concat([x, y], ignore_index=True)
    n, m = len(x), len(y)
    finite = both[both.abs() != math.inf]
    if len(finite) == n + m and finite.max() - finite.min() <= LEVEL * finite.abs().max() or not len(finite):
        return 1.0
    u = both.rank().iloc[:n].sum() - n * (n + 1) / 2
    ties = both.value_counts()
    total = n + m
    deviation = math.sqrt(n * m / 12 * (total + 1 - (ties**3 - ties).sum() / (total * (total - 1))))
    z = (max(u, n * m - u) - n * m / 2 - 0.5) / deviation
    return min(1.0, math.erfc(z / math.sqrt(2)))


def effect(x: pd.Series, y: pd.Series) -> float:
    """P(x < y) - P(x > y)."""
    return sum(float((y > value).sum() - (y < value).sum()) for value in x) / (len(x) * len(y))


def holm(p: list[float]) -> list[float]:
    """Holm's correction."""
    corrected, largest = [0.0] * len(p), 0.0
    for rank, place in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        largest = max(largest, p[place] * (len(p) - rank))
        corrected[place] = min(1.0, largest)
    return corrected


def tests_in(stored) -> Iterator[dict]:
    """Every test that a result states, in its order."""
    if isinstance(stored, dict) and {"family", "table", "p_holm"} <= stored.keys():
        yield stored
    elif isinstance(stored, (dict, list)):
        for part in stored.values() if isinstance(stored, dict) else stored:
            yield from tests_in(part)


def of_tests(folder: pathlib.Path) -> Iterator[tuple[str, float, float]]:
    """Name, stated and recomputed value of every p, effect and corrected p."""
    frames: dict[str, pd.DataFrame | None] = {}
    for path in sorted(folder.glob("*.json")):
        tests = list(tests_in(json.loads(path.read_text(encoding="utf-8"))))
        p: list[float] = []
        for test in tests:
            frame = frames.setdefault(test["table"], None)
            if frame is None:
                frame = frames[test["table"]] = pd.read_parquet(folder / test["table"])
            x, y = (frame.loc[rows(frame, test[side]), test["column"]].astype(float) for side in ("first", "second"))
            p.append(mann_whitney(x, y))
            name = f"{path.name}: {test['name']}"
            yield f"{name}, p", test["p"], p[-1]
            yield f"{name}, effect", test["effect"], effect(x, y) if p[-1] < 1.0 or test["effect"] else 0.0
        for test, value in zip(tests, holm(p), strict=True):
            yield f"{path.name}: {test['name']}, p (Holm)", test["p_holm"], value


def rows(frame: pd.DataFrame, wanted: list) -> pd.Series:
    """Which rows have these values."""
    keep = pd.Series(True, index=frame.index)
    for column, value in wanted:
        keep &= frame[column] == value
    return keep


def of_table_3(folder: pathlib.Path) -> Iterator[tuple[str, float, float]]:
    """Means and spreads of every reading that is named, and the literal row."""
    stated = json.loads((folder / "table3_swarms.json").read_text(encoding="utf-8"))
    runs = pd.read_parquet(folder / "table3_runs.parquet").astype({k: float for k in ("com", "inertia", "fitness")})
    by = runs.groupby("reading")
    mean, deviation = by[["com", "inertia", "fitness"]].mean(), by[["com", "inertia", "fitness"]].std()
    groups = ("nearest", "nearest_pair", "nearest_in_fitness", "nearest_normalised")
    named = [row for key in groups for row in stated[key].values()] + stated["other_swarms"]
    for row in named + [stated[f"best_{name}"] for name in ("pso", "qpso", "swarm")]:
        for key in ("com", "inertia", "fitness") if row["name"] in mean.index else ():
            yield f"Table 3: {row['name']}, {key}", row[key], mean.loc[row["name"], key]
            yield f"Table 3: {row['name']}, {key}, deviation", row[f"{key}_sd"], deviation.loc[row["name"], key]
    readings = pd.read_parquet(folder / "table3_readings.parquet")
    for family, row in stated["literal"].items():
        own = mean.loc[readings.loc[readings["literal"] & (readings["algorithm"] == family), "reading"]]
        for key in ("com", "inertia"):
            yield f"Table 3: literal {family}, lowest {key}", row[key][0], own[key].min()
            yield f"Table 3: literal {family}, highest {key}", row[key][1], own[key].max()


def of_table_4(folder: pathlib.Path) -> Iterator[tuple[str, float, float]]:
    """Every mean and spread of every reading."""
    stated = json.loads((folder / "table4_control.json").read_text(encoding="utf-8"))["table"]
    runs = pd.read_parquet(folder / "table4_runs.parquet").replace([math.inf, -math.inf], math.nan)
    by = runs.groupby(["reading", "condition", "model"])
    mean, deviation = by.mean(numeric_only=True), by.std(numeric_only=True)
    for reading, told in stated.items():
        for quantity, (column, factor) in QUANTITIES.items():
            for c in CONDITIONS:
                for m in MODELS:
                    cell, place = told[quantity][c][m], ((reading, c, m), column)
                    if cell["mean"] is not None:
                        name = f"Table 4: {reading}, {quantity}, {c}, {m}"
                        yield name, cell["mean"], factor * mean.loc[place]
                        yield f"{name}, deviation", cell["std"], factor * deviation.loc[place]


def main() -> int:
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1] / "results")
    wrong = 0
    for title, part in (("Table 3", of_table_3), ("Table 4", of_table_4), ("tests", of_tests)):
        count = 0
        for name, stated, found in part(folder):
            count += 1
            # Stated to five digits at least; spreads of round-off alone differ freely.
            if abs(stated - found) > 6e-5 * max(abs(stated), abs(found)) + 1e-12:
                wrong += 1
                print(f"{name}: stated {stated!r}, recomputed {found!r}")
        print(f"{title}: {count} figures")
    print("all agree" if not wrong else f"{wrong} differ")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
