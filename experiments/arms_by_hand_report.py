"""Write the page on physics that was hidden by hand, from the results that arms_by_hand.py stored."""

import json
import pathlib

import numpy as np
from hand_arms import ARMS
from hand_laws import ORDINARY
from pages import FIRST_ENGINE, page_of

OPENING = f"""# Arms and physics by hand

{FIRST_ENGINE}

Written by `experiments/arms_by_hand.py` from `results/arms_by_hand_*.jsonl`; don't edit. There are six arms: a
pendulum, two links, SCARA, gantry, cylindrical, and seven joints. Their MJCF, control and hidden physics are written
by hand in `hand_arms.py` and `hand_laws.py`. Where MuJoCo has the physics, its own `frictionloss`, `damping`,
`armature`, `stiffness` and `gravity` are used. Inertials are 5 % wrong. There are two recordings of 15 s that begin
and end in motion. The noise is 1e-5 on positions and 1 % on torques. Effects make 6 to 25 % of the joint's torque.
Delays are 6 to 22 ms, lags 15 to 60 ms, encoder offsets 0.02 to 0.06, and payloads 0.3 to 1 times the last link. No
case is left out because its effect is invisible: an encoder offset on a vertical slide, or a torque gain on a joint
with nothing but inertia, can't be seen by any method.

## One or two laws, a clean log
"""
OPENING_ABRUPT = """## One or two laws, motions that start and stop abruptly

These are the same cases along moves from pose to pose at constant speed. The joint reaches that speed with constant
acceleration in 0.1 to 0.3 s. The torque then has steps, and a log at 500 Hz does not show when between two samples a
step occurs.
"""
OPENING_ROUGH = """## Friction on every joint, a rough log, and one more law

These are the same arms with MuJoCo's `frictionloss` (15 % of the joint's torque, plus or minus 40 %) and `damping`
(10 %) on every joint. In five of six cases there is one more law of 6 to 25 %. There are three recordings of 20 s:
sines, point to point, and sines at a third of the speed. Encoders have 17 bits (slides 5 um). Torque has 2 % of
coloured noise with spikes. Samples are unevenly spaced, some are lost, and there are gaps of 20 ms.
"""
OPENING_PARTS = """## A part that the model lacks, a clean log

These effects need another plant than the nominal arm (`hand_parts.py`). Each part is used once on each arm.
Elasticity: a second joint with a spring, on which the load oscillates at 6 to 12 Hz. Backlash: a second joint with
MuJoCo's own limits, 1 to 5 % of the spread of the joint's positions apart. Coupling: a tendon with damping and
friction. Push: a force on the centre of mass of the last body that starts and ends at once and lasts 0.5 to 2 s.
Contact: an elastic wall. Presliding: a LuGre model with damping. Thermal drift: exponential. Position-dependent
friction: a bump of another form than the library's. Stribeck: MuJoCo's dry friction and more at low speed, with power
1 or 2. Rotors are much lighter than what they drive, so an impact at the end of the gap accelerates them strongly.
"""
OPENING_ROUGH_PARTS = """## Friction on every joint, a rough log, and a part that the model lacks

As above, with MuJoCo's friction on every joint and three rough recordings of 20 s.
"""


def key(effect: dict) -> tuple[str, ...]:
    """What it is and where."""
    return effect["effect"], *sorted(effect["joints"])


def say(items: list[dict]) -> str:
    """Effects with their joints, in words."""
    return "; ".join(f"{i['effect']} on {', '.join(i['joints'])}" for i in items) or "nothing"


def without(items: list[dict], others: list[dict]) -> list[dict]:
    """Those that are not among the others."""
    return [i for i in items if key(i) not in {*map(key, others)}]


