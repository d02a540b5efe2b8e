"""docs/study.md out of the stored results: what holds, what does not, and why, with every table and figure.

    python experiments/study_page.py [--joints 6] [--robot arm.xml]
"""
# ruff: noqa: E501  sentences read better whole

import json
import os
import pathlib
from collections import Counter

import jinja2
import mlp_report
import numpy as np
import tables_1_2_arm
import torque_swarms
import tracking_report
import tyro
from study_arm import DOCS, StudyArm, StudyConfig
from study_claims import VERDICTS, arm_claims, beyond_claims, control_claims, network_claims, swarm_claims
from study_statistics import difference
from table4_report import CONDITIONS, MODELS, SHOWN

from irb140_jax import identify

REPEATABILITY = 0.03  # [mm] of the IRB 140's pose, by its specification
# What the text says of Table 4, by the first words of our quantity, of its two conditions.
SAID_OF_TABLE_4 = {
    "rise time": ("PSO fastest", "PSO fastest"), "settling time": ("PSO fastest", "all slower"),
    "overshoot": ("PSO minimal, QPSO higher", "all worse"), "steady-state": ("PSO low", "all worse"),
    "torque away": ("QPSO close to the reference", "QPSO close to the reference"),
    "torque roughness": ("QPSO smoother", "QPSO smoother"),
    "energy, absolute": ("QPSO near the reference, PSO diverges", "QPSO near the reference"),
}  # fmt: skip


def write(config: StudyConfig, arm: StudyArm) -> pathlib.Path:
    """The page; returns its path."""
    path = config.page_path(arm)
    text = page(config.folder(arm), os.path.relpath(config.figure_folder(arm), path.parent), arm)
    path.write_text(text, encoding="utf-8")
    return path


def page(folder: pathlib.Path, figures: str, of: StudyArm) -> str:
    """Its text."""
    load = lambda name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))  # noqa: E731
    arm, t3, sets, t4 = (load(n) for n in ("tables_1_2", "table3_swarms", "table3_sets", "table4_control"))
    torque, tracking = load("torque_swarms"), load("tracking_swarms")
    network = load("mlp_kinematics") if (folder / "mlp_kinematics.json").is_file() else None
    sections = {
        "Identification by swarms": swarm_claims(t3, sets),
        "Control with the identified models": control_claims(t4, SHOWN),
        "The arm and its reference values": arm_claims(arm) + (network_claims(network) if network else []),
        "What the study leaves to the future": beyond_claims(torque, tracking),
    }
    sections = {title: claims for title, claims in sections.items() if claims}
    count = Counter(c.verdict for claims in sections.values() for c in claims)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )  # fmt: skip
    return environment.get_template("study.md.j2").render(
        arm=arm, title=title(of), is_studys=of.is_studys, t3=t3, t4=t4, sections=sections, figures=figures, network=network,
        short=in_short(t3, sets, t4, torque, tracking, of.is_studys), g=lambda x: f"{x:.3g}",
        verdicts={v: count[v] for v in VERDICTS if count[v]},
        table1=tables_1_2_arm.table1(arm), table2=tables_1_2_arm.table2(arm),
        seeds=len(sets["sets"]["PSO"]), parameters=parameters(sets), table4=table4(t4),
        share=f"{100 * t4['config']['share']:.0f}", mujoco=agreement(t4), table5=table5(sets, t4),
        torque_table=torque_swarms.table(torque), tracking_table=tracking_report.table(tracking),
        tracking_seen=tracking_report.said_of_seen(tracking),
        network_table=network_table(network) if network else "",
        network_seeds=mlp_report.by_seed(network["cases"]) if network else "",
        near_singular=mlp_report.near_singular(network["cases"]) if network else "",
        others=other_arms(folder) if of.is_studys else [],
    )  # fmt: skip


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


