"""Figures 6 to 9 of the study: estimates beside the reference, convergence, and the spread of the final fitness."""

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from jaxtyping import Array, Float  # noqa: E402

from irb140_jax.swarm import Minima  # noqa: E402

COLOURS = {"reference": "0.35", "pso": "tab:blue", "qpso": "tab:orange"}


def draw(found: dict[str, Minima], reference: Float[Array, " d"], folder: pathlib.Path) -> None:
    """Write figure6.svg to figure9.svg; estimates are means over the seeds, with a standard deviation."""
    folder.mkdir(parents=True, exist_ok=True)
    links = len(reference) // 9
    com = [f"{axis}{i + 1}" for i in range(links) for axis in "xyz"]
    inertia = [f"{name}{i + 1}" for i in range(links) for name in ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")]
    _bars(found, reference, slice(3 * links, None), inertia, "inertia [kg m²]", folder / "figure6.svg")
    _bars(found, reference, slice(0, 3 * links), com, "centre of mass [m]", folder / "figure7.svg")
    _convergence(found, folder / "figure8.svg")
    _boxes(found, folder / "figure9.svg")


def _bars(found: dict[str, Minima], reference, part: slice, names: list[str], label: str, path: pathlib.Path) -> None:
    figure, axes = plt.subplots(figsize=(0.55 * len(names) + 2, 3.5))
    place = np.arange(len(names))
    axes.bar(place - 0.27, np.asarray(reference)[part], 0.27, color=COLOURS["reference"], label="reference")
    for k, (name, minima) in enumerate(found.items()):
        x = np.asarray(minima.x)[:, part]
        axes.bar(place + 0.27 * k, x.mean(0), 0.27, yerr=x.std(0), color=COLOURS[name], label=name.upper(), capsize=2)
    axes.set_xticks(place, names, rotation=45)
    axes.set_ylabel(label)
    _finish(figure, axes, path)


def _convergence(found: dict[str, Minima], path: pathlib.Path) -> None:
    figure, axes = plt.subplots(figsize=(6, 3.5))
    for name, minima in found.items():
        best = np.asarray(minima.history.best)
        axes.plot(best.mean(0), color=COLOURS[name], label=name.upper())
        axes.fill_between(np.arange(best.shape[1]), best.min(0), best.max(0), color=COLOURS[name], alpha=0.2, lw=0)
    axes.set_yscale("log")
    axes.set_xlabel("iteration")
    axes.set_ylabel("best fitness, mean and range of the seeds")
    _finish(figure, axes, path)


def _boxes(found: dict[str, Minima], path: pathlib.Path) -> None:
    figure, axes = plt.subplots(figsize=(4, 3.5))
    axes.boxplot([np.asarray(m.fitness) for m in found.values()], tick_labels=[name.upper() for name in found])
    axes.set_yscale("log")
    axes.set_ylabel("final fitness of each seed")
    _finish(figure, axes, path, legend=False)


def _finish(figure, axes, path: pathlib.Path, legend: bool = True) -> None:
    if legend:
        axes.legend(frameon=False)
    figure.tight_layout()
    # Without a date, and with ids that do not change, the same result gives the same file.
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


matplotlib.rcParams["svg.hashsalt"] = "irb140"
