"""The study's statements on identification by swarms beside what we found; see study_claims.py."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false
# ruff: noqa: E501  sentences read better whole

import math

import numpy as np
import pandas as pd
from study_claims import FAILS, HOLDS, LEVEL, OPEN, READS, Claim, by_share, percent
from study_readings import PARTICLES, PUBLISHED, Reading
from study_statistics import said
from table3_report import pairs_of_readings, shares_of_pairs

NEAR = 1.25  # factor within which a figure counts as the published one
PUBLISHED_GAP = PUBLISHED["pso"]["com"] / PUBLISHED["qpso"]["com"]


def swarm_claims(table: dict, told: pd.DataFrame, sets: dict, time: dict | None, is_studys: bool) -> list[Claim]:
    """Table 3 and figures 6 to 9; what the text states as a figure is of its own arm."""
    own = table | {"tests": {row["name"]: row for row in table["tests"]}}
    figures = [_reached(own, told, "qpso"), _reached(own, told, "pso"), _literal(own), _fitness(own), _normalised(own)]
    found = [
        *(figures if is_studys else []), _better(own, told), _clamp(told), _lower_fitness(own, told), _plateau(own, told), _spread(told), _outliers(own, told), _products(told, sets), _feasible(own, told),
        _needed(own),
    ]  # fmt: skip
    return [claim for claim in found if claim] + ([_time(time)] if time else [])


def _reached(table: dict, told: pd.DataFrame, family: str) -> Claim:
    """Whether the published errors are reached, and how exactly."""
    wanted, near = PUBLISHED[family], table["nearest"][family]
    own = told[told["algorithm"] == family]
    averaged = f"; the averaged set of its seeds {near['averaged_com']:.2g} % and {near['averaged_inertia']:.2g} %"
    errors = own[["com", "inertia"]].to_numpy() / [wanted["com"], wanted["inertia"]]
    below = (errors <= 1.0).all(axis=1).mean()
    within = int((np.abs(np.log(np.maximum(errors, 1e-12))) < math.log(NEAR)).all(axis=1).sum())
    return Claim(
        f"{family.upper()}: MAPE {wanted['com']} % of the centres of mass, {wanted['inertia']} % of the inertias",
        f"nearest reading {near['com']:.3g} % and {near['inertia']:.3g} %: *{near['name']}*" + averaged,
        f"both reached or bettered in {percent(below)} of {len(own)} readings, both met to a factor of {NEAR:g} in {within}; all readings "
        f"span {own['com'].min():.2g} to {own['com'].max():.2g} % of the centres of mass",
        by_share(below), "the text leaves box, velocity limit and units open, and the error goes wherever these put it",
        share=below,
    )  # fmt: skip


def _literal(table: dict) -> Claim | None:
    """What the text's own numbers give, with nothing added."""
    pso, qpso = table["literal"]["pso"], table["literal"]["qpso"]
    if not pso["readings"] or not qpso["readings"]:
        return None
    span = lambda row: f"{row['com'][0]:.2g} to {row['com'][1]:.2g} %"  # noqa: E731
    return Claim(
        "with w = 0.99, c = 2.5 and 1.5, 120 particles and 150 iterations these errors follow",
        f"text read literally, without a velocity limit, in a box of 50 %: PSO {span(pso)}, QPSO {span(qpso)} of the centres of mass",
        f"means of all seeds in {pso['readings']} and {qpso['readings']} readings (walls, where the reference lies in its box, start speed, perturbation)",
        FAILS, "w = 0.99 with c1 + c2 = 4 is far outside the stable range: the swarms do not settle",
    )  # fmt: skip