def in_short(t3: dict, sets: dict, t4: dict, torque: dict, tracking: dict, is_studys: bool) -> list[str]:
    """The findings that a reader should leave with."""
    runs, table = sets["runs"], t4["table"][SHOWN]
    mean = lambda name, key: float(np.mean(runs[name][key]))  # noqa: E731
    pso = min((r for r in t3["readings"] if r["name"].startswith("pso,")), key=lambda r: r["com"] + r["inertia"])
    tool = {m: table["tracking error of the tool [mm]"]["nominal"][m]["mean"] for m in MODELS}
    pushed = table["tracking error of the tool [mm]"]["disturbed"]["reference"]["mean"]
    worst = max(tool, key=lambda m: tool[m])
    beneath = "below" if tool[worst] < REPEATABILITY else "above"
    by = {r["name"]: r for r in torque["rows"]}
    swarm = min((r for r in torque["rows"] if "PSO" in r["name"]), key=lambda r: r["held_out_median"])
    told = by["Levenberg-Marquardt, box as prior"]
    seen = tracking["seen"]
    first = "The published accuracy can be reached, and means little" if is_studys else "The error is the readings' own"
    return [
        f"**{first}.** Under readings of the text that stay open, the swarms "
        f"end with errors of {mean('PSO', 'com'):.2g} / {mean('PSO', 'inertia'):.2g} % (PSO) and "
        f"{mean('QPSO', 'com'):.2g} / {mean('QPSO', 'inertia'):.2g} % (QPSO); published: 2.94 / 4.66 and 0.43 / 0.76 %. Under "
        f"others PSO alone gets down to {pso['com']:.1g} %. The error follows from the box and the velocity limit.",
        "**Nothing is identified.** The objective is the squared distance to values that are known beforehand. One linear "
        f"solve ends at {max(t3['baselines'][0]['com'], t3['baselines'][0]['inertia']):.1g} %.",
        f"**The loop hardly notices.** Tool error on the nominal motion: {tool['reference']:.1g} mm with the reference model, "
        f"{tool['QPSO']:.1g} with QPSO's, {tool['PSO']:.1g} with PSO's, the largest {beneath} the robot's own repeatability of "
        f"{REPEATABILITY} mm; the disturbance alone makes {pushed:.2g} mm with any of the three.",
        f"**With data a swarm buys little.** On torque with noise, the best swarm's median run predicts unseen torque to "
        f"{swarm['held_out_median']:.2g} N m, Levenberg-Marquardt that is told the same box to "
        f"{told['held_out_median']:.2g} N m in {told['run_s'] / swarm['run_s']:.1g} of the time. Only "
        f"{seen['torque']['rank']} combinations of the {len(seen['names'])} unknowns show in a motion at all; tracking, "
        "smoothness and energy show no more.",
    ]  # fmt: skip


def parameters(sets: dict) -> list[dict]:
    """Table 3, value by value."""
    reference = np.array(sets["reference"])
    x = {name: np.array(values) for name, values in sets["sets"].items()}
    rows = []
    for i, name in enumerate(sets["names"]):
        row = {"name": name, "reference": f"{reference[i]:.6g}"}
        for kind, values in x.items():
            row[kind] = f"{values[:, i].mean():.5g} ± {values[:, i].std(ddof=1):.1g}"
            error = 100.0 * np.abs(values[:, i] / reference[i] - 1.0).mean() if sets["searched"][i] else np.nan
            row[f"error_{kind}"] = f"{error:.2g}" if np.isfinite(error) else "not sought"
        rows.append(row)
    return rows


def table4(t4: dict) -> list[dict]:
    """Table 4 in the reading shown."""
    rows = []
    for quantity, told in t4["table"][SHOWN].items():
        if not isinstance(told, dict):
            continue
        said = next((words for start, words in SAID_OF_TABLE_4.items() if quantity.startswith(start)), ("", ""))
        for condition, words in zip(CONDITIONS, said, strict=True):
            cells = {model: _cell(told[condition][model]) for model in MODELS}
            rows.append({"quantity": quantity, "condition": condition, "published": words, **cells})
    return rows


def _cell(x: dict) -> str:
    text = "" if x["mean"] is None else f"{x['mean']:.4g} ± {x['std']:.1g}"
    return text if not x["never"] else f"{text} never in {x['never']}".strip()


