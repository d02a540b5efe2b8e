"""Table and figure 12 out of what mlp_kinematics.py stored; computes nothing."""
# ruff: noqa: E501  sentences read better whole

import pathlib
from collections.abc import Iterable

import matplotlib
import numpy as np
import pandas as pd
from study_statistics import Test, said, tested

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402

# Position errors that the text gives [mm].
PUBLISHED = {"training": 0.48, "validation": 0.61}
FILE = "mlp_runs.parquet"
STUCK = 5.0  # times the error of the best seed: such a run has learnt next to nothing
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown", "tab:pink")


def page(rows: list[dict], regions: dict[str, tuple[list[float], list[float]]], told: list[dict]) -> str:
    """Position errors of every case in its region [deg], and behaviour near singular poses, in Markdown."""
    lines = [
        "# The network for the kinematics",
        "",
        f"Mean distance of the tool from where it should be; published {PUBLISHED['training']} mm in training and "
        f"{PUBLISHED['validation']} mm in validation. Three joints, sigmoid, samples made by the kinematics. Validation "
        "chooses rate, stop and network; test samples are a third set that nothing is chosen by. Trainings are cut to what a core does in some minutes, so that the widest network has few epochs. The text does "
        "not say where its robot moved; joint positions here, in degrees:",
        "",
        *(f"- {name}: {low} to {high}" for name, (low, high) in regions.items()),
        "",
        "| case | weights | training mm | 95 % | validation mm | 95 % | test mm | 95 % | epochs | CPU s |",
        "|" + "---|" * 10,
    ]
    first = [r for r in rows if not r["case"]["seed"]]
    lines += [
        f"| {r['name']} | {r['weights']} | {r['training']:.3g} | {r['training_p95']:.3g} | {r['validation']:.3g} | "
        f"{r['validation_p95']:.3g} | {_test(r)} | {_test(r, 'test_p95')} | {r['epochs']} | {r['seconds']:.0f} |"
        for r in first
    ]
    lines += ["", "Other seeds of the first weights and of the order of the samples:", "", by_seed(rows)]
    lines += ["", "## Near singular poses", "", near_singular(rows, told)]
    return "\n".join([*lines, "", *_by_condition(rows)]) + "\n"


def runs_of(rows: list[dict]) -> pd.DataFrame:
    """One row a training; what an inverse does at the poses worst to reach."""
    told = []
    for row in rows:
        case, worst = row["case"], row.get("bins", [{}])[-1]
        head = {"reading": row["reading"], "seed": case["seed"], "penalty": _penalty(row)}
        errors = {key: row.get(key, np.nan) for key in ("training", "validation", "test")}
        told.append(head | errors | {f"there_{key}": worst.get(key, np.nan) for key in ("error", "chosen_p95", "speed_p95")})
    return pd.DataFrame(told)


def tests(rows: list[dict], folder: pathlib.Path) -> list[dict]:
    """Whether each penalty lowers the condition number of what the network chooses, one family."""
    plain, *others = sorted(_penalties(rows), key=lambda runs: runs[0]["case"]["penalty"] != "none")
    of = lambda runs: (("reading", runs[0]["reading"]),)  # noqa: E731
    found = [Test("network", f"condition chosen: {_penalty(runs[0])} lower than none", FILE, "there_chosen_p95", of(runs), of(plain))
             for runs in others]  # fmt: skip
    return tested(found, folder)


def judged_on(rows: list[dict]) -> str:
    """The third set, or validation where a case was trained before there was one."""
    return "test" if all("test" in row for row in rows) else "validation"


def _test(row: dict, key: str = "test") -> str:
    return f"{row[key]:.3g}" if key in row else "not run"


def by_seed(rows: list[dict]) -> str:
    """Errors of the readings that were trained from several seeds."""
    lines = ["| case | seeds | training, mm | validation, mm | test, mm | stuck |", "|---" * 6 + "|"]
    for reading, runs in _readings(rows).items():
        if len(runs) > 1:
            errors = [_scatter(r[key] for r in runs) for key in ("training", "validation")]
            errors.append(_scatter(r["test"] for r in runs) if judged_on(runs) == "test" else "not run")
            lines.append(f"| {reading} | {len(runs)} | " + " | ".join(errors) + f" | {stuck(runs)} |")
    legend = (
        f"Stuck: runs whose {judged_on(rows)} error is over {STUCK:g} times that of the best seed, which learnt little. "
        "Warmed up: the rate rises over the first epochs, which the text does not name."
    )
    return "\n".join([*lines, "", legend])


def stuck(runs: list[dict]) -> int:
    """How many runs of a reading have learnt next to nothing."""
    errors = np.array([r[judged_on(runs)] for r in runs])
    return int(np.sum(errors > STUCK * errors.min()))