def _better(table: dict, told: pd.DataFrame) -> Claim:
    """Whether QPSO beats PSO: in the nearest pair, over all pairs, and with either's open choices at their best."""
    over, statement = table["over_pairs"]["com"], "QPSO finds better parameters than PSO"
    if not over["pairs"]:
        why = "an error relative to zero is not defined"
        return Claim(statement, "all centres of mass of this arm are zero", "", OPEN, why)
    row, own = table["tests"]["fitness: QPSO lower than PSO"], table["tests"]["com: QPSO lower than PSO"]
    in_pair = {"first": "yes", "second": "no", "neither": "no difference"}[own["lower"]]
    least = told[told["box"] == 0].assign(error=lambda r: r["com"] + r["inertia"])
    problems = ["inertia_weight", "units", "width", "place", "penalty"]
    best = least.groupby([*problems, "algorithm"])["error"].min().unstack("algorithm")[["pso", "qpso"]].dropna()
    won = int((best["qpso"] < best["pso"]).sum())
    return Claim(
        statement,
        f"lower error of the centres of mass in {percent(over['lower'])} of {over['pairs']} pairs of readings; with each algorithm's "
        f"own open choices at their best, in {won} of {len(best)} problems; in the nearest pair, {in_pair}",
        f"the nearest pair's final fitness: {said(row)}",
        by_share(over["lower"]), "the order depends on the velocity limits, which the text does not give and which are not the same quantity",
        share=over["lower"],
    )  # fmt: skip


def _clamp(told: pd.DataFrame) -> Claim:
    """PSO's error over the velocity limit alone."""
    found = _by_limit(told, "com")
    span = ", ".join(f"{limit}: {com:.2g} %" for limit, com in found) or "not run"
    errors = [com for _, com in found]
    moved = max(errors) / min(errors) if errors else 1.0
    return Claim(
        "the gap between PSO and QPSO is one of the algorithms",
        f"PSO as stated (w 0.99, c 2.5 and 1.5), centres of mass, by velocity limit in box widths: {span}",
        "means of all seeds; nothing else changed",
        FAILS if moved >= PUBLISHED_GAP else OPEN,
        f"the velocity limit alone moves PSO by a factor of {moved:.2g}, the published gap is a factor of "
        f"{PUBLISHED_GAP:.2g}",
    )


def _by_limit(told: pd.DataFrame, column: str) -> list[tuple[str, float]]:
    """PSO as stated, from no velocity limit to the tightest: limit and what is asked for."""
    rows, found = told.set_index("reading")[column], []
    for limit in (math.inf, 0.5, 0.2, 0.1, 0.05, 0.02):
        name = str(Reading("pso", velocity_limit=limit, place="anywhere"))
        if name in rows and math.isfinite(rows[name]):
            found.append(("none" if math.isinf(limit) else f"{limit:g}", float(rows[name])))
    return found


def _fitness(table: dict) -> Claim:
    """Mean final fitness of 1.02 and 2.09, and what errors go with it."""
    near = table["nearest_in_fitness"]
    told = "; ".join(
        f"{f.upper()} {near[f]['fitness']:.2g} ± {near[f]['fitness_sd']:.2g} with errors of {near[f]['com']:.2g} and "
        f"{near[f]['inertia']:.2g} %"
        for f in ("pso", "qpso")
    )
    return Claim(
        "mean final fitness 2.09 (PSO) and 1.02 (QPSO), standard deviations 0.901 and 0.923, with those errors",
        f"nearest to the fitness alone: {told}",
        "a squared error 6.8 times as small cannot go with half the fitness: a ratio of 0.02 is due, 0.49 is stated",
        FAILS, "no reading of equation 20 gives these fitnesses and these errors together",
    )  # fmt: skip


def _normalised(table: dict) -> Claim:
    """Figure 9's scores are called normalised: what any normalisation leaves as it is."""
    near = table["nearest_normalised"]
    pso, qpso = near["pso"], near["qpso"]
    return Claim(
        "the final scores of Figure 9 are normalised",
        f"a common factor leaves their ratio (0.49) and each spread over its mean (0.43, 0.90) as they are; nearest to these "
        f"three: {qpso['fitness'] / pso['fitness']:.2g}, {pso['fitness_sd'] / pso['fitness']:.2g}, "
        f"{qpso['fitness_sd'] / qpso['fitness']:.2g} with errors of {pso['com']:.2g} (PSO, *{pso['name']}*) and {qpso['com']:.2g} % (QPSO, *{qpso['name']}*)",
        "scores between 0 and 1 have no mean of 2.09, standard scores no two positive means, multiples of the best no mean of "
        "1.02 with a deviation of 0.92: only a common factor is left",
        FAILS, "whatever the factor, the stated ratio of scores and the stated ratio of errors exclude each other",
    )  # fmt: skip


