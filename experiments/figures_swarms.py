"""Figures 6 to 9 of the study: estimates beside the reference, convergence, and the spread of the final fitness."""

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import LogLocator  # noqa: E402

COLOURS = {"reference": "0.35", "PSO": "tab:red", "QPSO": "tab:blue"}


def draw(stored: dict, folder: pathlib.Path) -> None:
    """Write figure6.svg to figure9.svg out of table3_sets.json; estimates are means of the seeds, with deviations."""
    sets = {name: np.array(x) for name, x in stored["sets"].items()}
    reference, names = np.array(stored["reference"]), stored["names"]
    sought, centres = np.flatnonzero(stored["searched"]), len(reference) // 3
    inertia, com = sought[sought >= centres], sought[sought < centres]
    _bars(sets, reference, inertia, names, "inertia [kg m²]", folder / "figure6.svg")
    _bars(sets, reference, com, names, "centre of mass [m]", folder / "figure7.svg")
    _convergence({name: np.array(run["curves"]) for name, run in stored["runs"].items()}, folder / "figure8.svg")
    _boxes({name: np.array(run["fitness"]) for name, run in stored["runs"].items()}, folder / "figure9.svg")


def _bars(sets: dict, reference: np.ndarray, part: np.ndarray, names: list[str], label: str, path: pathlib.Path):
    """Values above, errors beneath: estimates that agree to a few per cent look alike above."""
    names, reference = [names[i] for i in part], reference[part]
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(0.45 * len(names) + 2.5, 5.5))
    place = np.arange(len(names))
    above.bar(place - 0.27, reference, 0.27, color=COLOURS["reference"], label="reference")
    for k, (name, x) in enumerate(sets.items()):
        x = x[:, part]
        above.bar(place + 0.27 * k, x.mean(0), 0.27, yerr=x.std(0), color=COLOURS[name], label=name, capsize=2)
        error = 100.0 * np.abs(x / reference - 1.0).mean(0)
        below.plot(place, error, "o", color=COLOURS[name])
    below.set_xticks(place, names, rotation=60)
    below.set(ylabel="mean error [%]", yscale="log")
    below.grid(axis="y", which="both", alpha=0.3)
    below.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    for formatter in (below.yaxis.set_major_formatter, below.yaxis.set_minor_formatter):
        formatter(lambda value, _: f"{value:g}")
    above.set(ylabel=label)
    _finish(figure, above, path)


def _convergence(curves: dict[str, np.ndarray], path: pathlib.Path) -> None:
    figure, axes = plt.subplots(figsize=(6, 3.5))
    for name, best in curves.items():
        axes.plot(best.mean(0), color=COLOURS[name], label=name)
        axes.fill_between(np.arange(best.shape[1]), best.min(0), best.max(0), color=COLOURS[name], alpha=0.2, lw=0)
    axes.set(yscale="log", xlabel="iteration", ylabel="best fitness, mean and range of the seeds")
    _finish(figure, axes, path)


def _boxes(fitness: dict[str, np.ndarray], path: pathlib.Path) -> None:
    figure, axes = plt.subplots(figsize=(4, 3.5))
    common = fitness["PSO"].mean()  # one factor for both: it leaves their ratio as it is
    axes.boxplot([values / common for values in fitness.values()], tick_labels=list(fitness))
    axes.set(yscale="log", ylabel="final fitness over the PSO runs' mean")
    _finish(figure, axes, path, legend=False)


def _finish(figure, axes, path: pathlib.Path, legend: bool = True) -> None:
    if legend:
        axes.legend(frameon=False)
    figure.tight_layout()
    # Without a date, and with ids that do not change, the same result gives the same file.
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


matplotlib.rcParams["svg.hashsalt"] = "irb140"
