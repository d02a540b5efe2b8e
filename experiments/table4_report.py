"""Table 4 and figures 14 to 17 out of what table4_control.py stored; computes no motion."""

import json
import pathlib

import numpy as np
from figures_control import CONDITIONS, MODELS, draw
from scipy import stats
from study_statistics import difference

# The reading that the figures show: models in the controller, disturbance of the peak torque, boundary layer.
SHOWN = "controller_of_peak_saturation_computed"
# Chance that even one of all statements in all readings is taken for settled by luck (Bonferroni).
ALPHA = 0.05
VERDICTS = ("yes", "no, the opposite", "no difference")
# Values that agree to this share are level: round-off, or one sample of a rise or settling time.
LEVEL = 1e-9


def write_report(result: dict, folder: pathlib.Path, pictures: pathlib.Path) -> list[pathlib.Path]:
    """Table as JSON and Markdown, and the figures; returns their paths."""
    arm3 = min(2, len(result["joints"]) - 1)
    runs = folder / "table4_runs"
    measures = {name: measures_of(runs / f"{name}.npz") for name in result["readings"]}
    table = {name: summary(values, arm3) for name, values in measures.items()}
    claims = {name: judged(values, arm3) for name, values in measures.items()}
    give_verdicts(claims)
    paths = [folder / "table4_control.json", folder / "table4_control.md"]
    paths[0].write_text(json.dumps({**result, "table": table, "claims": claims}, indent=1) + "\n", encoding="utf-8")
    paths[1].write_text(page(result, table, claims), encoding="utf-8")
    return paths + draw(runs, SHOWN, result["joints"], pictures)


def measures_of(path: pathlib.Path) -> dict[str, np.ndarray]:
    """Arrays (model, seed, condition, ...) by name; `mujoco`, if it ran, by (model, condition)."""
    with np.load(path) as stored:
        return {key.removeprefix("measure_"): stored[key] for key in stored if key[:5] == "measu" or key == "mujoco"}


def summary(values: dict[str, np.ndarray], arm3: int) -> dict:
    """Mean and spread over the seeds of every figure of Table 4, by condition and model."""
    rows = {
        "rise time of arm 3 [s]": values["rise"][..., arm3],
        "settling time of arm 3 [s]": values["settling"][..., arm3],
        "overshoot of arm 3 [%]": values["overshoot"][..., arm3],
        "steady-state error of arm 3 [mrad]": 1e3 * values["steady"][..., arm3],
        "tracking error, all joints [mrad]": 1e3 * np.linalg.norm(values["tracking"], axis=-1),
        "tracking error of the tool [mm]": 1e3 * values["tool"],
        "torque away from the reference's, all joints [N m]": np.linalg.norm(values["torque_apart"], axis=-1),
        "torque roughness, all joints [N m/s]": np.linalg.norm(values["roughness"], axis=-1),
        "energy, absolute [J]": values["energy"].sum(axis=-1),
        "energy, signed [J]": values["signed_energy"].sum(axis=-1),
    }
    told = {}
    for name, x in rows.items():
        told[name] = {
            condition: {model: spread(x[m, :, c]) for m, model in enumerate(MODELS)}
            for c, condition in enumerate(CONDITIONS)
        }
    if "mujoco" in values:
        told["largest difference from MuJoCo [rad]"] = float(np.nanmax(values["mujoco"]))
    return told


def spread(x: np.ndarray) -> dict:
    """Mean and standard deviation over the seeds that have a finite value, and how many have not."""
    finite = x[np.isfinite(x)]
    mean, std = (float(finite.mean()), float(finite.std())) if finite.size else (None, None)
    return {"mean": mean, "std": std, "never": int(x.size - finite.size)}


def judged(values: dict[str, np.ndarray], arm3: int) -> list[dict]:
    """Each statement of the text, what the runs say, and how sure that is."""
    rise, settling = values["rise"][..., arm3], values["settling"][..., arm3]
    overshoot, steady = values["overshoot"][..., arm3], values["steady"][..., arm3]
    rough, energy = np.linalg.norm(values["roughness"], axis=-1), values["energy"].sum(axis=-1)
    tracking, apart = (np.linalg.norm(values[key], axis=-1) for key in ("tracking", "torque_apart"))
    told = []
    for c, condition in enumerate(CONDITIONS):
        of = lambda x, c=c: x[:, :, c]  # noqa: E731
        told += [
            smaller(f"{condition}: PSO rises faster than QPSO", of(rise)[1], of(rise)[2], "s"),
            smaller(f"{condition}: PSO settles faster than QPSO", of(settling)[1], of(settling)[2], "s"),
            smaller(f"{condition}: PSO overshoots less than QPSO", of(overshoot)[1], of(overshoot)[2], "%"),
            smaller(f"{condition}: PSO has the lower steady-state error", of(steady)[1], of(steady)[2], "rad"),
            smaller(
                f"{condition}: QPSO tracks like the reference, PSO less so",
                off(of(tracking), 2), off(of(tracking), 1), "rad away",
            ),
            smaller(f"{condition}: QPSO's torque is nearer to the reference's", of(apart)[2], of(apart)[1], "N m away"),
            smaller(f"{condition}: QPSO's torque is smoother than PSO's", of(rough)[2], of(rough)[1], "N m/s"),
            smaller(
                f"{condition}: QPSO's energy is nearer to the reference's",
                off(of(energy), 2), off(of(energy), 1), "J away",
            ),
        ]  # fmt: skip
    worse = tracking[:, :, 1].mean(axis=1) > tracking[:, :, 0].mean(axis=1)
    told.append({
        "statement": "disturbed: all models track worse", "ours": f"{int(worse.sum())} of {len(MODELS)} do",
        "p": None, "effect": None, "holds": VERDICTS[0 if worse.all() else 1],
    })  # fmt: skip
    return told


