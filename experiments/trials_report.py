"""The page on concealed physics of every kind (docs/trials.md), from results/trials_*.jsonl."""

import json
import pathlib
from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np
from pages import page_of
from scipy import stats

from irb140_jax.effects.catalogue import CATALOGUE

FAINT = 0.005  # of its joint's torque: what of the hidden physics makes less is counted apart
NINETY = 1.645  # standard deviations either way that a 90 % interval spans
ORDINARY = ("coulomb_friction", "viscous_friction")
# Goal of every row, as asked for before anything was measured.
GOALS = {
    ("single", "joints located exactly"): {"plain": "99 %", "masked": "99 %", "buried": "93 %"},
    ("single", "name exact, nothing added"): {"plain": "98 %", "masked": "98 %", "buried": "90 %"},
    ("single", "name within the stated set"): {"plain": "99 %", "masked": "99 %", "buried": "94 %"},
    ("single", "held-out error removed, over what an oracle removes, median"): {
        "plain": "0.97", "masked": "0.95", "buried": "0.85"},
    ("rough", "the concealed effect named at its joints"): {"plain": "95 %", "masked": "85 %"},
    ("rough", "ordinary friction found, per joint"): {"plain": "98 %", "masked": "98 %"},
    ("rough", "findings that are not there, per case"): {"plain": "<= 0.2", "masked": "<= 0.2"},
    ("rough", "corrected error over the sensors' noise, median"): {"plain": "1.0", "masked": "1.0"},
    ("clean", "no finding"): {"clean log": "98 %", "rough log": "98 %"},
    ("several", "every one named"): {"two": "70 %", "three": "70 %"},
    ("several", "at least one named"): {"two": "98 %", "three": "98 %"},
    ("outside", "flagged and located"): {"tuned on": "90 %", "judged on": "90 %"},
    ("outside", "wrongly named"): {"tuned on": "<= 10 %", "judged on": "<= 10 %"},
}  # fmt: skip


def _key(effect: dict) -> tuple[str, tuple[str, ...]]:
    return effect["effect"], tuple(sorted(effect["joints"]))


def truths(case: dict) -> set:
    """Hidden effects with their joints."""
    return {_key(e) for e in case["truth"]}


def founds(case: dict) -> set:
    """Findings with their joints."""
    return {_key(f) for f in case["found"]}


def missed(case: dict) -> set:
    """What is hidden and has no finding; ordinary friction is in the law found at its joint that contains it."""
    laws = {(CATALOGUE[slug].law, js) for slug, js in truths(case) & founds(case) if slug in CATALOGUE}
    held = {(slug, js) for law, js in laws for slug in law.contains}
    return truths(case) - founds(case) - held


def _missed_that_matter(case: dict) -> set:
    """What is missed though it is not faint; play and lags may make no torque to speak of."""
    return missed(case) & {_key(e) for e in case["truth"] if e.get("share", 1.0) >= FAINT}


def concealed(case: dict) -> set:
    """What is hidden beneath ordinary friction."""
    return {k for k in truths(case) if k[0] not in ORDINARY}


def _stated(case: dict) -> list[set]:
    """The set of every finding: its name and its alternatives."""
    return [{f["effect"], *(a["effect"] for a in f["alternatives"])} for f in case["found"]]


def _in_set(case: dict, hidden: set) -> bool:
    """Whether each of these stands in the set of a finding at one of its joints."""
    return all(
        any(slug in s and set(joints) & set(f["joints"]) for s, f in zip(_stated(case), case["found"], strict=True))
        for slug, joints in hidden
    )


def _size_of_sets(cases: list[dict]) -> str:
    return f"{_mean([len(s) for c in cases for s in _stated(c)]):.2f}"


def _owned_up(case: dict) -> bool:
    """Nothing added, and whatever is missing stands in the list of what this motion can't show."""
    blind = {(n["effect"], j) for n in case["not_testable"] for j in n["joints"]}
    listed = all(any((slug, j) in blind for j in joints) for slug, joints in missed(case))
    return not founds(case) - truths(case) and listed


