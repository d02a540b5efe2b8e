"""Figures 14 to 17 of the study: tool path, torques and energy of the three models with all seeds, and how far apart."""
# ruff: noqa: E501  sentences read better whole

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402

MODELS = ("reference", "PSO", "QPSO")
CONDITIONS = ("nominal", "disturbed")
# The later lines lie upon the earlier ones: the thick one shows beneath, the dashed one lets it.
STYLES = (
    {"color": "0.35", "linewidth": 2.5, "alpha": 0.6},
    {"color": "tab:red", "linewidth": 1.0},
    {"color": "tab:blue", "linewidth": 1.0, "linestyle": (0, (4, 2))},
)
matplotlib.rcParams["svg.hashsalt"] = "irb140"


def draw(stored: pathlib.Path, reading: str, joints: list[str], out: pathlib.Path) -> list[pathlib.Path]:
    """All four, of all seeds in this reading: a line is their median, a band reaches from lowest to highest."""
    with np.load(stored / "shared.npz") as shared, np.load(stored / f"{reading}.npz") as told:
        t, wanted = shared["t"], shared["tool"]
        band = {key.removeprefix("band_"): told[key] for key in told if key.startswith("band_")}
        paths = told["paths"]
    return [
        path_figure(t, wanted, paths, band["miss"], out / "figure14.svg"),
        torque_figure(t, band, 0, joints, out / "figure15.svg"),
        torque_figure(t, band, 1, joints, out / "figure16.svg"),
        energy_figure(t, band, out / "figure17.svg"),
    ]


def _band(axes: Axes, t: np.ndarray, stats: np.ndarray, style: dict, label: str | None = None, step: int = 2) -> None:
    """Median of the seeds, shape (3, T): lowest, median, highest."""
    low, middle, high = stats[:, ::step]
    axes.plot(t[::step], middle, label=label, **style)
    if np.any(high > low):
        axes.fill_between(t[::step], low, high, color=style["color"], alpha=0.2, lw=0)


def path_figure(t, wanted: np.ndarray, paths: np.ndarray, miss: np.ndarray, path: pathlib.Path) -> pathlib.Path:
    """Tool paths of all seeds in space, nominal, and how far the tool is from where it should be."""
    figure = plt.figure(figsize=(11, 4.5))
    space = figure.add_subplot(1, 2, 1, projection="3d")
    space.plot(*(1e3 * wanted[::5].T), color="gold", linewidth=6, alpha=0.6, label="wanted")
    for model, style, seeds in zip(MODELS, STYLES, paths, strict=True):
        for k, line in enumerate(seeds if model != MODELS[0] else seeds[:1]):
            space.plot(*(1e3 * line.T), label=model if k == 0 else None, **style)
    space.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="tool path, nominal, every seed")
    space.legend(loc="upper left", bbox_to_anchor=(-0.25, 1.0), frameon=False)
    apart = figure.add_subplot(1, 2, 2)
    for model, style, stats in zip(MODELS, STYLES, miss, strict=True):
        for c, condition in enumerate(CONDITIONS):
            _band(apart, t, 1e3 * stats[:, c], style, model if condition == CONDITIONS[0] else None)
    apart.set(xlabel="t [s]", ylabel="distance from the wanted point [mm]", yscale="log")
    apart.set_title("nominal (low) and disturbed (high)")
    apart.legend(ncols=3, frameon=False)
    return _saved(figure, path)


def torque_figure(t: np.ndarray, band: dict, condition: int, joints: list, path: pathlib.Path) -> pathlib.Path:
    """Motor torque of every joint, and beside it how far it is from the reference model's."""
    tau, apart = band["tau"][:, :, condition], band["tau_apart"][:, :, condition]
    figure, rows = plt.subplots(len(joints), 2, sharex=True, figsize=(11, 1.9 * len(joints) + 0.6), squeeze=False)
    for i, (left, right) in enumerate(rows):
        for model, style, own, off in zip(MODELS, STYLES, tau, apart, strict=True):
            _band(left, t, own[..., i], style, model)
            if model != MODELS[0]:
                _band(right, t, off[..., i], style)
        left.set_ylabel(f"{joints[i]} [N m]")
        left.set_ylim(_without_start(t, tau[..., i]))
        right.set_ylim(_without_start(t, apart[..., i]))
    rows[0, 0].set_title(f"motor torque, {CONDITIONS[condition]}")
    rows[0, 1].set_title("less the reference model's [N m]")
    rows[0, 0].legend(ncols=3, frameon=False)
    for axes in rows[-1]:
        axes.set_xlabel("t [s]")
    return _saved(figure, path)


def _without_start(t: np.ndarray, tau: np.ndarray, settled: float = 1.0) -> tuple[float, float]:
    """Limits that show the motion: the jolt of the error at the start, many times as large, runs out of the picture."""
    calm = tau[..., t >= settled]
    calm = calm[np.isfinite(calm)]
    margin = 0.15 * max(np.ptp(calm), 1e-9)
    return calm.min() - margin, calm.max() + margin


def energy_figure(t: np.ndarray, band: dict, path: pathlib.Path) -> pathlib.Path:
    """Absolute work of the motors up to t, all joints, and beside it how far it is from the reference model's."""
    figure, (left, right) = plt.subplots(1, 2, sharex=True, figsize=(11, 3.8))
    for m, (model, style) in enumerate(zip(MODELS, STYLES, strict=True)):
        for c, condition in enumerate(CONDITIONS):
            _band(left, t, band["energy"][m, :, c], style, model if c == 0 else None)
            if m:
                line = style | {"linestyle": "solid" if c == 0 else "dotted"}
                _band(right, t, band["energy_apart"][m, :, c], line, f"{model}, {condition}")
    left.set(xlabel="t [s]", ylabel="energy [J]", title="nominal (low) and disturbed (high)")
    right.set(xlabel="t [s]", title="less the reference model's [J]")
    left.legend(frameon=False)
    right.legend(frameon=False)
    return _saved(figure, path)


def _saved(figure, path: pathlib.Path) -> pathlib.Path:
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
    return path