def _lower_fitness(table: dict, told: pd.DataFrame) -> Claim:
    """51 % lower."""
    pair, over = table["nearest_pair"], table["over_pairs"]["fitness"]
    ratio, stated = pair["qpso"]["fitness"] / pair["pso"]["fitness"], PUBLISHED["qpso"]["fitness"] / PUBLISHED["pso"]["fitness"]
    about, _ = shares_of_pairs(told, lambda pso, qpso: np.abs(np.log(qpso["fitness"] / pso["fitness"] / stated)) < math.log(NEAR))
    change = f"{100 * (1 - ratio):.0f} % lower" if ratio < 1.0 else f"{ratio:.2g} times as high"
    return Claim(
        "QPSO's mean final fitness is about 51 % lower than PSO's",
        f"a ratio of {stated:.2g}, to a factor of {NEAR:g}, in {percent(about)} of {over['pairs']} pairs of readings, lower at all in "
        f"{percent(over['lower'])}; in the nearest pair {change}",
        said(table["tests"]["fitness: QPSO lower than PSO"]),
        by_share(about), "51 % is the ratio of the stated means; the size follows from the two velocity limits", share=about,
    )  # fmt: skip


def _plateau(table: dict, told: pd.DataFrame) -> Claim:
    """Where the curves flatten."""
    pair, over = table["nearest_pair"], table["over_pairs"]["plateau"]
    stated = PUBLISHED["pso"]["plateau"]
    near = np.abs(np.log(np.maximum(told.loc[told["algorithm"] == "pso", "plateau"], 1.0) / stated)) < math.log(NEAR)
    own = [iterations for _, iterations in _by_limit(told, "plateau")]
    moved = f"the velocity limit alone moves PSO's own plateau between {min(own):.0f} and {max(own):.0f} iterations" if own else ""
    return Claim(
        "PSO plateaus after about 27 iterations, QPSO later",
        f"QPSO later in {percent(over['higher'])}, earlier in {percent(over['lower'])} of {over['pairs']} pairs of readings; medians of the "
        f"nearest pair: PSO {pair['pso']['plateau']:.0f}, QPSO {pair['qpso']['plateau']:.0f} iterations to 99 % of the fall; PSO's within a factor of {NEAR:g} of {stated} in {percent(float(near.mean()))} of its readings",
        f"the nearest pair: {said(table['tests']['plateau: PSO earlier than QPSO'])}",
        by_share(over["higher"]), moved or "the order depends on the velocity limits", share=over["higher"],
    )  # fmt: skip


def _spread(told: pd.DataFrame) -> Claim:
    """Whether QPSO's final scores are closer together."""
    over = pairs_of_readings(told.assign(relative=told["fitness_sd"] / told["fitness"]), "relative")
    narrower, count = shares_of_pairs(told, lambda pso, qpso: qpso["fitness_iqr"] < pso["fitness_iqr"])
    both, _ = shares_of_pairs(
        told, lambda pso, qpso: (qpso["fitness_iqr"] < pso["fitness_iqr"]) & (qpso["fitness_sd"] > pso["fitness_sd"])
    )
    return Claim(
        "QPSO is the more stable one: narrower box plot, though its standard deviation is larger",
        f"narrower box in {percent(narrower)} of {count} pairs of readings, together with a larger standard deviation in {percent(both)}; "
        f"standard deviation over mean smaller than PSO's in {percent(over['lower'])}",
        "counted, not tested",
        by_share(both), "the stated figures, 0.43 and 0.90 of the mean, have QPSO as the less stable one", share=both,
    )  # fmt: skip