def off(x: np.ndarray, model: int) -> np.ndarray:
    """Distance of a model's values from the reference's."""
    return np.abs(x[model] - x[0])


def smaller(statement: str, x: np.ndarray, y: np.ndarray, unit: str = "") -> dict:
    """Whether x is smaller than y over the seeds.

    Mann-Whitney's two-sided p, its effect P(x < y) - P(x > y), and the interval of the difference of means.
    """
    values = np.concatenate([x, y])
    known = bool(np.isfinite(values).all())
    # What never gets there comes last.
    values = values if known else stats.rankdata(np.nan_to_num(values, nan=np.inf))
    level = np.ptp(values) <= LEVEL * np.abs(values).max()
    test = difference(values[: x.size], values[x.size :])
    return {
        "statement": statement, "ours": f"{_median(x)} against {_median(y)} {unit}".strip(),
        "medians": [_median(x), _median(y)], "unit": unit,
        "p": 1.0 if level else test["p_value"], "effect": 0.0 if level else 2.0 * test["superiority"] - 1.0,
        "interval": [test["low"], test["high"]] if known and not level else None,
    }  # fmt: skip


def _median(x: np.ndarray) -> str:
    middle = np.median(np.nan_to_num(x, nan=np.inf))
    return f"{middle:.4g}" if np.isfinite(middle) else "never"


def give_verdicts(claims: dict[str, list[dict]]) -> None:
    """Say of every statement that was tested whether it holds, is opposite, or shows no difference."""
    tested = [row for told in claims.values() for row in told if row["p"] is not None]
    for row in tested:
        settled = row["p"] < ALPHA / len(tested)
        row["holds"] = VERDICTS[2 if not settled else (0 if row["effect"] > 0.0 else 1)]


def page(result: dict, table: dict, claims: dict) -> str:
    """The table as Markdown: published statement, ours, reading."""
    lines = [
        f"# Table 4: {result['robot']}", "",
        "Written by `python experiments/table4_control.py`; don't edit.  The study's cells are not known, only what "
        "its text says of them.", "",
        f"Motion: {result['motion']}.  Gains {np.round(result['gain'], 2).tolist()} N m; largest torque along "
        f"the motion {np.round(result['peak_torque'], 2).tolist()} N m.", "",
        "## What the text says", "",
        f"Ours: medians over the seeds in the reading *{_words(SHOWN)}*, Mann-Whitney's p, effect P(first smaller) "
        f"less P(first larger).  A reading is: the side that gets the identified set, what the 40 % are of, switching "
        f"function, form; it counts as holding or opposite at p < {ALPHA} over the number of tests "
        f"({sum(row['p'] is not None for told in claims.values() for row in told)}).", "",
        "| published statement | ours | p | effect | holds in | opposite in | no difference in |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for k, row in enumerate(claims[SHOWN]):
        p, effect = ("" if row[key] is None else f"{row[key]:.2g}" for key in ("p", "effect"))
        verdicts = {name: told[k]["holds"] for name, told in claims.items()}
        columns = [[name for name, verdict in verdicts.items() if verdict == kind] for kind in VERDICTS]
        cells = " | ".join(_readings(names, len(claims)) for names in columns)
        lines.append(f"| {row['statement']} | {row['ours']} | {p} | {effect} | {cells} |")
    lines += [
        "",
        "## Figures",
        "",
        "Mean and standard deviation over the seeds; `never`: seeds that don't get there.",
        "",
    ]
    for name, told in table.items():
        lines += [f"### {_words(name)}", "", "| quantity | condition | " + " | ".join(MODELS) + " |"]
        lines.append("|---|---|" + "---|" * len(MODELS))
        for quantity, by_condition in told.items():
            if not isinstance(by_condition, dict):
                lines.append(f"| {quantity} | both | {by_condition:.2g} |" + " |" * (len(MODELS) - 1))
                continue
            for condition, by_model in by_condition.items():
                cells = " | ".join(_cell(by_model[model]) for model in MODELS)
                lines.append(f"| {quantity} | {condition} | {cells} |")
        lines.append("")
    return "\n".join(lines)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _readings(names: list[str], count: int) -> str:
    """How many readings, and which where they are few."""
    if not names:
        return "none"
    if len(names) == count:
        return f"all {count}"
    return f"{len(names)}: {', '.join(map(_words, names))}" if len(names) <= 3 else f"{len(names)} of {count}"


def _cell(x: dict) -> str:
    text = "" if x["mean"] is None else f"{x['mean']:.5g} ± {x['std']:.2g}"
    return text + (f" (never: {x['never']})" if x["never"] else "")