def missed_by_us_alone(case: dict) -> set:
    """What is missed though a search for nothing but the hidden effects finds it."""
    oracle = {_key(f) for f in case["oracle"]["found"]} if case["oracle"] else set()
    return missed(case) & oracle


def _beyond_an_oracle(case: dict) -> bool:
    """Nothing added, and what is missing a search for nothing else does not find either."""
    return not founds(case) - truths(case) and not missed_by_us_alone(case)


def _removed(case: dict) -> float:
    """Held-out squared error that the findings remove, over what an oracle told the effect removes."""
    joints = {j for e in case["truth"] for j in e["joints"]}
    drop = lambda fit: sum(fit[j]["rmse_refit"] ** 2 - fit[j]["rmse_corrected"] ** 2 for j in joints)  # noqa: E731
    oracle = drop(case["oracle"]["fit"]) if case["oracle"] else 0.0
    noise = sum(case["fit"][j]["noise_floor"] ** 2 for j in joints)
    return drop(case["fit"]) / oracle if oracle > 0.02 * noise else np.nan  # an oracle that sees nothing says nothing


def _friction_found(case: dict) -> float:
    """Share of the joints whose Coulomb (or a law that contains it) and viscous friction are both found."""
    rubbing = {"coulomb_friction", "asymmetric_friction", "stribeck_friction", "load_dependent_friction",
               "position_dependent_friction", "presliding_hysteresis"}  # fmt: skip
    dragging = {"viscous_friction", "thermal_friction_drift", "nonlinear_viscous_friction"}
    joints = sorted({j for s, js in truths(case) if s in ORDINARY for j in js})
    at = lambda j: {s for s, js in founds(case) if js == (j,)}  # noqa: E731
    return float(np.mean([bool(at(j) & rubbing) and bool(at(j) & dragging) for j in joints]))


def _not_there(case: dict) -> int:
    """Findings that are not there; ordinary friction that a hidden law at the joint contains is not one."""
    return len(founds(case) - truths(case))


def _over_noise(case: dict, what: str) -> float:
    return float(np.median(list(case[what].values())))


def _flagged(case: dict) -> bool:
    joints = {j for e in case["truth"] for j in e["joints"]}
    return any(joints & set(u["joints"]) for u in case["unexplained"])


def _percent(values: Iterable[float]) -> str:
    values = list(values)
    return f"{100 * float(np.mean(values)):.0f} %" if values else "-"


def _mean(values: list[int]) -> float:
    return float(np.mean(values)) if values else 0.0


def _median(values: Iterable[float]) -> str:
    values = [v for v in values if np.isfinite(v)]
    return f"{np.median(values):.3g}" if values else "-"


def _errors(cases: list[dict]) -> list[tuple[float, bool, float]]:
    """Relative error, whether the 90 % interval covers, and strength, of the parameters of rightly named effects.

    Where a special case of the effect is hidden at the same joint, the finding is the sum of both, and is left out.
    """
    rows = []
    for case in cases:
        for e in case["truth"]:
            slug, joints = _key(e)
            special = CATALOGUE[slug].law.contains if slug in CATALOGUE else ()
            if any((s, joints) in truths(case) for s in special):
                continue
            for f in case["found"]:
                if _key(e) != _key(f):
                    continue
                for k, v in f["parameters"].items():
                    true = e["parameters"].get(k, {}).get("value")
                    if true:
                        off = v["value"] - true
                        rows.append((abs(off / true), abs(off) <= NINETY * v["std"], e.get("share", 1.0)))
    return rows


