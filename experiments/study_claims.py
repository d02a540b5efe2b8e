"""Each statement of the study beside what we found: number, test, verdict, and why; out of stored results."""
# ruff: noqa: E501  sentences read better whole

import dataclasses
import math

import numpy as np
from scipy import stats
from study_readings import PARTICLES, PUBLISHED, Reading, all_readings, usual_readings
from study_statistics import difference

from irb140_jax import identify

HOLDS, READS, LEVEL = "holds", "holds in some readings", "no difference"
FAILS, OPEN = "does not hold", "cannot be judged"
VERDICTS = (HOLDS, READS, LEVEL, FAILS, OPEN)
SURE = 0.01  # p below which a difference counts
NEAR = 1.25  # factor within which a figure counts as the published one
PUBLISHED_GAP = PUBLISHED["pso"]["com"] / PUBLISHED["qpso"]["com"]


@dataclasses.dataclass(frozen=True)
class Claim:
    """A statement and what became of it.

    Attributes:
        said: By the study.
        ours: What we found.
        test: How sure that is.
        verdict: One of `VERDICTS`.
        why: In a sentence.
    """

    said: str
    ours: str
    test: str
    verdict: str
    why: str


def said_test(test: dict, unit: str = "") -> str:
    """A comparison in words."""
    return (
        f"difference {test['difference']:.3g}{unit} [{test['low']:.3g}, {test['high']:.3g}], "
        f"Mann-Whitney p = {test['p_value']:.1g}, lower in {100 * test['superiority']:.0f} % of the pairs of runs"
    )


def swarm_claims(table: dict, sets: dict) -> list[Claim]:
    """Table 3 and figures 6 to 9."""
    return [
        _reached(table, "qpso"), _reached(table, "pso"), _better(table, sets), _clamp(table), _fitness(table),
        _plateau(sets), _spread(sets), _products(table, sets), _feasible(table), _needed(table),
    ]  # fmt: skip


def _reached(table: dict, family: str) -> Claim:
    """Whether the published errors are reached, and how exactly."""
    wanted, near, keys = PUBLISHED[family], table["nearest"][family], ("com", "inertia")
    own = [r for r in table["readings"] if r["name"].startswith(f"{family},")]
    within = [r for r in own if all(abs(math.log(max(r[k], 1e-12) / wanted[k])) < math.log(NEAR) for k in keys)]
    below = [r for r in own if all(r[k] <= wanted[k] for k in keys)]
    return Claim(
        f"{family.upper()}: MAPE {wanted['com']} % of the centres of mass, {wanted['inertia']} % of the inertias",
        f"nearest reading {near['com']:.3g} % and {near['inertia']:.3g} %: *{near['name']}*",
        f"at most both in {len(below)} of {len(own)} readings, both to a factor of {NEAR:g} in {len(within)}; all readings "
        f"span {min(r['com'] for r in own):.1g} to {max(r['com'] for r in own):.2g} %",
        READS if below or within else FAILS,
        "the text leaves box, velocity limit and units open, and the error goes wherever these put it",
    )


def _better(table: dict, sets: dict) -> Claim:
    """Whether QPSO beats PSO: in the nearest pair, and with either's open choices made at its best."""
    test = difference(*(np.array(sets["runs"][name]["fitness"]) for name in ("QPSO", "PSO")))
    by_name = {str(r): r for r in (*all_readings(), *usual_readings())}
    best: dict[tuple, dict[str, float]] = {}
    for row in table["readings"]:
        reading = by_name[row["name"]]
        if reading.family in PUBLISHED:
            told = best.setdefault(reading.problem, {})
            told[reading.family] = min(row["com"] + row["inertia"], told.get(reading.family, math.inf))
    both = [told for told in best.values() if len(told) == 2]
    won = sum(told["qpso"] < told["pso"] for told in both)
    sign = stats.binomtest(won, len(both)).pvalue if both else 1.0
    pair_holds = test["p_value"] < SURE and test["difference"] > 0
    verdict = HOLDS if pair_holds and won == len(both) else READS if pair_holds or won else FAILS
    return Claim(
        "QPSO finds better parameters than PSO",
        f"in the pair of readings that comes nearest, yes; with each algorithm's own open choices at their best, QPSO is "
        f"better in {won} of {len(both)} problems",
        f"the pair's final fitness: {said_test(test)}, d = {test['cohen_d']:.1f}; sign test over the problems "
        f"p = {sign:.1g}",
        verdict, "the order depends on the velocity limits, which the text does not give and which are not the same quantity",
    )  # fmt: skip


