"""What the text leaves open, what we chose, what it changes: the table and its figure, out of stored results."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false
# ruff: noqa: E501  sentences read better whole

import dataclasses
import math
import pathlib

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from study_readings import Reading  # noqa: E402

TOOL = "tracking error of the tool [mm]"
COLOURS = {"reference": "0.35", "PSO": "tab:red", "QPSO": "tab:blue"}
matplotlib.rcParams["svg.hashsalt"] = "irb140"


@dataclasses.dataclass(frozen=True)
class Choice:
    """One open point of the text.

    Attributes:
        open: What the text leaves open.
        chosen: What we took.
        tried: What else was run.
        spans: Lowest and highest result by model: of the centres of mass [%], or of the tool's path [mm].
        control: Whether it belongs to the control.
    """

    open: str
    chosen: str
    tried: str
    spans: dict[str, tuple[float, float]]
    control: bool

    @property
    def changes(self) -> str:
        """In words."""
        unit = "mm at the tool" if self.control else "% of the centres of mass"
        told = [f"{model} {between(*ends)}" for model, ends in self.spans.items()]
        return ", ".join(told) + f" {unit}" if told else "not run"


def between(low: float, high: float, digits: int = 2) -> str:
    """A span in words; one number where both ends are printed alike, and what has none says so."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "not defined"
    ends = f"{low:.{digits}g}", f"{high:.{digits}g}"
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


# Attribute of a reading: what is open, and which other attributes may go along with it.
OPEN = {
    "velocity_limit": ("limit of the velocities (a fraction of the box; rad)", ()),
    "width": ("the parameters' bounds: half width of the box", ()),
    "place": ("where the reference lies in its box", ()),
    "box": ("which draw of that place, one for all seeds", ()),
    "inertia_weight": ("inertia weight: 0.99 (section 3) or falling (equation 18)", ()),
    "units": ("units of equation 20", ()),
    "walls": ("whether particles stop at the bounds", ()),
    "penalty": ("weight of equation 20's penalty", ()),
    "start_speed": ("Algorithm 1's random first velocities", ()),
    "decode": ("from angles or bits to parameters", ("perturbed", "collapse")),
    "perturbed": ("Algorithm 2's perturbation", ()),
    "perturbation": ("size of Algorithm 2's perturbation [rad]", ("perturbed",)),
}
# A penalty matters only where particles may leave the box.
FREE = Reading("pso", velocity_limit=0.1, walls=False)
# Where the nearest pair's own neighbours were not run, these two are the ones that change.
PLAIN = {"pso": Reading("pso", velocity_limit=0.2, place="anywhere"),
         "qpso": Reading("qpso", velocity_limit=0.02, perturbed=False, place="anywhere")}  # fmt: skip


def swarm_choices(told: pd.DataFrame, pair: dict[str, dict]) -> list[Choice]:
    """Each choice changed alone, from the nearest pair of readings."""
    by_name = told.set_index("reading", drop=False)
    rows = {f: by_name.loc[row["name"]] for f, row in pair.items()}
    plain = {f: by_name.loc[str(reading)] for f, reading in PLAIN.items() if str(reading) in by_name.index}
    found = []
    for attribute, (words, along) in OPEN.items():
        spans, tried = {}, set()
        for family, base in rows.items():
            alike = _alike(told, base, attribute, along)
            if len(alike) < 2 and family in plain:
                alike = _alike(told, plain[family], attribute, along)
            if len(alike) < 2 and family == "pso" and str(FREE) in by_name.index:
                alike = _alike(told, by_name.loc[str(FREE)], attribute, along)
            if len(alike) > 1:
                spans[family.upper()] = (float(alike["com"].min()), float(alike["com"].max()))
                tried |= set(alike[attribute])
        if spans:
            taken = {f.upper(): _said(r[attribute]) for f, r in rows.items() if f.upper() in spans}
            both = " and ".join(f"{value} ({f})" for f, value in taken.items())
            chosen = next(iter(taken.values())) if len(set(taken.values())) == 1 else both
            found.append(Choice(words, chosen, ", ".join(map(_said, sorted(tried))), spans, False))
    spans = {f.upper(): tuple(sorted((r["averaged_com"], r["com"]))) for f, r in rows.items()}
    averaged = Choice("MAPE of each run, or of the averaged set of 30 runs", "of each run, then the mean", "both", spans, False)
    return [*found, averaged]


