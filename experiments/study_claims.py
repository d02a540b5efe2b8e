"""Each statement of the study beside what we found: number, test, verdict, and why; out of stored results.

Those on the swarms themselves are in study_swarm_claims.py.
"""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false
# ruff: noqa: E501  sentences read better whole

import dataclasses

import numpy as np
from mlp_report import judged_on
from study_statistics import ALPHA, said
from table4_report import ours, weakest

HOLDS, READS, LEVEL = "holds", "holds in part", "no difference"
FAILS, OPEN = "does not hold", "cannot be judged"
VERDICTS = (HOLDS, READS, LEVEL, FAILS, OPEN)


@dataclasses.dataclass(frozen=True)
class Claim:
    """A statement and what became of it.

    Attributes:
        said: By the study.
        ours: What we found.
        test: How sure that is.
        verdict: One of `VERDICTS`.
        why: In a sentence.
        share: Of the readings, or of the pairs of readings, in which it holds; None where there is one case.
    """

    said: str
    ours: str
    test: str
    verdict: str
    why: str
    share: float | None = None

    @property
    def told(self) -> str:
        """The verdict with its share."""
        return f"{self.verdict} ({percent(self.share)})" if self.verdict == READS and self.share is not None else self.verdict


def percent(share: float) -> str:
    """In words; nothing and everything only where it is exactly that."""
    if 0.0 < share < 0.01:
        return "under 1 %"
    return "over 99 %" if 0.99 < share < 1.0 else f"{100 * share:.0f} %"


def by_share(share: float) -> str:
    """Holds only where it does in all readings."""
    return HOLDS if share == 1.0 else READS if share > 0.0 else FAILS


def control_claims(control: dict) -> list[Claim]:
    """Table 4 and figures 14 to 17: every statement in the nearest reading, and in how many readings it holds."""
    found = []
    for k, row in enumerate(control["claims"][control["shown"]]):
        verdicts = [rows[k]["holds"] for rows in control["claims"].values()]
        yes, opposite = verdicts.count("yes"), verdicts.count("no, the opposite")
        count, level = len(verdicts), len(verdicts) - yes - opposite
        verdict = by_share(yes / count) if yes or opposite else LEVEL
        why = f"holds in {yes}, is opposite in {opposite}, shows no difference in {level} of {count} readings"
        share = yes / count if yes else None
        found.append(Claim(row["statement"], ours(row), said(weakest(row)), verdict, why, share=share))
    return found


def arm_claims(arm: dict) -> list[Claim]:
    """Table 2: uniform density against the maker's own simulator."""
    if "rest" not in arm:
        return []
    told = arm["rest"]
    off = {j: abs(told["ours"][j] / told["maker"][j] - 1.0) for j in (1, 2)}
    return [
        Claim(
            "mass properties from CAD at uniform density, less than 0.9 % error",
            f"torque at rest in the maker's simulator and ours: axis 2 {told['maker'][1]:.1f} and {told['ours'][1]:.1f} N m, "
            f"axis 3 {told['maker'][2]:.1f} and {told['ours'][2]:.1f} N m",
            f"{100 * off[1]:.0f} % and {100 * off[2]:.0f} % apart, in one posture: indicative",
            FAILS, "motors are denser than castings; 0.9 % can be said of volumes, not of masses",
        )
    ]  # fmt: skip


def network_claims(network: dict) -> list[Claim]:
    """Figure 12, position errors of the network; and what equation 33's penalty on the condition number buys."""
    return [_learnt(network), _penalised(network)]


def _learnt(network: dict) -> Claim:
    """Position errors, as the study gives them."""
    cases = [c for c in network["cases"] if c["name"].startswith("forward, task") and not c["case"]["seed"]]
    told = [c for c in cases if c["case"].get("optimiser") == "plain"]
    ours_of = next(c for c in cases if c["case"]["hidden"] == "1 x 50" and not c["case"]["refined"] and c not in told)
    best = min(cases, key=lambda c: c["validation"])
    on = judged_on(cases)
    third = "on a third set" if on == "test" else "in validation"
    reached = [c for c in cases if c["training"] <= 0.48 and c[on] <= 0.61]
    plain = f"gradient descent as told: {told[0]['training']:.3g} and {told[0][on]:.3g} mm; " if told else ""
    return Claim(
        "the network learns the kinematics to 0.48 mm in training, 0.61 mm in validation",
        f"in training and {third}, one hidden layer of 50, {plain}with Adam, clipped steps and a cosine rate, which are ours: {ours_of['training']:.2g} and "
        f"{ours_of[on]:.2g} mm; best in validation, *{best['name']}*: {best['training']:.2g} and {best[on]:.2g} mm",
        f"{len(reached)} of {len(cases)} readings of the forward task stay within 0.48 mm in training and 0.61 mm {third}, on synthetic samples",
        by_share(len(reached) / len(cases)),
        "it validates lengths that are known to a hundredth of that; nothing dynamic is in it", share=len(reached) / len(cases),
    )  # fmt: skip