def _clamp(table: dict) -> Claim:
    """PSO's error over the velocity limit alone."""
    rows = {r["name"]: r for r in table["readings"]}
    told = []
    for limit in (math.inf, 0.5, 0.2, 0.1, 0.05, 0.02):
        row = rows.get(str(Reading("pso", velocity_limit=limit, place="anywhere")))
        if row:
            told.append(("none" if math.isinf(limit) else f"{limit:g}", row["com"]))
    span = ", ".join(f"{limit}: {com:.2g} %" for limit, com in told) or "not run"
    errors = [com for _, com in told]
    moved = max(errors) / min(errors) if errors else 1.0
    return Claim(
        "the gap between PSO and QPSO is one of the algorithms",
        f"PSO as stated (w 0.99, c 2.5 and 1.5), centres of mass, by velocity limit in box widths: {span}",
        "means of all seeds; nothing else changed",
        FAILS if moved >= PUBLISHED_GAP else OPEN,
        f"the velocity limit alone moves PSO by a factor of {moved:.2g}, the published gap is a factor of "
        f"{PUBLISHED_GAP:.2g}",
    )


def _fitness(table: dict) -> Claim:
    """Mean final fitness of 1.02 and 2.09, and what errors go with it."""
    near = table["nearest_in_fitness"]
    moments = [PUBLISHED[f][k] for f in ("pso", "qpso") for k in ("fitness", "fitness_sd")]
    welch = stats.ttest_ind_from_stats(moments[0], moments[1], 30, moments[2], moments[3], 30, equal_var=False)
    said = "; ".join(
        f"{f.upper()} {near[f]['fitness']:.2g} ± {near[f]['fitness_sd']:.2g} with errors of {near[f]['com']:.2g} and "
        f"{near[f]['inertia']:.2g} %"
        for f in ("pso", "qpso")
    )
    return Claim(
        "mean final fitness 2.09 (PSO) and 1.02 (QPSO), standard deviations 0.901 and 0.923, with those errors",
        f"nearest to the fitness alone: {said}",
        f"the quoted moments differ (Welch p = {welch.pvalue:.1g}); but a squared error 6.8 times as small cannot go with "
        "half the fitness: a ratio of 0.02 is due, 0.49 is stated",
        FAILS, "no reading of equation 20 gives these fitnesses and these errors together",
    )  # fmt: skip


def _plateau(sets: dict) -> Claim:
    """Where the curves flatten."""
    own = {name: np.array([identify.plateau(np.array(c)) for c in run["curves"]]) for name, run in sets["runs"].items()}
    test = difference(own["PSO"], own["QPSO"])
    slower = test["p_value"] < SURE and test["difference"] > 0
    return Claim(
        "PSO plateaus after about 27 iterations, QPSO later and lower",
        f"medians of the nearest pair: PSO {np.median(own['PSO']):.0f}, QPSO {np.median(own['QPSO']):.0f} iterations to "
        "99 % of the fall",
        said_test(test, " iterations"),
        HOLDS if slower else FAILS,
        "a tighter velocity limit is slower and ends lower; so does PSO with that limit",
    )


def _spread(sets: dict) -> Claim:
    """Whether QPSO's final scores are closer together."""
    fitness = {name: np.array(run["fitness"]) for name, run in sets["runs"].items()}
    relative = {name: f.std(ddof=1) / f.mean() for name, f in fitness.items()}
    p = float(stats.levene(*[np.log(f) for f in fitness.values()], center="median").pvalue)
    tighter = relative["QPSO"] < relative["PSO"]
    return Claim(
        "QPSO is the more stable one: narrower box plot, though its standard deviation is larger",
        f"standard deviation over mean: PSO {relative['PSO']:.2f}, QPSO {relative['QPSO']:.2f}",
        f"Brown-Forsythe on the logarithms p = {p:.2g}",
        OPEN if p > SURE else HOLDS if tighter else FAILS,
        "relative to its mean the spread is what can be compared; the stated figures, 0.43 and 0.90 of the mean, have QPSO "
        "as the less stable one",
    )