def near_singular(rows: list[dict], told: list[dict]) -> str:
    """What each penalty changes at the poses worst to reach, beside what a seed changes; a table and its legend."""
    readings = _penalties(rows)
    plain = next(runs for runs in readings if runs[0]["case"]["penalty"] == "none")
    on = judged_on([row for runs in readings for row in runs])
    lines = [
        "| penalty | seeds | stuck | error, mm | error there, mm | condition chosen | lower than without | speed |",
        "|---" * 8 + "|",
    ]
    for runs in readings:
        worst = [r["bins"][-1] for r in runs]
        cells = [_scatter(r[on] for r in runs)]
        cells += [_scatter(b[key] for b in worst) for key in ("error", "chosen_p95", "speed_p95")]
        own = [test for test in told if test["first"][0][1] == runs[0]["reading"]]
        cells.insert(3, said(own[0]) if own else "")
        lines.append(f"| {_penalty(runs[0])} | {len(runs)} | {stuck(runs)} | " + " | ".join(cells) + " |")
    last = plain[0]["bins"][-1]
    legend = (
        f"There: the {last['samples']} {on} poses whose own condition number (2-norm) is above {last['from']:g}. "
        "Condition chosen: condition number of the network's pose, 95th percentile; whether a penalty makes it lower, "
        f"by Mann-Whitney's p after Holm's correction over the {len(told)} penalties, and the effect. Speed: joint speed per tool speed "
        f"[rad/m] when the network is followed, 95th percentile; by the exact inverse {last['asked_speed_p95']:.3g}. "
        "Median of the seeds [lowest, highest]."
    )
    return "\n".join([*lines, "", legend])


def _readings(rows: list[dict]) -> dict[str, list[dict]]:
    found: dict[str, list[dict]] = {}
    for row in rows:
        found.setdefault(row["reading"], []).append(row)
    return found


def _penalties(rows: list[dict]) -> list[list[dict]]:
    """Runs of each penalty and of none, all warmed up."""
    return [r for r in _readings(rows).values() if r[0]["case"]["region"] == "branch" and r[0]["case"]["warm_up"]]


def _scatter(values: Iterable[float]) -> str:
    x = np.array(list(values))
    return f"{np.median(x):.3g}" + f" [{x.min():.3g}, {x.max():.3g}]" * (len(x) > 1)


def _penalty(row: dict) -> str:
    case = row["case"]
    return "none" if case["penalty"] == "none" else f"{case['penalty']}, weight {case['weight']:g} m"


def _by_condition(rows: list[dict]) -> list[str]:
    """Behaviour by the condition number of the pose asked for, medians of the seeds."""
    lines = [
        "By the condition number of the pose which each sample was made with; medians of the seeds. Exact: 95th "
        "percentile of the speed by the exact inverse.",
        "",
        "| penalty | asked | samples | error mm | 95 % | chosen | speed | exact |",
        "|" + "---|" * 8,
    ]
    for runs in _penalties(rows):
        for of_seeds in zip(*(r["bins"] for r in runs), strict=True):
            one = of_seeds[0]
            keys = ("error", "error_p95", "chosen_p95", "speed_p95", "asked_speed_p95")
            cells = [f"{np.median([b[key] for b in of_seeds]):.3g}" for key in keys]
            head = f"| {_penalty(runs[0])} | {one['from']:g} to {one['to'] or float('inf'):g} | {one['samples']} | "
            lines.append(head + " | ".join(cells) + " |")
    return lines


def figure12(rows: list[dict], folder: pathlib.Path) -> None:
    """Error over the epochs of what is comparable with the published curve: the cases of the region of the task."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(figsize=(11, 5))
    shown = [r for r in rows if r["case"]["region"] == "task" and not (r["case"]["velocities"] or r["case"]["seed"])]
    on = judged_on(shown)
    for k, row in enumerate(shown):
        label = f"{row['name'].replace(', task', '')}: {row[on]:.2g} mm"
        curve, colour = row["curve"], COLOURS[k % len(COLOURS)]
        axes.plot(curve["epoch"], [1e3 * x for x in curve["validation"]], color=colour, lw=1.6, label=label)
        axes.plot(curve["epoch"], [1e3 * x for x in curve["training"]], color=colour, lw=0.6, alpha=0.6)
        steps = [curve["epoch"][-1] + 1 + k for k in range(len(row["refinement"]))]
        axes.plot(steps, [1e3 * x for x in row["refinement"]], color=colour, lw=1.6, ls="--")
    for (name, value), style in zip(PUBLISHED.items(), (":", "-"), strict=True):
        axes.axhline(value, color="0.5", lw=0.8, ls=style, label=f"published, {name}: {value} mm")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("epoch; dashed: step of Levenberg-Marquardt after the epochs")
    axes.set_ylabel("mean position error [mm]; thin: training, thick: validation")
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.tight_layout()
    figure.savefig(folder / "figure12.svg", metadata={"Date": None})
    plt.close(figure)


matplotlib.rcParams["svg.hashsalt"] = "irb140"