def table(cases: list[dict], ordinary: tuple[str, ...] = (), *, by_law: bool = False) -> list[str]:
    """Lines with all figures of one kind, arm by arm or by what is hidden first.

    The `ordinary` laws, which every joint has, are counted apart.
    """
    what = lambda c: c["truth"][0]["effect"] if by_law else c["arm"]  # noqa: E731
    parts = dict.fromkeys(map(what, cases)) if by_law else ARMS
    apart = ["ordinary friction", "named"] if ordinary else []
    first = ["hidden" if by_law else "arm", "cases", "exact, nothing added", "hidden", "named"]
    last = ["false findings", "median error", "90 % intervals that contain the truth"]
    heads = [*first, "listed as not testable", *apart, *last]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, part in [*((p, [c for c in cases if what(c) == p]) for p in parts), ("all", cases)]:
        laws = [(c, e) for c in part for e in c["truth"]]
        missed = [(c, e) for c in part for e in without(c["truth"], c["found"])]
        count = lambda pairs, usual: sum((e["effect"] in ordinary) == usual for _, e in pairs)  # noqa: E731
        listed = sum(e["effect"] in {x["effect"] for x in c["not_testable"]} for c, e in missed)
        row = [len(part), sum(c["exact"] for c in part), count(laws, False), count(laws, False) - count(missed, False)]
        row += [listed, *((count(laws, True), count(laws, True) - count(missed, True)) if ordinary else ())]
        row += [sum(len(without(c["found"], c["truth"])) for c in part), *_errors(_values(part, ordinary))]
        lines.append(f"| {name} | {' | '.join(map(str, row))} |")
    error, cover = _errors(_values(cases))
    figures = "There is no parameter to compare, because nothing that was hidden is named."
    if error:
        figures = f"The median error of the named parameters over all laws is {error}. {cover} of their 90 % intervals "
        figures += "contain the truth."
    nothing = [c for c in cases if all(e["effect"] in ordinary for e in c["truth"])]
    false = sum(len(without(c["found"], c["truth"])) for c in nothing)
    more = "nothing more was hidden" if ordinary else "nothing was hidden"
    clear = [f"In {len(nothing)} of these cases {more}; false findings there: {false}."] if nothing else []
    return [
        *lines,
        "",
        *clear,
        figures,
        "",
        "### Every case that is not exact",
        "",
        "| case | arm | hidden | missed | added | verdict |",
        "|---|---|---|---|---|---|",
        *(
            f"| {c['seed']} | {c['arm']} | {say([e for e in c['truth'] if e['effect'] not in ordinary])} "
            f"| {say(without(c['truth'], c['found']))} | {say(without(c['found'], c['truth']))} | {c['verdict']} |"
            for c in cases
            if not c["exact"]
        ),
        "",
    ]


def _values(cases: list[dict], but: tuple[str, ...] = ()) -> list[tuple[float, float, float]]:
    """Value, standard deviation and truth of every parameter of what is named, but for some laws."""
    out = []
    for c in cases:
        found = {key(f): f["parameters"] for f in c["found"]}
        for e in (e for e in c["truth"] if e["effect"] not in but):
            own = found.get(key(e), {})
            out += [(own[k]["value"], own[k]["std"], v) for k, v in e["parameters"].items() if k in own and v]
    return out


def _errors(values: list[tuple[float, float, float]]) -> tuple[str, str]:
    """Median relative error, and share of the 90 % intervals that cover the truth, in words; empty without values."""
    if not values:
        return "", ""
    error = 100 * np.median([abs(v / true - 1.0) for v, _, true in values])
    cover = 100 * np.mean([abs(v - true) <= 1.645 * std for v, std, true in values])
    return f"{error:.2g} %", f"{cover:.0f} %"


def read(path: pathlib.Path) -> list[dict]:
    """The cases that are done."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return sorted(map(json.loads, lines), key=lambda c: c["seed"])


def write(paths: dict[str, pathlib.Path]) -> None:
    """docs/arms-by-hand.md from the files of each kind that are there."""
    lines = []
    openings = {
        "clean": OPENING, "abrupt": OPENING_ABRUPT, "rough": OPENING_ROUGH, "parts": OPENING_PARTS,
        "rough_parts": OPENING_ROUGH_PARTS,
    }  # fmt: skip
    for kind, opening in openings.items():
        if cases := read(paths[kind]):
            lines += [opening, *table(cases, ORDINARY if "rough" in kind else (), by_law="parts" in kind)]
    page_of(paths["clean"].parent, "arms-by-hand.md").write_text("\n".join(lines), encoding="utf-8")
