"""Cases that poor motions leave open: design a motion with `propose`, record it in MuJoCo, and diagnose again.

    python experiments/ambiguous.py --cases 20

Cases are appended to results/ambiguous.jsonl as they are done, so that an interrupted run goes on where it stopped;
docs/ambiguous.md is written from what is there.  Beside the proposed motion, the same time is given to the poor motion
once more, with other random numbers: what more of the same would have told.
"""

import dataclasses
import json
import pathlib
import tempfile
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import tyro
from pages import page_of

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.errors import InputError
from irb140_jax.mismatch import Result, diagnose, propose
from irb140_jax.recordings import Recording
from irb140_jax.recordings.conceal import ConcealedCase, Concealment, conceal, random_robot, record_again
from irb140_jax.recordings.concealed.choice import chosen, meaningful_sites
from irb140_jax.recordings.concealed.hidden import survey_of
from irb140_jax.recordings.concealed.plant import arm_model, arm_spec
from irb140_jax.recordings.excite import Excitation, fourier_motion, slow_motion, three_motions
from irb140_jax.recordings.segments import Segment, segment_motion
from irb140_jax.robot import Robot, load_robot

RATE = 1000.0  # [1/s] steps of MuJoCo
SECONDS = 12.0  # of each poor recording
EFFECTS = (
    "coulomb_friction", "viscous_friction", "asymmetric_friction", "stribeck_friction", "load_dependent_friction",
    "nonlinear_viscous_friction", "rotor_inertia", "torque_offset", "torque_gain", "gravity_spring", "encoder_offset",
    "presliding_hysteresis",
)  # fmt: skip
POOR = ("slow", "small", "other_joint")
ROBOTS = ((3, 3), (5, 2), (8, 4))  # seed and number of joints
LABELS = {
    "by the poor motions": "before", "with more of the same": "more_of_the_same", "with the proposed motion": "after",
}  # fmt: skip
CERTAIN = 0.9  # probability from which a name counts as decided


@dataclasses.dataclass(frozen=True)
class Config:
    """How many cases are drawn; those that the poor motions decide at once are counted and not continued."""

    cases: int = 36
    out: pathlib.Path = pathlib.Path("results/ambiguous.jsonl")
    page: bool = False
    """Only write the page from the results that are there."""


def robot_text(seed: int, n: int) -> str:
    """MJCF of a random robot with speed limits, within which a motion may be designed."""
    text = random_robot(seed, n)
    limits = " ".join("0.5" if f'name="joint{i + 1}" type="slide"' in text else "2" for i in range(n))
    custom = f'<custom><numeric name="velocity_limit" size="{n}" data="{limits}"/></custom>'
    return text.replace("<worldbody>", custom + "<worldbody>", 1)


def poor_motions(robot: Robot, kind: str, joint: int, seed: int) -> list[Excitation]:
    """Two motions from which little can be told: slow ones, small ones, or ones of another joint only."""
    seeds = (seed, seed + 1000)
    if kind == "slow":
        return [slow_motion(robot, SECONDS, RATE, seed=s) for s in seeds]
    if kind == "small":
        middle = 0.5 * np.asarray(robot.lower + robot.upper)
        limits = (jnp.asarray(middle - 0.1), jnp.asarray(middle + 0.1))
        narrow = eqx.tree_at(lambda r: (r.lower, r.upper), robot, limits)
        return [fourier_motion(narrow, SECONDS, RATE, seed=s, speed=0.3) for s in seeds]
    other = (joint + 1) % robot.n
    return [segment_motion(robot, Segment("fourier", other, 0.6, 0.15, s), SECONDS, RATE) for s in seeds]


