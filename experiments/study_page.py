"""docs/study.md out of the stored results: what holds, what does not, and why, with every table and figure.

    python experiments/study_page.py [--joints 6] [--robot arm.xml]
"""
# ruff: noqa: E501  sentences read better whole

import json
import math
import os
import pathlib
from collections import Counter
from typing import Any

import jinja2
import mlp_report
import noisy_swarms
import numpy as np
import study_choices
import table3_report
import tables_1_2_arm
import torque_swarms
import tracking_report
import tyro
from study_arm import DOCS, StudyArm, StudyConfig
from study_claims import VERDICTS, arm_claims, beyond_claims, control_claims, network_claims
from study_statistics import ALPHA, FAMILIES, runs, said
from study_swarm_claims import swarm_claims
from table4_report import CONDITIONS, MODELS, cell, ours, weakest

REPEATABILITY = 0.03  # [mm] of the IRB 140's pose, by its specification
# Results of the study, as there are others in the folder.
STORED = ("tables_1_2", "table3_swarms", "table3_sets", "table4_control", "torque_swarms", "tracking_swarms", "tracking_circle", "mlp_kinematics",
          "time_per_iteration", "noisy_swarms", "embedded_model")  # fmt: skip
# What the text says of Table 4, by the first words of our quantity, of its two conditions.
SAID_OF_TABLE_4 = {
    "rise time": ("PSO fastest", "PSO fastest"), "settling time": ("PSO fastest", "all slower"),
    "overshoot": ("PSO minimal, QPSO higher", "all worse"), "steady-state": ("PSO low", "all worse"),
    "torque away": ("QPSO close to the reference", "QPSO close to the reference"),
    "torque roughness": ("QPSO smoother", "QPSO smoother"),
    "energy, absolute": ("QPSO near the reference, PSO diverges", "QPSO near the reference"),
    "energy of the first": ("PSO higher", ""), "energy's distance": ("PSO diverges", ""),
}  # fmt: skip


def write(config: StudyConfig, arm: StudyArm) -> pathlib.Path:
    """The page; returns its path."""
    path = config.page_path(arm)
    folder, figures = config.folder(arm), config.figure_folder(arm)
    choices = choices_of(folder)
    study_choices.figure(choices, figures / "figure_choices.svg", arm.is_studys)
    text = page(folder, os.path.relpath(figures, path.parent), arm, choices)
    path.write_text(text, encoding="utf-8")
    return path


def choices_of(folder: pathlib.Path) -> list[study_choices.Choice]:
    """Our own choices and what they change."""
    t3, t4 = (json.loads((folder / f"{n}.json").read_text(encoding="utf-8")) for n in ("table3_swarms", "table4_control"))
    swarms = study_choices.swarm_choices(readings_in(folder), t3["nearest_pair"])
    return swarms + study_choices.control_choices(t4)


def readings_in(folder: pathlib.Path):
    """Every reading with the means of its runs."""
    return table3_report.judged(runs(folder / table3_report.RUNS), runs(folder / table3_report.READINGS))


