"""Table and figure 12 out of what mlp_kinematics.py stored; computes nothing."""

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402

# Position errors that the text gives [mm].
PUBLISHED = {"training": 0.48, "validation": 0.61}
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


def page(rows: list[dict], regions: dict[str, tuple[list[float], list[float]]]) -> str:
    """Position errors of every case in its region [deg], and behaviour near singular poses, in Markdown."""
    lines = [
        "# The network for the kinematics",
        "",
        f"Mean distance of the tool from where it should be; published {PUBLISHED['training']} mm in training and "
        f"{PUBLISHED['validation']} mm in validation. Three joints, sigmoid, samples made by the kinematics. Trainings "
        "are cut to what a core does in two to four minutes, so that the widest network has few epochs. The text does "
        "not say where its robot moved; joint positions here, in degrees:",
        "",
        *(f"- {name}: {low} to {high}" for name, (low, high) in regions.items()),
        "",
        "| case | weights | training mm | 95 % | validation mm | 95 % | epochs | CPU s |",
        "|" + "---|" * 8,
    ]
    lines += [
        f"| {r['name']} | {r['weights']} | {r['training']:.3g} | {r['training_p95']:.3g} | {r['validation']:.3g} | "
        f"{r['validation_p95']:.3g} | {r['epochs']} | {r['seconds']:.0f} |"
        for r in rows
    ]
    return "\n".join(lines + [""] + _near_singular([r for r in rows if r["case"]["region"] == "branch"])) + "\n"


def _near_singular(rows: list[dict]) -> list[str]:
    """Behaviour by the condition number of the pose asked for."""
    lines = [
        "## Near singular poses",
        "",
        "By the condition number (2-norm) of the pose which each sample was made with. Chosen: of the network's own "
        "pose, 95th percentile. Speed: joint speed per speed of the tool [rad/m] when the network is followed, and by "
        "the exact inverse, 95th percentiles.",
        "",
        "| penalty | asked | samples | error mm | 95 % | chosen | speed | exact |",
        "|" + "---|" * 8,
    ]
    for row in rows:
        case = row["case"]
        name = "none" if case["penalty"] == "none" else f"{case['penalty']}, weight {case['weight']:g} m"
        lines += [
            f"| {name} | {b['from']:g} to {b['to'] or float('inf'):g} | {b['samples']} | {b['error']:.3g} | "
            f"{b['error_p95']:.3g} | {b['chosen_p95']:.3g} | {b['speed_p95']:.3g} | {b['asked_speed_p95']:.3g} |"
            for b in row.get("bins", [])
        ]
    return lines


def figure12(rows: list[dict], folder: pathlib.Path) -> None:
    """Error over the epochs of what is comparable with the published curve: the cases of the region of the task."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(figsize=(9.5, 4))
    shown = [r for r in rows if r["case"]["region"] == "task" and not r["case"]["velocities"]]
    for row, colour in zip(shown, COLOURS, strict=False):
        second = ", then Levenberg-Marquardt" if row["refinement"] else ""
        label = f"{row['case']['direction']}, {row['case']['hidden']}{second}: {row['validation']:.2g} mm"
        curve = row["curve"]
        axes.plot(curve["epoch"], [1e3 * x for x in curve["training"]], color=colour, lw=0.8, ls=":")
        axes.plot(curve["epoch"], [1e3 * x for x in curve["validation"]], color=colour, lw=1.0, label=label)
        steps = [curve["epoch"][-1] + 1 + k for k in range(len(row["refinement"]))]
        axes.plot(steps, [1e3 * x for x in row["refinement"]], color=colour, lw=1.0, ls="--")
    for (name, value), style in zip(PUBLISHED.items(), (":", "-"), strict=True):
        axes.axhline(value, color="0.5", lw=0.8, ls=style, label=f"published, {name}: {value} mm")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("epoch; dashed: step of Levenberg-Marquardt after the epochs")
    axes.set_ylabel("mean position error [mm]; dotted: training")
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.tight_layout()
    figure.savefig(folder / "figure12.svg", metadata={"Date": None})
    plt.close(figure)


matplotlib.rcParams["svg.hashsalt"] = "irb140"
