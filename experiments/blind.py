"""Hide physics by seed, diagnose blind, and count: the table of docs/blind.md.

    python experiments/blind.py demo            # the nine first effects in the IRB 140, 6 to 20 % of the joint's torque
    python experiments/blind.py clean           # wrong inertials and noise only
    python experiments/blind.py robots          # random robots of 1 to 7 joints, with slides; every fourth is clean

Cases are appended to results/blind_<kind>.jsonl as they are done, so an interrupted run goes on where it stopped.
`--table` writes docs/blind.md from what is there.
"""

import dataclasses
import json
import pathlib
import tempfile
from typing import Literal

import numpy as np
import tyro
from pages import page_of

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.errors import InputError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.conceal import ConcealedCase, Concealment, clean_case, conceal, demo_case, random_robot
from irb140_jax.recordings.concealed.catalogue import FIRST_NINE
from irb140_jax.recordings.concealed.choice import meaningful_sites
from irb140_jax.recordings.concealed.hidden import survey_of
from irb140_jax.recordings.concealed.plant import arm_model, arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import irb140, load_robot, robot_from_model


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    kind: tyro.conf.Positional[Literal["demo", "clean", "robots"]] = "demo"
    first: int = 0
    last: int = 39
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the table from the results that are there."""


def robots_case(seed: int) -> ConcealedCase:
    """A random robot of 1 to 7 joints; every fourth case is clean, the others hide one of the nine effects."""
    rng = np.random.default_rng([seed, 77])
    n = 1 + seed % 7
    xml = random_robot(seed, n)
    spec = arm_spec(xml)
    robot = robot_from_model(spec.compile(), source=f"random{seed}")
    motions = three_motions(robot, 15.0, 1000.0, seed=seed)
    survey = survey_of(arm_model(spec, 1e-3), motions, every=20)
    hidden = []
    if seed % 4:
        for effect in rng.permutation(FIRST_NINE):
            try:
                sites = meaningful_sites(str(effect), survey)
            except InputError:  # this robot has no place for it
                continue
            names = tuple(robot.joint_names[j] for j in sites[rng.integers(len(sites))])
            hidden = [Concealment(str(effect), names, share=float(rng.uniform(0.06, 0.2)))]
            break
    return conceal(xml, hidden, motions, seed=seed)


def judged(kind: str, seed: int) -> dict:
    """Make the case, diagnose it, and compare."""
    case = {"demo": demo_case, "clean": clean_case, "robots": robots_case}[kind](seed)
    robot = irb140()
    if kind == "robots":
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "robot.xml"
            path.write_text(case.robot_source, encoding="utf-8")
            robot = load_robot(path)
    d = diagnose(robot, list(case.recordings)).diagnosis.to_json()
    truth = [(e["effect"], sorted(e["joints"])) for e in case.truth["effects"]]
    found = [(f["effect"], sorted(f["joints"])) for f in d["findings"]]
    stated = [
        [(f["effect"], sorted(f["joints"])), *((a["effect"], sorted(f["joints"])) for a in f["alternatives"])]
        for f in d["findings"]
    ]
    joints = sorted({j for _, js in truth for j in js}) or list(robot.joint_names)
    rms = lambda key: float(np.sqrt(np.mean([d["fit"][j][key] ** 2 for j in joints])))  # noqa: E731
    return {
        "seed": seed, "joints_of_robot": robot.n, "truth": case.truth["effects"], "found": d["findings"],
        "verdict": d["verdict"], "exact": sorted(truth) == sorted(found), "open": _left_open(truth, found, d),
        "in_set": all(any(t in s for s in stated) for t in truth) and len(found) == len(truth),
        "refit": rms("rmse_refit"), "corrected": rms("rmse_corrected"), "floor": rms("noise_floor"),
        "parameters": _parameter_errors(case.truth["effects"], d["findings"]),
    }  # fmt: skip


def _left_open(truth: list, found: list, diagnosis: dict) -> bool:
    """Whether nothing wrong is named, and what is missing is listed as what these motions can't test."""
    open_ = {(x["effect"], joint) for x in diagnosis["not_testable"] for joint in x["joints"]}
    missing = {(effect, joint) for effect, joints in truth if (effect, joints) not in found for joint in joints}
    return bool(missing) and missing <= open_ and all(f in truth for f in found)