def page(folder: pathlib.Path, figures: str, of: StudyArm, choices: list[study_choices.Choice]) -> str:
    """Its text."""
    load = lambda name: _defined(json.loads((folder / f"{name}.json").read_text(encoding="utf-8")))  # noqa: E731
    perhaps = lambda name: load(name) if (folder / f"{name}.json").is_file() else None  # noqa: E731
    arm, t3, sets, t4 = (load(n) for n in ("tables_1_2", "table3_swarms", "table3_sets", "table4_control"))
    torque, tracking = load("torque_swarms"), perhaps("tracking_swarms")
    circle = perhaps("tracking_circle")
    network, time, noisy, embedded = map(perhaps, ("mlp_kinematics", "time_per_iteration", "noisy_swarms", "embedded_model"))
    told = readings_in(folder)
    sections = {
        "Identification by swarms": swarm_claims(t3, told, sets, time, of.is_studys),
        "Control with the identified models": control_claims(t4),
        "The arm and its reference values": arm_claims(arm) + (network_claims(network) if network else []),
        "What the study leaves to the future": beyond_claims(torque, tracking, circle, noisy, embedded),
    }
    sections = {title: claims for title, claims in sections.items() if claims}
    count = Counter(c.verdict for claims in sections.values() for c in claims)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )  # fmt: skip
    return environment.get_template("study.md.j2").render(
        arm=arm, title=title(of), is_studys=of.is_studys, t3=t3, t4=t4, sections=sections, figures=figures, network=network, torque=torque,
        short=in_short(t3, t4, torque, tracking, of.is_studys), g=lambda x: f"{x:.3g}",
        verdicts={v: count[v] for v in VERDICTS if count[v]},
        table1=tables_1_2_arm.table1(arm), table2=tables_1_2_arm.table2(arm),
        seeds=len(sets["sets"]["PSO"]), parameters=parameters(sets), table4=table4(t4), choices=study_choices.table(choices),
        walls=walls(sets), families=FAMILIES, alpha=ALPHA, shown=t4["shown"].replace("_", " "), tracking=tracking, span=lambda x: study_choices.between(x[0], x[1], 3),
        noisy_table=noisy_swarms.table(noisy) if noisy else "", embedded=embedded, made=provenance(folder),
        share=f"{100 * t4['config']['share']:.0f}", mujoco=max(t4["mujoco"].values()), table5=table5(t3, t4, of.is_studys),
        torque_table=torque_swarms.table(torque), tracking_table=tracking_report.table(tracking) if tracking else "",
        tracking_seen=tracking_report.said_of_seen(tracking) if tracking else "",
        tracking_tests=tracking_report.said_of_tests(tracking) if tracking else "", circle=circle,
        circle_table=tracking_report.table(circle) if circle else "", circle_seen=tracking_report.said_of_seen(circle) if circle else "",
        circle_tests=tracking_report.said_of_tests(circle) if circle else "", of_control=of_control(t4), against_gain=against_gain(t4),
        network_table=network_table(network) if network else "", network_on=mlp_report.judged_on(network["cases"]) if network else "",
        network_seeds=mlp_report.by_seed(network["cases"]) if network else "",
        near_singular=mlp_report.near_singular(network["cases"], network["tests"]) if network else "",
        others=other_arms(folder) if of.is_studys else [], choice=choice(t3["made"]["options"]),
    )  # fmt: skip


def choice(options: dict) -> str:
    """The arm of a result, as it was given to the command; a model by its file's name."""
    given = {name: options[name] for name in ("robot", "joints") if options.get(name)}
    return "".join(f" --{name} {value}" for name, value in given.items())


def of_control(t4: dict) -> str:
    """What figures 14 to 17 are of."""
    return (
        f"Reading {t4['shown'].replace('_', ' ')}; lines are medians of {t4['config']['seeds']} seeds a model, bands reach from the "
        "lowest to the highest."
    )


def against_gain(t4: dict) -> str:
    """Whether the switching gain, chosen by the mass matrix, can hold the disturbance, chosen by the peak torque."""
    size = [t4["config"]["share"] * peak for peak in t4["peak_torque"]]
    weak = [f"{j} ({d:.2g} against {g:.2g} N m)" for j, d, g in zip(t4["joints"], size, t4["gain"], strict=True) if d > g]
    if not weak:
        return f"On every joint the switching gain is larger than {100 * t4['config']['share']:.0f} % of the peak torque."
    return (
        f"**On {', '.join(weak)} the disturbance is larger than the switching gain**, which comes from the mass matrix alone: "
        "near its peak the arm is pushed off its path, whatever the model."
    )


class Undefined(float):
    """An error that is not defined, relative to values that are all zero; printed as such."""

    def __format__(self, _: str) -> str:
        return "not defined"


def _defined(stored: Any) -> Any:
    """What is stored, errors that are not defined as such; they are stored as null, or NaN."""
    if isinstance(stored, list):
        return [_defined(part) for part in stored]
    if isinstance(stored, float) and math.isnan(stored):
        return Undefined("nan")
    if not isinstance(stored, dict):
        return stored
    relative = ("com", "com_sd", "inertia", "inertia_sd", "averaged_com", "averaged_inertia")
    return {k: Undefined("nan") if v is None and k in relative else _defined(v) for k, v in stored.items()}


def title(arm: StudyArm) -> str:
    """What the page is of."""
    return f"{arm.name}, all {arm.whole.n} joints" if len(arm.links) == arm.whole.n else arm.name


def other_arms(folder: pathlib.Path) -> list[dict[str, str]]:
    """Pages of more or fewer joints, and of other arms, which lie in folders beside the study's results."""
    found = []
    for path in sorted([*DOCS.glob("study-*-joints.md"), *folder.glob("*_joints/study.md")]):
        of = path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# The study, reproduced: ")
        found.append({"title": of, "path": os.path.relpath(path, DOCS)})
    return found


