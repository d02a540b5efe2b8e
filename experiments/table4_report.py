"""Table 4 and figures 14 to 17 out of what table4_control.py stored; computes no motion."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import json
import pathlib

import numpy as np
import pandas as pd
from figures_control import CONDITIONS, MODELS, draw
from study_provenance import store
from study_statistics import Test, rounded, runs, said, tested

FILE = "table4_runs.parquet"
# Quantity of Table 4: its column, and the factor to the unit in its name.
QUANTITIES = {
    "rise time of arm 3 [s]": ("rise", 1.0), "settling time of arm 3 [s]": ("settling", 1.0),
    "overshoot of arm 3 [%]": ("overshoot", 1.0), "steady-state error of arm 3 [mrad]": ("steady", 1e3),
    "tracking error, all joints [mrad]": ("tracking", 1e3), "tracking error of the tool [mm]": ("tool", 1e3),
    "torque away from the reference's, all joints [N m]": ("torque_apart", 1.0),
    "torque roughness, all joints [N m/s]": ("roughness", 1.0), "energy, absolute [J]": ("energy", 1.0),
    "energy, signed [J]": ("signed_energy", 1.0), "energy of the first 2 s [J]": ("energy_early", 1.0),
    "energy's distance from the reference's, end less third [J]": ("energy_drift", 1.0),
}  # fmt: skip
# What the text says, as a column that is lower for the first model than for the second.
STATEMENTS = (
    ("PSO rises faster than QPSO", "rise", "PSO", "QPSO", "s"),
    ("PSO settles faster than QPSO", "settling", "PSO", "QPSO", "s"),
    ("PSO overshoots less than QPSO", "overshoot", "PSO", "QPSO", "%"),
    ("PSO has the lower steady-state error", "steady", "PSO", "QPSO", "rad"),
    ("QPSO tracks like the reference, PSO less so", "tracking_off", "QPSO", "PSO", "rad away"),
    ("QPSO's torque is nearer to the reference's", "torque_apart", "QPSO", "PSO", "N m away"),
    ("QPSO's torque is smoother than PSO's", "roughness", "QPSO", "PSO", "N m/s"),
    ("QPSO's energy is nearer to the reference's", "energy_off", "QPSO", "PSO", "J away"),
    ("PSO consumes more than QPSO at the start", "energy_early", "QPSO", "PSO", "J in 2 s"),
    ("PSO's energy diverges from the reference's, QPSO's less", "energy_drift", "QPSO", "PSO", "J further away"),
)
WORSE = "all models track worse when disturbed"
VERDICTS = ("yes", "no, the opposite", "no difference")


def write_report(result: dict, folder: pathlib.Path, pictures: pathlib.Path) -> list[pathlib.Path]:
    """Runs as Parquet, table as JSON and Markdown, and the figures; returns their paths."""
    arm3 = min(2, len(result["joints"]) - 1)
    parts = {name: measures_of(folder / "table4_runs" / f"{name}.npz") for name in result["readings"]}
    store(pd.concat([frame(name, values, arm3) for name, values in parts.items()]), folder / FILE)
    told = runs(folder / FILE)
    readings = [name for name, reading in result["readings"].items() if "choice" not in reading]
    claims = judged(folder, readings)
    shown = nearest(claims)
    result = result | {
        "table": {name: summary(told[told["reading"] == name]) for name in result["readings"]},
        "mujoco": {name: float(np.nanmax(x["mujoco"])) for name, x in parts.items() if "mujoco" in x},
        "claims": claims, "shown": shown,
    }  # fmt: skip
    paths = [folder / "table4_control.json", folder / "table4_control.md"]
    paths[0].write_text(json.dumps(result) + "\n", encoding="utf-8")
    paths[1].write_text(page(result), encoding="utf-8")
    return paths + draw(folder / "table4_runs", shown, result["joints"], pictures)


def measures_of(path: pathlib.Path) -> dict[str, np.ndarray]:
    """Arrays (model, seed, condition, ...) by name; `mujoco`, if it ran, by (model, condition)."""
    with np.load(path) as stored:
        return {key.removeprefix("measure_"): stored[key] for key in stored if key[:5] == "measu" or key == "mujoco"}


def frame(reading: str, values: dict[str, np.ndarray], arm3: int) -> pd.DataFrame:
    """One row a run; digits beyond round-off are left out."""
    total = lambda key: values[key].sum(axis=-1)  # noqa: E731
    size = lambda key: np.linalg.norm(values[key], axis=-1)  # noqa: E731
    columns = {key: values[key][..., arm3] for key in ("rise", "settling", "overshoot", "steady")}
    columns |= {key: size(key) for key in ("tracking", "torque_apart", "roughness")} | {"tool": values["tool"]}
    columns |= {key: total(key) for key in ("energy", "signed_energy", "energy_early")}
    off = lambda x: np.abs(rounded(x) - rounded(x[:1]))  # noqa: E731
    columns |= {
        "tracking_off": off(columns["tracking"]), "energy_off": off(columns["energy"]),
        "energy_drift": off(columns["energy"]) - off(total("energy_third")),
    }  # fmt: skip
    models, seeds, conditions = columns["tool"].shape
    place = pd.MultiIndex.from_product([MODELS, range(seeds), CONDITIONS], names=["model", "seed", "condition"])
    flat = {key: rounded(x).ravel() for key, x in columns.items()}
    return pd.DataFrame({"reading": reading} | {n: place.get_level_values(n) for n in place.names} | flat)


def summary(told: pd.DataFrame) -> dict:
    """Mean and spread over the seeds of every figure of Table 4, by condition and model."""
    by = lambda c, m: told[(told["condition"] == c) & (told["model"] == m)]  # noqa: E731
    return {
        name: {c: {m: spread(factor * by(c, m)[column].to_numpy()) for m in MODELS} for c in CONDITIONS}
        for name, (column, factor) in QUANTITIES.items()
    }


def spread(x: np.ndarray) -> dict:
    """Mean and standard deviation over the seeds that have a finite value, and how many have not."""
    finite = x[np.isfinite(x)]
    mean = float(finite.mean()) if finite.size > 1 else None
    std = None if mean is None else float(finite.std(ddof=1)) if np.ptp(finite) > 0.0 else 0.0
    return {"mean": mean, "std": std, "never": int(x.size - finite.size)}


def judged(folder: pathlib.Path, readings: list[str]) -> dict[str, list[dict]]:
    """Each statement of the text in each reading, all tests one family."""
    tests = [test for name in readings for test in _tests(name)]
    rows = tested(tests, folder)
    each = len(rows) // len(readings)
    return {name: _statements(rows[k * each : (k + 1) * each]) for k, name in enumerate(readings)}


def _tests(reading: str) -> list[Test]:
    of = lambda model, condition: (("reading", reading), ("condition", condition), ("model", model))  # noqa: E731
    found = [
        Test("control", f"{condition}: {words}", FILE, column, of(first, condition), of(second, condition))
        for condition in CONDITIONS
        for words, column, first, second, _ in STATEMENTS
    ]
    worse = [Test("control", f"{WORSE}: {m}", FILE, "tracking", of(m, "nominal"), of(m, "disturbed")) for m in MODELS]
    return found + worse


def _statements(rows: list[dict]) -> list[dict]:
    """One row a statement; the last is of all models at once."""
    told = []
    for row, words in zip(rows, STATEMENTS * len(CONDITIONS), strict=False):
        verdict = {"first": VERDICTS[0], "second": VERDICTS[1], "neither": VERDICTS[2]}[row["lower"]]
        told.append({"statement": row["name"], "unit": words[4], "holds": verdict, "tests": [row]})
    three = rows[-len(MODELS) :]
    lower = [row["lower"] for row in three]
    verdict = VERDICTS[0 if set(lower) == {"first"} else 1 if "second" in lower else 2]
    return [*told, {"statement": WORSE, "unit": "rad", "holds": verdict, "tests": three}]


def nearest(claims: dict[str, list[dict]]) -> str:
    """The reading in which most of the text's statements hold, those that turn out opposite taken off."""
    count = lambda rows: sum({VERDICTS[0]: 1, VERDICTS[1]: -1}.get(row["holds"], 0) for row in rows)  # noqa: E731
    return max(claims, key=lambda name: count(claims[name]))