def made(seed: int) -> tuple[ConcealedCase, Robot, str, list[Excitation]]:
    """A case: robot, effect, joint and poor motion drawn; strong enough to matter on lively motions."""
    rng = np.random.default_rng([seed, 78])
    text = robot_text(*ROBOTS[seed % len(ROBOTS)])
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "robot.xml"
        path.write_text(text, encoding="utf-8")
        robot = load_robot(path)
    effect, kind = str(rng.choice(EFFECTS)), POOR[(seed // len(ROBOTS)) % len(POOR)]
    lively = three_motions(robot, 10.0, RATE, seed=seed)
    survey = survey_of(arm_model(arm_spec(text), 1.0 / RATE), lively, every=20)
    sites = meaningful_sites(effect, survey)
    joints = sites[rng.integers(len(sites))]
    names = tuple(robot.joint_names[j] for j in joints)
    hidden = chosen(Concealment(effect, names, float(rng.uniform(0.08, 0.2))), survey, robot.joint_names, seed, 0)
    motions = poor_motions(robot, kind, joints[0], seed)
    case = conceal(text, [Concealment(effect, names, parameters=hidden.parameters)], motions, seed=seed)
    return case, robot, kind, motions


def state(diagnosis: dict, truth: dict) -> str:
    """How a diagnosis stands to the one hidden effect: named, open, not testable, missed or wrong."""
    key = (truth["effect"], sorted(truth["joints"]))
    found = {(f["effect"], tuple(sorted(f["joints"]))): f for f in diagnosis["findings"]}
    mine = found.get((key[0], tuple(key[1])))
    if mine:
        alone = len(found) == 1 and (mine["evidence"]["probability"] or 0.0) >= CERTAIN
        return "named" if alone else "open"
    stated = any(a["effect"] == key[0] for f in diagnosis["findings"] for a in f["alternatives"])
    if stated:
        return "open"
    blind = any(n["effect"] == key[0] and set(key[1]) <= set(n["joints"]) for n in diagnosis["not_testable"])
    if blind:
        return "not testable"
    return "wrong" if found else "missed"


def judged(seed: int) -> dict:
    """One case before and after the proposed motion."""
    case, robot, kind, motions = made(seed)
    truth = case.truth["effects"][0]
    before = diagnose(robot, case.recordings)
    row = {"seed": seed, "joints_of_robot": robot.n, "motion": kind, "truth": truth, "before": told(before, truth)}
    if row["before"]["state"] == "named":
        return row
    proposal = propose(robot, before.undecided, seed=seed, rate=RATE)
    again = lambda more: diagnosed(robot, case, more, truth)  # noqa: E731
    row["pieces"] = [p.said(robot.joint_names) for p in proposal.pieces]
    row["odds"] = [
        {"named": p.named, "rival": p.rival, "now": a, "expected": b}
        for p, a, b in zip(before.undecided.pairs, proposal.odds_now, proposal.odds, strict=True)
    ]
    row["after"] = again([proposal.motion])
    length = proposal.motion.t[-1]
    repeats = max(1, round(length / SECONDS))
    joint = robot.joint_names.index(truth["joints"][0])
    row["more_of_the_same"] = again(
        [m for k in range(1, 1 + (repeats + 1) // 2) for m in poor_motions(robot, kind, joint, seed + 50 * k)][:repeats]
    )
    return row


def diagnosed(robot: Robot, case: ConcealedCase, motions: Sequence[Excitation], truth: dict) -> dict:
    """What the old recordings and new ones together say."""
    new: tuple[Recording, ...] = record_again(case, motions, seed=case.truth["seed"] + 1)
    return told(diagnose(robot, [*case.recordings, *new]), truth)


def told(result: Result, truth: dict) -> dict:
    """The part of a diagnosis that is judged."""
    d = result.diagnosis.to_json()
    return {
        "state": state(d, truth), "verdict": d["verdict"],
        "found": [
            {"effect": f["effect"], "joints": f["joints"], "probability": f["evidence"]["probability"],
             "alternatives": {a["effect"]: a["probability"] for a in f["alternatives"]}}
            for f in d["findings"]
        ],
        "not_testable": [n["effect"] for n in d["not_testable"]],
    }  # fmt: skip


def page(rows: list[dict]) -> str:
    """The page, from the results."""
    left = [r for r in rows if r["before"]["state"] != "named"]
    count = lambda key, what: sum(r[key]["state"] == what for r in left)  # noqa: E731
    states = ("named", "open", "not testable", "missed", "wrong")
    lines = [
        "# Cases left open, and motions that decide them", "",
        "Written by `experiments/ambiguous.py` from `results/ambiguous.jsonl`. In each case MuJoCo hides one effect",
        "in a random robot. On fast motions the effect makes 8 to 20 % of the joint's torque. Two poor motions of 12",
        "s are recorded: slow motions, small motions, or motions of another joint only. Inertials are 5 % wrong,",
        "encoder noise is 2e-5 rad, and torque noise is 1 % of the joint's torque. If the diagnosis leaves a question",
        "open, `irb140 excite` designs a motion. The same robot performs it, and the old and the new recordings are",
        "diagnosed together. For comparison, the poor motion is also recorded again for the same time.", "",
        f"The poor motions alone decide {len(rows) - len(left)} of {len(rows)} cases. {len(left)} cases stay open:", "",
        "| | " + " | ".join(states) + " |", "|---|" + "---|" * len(states),
        *(
            f"| {label} | " + " | ".join(str(count(key, s)) for s in states) + " |"
            for label, key in LABELS.items()
        ), "",
        f"*Named*: the diagnosis names the hidden effect at its joints with a probability of at least {CERTAIN}, and",
        "nothing else. *Open*: it names the effect with a lower probability, names it beside others, or lists it as",
        "an alternative. *Not testable*: it says that the motion could not have shown the effect. *Missed*: it does",
        "not mention the effect. *Wrong*: it names other effects and does not mention the hidden one.", "",
        "## Every case", "",
        "| seed | joints | poor motion | hidden | before | proposed motion | after | found after |",
        "|---|" + "---|" * 7,
        *(_line(r) for r in rows),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _line(r: dict) -> str:
    hidden = f"{r['truth']['effect']} on {', '.join(r['truth']['joints'])}"
    if "after" not in r:
        return f"| {r['seed']} | {r['joints_of_robot']} | {r['motion']} | {hidden} | named | | | |"
    found = "; ".join(f"{f['effect']} on {', '.join(f['joints'])}" for f in r["after"]["found"]) or "nothing"
    return (
        f"| {r['seed']} | {r['joints_of_robot']} | {r['motion']} | {hidden} | {r['before']['state']} | "
        f"{'; '.join(r['pieces'])} | {r['after']['state']} | {found} |"
    )


def main() -> None:
    config = tyro.cli(Config)
    rows = [json.loads(x) for x in config.out.read_text().splitlines()] if config.out.exists() else []
    if not config.page:
        set_up_compilation_cache()
        config.out.parent.mkdir(parents=True, exist_ok=True)
        for seed in sorted(set(range(config.cases)) - {r["seed"] for r in rows}):
            try:
                rows.append(judged(seed))
            except InputError as error:  # no place for the effect on this robot, or nothing moves enough to compare
                print(seed, "no case:", error, flush=True)
                continue
            with config.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            r = rows[-1]
            states = [f"{k}: {r[k]['state']}" for k in LABELS.values() if k in r]
            print(seed, r["motion"], r["truth"]["effect"], r["truth"]["joints"], *states, flush=True)
    text = page(sorted(rows, key=lambda r: r["seed"]))
    page_of(config.out.parent, "ambiguous.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