def in_short(t3: dict, t4: dict, torque: dict, tracking: dict | None, is_studys: bool) -> list[str]:
    """The findings that a reader should leave with."""
    pso, qpso = t3["nearest_pair"]["pso"], t3["nearest_pair"]["qpso"]
    by = {r["name"]: r for r in torque["rows"]}
    swarm = min((r for r in torque["rows"] if "PSO" in r["name"]), key=lambda r: r["held_out_median"])
    told, seen = by["Levenberg-Marquardt, box as prior"], tracking["seen"] if tracking else None
    shows = "" if seen is None else (
        f" In the torque of a motion {seen['torque']['rank']} combinations of the {len(seen['names'])} unknowns show, in the tracking "
        f"of a closed loop {seen['tracking']['rank']}."
    )
    published = "; published: 2.94 / 4.66 and 0.43 / 0.76 %" if is_studys else ""
    literal = {f: t3["literal"][f] for f in ("pso", "qpso")}
    found = []
    if all(row["readings"] for row in literal.values()):
        span = lambda row: f"{row['com'][0]:.2g} to {row['com'][1]:.2g} %"  # noqa: E731
        found.append(
            f"**Read literally, the text gives other figures.** With w = 0.99 and no velocity limit, which it does not name, in a box of 50 %, "
            f"PSO ends at {span(literal['pso'])} and QPSO at {span(literal['qpso'])} of the centres of mass" + ("; published: 2.94 and 0.43 %." if is_studys else ".")
        )
    headline = "The published accuracy can be reached, and means little" if is_studys else "The error follows from the choices"
    found += [
        f"**{headline}.** In the pair of readings that was chosen for "
        f"nearness, the swarms end at {pso['com']:.2g} / {pso['inertia']:.2g} % (PSO) and {qpso['com']:.2g} / {qpso['inertia']:.2g} % (QPSO){published}. "
        f"In others PSO alone gets down to {t3['best_pso']['com']:.1g} %. The error follows from the box and the velocity limit.",
        "**Nothing is identified.** The objective is the squared distance to values that are known beforehand. One linear "
        f"solve ends at {max(t3['baselines'][0]['com'], t3['baselines'][0]['inertia']):.1g} %.",
        tool_in_short(t4, is_studys),
        f"**With data a swarm buys little.** On torque with noise, the best swarm's median run predicts unseen torque to "
        f"{swarm['held_out_median']:.2g} N m, Levenberg-Marquardt that is told the same box to "
        f"{told['held_out_median']:.2g} N m in {told['run_s'] / swarm['run_s']:.1g} of the time." + shows,
    ]
    return found


def tool_in_short(t4: dict, is_studys: bool) -> str:
    """What the loop makes of the models; its size is the boundary layer's."""
    base, key = "controller_of_peak_saturation_computed", study_choices.TOOL
    disturbed = [t4["table"][base][key]["disturbed"][model]["mean"] for model in MODELS]
    mean = lambda reading, model, condition="nominal": t4["table"][reading][key][condition][model]["mean"]  # noqa: E731
    text = (
        f"**Beside the disturbance the model hardly counts.** With the identified set in the controller the tool is off by {mean(base, 'reference'):.1g} mm with the reference "
        f"model, {mean(base, 'QPSO'):.1g} with QPSO's, {mean(base, 'PSO'):.1g} with PSO's; with the disturbance it is "
        f"{study_choices.between(min(disturbed), max(disturbed))} mm with the three."
    )
    layers = {r["choice"][1]: n for n, r in t4["readings"].items() if r.get("choice", [""])[0] == "layer"}
    if layers:
        layers[t4["config"]["layer"]] = base
        sizes = ", ".join(f"{mean(name, 'PSO'):.2g} mm at {layer:g}" for layer, name in sorted(layers.items()))
        text += f" These sizes are our boundary layer's, not findings: PSO's model makes {sizes} rad/s"
        text += f" (the robot's own repeatability is {REPEATABILITY} mm)." if is_studys else "."
    return text


def walls(sets: dict) -> dict[str, str]:
    """Which parameters end at the box's wall, by algorithm."""
    sought = [n for n, s in zip(sets["names"], sets["searched"], strict=True) if s]
    seeds = len(sets["sets"]["PSO"])
    told = {}
    for model, counts in sets["walls"].items():
        held = [f"{n} in {c} of {seeds} runs" for n, c in zip(sought, counts, strict=True) if c > 0.5 * seeds]
        told[model] = ", ".join(held) or "none in most runs"
    return told


def provenance(folder: pathlib.Path) -> list[dict]:
    """Where each stored result comes from."""
    rows = []
    for path in sorted(folder.glob("*.json")):
        stored = json.loads(path.read_text(encoding="utf-8"))
        if path.stem in STORED and isinstance(stored, dict):
            made = stored.get("made")
            commits = ", ".join(made.get("commits", [made["commit"]])) if made else ""
            rows.append({"file": path.name, "made": made, "commits": commits})
    return rows


