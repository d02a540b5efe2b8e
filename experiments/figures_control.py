"""Figures 14 to 17 of the study: tool path, torques and energy of the three models, and how far apart they are."""

import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

MODELS = ("reference", "PSO", "QPSO")
CONDITIONS = ("nominal", "disturbed")
# The later lines lie upon the earlier ones: the thick one shows beneath, the dashed one lets it.
STYLES = (
    {"color": "0.35", "linewidth": 3.0, "alpha": 0.6},
    {"color": "tab:red", "linewidth": 1.2},
    {"color": "tab:blue", "linewidth": 1.2, "linestyle": (0, (4, 2))},
)


def draw(runs: pathlib.Path, reading: str, joints: list[str], out: pathlib.Path) -> list[pathlib.Path]:
    """All four, of the first seed's run in this reading; returns their paths."""
    with np.load(runs / "shared.npz") as shared, np.load(runs / f"{reading}.npz") as stored:
        t, wanted = shared["t"], shared["tool"]
        traces = {key: stored[f"trace_{key}"] for key in ("tau", "energy", "tool")}
    return [
        path_figure(t, wanted, traces["tool"], out / "figure14.png"),
        torque_figure(t, traces["tau"][:, 0], joints, CONDITIONS[0], out / "figure15.png"),
        torque_figure(t, traces["tau"][:, 1], joints, CONDITIONS[1], out / "figure16.png"),
        energy_figure(t, traces["energy"], out / "figure17.png"),
    ]


def path_figure(t: np.ndarray, wanted: np.ndarray, tool: np.ndarray, path: pathlib.Path) -> pathlib.Path:
    """Tool paths in space, nominal, and how far the tool is from where it should be, in both conditions."""
    figure = plt.figure(figsize=(11, 4.5))
    space = figure.add_subplot(1, 2, 1, projection="3d")
    space.plot(*(1e3 * wanted.T), color="gold", linewidth=6, alpha=0.6, label="wanted")
    for model, style, line in zip(MODELS, STYLES, tool[:, 0], strict=True):
        space.plot(*(1e3 * line.T), label=model, **style)
    space.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="tool path, nominal")
    space.legend(loc="upper left", bbox_to_anchor=(-0.25, 1.0), frameon=False)
    apart = figure.add_subplot(1, 2, 2)
    for model, style, lines in zip(MODELS, STYLES, tool, strict=True):
        for condition, line in zip(CONDITIONS, lines, strict=True):
            distance = 1e3 * np.linalg.norm(line - wanted, axis=-1)
            apart.semilogy(t, distance, label=model if condition == CONDITIONS[0] else None, **style)
    apart.set(xlabel="t [s]", ylabel="distance from the wanted point [mm]", title="nominal (low) and disturbed (high)")
    apart.legend(ncols=3, frameon=False)
    return _saved(figure, path)


def torque_figure(t: np.ndarray, tau: np.ndarray, joints: list, condition: str, path: pathlib.Path) -> pathlib.Path:
    """Motor torque of every joint, and beside it how far it is from the reference model's."""
    figure, rows = plt.subplots(len(joints), 2, sharex=True, figsize=(11, 1.9 * len(joints) + 0.6), squeeze=False)
    for i, (left, right) in enumerate(rows):
        for model, style, line in zip(MODELS, STYLES, tau, strict=True):
            left.plot(t, line[:, i], label=model, **style)
            if model != MODELS[0]:
                right.plot(t, line[:, i] - tau[0][:, i], **style)
        left.set_ylabel(f"{joints[i]} [N m]")
        left.set_ylim(_without_start(t, tau[:, :, i]))
        right.set_ylim(_without_start(t, (tau - tau[:1])[:, :, i]))
    rows[0, 0].set_title(f"motor torque, {condition}")
    rows[0, 1].set_title("less the reference model's [N m]")
    rows[0, 0].legend(ncols=3, frameon=False)
    for axes in rows[-1]:
        axes.set_xlabel("t [s]")
    return _saved(figure, path)


def _without_start(t: np.ndarray, tau: np.ndarray, settled: float = 1.0) -> tuple[float, float]:
    """Limits that show the motion: the jolt of the error at the start, many times as large, runs out of the picture."""
    calm = tau[:, t >= settled]
    calm = calm[np.isfinite(calm)]
    margin = 0.15 * max(np.ptp(calm), 1e-9)
    return calm.min() - margin, calm.max() + margin


def energy_figure(t: np.ndarray, energy: np.ndarray, path: pathlib.Path) -> pathlib.Path:
    """Absolute work of the motors up to t, all joints, and beside it how far it is from the reference model's."""
    figure, (left, right) = plt.subplots(1, 2, sharex=True, figsize=(11, 3.8))
    total = energy.sum(axis=-1)
    for m, (model, style) in enumerate(zip(MODELS, STYLES, strict=True)):
        for c, condition in enumerate(CONDITIONS):
            left.plot(t, total[m, c], label=model if c == 0 else None, **style)
            if m:
                line = "solid" if c == 0 else "dotted"
                right.plot(t, total[m, c] - total[0, c], label=f"{model}, {condition}", color=style["color"], ls=line)
    left.set(xlabel="t [s]", ylabel="energy [J]", title="nominal (low) and disturbed (high)")
    right.set(xlabel="t [s]", title="less the reference model's [J]")
    left.legend(frameon=False)
    right.legend(frameon=False)
    return _saved(figure, path)


def _saved(figure, path: pathlib.Path) -> pathlib.Path:
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path