MEASURES: dict[str, dict[str, Callable[[list[dict]], str]]] = {
    "single": {
        "joints located exactly": lambda cs: _percent(
            {j for _, js in truths(c) for j in js} == {j for _, js in founds(c) for j in js} for c in cs),
        "name exact, nothing added": lambda cs: _percent(truths(c) == founds(c) for c in cs),
        "exact, of those that make 0.5 % of a joint's torque": lambda cs: _percent(
            not _missed_that_matter(c) and not _not_there(c) for c in cs),
        "exact, or what is missing is listed as not testable": lambda cs: _percent(_owned_up(c) for c in cs),
        "exact, or an oracle told the effect does not find it either": lambda cs: _percent(
            _beyond_an_oracle(c) for c in cs),
        "name within the stated set": lambda cs: _percent(_in_set(c, truths(c)) for c in cs),
        "mean size of a stated set": _size_of_sets,
        "held-out error removed, over what an oracle removes, median": lambda cs: _median(_removed(c) for c in cs),
    },
    "rough": {
        "the concealed effect named at its joints": lambda cs: _percent(concealed(c) <= founds(c) for c in cs),
        "named, or listed as not testable": lambda cs: _percent(_owned_up(c) for c in cs),
        "nothing missing that an oracle told the effects finds": lambda cs: _percent(
            not missed_by_us_alone(c) for c in cs),
        "the concealed effect within the stated set": lambda cs: _percent(_in_set(c, concealed(c)) for c in cs),
        "mean size of a stated set": _size_of_sets,
        "ordinary friction found, per joint": lambda cs: _percent(_friction_found(c) for c in cs),
        "findings that are not there, per case": lambda cs: f"{np.mean([_not_there(c) for c in cs]):.2f}",
        "corrected error over the sensors' noise, median": lambda cs: _median(_over_noise(c, "unseen") for c in cs),
        "the same, of these laws with any parameters": lambda cs: _median(_over_noise(c, "unseen_limit") for c in cs),
        "the same, given positions without any noise": lambda cs: _median(_over_noise(c, "unseen_exact") for c in cs),
    },
    "several": {
        "every one named": lambda cs: _percent(not missed(c) for c in cs),
        "every one named that makes 0.5 % of a joint's torque": lambda cs: _percent(
            not _missed_that_matter(c) for c in cs),
        "exact, or what is missing is listed as not testable": lambda cs: _percent(_owned_up(c) for c in cs),
        "nothing missing that an oracle told the effects finds": lambda cs: _percent(
            not missed_by_us_alone(c) for c in cs),
        "every one within a stated set": lambda cs: _percent(_in_set(c, truths(c)) for c in cs),
        "mean size of a stated set": _size_of_sets,
        "at least one named": lambda cs: _percent(bool(truths(c) & founds(c)) for c in cs),
        "findings that are not there, per case": lambda cs: f"{np.mean([_not_there(c) for c in cs]):.2f}",
    },
    "clean": {
        "no finding": lambda cs: _percent(not c["found"] for c in cs),
        "nothing unexplained": lambda cs: _percent(not c["unexplained"] for c in cs),
    },
    "outside": {
        "flagged and located": lambda cs: _percent(_flagged(c) for c in cs),
        "wrongly named": lambda cs: _percent(bool(c["found"]) for c in cs),
    },
}  # fmt: skip
EVERY: dict[str, Callable[[list[dict]], str]] = {
    "worst corrected / refit error": lambda cs: f"{max(_harm(c) for c in cs):.3f}",
    "parameter error, median": lambda cs: _percent([np.median([e for e, _, _ in _errors(cs)])]) if _errors(cs) else "-",
    "90 % intervals that cover": lambda cs: _percent(c for _, c, _ in _errors(cs)),
    "cases": lambda cs: str(len(cs)),
}


def _harm(case: dict) -> float:
    """Largest ratio of corrected to refit error over the joints with any torque to speak of."""
    total = lambda key: np.sqrt(sum((f[key] / max(f["noise_floor"], 1e-12)) ** 2 for f in case["fit"].values()))  # noqa: E731
    return float(total("rmse_corrected") / max(total("rmse_refit"), 1e-300))