def page(result: dict) -> str:
    """The table as Markdown: published statement, ours, reading."""
    table, claims, shown = result["table"], result["claims"], result["shown"]
    count = sum(len(row["tests"]) for rows in claims.values() for row in rows)
    lines = [
        f"# Table 4: {result['robot']}", "",
        "Written by `python experiments/table4_control.py`; don't edit.  The study's cells are not known, only what "
        "its text says of them.", "",
        f"Motion: {result['motion']}.  Gains {np.round(result['gain'], 2).tolist()} N m; largest torque along "
        f"the motion {np.round(result['peak_torque'], 2).tolist()} N m.  Commit {result['made']['commit']}.", "",
        "## What the text says", "",
        f"Ours: medians over the seeds in the reading *{_words(shown)}*, in which most of the statements hold; p by "
        f"Mann-Whitney after Holm's correction over all {count} tests of all readings, effect P(first smaller) less "
        "P(first larger).  A reading is: the side that gets the identified set, what the 40 % are of, switching "
        "function, form.", "",
        "| published statement | ours | test | holds in | opposite in | no difference in |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for k, row in enumerate(claims[shown]):
        verdicts = {name: rows[k]["holds"] for name, rows in claims.items()}
        columns = [[name for name, verdict in verdicts.items() if verdict == kind] for kind in VERDICTS]
        cells = " | ".join(_readings(names, len(claims)) for names in columns)
        lines.append(f"| {row['statement']} | {ours(row)} | {said(weakest(row))} | {cells} |")
    lines += ["", "## Figures", "", "Mean and standard deviation over the seeds; `never`: seeds that don't get there."]
    for name, told in table.items():
        beside = result["mujoco"].get(name)
        agrees = "" if beside is None else f"Joints apart from MuJoCo's by {beside:.2g} rad at most."
        lines += ["", f"### {_words(name)}", "", agrees, "", "| quantity | condition | " + " | ".join(MODELS) + " |"]
        lines.append("|---|---|" + "---|" * len(MODELS))
        for quantity, by_condition in told.items():
            for condition, by_model in by_condition.items():
                cells = " | ".join(cell(by_model[model]) for model in MODELS)
                lines.append(f"| {quantity} | {condition} | {cells} |")
    return "\n".join(lines) + "\n"


def ours(row: dict) -> str:
    """Medians that a statement compares."""
    if len(row["tests"]) > 1:
        return f"{sum(test['lower'] == 'first' for test in row['tests'])} of {len(row['tests'])} do"
    middle = [f"{x:.4g}" if np.isfinite(x) else "never" for x in row["tests"][0]["medians"]]
    return f"{middle[0]} against {middle[1]} {row['unit']}"


def weakest(row: dict) -> dict:
    """The test on which a statement stands."""
    return max(row["tests"], key=lambda test: test["p_holm"])


def cell(x: dict, digits: int = 5) -> str:
    """Mean and spread; a spread of nothing but round-off is left out."""
    if x["mean"] is None:
        return f"never in {x['never']}"
    text = f"{x['mean']:.{digits}g}" + f" ± {x['std']:.1g}" * (x["std"] > 1e-7 * abs(x["mean"]))
    return text + (f" (never in {x['never']})" if x["never"] else "")


def _words(name: str) -> str:
    return name.replace("_", " ")


def _readings(names: list[str], count: int) -> str:
    """How many readings, and which where they are few."""
    if not names:
        return "none"
    if len(names) == count:
        return f"all {count}"
    return f"{len(names)}: {', '.join(map(_words, names))}" if len(names) <= 3 else f"{len(names)} of {count}"