def _penalised(network: dict) -> Claim:
    """Runs of several seeds with each form and weight, against those without; all warmed up, so that none gets stuck."""
    runs: dict[tuple, list[dict]] = {}
    for row in network["cases"]:
        if row["case"]["region"] == "branch" and row["case"]["warm_up"]:
            runs.setdefault((row["case"]["penalty"], row["case"]["weight"]), []).append(row)
    of = lambda rows, key: np.array([row["bins"][-1][key] for row in rows])  # noqa: E731
    plain = runs.pop(("none", 0.0))
    tests = network["tests"]
    sure = [test for test in tests if test["lower"] == "first"]
    middle = lambda rows, key: float(np.median(of(rows, key)))  # noqa: E731
    strongest = min(runs, key=lambda key: middle(runs[key], "chosen_p95"))
    with_it = runs[strongest]
    return Claim(
        "a penalty on the condition number keeps the network away from singular poses",
        f"asked for poses above {plain[0]['bins'][-1]['from']:g}, the network without penalty stays at "
        f"{middle(plain, 'chosen_p95'):.3g} (95th percentile; median of {len(plain)} seeds), with {strongest[0]} penalty "
        f"{strongest[1]:g} m at {middle(with_it, 'chosen_p95'):.3g}, and misses them by {middle(with_it, 'error'):.2g} instead of "
        f"{middle(plain, 'error'):.2g} mm; joint speed {middle(with_it, 'speed_p95'):.3g} instead of "
        f"{middle(plain, 'speed_p95'):.3g} rad/m, by the exact inverse {middle(plain, 'asked_speed_p95'):.3g}",
        f"{len(sure)} of {len(tests)} forms and weights lower at p < {ALPHA:g} (Holm); the weakest: {said(max(tests, key=lambda t: t['p_holm']))}",
        by_share(len(sure) / len(tests)),
        "a smooth network rounds a singularity off by itself; the penalty adds to that and is paid for in accuracy",
        share=len(sure) / len(tests),
    )


def beyond_claims(
    torque: dict, tracking: dict | None, circle: dict | None, noisy: dict | None, embedded: dict | None
) -> list[Claim]:
    """What the study leaves to future research: data instead of known answers."""
    by = {row["name"]: row for row in torque["rows"]}
    swarms = [r for r in torque["rows"] if "PSO" in r["name"]]
    best = min(swarms, key=lambda r: r["held_out_median"])
    prior = by["Levenberg-Marquardt, box as prior"]
    more = ([_noisy(noisy)] if noisy else []) + ([_embedded(embedded)] if embedded else [])
    found = [_torque(torque, swarms, best, prior)]
    if tracking is None:
        return found + more
    seen, truth = tracking["seen"], tracking["truth"]
    rows = [r for r in tracking["rows"] if r["algorithm"]]
    tracked = [r for r in rows if r["objective"] == "tracking"]
    middle = next(r for r in tracking["rows"] if not r["algorithm"])
    worth = [test for test in tracking["tests"] if test["name"].endswith("tracking: com, QPSO lower than PSO")]
    cheaper = [r for r in rows if r["objective"] in truth and r["objective"] != "tracking"]
    below = [r for r in cheaper if r["measures"][r["objective"]] < truth[r["objective"]]]
    found += [
        Claim(
            "tracking performance can take the place of known answers (future research)",
            f"tracking alone leaves the centres of mass off by {min(r['com'] for r in tracked):.0f} %, the inertias by "
            f"{min(r['inertia'] for r in tracked):.0f} % (the box's middle: {middle['com']:.0f} and {middle['inertia']:.0f} %), and predicts "
            f"unseen torque to {min(r['torque_rmse'] for r in tracked):.2g} N m (the box's middle: {middle['torque_rmse']:.2g})" + _along_circle(circle),
            f"{tracked[0]['runs']} seeds; the loop shows {seen['tracking']['rank']} combinations of {len(seen['names'])} unknowns"
            + "".join(f"; centres of mass, QPSO against PSO: {said(test)}" for test in worth[:1]),
            READS, "it identifies what drives the arm, not the parameters one by one",
        ),
    ]  # fmt: skip
    if cheaper:
        found.append(Claim(
            "torque smoothness and energy as objectives improve the identification (future research)",
            f"{len(below)} of {len(cheaper)} searches end at a model that is smoother or cheaper than the true one, "
            f"with inertias off by {min(r['inertia'] for r in cheaper):.0f} to {max(r['inertia'] for r in cheaper):.0f} % "
            f"and tracking {max(r['measures']['tracking'] for r in cheaper) / truth['tracking']:.2g} times as bad at worst",
            f"true model: roughness {truth['smoothness']:.4g} N m/s, energy {truth['energy']:.4g} J",
            FAILS if below else OPEN, "the smoothest or cheapest motion is not the one under the true model",
        ))  # fmt: skip
    return found + more