def _parameter_errors(truth: list[dict], found: list[dict]) -> list[dict]:
    """True and diagnosed value of every parameter of the effects that were found."""
    rows = []
    for e in truth:
        for f in found:
            if f["effect"] == e["effect"] and sorted(f["joints"]) == sorted(e["joints"]):
                rows += [
                    {"name": k, "true": e["parameters"][k]["value"], **v}
                    for k, v in f["parameters"].items() if k in e["parameters"]
                ]  # fmt: skip
    return rows


def table(out: pathlib.Path) -> str:
    """The page with all figures, from the result files."""
    lines = [
        "# Concealed physics: what the diagnosis finds",
        "",
        "Written by `experiments/blind.py --table` from `results/blind_*.jsonl`. MuJoCo simulates the robot in closed",
        "loop. Its inertials are 5 % wrong, encoder noise is 2e-5 rad, and torque noise is 1 %. There are three",
        "recordings of 20 s (15 s for random robots). Each hidden effect makes 6 to 20 % of the joint's torque.",
        "Errors are those of the joints with the hidden effect, on recordings that the fit did not see.",
        "",
        "| cases | number | exact name and joints, nothing added | or listed as not testable | within the stated set "
        "| any finding | corrected error at most half of refit's | worst corrected / refit | median parameter error "
        "| 90 % intervals that cover |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    misses = []
    for kind in ("demo", "clean", "robots"):
        path = out / f"blind_{kind}.jsonl"
        if not path.exists():
            continue
        cases = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        for label, part in (
            (kind, [c for c in cases if c["truth"]]),
            (f"{kind}, nothing hidden", [c for c in cases if not c["truth"]]),
        ):
            if not part:
                continue
            ratio = np.array([c["corrected"] / c["refit"] for c in part])
            p = [x for c in part for x in c["parameters"] if x["true"]]
            error = np.median([abs(x["value"] / x["true"] - 1) for x in p]) if p else np.nan
            cover = np.mean([abs(x["value"] - x["true"]) <= 1.645 * x["std"] for x in p]) if p else np.nan
            hidden = bool(part[0]["truth"])
            lines.append(
                f"| {label} | {len(part)} | {sum(c['exact'] for c in part)} | "
                f"{sum(c['exact'] or c['open'] for c in part)} | {sum(c['in_set'] for c in part)} | "
                f"{sum(bool(c['found']) for c in part)} | {int(np.sum(ratio <= 0.5)) if hidden else '-'} | "
                f"{ratio.max():.3f} | {f'{100 * error:.2g} %' if p else '-'} | {f'{100 * cover:.0f} %' if p else '-'} |"
            )
            misses += [(label, c) for c in part if not c["exact"]]
    lines += [
        "",
        "## Every miss",
        "",
        "| cases | seed | hidden | found | listed as not testable | corrected / refit error |",
        "|---|---|---|---|---|---|",
    ]
    say = lambda items: "; ".join(f"{i['effect']} on {', '.join(i['joints'])}" for i in items) or "nothing"  # noqa: E731
    for label, c in misses:
        lines.append(
            f"| {label} | {c['seed']} | {say(c['truth'])} | {say(c['found'])} | {'yes' if c['open'] else ''} | "
            f"{c['corrected'] / c['refit']:.3f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    config = tyro.cli(Config)
    if not config.table:
        set_up_compilation_cache()
        config.out.mkdir(parents=True, exist_ok=True)
        path = config.out / f"blind_{config.kind}.jsonl"
        done = {json.loads(line)["seed"] for line in path.read_text().splitlines()} if path.exists() else set()
        for seed in range(config.first, config.last + 1):
            if seed in done:
                continue
            case = judged(config.kind, seed)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
            mark = "ok  " if case["exact"] else "MISS"
            say = lambda items: [(i["effect"], *i["joints"]) for i in items]  # noqa: E731
            print(mark, seed, "hidden", say(case["truth"]), "found", say(case["found"]), case["verdict"],
                  f"corrected/refit {case['corrected'] / case['refit']:.3f}", flush=True)  # fmt: skip
    page_of(config.out, "blind.md").write_text(table(config.out), encoding="utf-8")


if __name__ == "__main__":
    main()