def _outliers(table: dict, told: pd.DataFrame) -> Claim:
    """Points beyond the whiskers of Figure 9."""
    usual = told.groupby("algorithm")["outliers"].median()
    over, pair = table["over_pairs"]["outliers"], table["nearest_pair"]
    return Claim(
        "QPSO has fewer outliers among its final scores",
        f"fewer in {percent(over['lower'])}, more in {percent(over['higher'])} of {over['pairs']} pairs of readings; in the nearest pair "
        f"{pair['qpso']['outliers']:.0f} against {pair['pso']['outliers']:.0f}",
        "beyond 1.5 interquartile ranges; counted, not tested",
        by_share(over["lower"]), f"such points are few in any case: median of the readings {usual['pso']:g} of PSO's runs, {usual['qpso']:g} of QPSO's", share=over["lower"],
    )  # fmt: skip


def _time(time: dict) -> Claim:
    """Time of an iteration."""
    rows = {row["name"]: row["per_iteration_ms"] for row in time["rows"]}
    pso, qpso = (np.array(rows[name]) for name in ("PSO", "QPSO"))
    return Claim(
        "QPSO takes less time per iteration than PSO",
        f"QPSO {np.median(qpso):.3g} ms [{qpso.min():.3g}, {qpso.max():.3g}], PSO {np.median(pso):.3g} ms "
        f"[{pso.min():.3g}, {pso.max():.3g}] of processor time for an iteration of 30 swarms",
        f"{len(pso)} repetitions of each, taking turns; median [lowest, highest]",
        HOLDS if qpso.max() < pso.min() else FAILS,
        "an angle's sine comes on top of the same update; the two figures of the text are lost",
    )  # fmt: skip


def _products(told: pd.DataFrame, sets: dict) -> Claim | None:
    """Whether products of inertia are found as well as moments."""
    names, reference = np.array(sets["names"]), np.array(sets["reference"])
    sought = np.array(sets["searched"])
    off = np.array([n[:3] in ("Ixy", "Ixz", "Iyz") for n in names]) & sought
    diagonal = np.array([n[:3] in ("Ixx", "Iyy", "Izz") for n in names]) & sought
    if not off.any():
        return Claim(
            "QPSO is more sensitive particularly in the off-diagonal terms", "this arm's products of inertia are all zero", "",
            OPEN, "an error relative to zero is not defined; none was sought",
        )  # fmt: skip
    miss = lambda which: 100.0 * np.abs(np.array(sets["sets"]["QPSO"])[:, which] / reference[which] - 1.0).mean(axis=1)  # noqa: E731
    products, moments = miss(off), miss(diagonal)
    apart = products.mean() - moments.mean()
    unsure = 2.0 * math.hypot(*(x.std(ddof=1) / math.sqrt(len(x)) for x in (products, moments)))
    si = told[(told["algorithm"] == "qpso") & (told["units"] == "si")]["inertia"]
    units = f"; in SI units, as printed, the median reading misses the inertias by {si.median():.2g} %" if len(si) else ""
    return Claim(
        "QPSO is more sensitive particularly in the off-diagonal terms",
        f"QPSO's mean error of products {products.mean():.2g} %, of moments {moments.mean():.2g} %{units}",
        f"{len(products)} seeds of the nearest pair: {apart:.2g} ± {unsure:.1g} % apart (twice the standard error); not tested",
        LEVEL if abs(apart) <= unsure else FAILS if apart > 0.0 else READS,
        "only a normalised objective weighs a small product like a moment; the text states none",
    )  # fmt: skip


def _feasible(table: dict, told: pd.DataFrame) -> Claim:
    """Whether what the swarms end with are possible bodies."""
    own = told[told["algorithm"].isin(list(PUBLISHED))]
    whole = float((own["possible"] == 1.0).mean())
    pair = min(row["possible"] for row in table["nearest_pair"].values())
    without = own[own["penalty"] == "none"]
    none = f"; without any penalty in {int((without['possible'] == 1.0).sum())} of {len(without)}" if len(without) else ""
    return Claim(
        "the penalty on bounds guides the search to physically consistent solutions",
        f"all seeds end at possible bodies in {percent(whole)} of {len(own)} readings of PSO and QPSO; in the nearest pair "
        f"{100 * pair:.0f} % of the sets are possible{none}",
        "pseudo-inertia of every link positive definite",
        by_share(whole), "bounds on single numbers do not make an inertia tensor possible; near enough to the reference all are", share=whole,
    )  # fmt: skip


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