def _products(table: dict, sets: dict) -> Claim:
    """Whether products of inertia are found as well as moments."""
    names, reference = np.array(sets["names"]), np.array(sets["reference"])
    off = np.array([n[:3] in ("Ixy", "Ixz", "Iyz") for n in names]) & np.array(sets["searched"])
    diagonal = np.array([n[:3] in ("Ixx", "Iyy", "Izz") for n in names])
    error = 100.0 * np.abs(np.array(sets["sets"]["QPSO"])[:, off | diagonal] / reference[off | diagonal] - 1.0)
    kinds = off[off | diagonal]
    test = difference(error[:, kinds].mean(axis=1), error[:, ~kinds].mean(axis=1))
    si = [r["inertia"] for r in table["readings"] if r["name"].startswith("qpso,") and ", si," in r["name"]]
    units = f"; in SI units, as printed, the median reading misses the inertias by {np.median(si):.2g} %" if si else ""
    return Claim(
        "QPSO is more sensitive particularly in the off-diagonal terms",
        f"QPSO's mean error of products {error[:, kinds].mean():.2g} %, of moments {error[:, ~kinds].mean():.2g} %{units}",
        f"products against moments: {said_test(test, ' %')}",
        READS if test["p_value"] > SURE else HOLDS if test["difference"] > 0 else FAILS,
        "only a normalised objective weighs a product of 0.001 kg m² like a moment of 0.5; the text states none",
    )  # fmt: skip


def _feasible(table: dict) -> Claim:
    """Whether what the swarms end with are possible bodies."""
    own = [r for r in table["readings"] if r["name"].split(",")[0] in PUBLISHED]
    broken = [r for r in own if r["consistent"] < 1.0]
    pair = min(row["consistent"] for row in table["nearest_pair"].values())
    return Claim(
        "the penalty on bounds guides the search to physically consistent solutions",
        f"in {len(broken)} of {len(own)} readings of PSO and QPSO some seeds end at a body that no distribution of mass has; "
        f"in the nearest pair {100 * pair:.0f} % of the sets are possible",
        "pseudo-inertia of every link positive definite",
        READS if broken and pair == 1.0 else FAILS if broken else HOLDS,
        "bounds on single numbers do not make an inertia tensor possible; near enough to the reference all are",
    )


def _needed(table: dict) -> Claim:
    """What a swarm buys on equation 20."""
    linear, best = table["baselines"][0], table["best_swarm"]
    return Claim(
        "the landscape is highly complex, and a swarm is needed to search it",
        f"one linear solve: error {max(linear['com'], linear['inertia']):.1g} %; best swarm of all readings "
        f"{max(best['com'], best['inertia']):.1g} %",
        f"exact, from any start; a swarm evaluates the objective {PARTICLES} times an iteration",
        FAILS, "equation 20 is a squared distance to known values: a bowl without data, whose bottom is the reference",
    )  # fmt: skip


def control_claims(control: dict, shown: str) -> list[Claim]:
    """Table 4 and figures 14 to 17: every statement in the reading shown, and in how many readings it holds."""
    found = []
    for k, row in enumerate(control["claims"][shown]):
        verdicts = [told[k]["holds"] for told in control["claims"].values()]
        yes, opposite = verdicts.count("yes"), verdicts.count("no, the opposite")
        known = row.get("interval")
        interval = f", difference within [{known[0]:.2g}, {known[1]:.2g}]" if known else ""
        test = "all of them compared" if row["p"] is None else f"p = {row['p']:.1g}, effect {row['effect']:.2f}{interval}"
        verdict = HOLDS if yes == len(verdicts) else READS if yes else FAILS if opposite else LEVEL
        count, level = len(verdicts), len(verdicts) - yes - opposite
        why = f"holds in {yes}, is opposite in {opposite}, shows no difference in {level} of {count} readings"
        found.append(Claim(row["statement"], row["ours"], test, verdict, why))
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
    plain = next(c for c in cases if c["case"]["hidden"] == "1 x 50" and not c["case"]["refined"])
    best = min(cases, key=lambda c: c["validation"])
    reached = [c for c in cases if c["validation"] <= 0.61]
    return Claim(
        "the network learns the kinematics to 0.48 mm in training, 0.61 mm in validation",
        f"one hidden layer of 50, gradient descent as told: {plain['training']:.2g} and {plain['validation']:.2g} mm; "
        f"best of all, *{best['name']}*: {best['training']:.2g} and {best['validation']:.2g} mm",
        f"{len(reached)} of {len(cases)} readings of the forward task stay within 0.61 mm",
        READS if reached else FAILS,
        "it validates lengths that are known to a hundredth of that; nothing dynamic is in it",
    )