def _alike(told: pd.DataFrame, base: pd.Series, attribute: str, along: tuple[str, ...]) -> pd.DataFrame:
    """Readings that differ from the base in nothing but this; none unless it takes two values."""
    same = told["algorithm"] == base["algorithm"]
    for other in OPEN.keys() - {attribute, *along}:
        same &= told[other] == base[other]
    return told[same] if told.loc[same, attribute].nunique() > 1 else told[:0]


def _said(value) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, float, np.number)):
        return "none" if math.isinf(value) else f"{value:g}"
    return str(value).removeprefix("w ")


CONTROL_OPEN = {
    "layer": "boundary layer of the sliding mode [rad/s]", "slope": "slope of the sliding surface [1/s]",
    "authority": "switching gain, as an acceleration [rad/s²]", "start_error": "error at the start [rad]",
    "frequency": "frequency of the disturbance [Hz]", "share": "size of the disturbance (40 % is stated)",
}  # fmt: skip


def control_choices(t4: dict) -> list[Choice]:
    """Each choice changed alone; the tool's error, disturbed where the disturbance is what changes."""
    base = "controller_of_peak_saturation_computed"
    found = []
    for option, words in CONTROL_OPEN.items():
        names = {n: r["choice"] for n, r in t4["readings"].items() if r.get("choice", [""])[0] == option}
        if not names:
            continue
        condition = "disturbed" if option in ("frequency", "share") else "nominal"
        tried = sorted([value for _, value, _ in names.values()] + [t4["config"][option]])
        found.append(Choice(
            f"{words}; {condition}", f"{t4['config'][option]:g}", ", ".join(f"{v:g}" for v in tried),
            _tool(t4, [base, *names], condition), True,
        ))  # fmt: skip
    plain = {n: r for n, r in t4["readings"].items() if "choice" not in r}
    for key, words in (("side", "which side gets the identified set"), ("law", "switching function and form"),
                       ("disturbance", "of what the 40 % are")):  # fmt: skip
        first = plain[base]
        alike = [n for n, r in plain.items() if all(r[k] == first[k] for k in ("side", "law", "disturbance") if k != key)]
        if len(alike) < 2:
            continue
        condition = "disturbed" if key == "disturbance" else "nominal"
        tried = ", ".join(dict.fromkeys(" ".join(r) if isinstance(r, list) else r for r in (plain[n][key] for n in alike)))
        found.append(Choice(f"{words}; {condition}", "every reading", tried, _tool(t4, alike, condition), True))
    return found


def _tool(t4: dict, names: list[str], condition: str) -> dict[str, tuple[float, float]]:
    spans = {}
    for model in ("reference", "PSO", "QPSO"):
        values = [t4["table"][n][TOOL][condition][model]["mean"] for n in names]
        spans[model] = (min(values), max(values))
    return spans


def table(choices: list[Choice]) -> str:
    """In Markdown."""
    lines = ["| the text leaves open | we chose | tried | what it changes |", "|---" * 4 + "|"]
    return "\n".join(lines + [f"| {c.open} | {c.chosen} | {c.tried} | {c.changes} |" for c in choices])


def figure(choices: list[Choice], path: pathlib.Path, is_studys: bool) -> pathlib.Path:
    """Spans of both kinds, what was published beside those of the swarms."""
    kinds = [[c for c in choices if c.control == control] for control in (False, True)]
    figure, axes = plt.subplots(1, 2, figsize=(12.5, 0.36 * max(map(len, kinds)) + 1.2))
    for ax, kind, label in zip(axes, kinds, ("error of the centres of mass [%]", "error of the tool [mm]"), strict=True):
        for y, choice in enumerate(kind[::-1]):
            models = list(COLOURS)
            for model, (low, high) in choice.spans.items():
                place = y + 0.24 * (1 - models.index(model))
                ax.plot([low, high], [place, place], color=COLOURS[model], lw=3, marker="|", label=model)
        ax.set_yticks(range(len(kind)), [c.open.split(":")[0].split(" (")[0] for c in kind[::-1]], fontsize=8)
        ax.set(xscale="log", xlabel=label)
        ax.grid(axis="x", which="both", alpha=0.25)
    for value, name in ((2.94, "PSO"), (0.43, "QPSO")) if is_studys else ():
        axes[0].axvline(value, color=COLOURS[name], ls=":", lw=1.2)
    handles = {k: h for ax in axes for h, k in zip(*ax.get_legend_handles_labels(), strict=True)}
    axes[1].legend(handles.values(), handles.keys(), frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
    return path