def said(items: Iterable[tuple[str, tuple[str, ...]]], joints: int) -> str:
    """Effects with their joints, in a few words."""
    name = lambda k: k[0] if len(k[1]) == joints and joints > 1 else f"{k[0]} on {', '.join(k[1])}"  # noqa: E731
    return "; ".join(name(k) for k in sorted(items)) or "nothing"


def exact(case: dict) -> bool:
    """Whether all that is hidden is named, and nothing else."""
    return not missed(case) and not _not_there(case)


def _said_otherwise(case: dict) -> bool:
    """Nothing added, and what is missing is listed as not testable, an alternative of a finding or unexplained."""
    blind = {(n["effect"], j) for n in case["not_testable"] for j in n["joints"]}
    left = {j for u in case["unexplained"] for j in u["joints"]}
    told = lambda slug, joints: (  # noqa: E731
        all((slug, j) in blind for j in joints) or bool(left & set(joints)) or _in_set(case, {(slug, joints)}))
    return not founds(case) - truths(case) and all(told(slug, joints) for slug, joints in missed(case))


def _beside_first_engine(out: pathlib.Path, cases: dict[str, list[dict]]) -> list[str]:
    """The same cases by the first statistical engine, of which is kept which of them it had exact."""
    path = out / "trials_first_engine.json"
    if not path.exists():
        return []
    then = {kind: {int(seed): was for seed, was in of.items()} for kind, of in json.loads(path.read_text()).items()}
    lines = [
        "", "## Beside the first engine", "",
        "Which cases are exact: all that is hidden is named, and nothing else. The first statistical engine, which",
        "[decisions 30 to 33](decisions/index.md) replaced, took laws and stated uncertainties to be right to the last",
        "digit, and noise to be white. In a clean log it named torque constants and zeros that masses a little off",
        "explain as well. In a rough one it named laws of a form that no law of the library has quite: the discrepancy",
        "holds what such a law and a simpler one differ in, and noise that is correlated counts for less.", "",
        "| cases | in common | exact then | exact now | then alone | of those now listed as not testable, an "
        "alternative, or unexplained at the joint | now alone | as uneven by chance, p |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for kind, now in cases.items():
        both = [(c, then[kind][c["seed"]]) for c in now if c["seed"] in then.get(kind, {})]
        if not both:
            continue
        lost, won = [c for c, was in both if was and not exact(c)], [c for c, was in both if exact(c) and not was]
        p = stats.binomtest(len(won), len(won) + len(lost)).pvalue if won or lost else 1.0
        cells = [len(both), sum(was for _, was in both), sum(exact(c) for c, _ in both), len(lost),
                 sum(map(_said_otherwise, lost)), len(won), f"{p:.2g}"]  # fmt: skip
        lines.append(f"| {' | '.join(map(str, [TITLES[kind], *cells]))} |")
    return lines


def line_of(case: dict) -> str:
    """A case in one line, for the screen."""
    added, n = founds(case) - truths(case), case["joints_of_robot"]
    return (
        f"{'MISS' if missed(case) or added else 'ok  '} {case['seed']} {case['row']} n={n} "
        f"missed [{said(missed(case), n)}] added [{said(added, n)}] {case['verdict']} "
        f"unexplained {[j for u in case['unexplained'] for j in u['joints']]} "
        f"noise x{_over_noise(case, 'unseen'):.2f} {case['seconds']:.0f} s"
    )


def _table(kind: str, cases: list[dict]) -> list[str]:
    rows = list(dict.fromkeys(c["row"] for c in cases))
    rows.sort(key=lambda r: ["plain", "masked", "buried", "two", "three"].index(r) if r in
              ("plain", "masked", "buried", "two", "three") else 9)  # fmt: skip
    part = {r: [c for c in cases if c["row"] == r] for r in rows}
    lines = [f"| | {' | '.join(rows)} |", "|---" * (len(rows) + 1) + "|"]
    for name, measure in {**MEASURES[kind], **EVERY}.items():
        goal = GOALS.get((kind, name), {})
        cells = [measure(part[r]) + (f" (goal {goal[r]})" if r in goal else "") for r in rows]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _by_effect(cases: list[dict]) -> list[str]:
    """How often each hidden effect was named at its joints."""
    named, hidden = Counter(), Counter()
    for case in cases:
        for key in truths(case):
            hidden[key[0]] += 1
            named[key[0]] += key in founds(case)
    lines = ["", "| hidden | named at its joints |", "|---|---|"]
    return lines + [f"| {slug} | {named[slug]} of {hidden[slug]} |" for slug in sorted(hidden)]


def _misses(cases: list[dict]) -> list[str]:
    columns = ("case", "robot", "missed", "added", "verdict", "listed as not testable", "an oracle finds")
    lines = ["", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for c in cases:
        missing, added, n = missed(c), founds(c) - truths(c), c["joints_of_robot"]
        if missing or added:
            owned = "yes" if missing and _owned_up(c) else ""
            lines.append(f"| {c['row']} {c['seed']} | {_robot(c)} | {said(missing, n)} | {said(added, n)} "
                         f"| {c['verdict']} | {owned} | {said(missed_by_us_alone(c), n)} |")
    return lines


def _misses_outside(cases: list[dict]) -> list[str]:
    lines = ["", "| case | robot | hidden | named all the same | located |", "|---|---|---|---|---|"]
    for c in cases:
        if c["found"] or not _flagged(c):
            n = c["joints_of_robot"]
            lines.append(f"| {c['row']} {c['seed']} | {_robot(c)} | {said(truths(c), n)} | {said(founds(c), n)} "
                         f"| {'yes' if _flagged(c) else 'no'} |")
    return lines


def _robot(case: dict) -> str:
    n = case["joints_of_robot"]
    return f"{n} joint{'s' if n > 1 else ''}"


TITLES = {
    "single": "One effect, clean log",
    "rough": "Friction on every joint, rough log, and one more effect under another law",
    "several": "Several effects at once",
    "clean": "Nothing hidden",
    "outside": "Physics that is in no library",
}


def write(out: pathlib.Path) -> None:
    """Write docs/trials.md from the result files."""
    lines = [
        "# Trials: concealed physics of every kind",
        "",
        "Cases of a kind that the library itself describes: a regression test. How good a diagnosis is stands in",
        "[calibration](calibration.md).",
        "",
        "Written by `experiments/trials.py` from `results/trials_*.jsonl`. MuJoCo drives the arm in closed loop,",
        "inertials 5 % wrong; three recordings of 15 s; the IRB 140 and random robots of 1 to 7 joints with slides.",
        "Strength is the effect's torque RMS as a share of its joint's: plain 20 %, masked 6 %, buried 2 %. A rough",
        "log has encoders of 17 bits, 2 % coloured torque noise with spikes, jittered stamps and lost samples.",
        "Every miss is listed, with what a search finds that is told which effects are hidden, and looks for no others",
        "but their special cases.",
        "Cases are kept as the code goes on: delete a result file to make its cases anew.",
    ]
    every: dict[str, list[dict]] = {}
    for kind, title in TITLES.items():
        path = out / f"trials_{kind}.jsonl"
        if not path.exists():
            continue
        cases = sorted((json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()),
                       key=lambda c: c["seed"])  # fmt: skip
        every[kind] = cases
        lines += ["", f"## {title}", "", *_table(kind, cases)]
        if kind in ("single", "rough", "several"):
            lines += _by_effect(cases)
        lines += ["", "### Every miss", *(_misses_outside if kind == "outside" else _misses)(cases)]
    engines = sorted({c["engine"][:7] for cases in every.values() for c in cases if "engine" in c})
    lines += [*_beside_first_engine(out, every), "", f"Engine at commit {', '.join(engines)}."]
    page_of(out, "trials.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