def _penalised(network: dict) -> Claim:
    """Runs of several seeds with each form and weight, against those without; all warmed up, so that none gets stuck."""
    runs: dict[tuple, list[dict]] = {}
    for row in network["cases"]:
        if row["case"]["region"] == "branch" and row["case"]["warm_up"]:
            runs.setdefault((row["case"]["penalty"], row["case"]["weight"]), []).append(row)
    of = lambda rows, key: np.array([row["bins"][-1][key] for row in rows])  # noqa: E731
    plain = runs.pop(("none", 0.0))
    tests = {key: difference(of(rows, "chosen_p95"), of(plain, "chosen_p95")) for key, rows in runs.items()}
    sure = {key: t for key, t in tests.items() if t["p_value"] < SURE and t["difference"] > 0.0}
    strongest = max(tests, key=lambda key: tests[key]["difference"])
    with_it = runs[strongest]
    middle = lambda rows, key: float(np.median(of(rows, key)))  # noqa: E731
    return Claim(
        "a penalty on the condition number keeps the network away from singular poses",
        f"asked for poses above {plain[0]['bins'][-1]['from']:g}, the network without penalty stays at "
        f"{middle(plain, 'chosen_p95'):.3g} (95th percentile; median of {len(plain)} seeds), with {strongest[0]} penalty "
        f"{strongest[1]:g} m at {middle(with_it, 'chosen_p95'):.3g}, and misses them by {middle(with_it, 'error'):.2g} instead of "
        f"{middle(plain, 'error'):.2g} mm; joint speed {middle(with_it, 'speed_p95'):.3g} instead of "
        f"{middle(plain, 'speed_p95'):.3g} rad/m, by the exact inverse {middle(plain, 'asked_speed_p95'):.3g}",
        f"{said_test(tests[strongest])}; {len(sure)} of {len(tests)} forms and weights surely lower",
        HOLDS if len(sure) == len(tests) else READS if sure else LEVEL,
        "a smooth network rounds a singularity off by itself; the penalty adds to that and is paid for in accuracy",
    )


def beyond_claims(torque: dict, tracking: dict) -> list[Claim]:
    """What the study leaves to future research: data instead of known answers."""
    by = {row["name"]: row for row in torque["rows"]}
    swarms = [r for r in torque["rows"] if "PSO" in r["name"]]
    best = min(swarms, key=lambda r: r["held_out_median"])
    prior = by["Levenberg-Marquardt, box as prior"]
    seen, truth = tracking["seen"], tracking["truth"]
    rows = [r for r in tracking["rows"] if r["algorithm"]]
    tracked = [r for r in rows if r["objective"] == "tracking"]
    cheaper = [r for r in rows if r["objective"] in truth and r["objective"] != "tracking"]
    below = [r for r in cheaper if r["measures"][r["objective"]] < truth[r["objective"]]]
    found = [
        Claim(
            "swarms identify the parameters (with torque instead of known answers)",
            f"held-out torque error, median of the runs: best swarm {best['held_out_median']:.2g} N m in {best['run_s']:.2g} s, Levenberg-Marquardt "
            f"that is told the same box {prior['held_out_median']:.2g} N m in {prior['run_s']:.2g} s; parameters off by "
            f"{min(r['inertia'] for r in swarms):.0f} % or more of the inertias all the same",
            f"noise {torque['bounds']['noise']:.2g} N m, middle of the box {torque['bounds']['middle of the box']:.2g} N m",
            FAILS, "torque shows base parameters only; what predicts well need not be the parameters",
        ),
        Claim(
            "tracking performance can take the place of known answers (future research)",
            f"tracking alone leaves the centres of mass off by {min(r['com'] for r in tracked):.0f} %, the inertias by "
            f"{min(r['inertia'] for r in tracked):.0f} %, and predicts unseen torque to "
            f"{min(r['torque_rmse'] for r in tracked):.2g} N m",
            f"the loop shows {seen['tracking']['rank']} combinations of {len(seen['names'])} unknowns",
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
    return found