def agreement(t4: dict) -> float:
    """Largest difference of a joint's position from MuJoCo's in any run [rad]."""
    key = "largest difference from MuJoCo [rad]"
    return max(told[key] for told in t4["table"].values() if key in told)


def table5(sets: dict, t4: dict) -> list[dict]:
    """Table 5: every dimension of the comparison, published words beside ours."""
    runs = sets["runs"]
    curves = {name: [identify.plateau(np.array(c)) for c in run["curves"]] for name, run in runs.items()}
    rows = [
        _compared("error of the centres of mass, %", "QPSO better: 0.43 against 2.94", runs["PSO"]["com"], runs["QPSO"]["com"]),
        _compared("error of the inertias, %", "QPSO better: 0.76 against 4.66", runs["PSO"]["inertia"], runs["QPSO"]["inertia"]),
        _compared("final fitness", "QPSO better: 1.02 against 2.09", runs["PSO"]["fitness"], runs["QPSO"]["fitness"]),
        _compared("iterations to the plateau", "PSO early (27), QPSO gradual", curves["PSO"], curves["QPSO"]),
    ]  # fmt: skip
    shown = {
        "nominal: PSO rises faster than QPSO": ("rise time", "PSO better"),
        "nominal: PSO settles faster than QPSO": ("settling time", "PSO better"),
        "nominal: PSO overshoots less than QPSO": ("overshoot", "PSO better"),
        "nominal: PSO has the lower steady-state error": ("steady-state error", "PSO better"),
        "nominal: QPSO's torque is smoother than PSO's": ("torque smoothness", "QPSO better"),
        "disturbed: QPSO's torque is smoother than PSO's": ("torque smoothness, disturbed", "QPSO better"),
        "nominal: QPSO's energy is nearer to the reference's": ("energy, distance from the reference's", "QPSO better"),
    }
    for claim in t4["claims"][SHOWN]:
        if claim["statement"] in shown:
            rows.append(_of_claim(claim, *shown[claim["statement"]]))
    return rows


def _compared(name: str, published: str, pso: list, qpso: list) -> dict:
    """A dimension in which lower is better, from the runs."""
    test = difference(np.array(pso), np.array(qpso))
    sure = test["p_value"] < 0.01
    better = "no difference" if not sure else "PSO" if test["difference"] > 0 else "QPSO"
    return {
        "name": name, "published": published, "pso": f"{np.mean(pso):.3g} ± {np.std(pso, ddof=1):.1g}",
        "qpso": f"{np.mean(qpso):.3g} ± {np.std(qpso, ddof=1):.1g}", "better": better,
        "test": f"p = {test['p_value']:.1g}, difference [{test['low']:.2g}, {test['high']:.2g}]",
    }  # fmt: skip


def _of_claim(claim: dict, name: str, published: str) -> dict:
    """A dimension of Table 4, whose test is there: the claim's first value is that of the better one as published."""
    first, second = claim["medians"]
    by_qpso = published.startswith("QPSO")
    winner, loser = ("QPSO", "PSO") if by_qpso else ("PSO", "QPSO")
    better = {"yes": winner, "no, the opposite": loser}.get(claim["holds"], "no difference")
    return {
        "name": f"{name}, {claim['unit']}", "published": published, "pso": second if by_qpso else first, "qpso": first if by_qpso else second,
        "better": better, "test": f"p = {claim['p']:.1g}, effect {claim['effect']:.2f}",
    }  # fmt: skip


def network_table(network: dict) -> str:
    """Position errors of every case."""
    lines = ["| case | weights | training, mm | validation, mm |", "|---" * 4 + "|", "| published | | 0.48 | 0.61 |"]
    for case in network["cases"]:
        if case["case"]["seed"]:
            continue
        lines.append(f"| {case['name']} | {case['weights']} | {case['training']:.3g} | {case['validation']:.3g} |")
    return "\n".join(lines)


if __name__ == "__main__":
    chosen = tyro.cli(StudyConfig)
    print(write(chosen, chosen.arm()))
