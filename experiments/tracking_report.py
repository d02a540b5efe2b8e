"""Table and figure out of what tracking_swarms.py stored; runs no loop."""

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from study_statistics import said  # noqa: E402

matplotlib.rcParams["svg.hashsalt"] = "irb140"


def page(result: dict) -> str:
    """What each objective identifies, and what none can."""
    parts = [f"# Swarms judged by the closed loop, {result['motion']}: {result['arm']}", table(result)]
    parts += [said_of_seen(result), said_of_tests(result)]
    return "\n\n".join(part for part in parts if part) + "\n"


def table(result: dict) -> str:
    """Errors and measures of every search along one motion, the truth above."""
    head = (
        "| minimised | by | COM MAPE % | inertia MAPE % | tracking, mrad | roughness, N m/s | energy, J | "
        "tracking elsewhere, mrad | torque elsewhere, N m |"
    )
    truth, unseen = result["truth"], result["truth_unseen"]
    lines = [head, "|---" * 9 + "|", _line("the true parameters", "", ("0", "0"), truth, unseen, 0.0)]
    for row in result["rows"]:
        errors = tuple(_with_spread(row[key], row[f"{key}_sd"], row["runs"]) for key in ("com", "inertia"))
        lines.append(
            _line(row["objective"], row["algorithm"], errors, row["measures"], row["unseen"], row["torque_rmse"])
        )
    return "\n".join(lines)


def _with_spread(mean: float, deviation: float, runs: int) -> str:
    return f"{mean:.3g} ± {deviation:.2g}" if runs > 1 else f"{mean:.3g}"


def _line(name: str, by: str, errors: tuple[str, ...], own: dict, other: dict, torque: float) -> str:
    return (
        f"| {name} | {by} | {errors[0]} | {errors[1]} | {1e3 * own['tracking']:.4g} | "
        f"{own['smoothness']:.5g} | {own['energy']:.5g} | {1e3 * other['tracking']:.4g} | {torque:.3g} |"
    )


def said_of_tests(result: dict) -> str:
    """QPSO against PSO at each objective."""
    words = {"com": "centres of mass", "inertia": "inertias", "torque_rmse": "torque elsewhere"}
    lines = []
    for test in result["tests"]:
        about, _, key = test["name"].removesuffix(", QPSO lower than PSO").rpartition(": ")
        lines.append(f"- {about}: {words[key]}, n = {test['n'][0]}: {said(test)}")
    return "Is QPSO's error lower than PSO's?\n\n" + "\n".join(lines) if lines else ""


def said_of_seen(result: dict) -> str:
    """How many directions of the parameters show, and which single parameters don't at all."""
    told = result["seen"]
    names, share = told["names"], np.array(told["tracking"]["share"])
    blind = [name for name, s in zip(names, share, strict=True) if s < 1e-6]
    whole = [name for name, s in zip(names, share, strict=True) if s > 1.0 - 1e-6]
    return (
        f"Of {len(names)} unknowns the closed loop shows {told['tracking']['rank']} combinations, torque itself "
        f"{told['torque']['rank']}, along this motion; a change of 10 % shows above 0.01° of a joint in "
        f"{told['above_encoder']}.  Not seen at all: {', '.join(blind) or 'none'}.  "
        f"Seen alone, not only in combination with others: {', '.join(whole) or 'none'}."
    )


def figure(result: dict, path: pathlib.Path) -> None:
    """Share of every parameter that the loop, and torque, can show; singular values beside it."""
    told = result["seen"]
    names = told["names"]
    picture, (left, right) = plt.subplots(1, 2, figsize=(max(11.0, 0.33 * len(names)), 4), width_ratios=(2.4, 1))
    place = np.arange(len(names))
    for k, (name, colour) in enumerate((("tracking", "tab:green"), ("torque", "0.6"))):
        left.bar(place - 0.2 + 0.4 * k, told[name]["share"], 0.4, color=colour, label=f"through {name}")
        values = np.array(told[name]["singular_values"])
        right.semilogy(np.arange(1, len(values) + 1), values / values[0], "o-", color=colour, markersize=3)
    left.set_xticks(place, names, rotation=75)
    left.set(ylabel="share that can be seen", ylim=(0, 1.15))
    left.legend(ncols=2, frameon=False, loc="upper right")
    right.set(xlabel="direction", ylabel="singular value / largest")
    picture.tight_layout()
    picture.savefig(path, metadata={"Date": None})
    plt.close(picture)