def parameters(sets: dict) -> list[dict]:
    """Table 3, value by value; a value at the box's wall in all runs has no spread."""
    reference = np.array(sets["reference"])
    x = {name: np.array(values) for name, values in sets["sets"].items()}
    rows = []
    for i, name in enumerate(sets["names"]):
        row = {"name": name, "reference": f"{reference[i]:.6g}"}
        for kind, values in x.items():
            mean, std = values[:, i].mean(), values[:, i].std(ddof=1)
            row[kind] = f"{mean:.5g}" + (f" ± {std:.1g}" if std > 1e-7 * abs(mean) else "")
            sought = sets["searched"][i]
            row[f"error_{kind}"] = f"{100.0 * np.abs(values[:, i] / reference[i] - 1.0).mean():.2g}" if sought else "not defined"
        rows.append(row)
    return rows


def table4(t4: dict) -> list[dict]:
    """Table 4 in the nearest reading."""
    rows = []
    for quantity, told in t4["table"][t4["shown"]].items():
        said_there = next((words for start, words in SAID_OF_TABLE_4.items() if quantity.startswith(start)), ("", ""))
        for condition, words in zip(CONDITIONS, said_there, strict=True):
            cells = {model: cell(told[condition][model], 4) for model in MODELS}
            rows.append({"quantity": quantity, "condition": condition, "published": words, **cells})
    return rows


def table5(t3: dict, t4: dict, is_studys: bool) -> list[dict]:
    """Table 5: every dimension of the comparison, published words beside ours."""
    words = {
        "com": ("error of the centres of mass, %", "QPSO better: 0.43 against 2.94"), "inertia": ("error of the inertias, %", "QPSO better: 0.76 against 4.66"),
        "fitness": ("final fitness", "QPSO better: 1.02 against 2.09"), "plateau": ("iterations to the plateau", "PSO early (27), QPSO gradual"),
    }
    rows = []
    for test in t3["tests"]:
        name, published = words[test["column"]]
        published = published if is_studys else published.split(":")[0].replace(" (27)", "")
        first = "PSO" if test["column"] == "plateau" else "QPSO"
        rows.append(_of_test(test, name, published, first, first == "PSO", [f"{x:.3g}" for x in test["medians"]]))
    shown = {
        "nominal: PSO rises faster than QPSO": ("rise time, s", "PSO better"),
        "nominal: PSO settles faster than QPSO": ("settling time, s", "PSO better"),
        "nominal: PSO overshoots less than QPSO": ("overshoot, %", "PSO better"),
        "nominal: PSO has the lower steady-state error": ("steady-state error, rad", "PSO better"),
        "nominal: QPSO's torque is smoother than PSO's": ("torque smoothness, N m/s", "QPSO better"),
        "disturbed: QPSO's torque is smoother than PSO's": ("torque smoothness, disturbed, N m/s", "QPSO better"),
        "nominal: QPSO's energy is nearer to the reference's": ("energy, distance from the reference's, J", "QPSO better"),
    }
    for claim in t4["claims"][t4["shown"]]:
        if claim["statement"] in shown:
            name, published = shown[claim["statement"]]
            by_pso = published.startswith("PSO")
            medians = ours(claim).rsplit(f" {claim['unit']}")[0].split(" against ")
            rows.append(_of_test(weakest(claim), name, published, "PSO" if by_pso else "QPSO", by_pso, medians))
    return rows


def _of_test(test: dict, name: str, published: str, first: str, by_pso: bool, medians: list[str]) -> dict:
    """A row of Table 5; `first` is whose values the test names first."""
    second = {"PSO": "QPSO", "QPSO": "PSO"}[first]
    better = {"first": first, "second": second, "neither": "no difference"}[test["lower"]]
    pso, qpso = medians if by_pso else medians[::-1]
    return {"name": name, "published": published, "pso": pso, "qpso": qpso, "better": better, "test": said(test)}


def network_table(network: dict) -> str:
    """Position errors of every case."""
    lines = ["| case | weights | training, mm | validation, mm | test, mm |", "|---" * 5 + "|", "| published | | 0.48 | 0.61 | |"]
    for case in network["cases"]:
        if not case["case"]["seed"]:
            parts = ("training", "validation", "test")
            errors = " | ".join(f"{case[part]:.3g}" if part in case else "not run" for part in parts)
            lines.append(f"| {case['name']} | {case['weights']} | {errors} |")
    return "\n".join(lines)


if __name__ == "__main__":
    chosen = tyro.cli(StudyConfig)
    print(write(chosen, chosen.arm()))