def _along_circle(circle: dict | None) -> str:
    """What tracking identifies along the study's own motion."""
    if circle is None:
        return ""
    tracked = [r for r in circle["rows"] if r["objective"] == "tracking"]
    return (
        f"; along the study's circle the centres of mass are off by {min(r['com'] for r in tracked):.0f} %, the inertias by "
        f"{min(r['inertia'] for r in tracked):.0f} %, unseen torque by {min(r['torque_rmse'] for r in tracked):.2g} N m"
    )


def _torque(torque: dict, swarms: list[dict], best: dict, prior: dict) -> Claim:
    """Data in place of known answers."""
    return Claim(
        "swarms identify the parameters (with torque instead of known answers)",
        f"held-out torque error, median of the runs: best swarm {best['held_out_median']:.2g} N m in {best['run_s']:.2g} s, Levenberg-Marquardt "
        f"that is told the same box {prior['held_out_median']:.2g} N m in {prior['run_s']:.2g} s; parameters off by "
        f"{min(r['inertia'] for r in swarms):.0f} % or more of the inertias all the same",
        f"noise {torque['bounds']['noise']:.2g} N m, middle of the box {torque['bounds']['middle of the box']:.2g} N m",
        FAILS, "torque shows base parameters only; what predicts well need not be the parameters",
    )  # fmt: skip


def _noisy(noisy: dict) -> Claim:
    """The enhanced swarms where every evaluation is noisy."""
    tests = noisy["tests"]
    won = sum(test["lower"] == "first" for test in tests)
    lost = sum(test["lower"] == "second" for test in tests)
    best = min(tests, key=lambda test: test["p_holm"])
    return Claim(
        "noise-resilient, adaptive and self-tuning swarms are more robust (future research)",
        f"with new noise in every evaluation they predict unseen torque better than the plain delta-well swarm in {won}, worse in {lost} of "
        f"{len(tests)} comparisons; the clearest: {best['name']}, {best['medians'][0]:.2g} against {best['medians'][1]:.2g} N m",
        said(best), by_share(won / len(tests)) if won or lost else LEVEL,
        "measuring a best again pays where luck is larger than the differences that are left", share=won / len(tests) if won else None,
    )  # fmt: skip


def _embedded(embedded: dict) -> Claim:
    """The model on an embedded platform."""
    rows = embedded["rows"]
    slowest = max(rows, key=lambda row: row["p999_us"])
    within = [row for row in rows if row["p999_us"] < 1000.0]
    return Claim(
        "the identified model runs in real time on embedded platforms (future research)",
        "; ".join(f"{row['form']}, {row['joints']} joints: {row['median_us']:.3g} µs" for row in rows),
        f"99.9th percentile of the slowest form {slowest['p999_us']:.3g} µs; a cycle of 1 kHz has 1000",
        by_share(len(within) / len(rows)) if rows else OPEN,
        f"on {embedded['made']['machine']}; the C code needs no library, but no microcontroller was at hand", share=len(within) / len(rows),
    )  # fmt: skip
