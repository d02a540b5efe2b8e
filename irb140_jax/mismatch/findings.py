"""From an explanation to findings: parameters with intervals, evidence, alternatives, and what can't be tested."""

from typing import Any

import numpy as np
from scipy import stats

from irb140_jax.effects import AbstractEffect
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.candidates import Candidate
from irb140_jax.mismatch.certain import certain
from irb140_jax.mismatch.explanation import Explanation, estimate, full_posterior, parts
from irb140_jax.mismatch.intervals import others, parameters_of
from irb140_jax.mismatch.name import PREFER
from irb140_jax.mismatch.problem import best_of_groups
from irb140_jax.mismatch.prove import held_out_gain, jackknife_factor
from irb140_jax.mismatch.regression.nuisances import GAIN_COMMON
from irb140_jax.mismatch.silent import SILENT
from irb140_jax.robot import Robot

Key = tuple[str, tuple[int, ...]]  # an effect and its joints

CERTAIN = 0.99  # probability that the torque scale is off by more than the inertials may be
WORTH_SAYING = 0.02  # alternatives less probable than this stay unsaid


def findings(robot: Robot, ex: Explanation) -> list[dict[str, Any]]:
    """The contract's findings, strongest first."""
    post = estimate(ex)
    widen = np.ones(len(post.mean)) if ex.selected else jackknife_factor(ex)
    plain = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)
    w = post.mean * ex.data.scale[post.columns]
    cov = post.cov * np.outer(widen, widen) * np.outer(ex.data.scale[post.columns], ex.data.scale[post.columns])
    out = []
    for index, rows in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
        c = ex.data.candidates[index]
        if c.effect.silent:
            continue
        spread = float(np.max(widen[rows]))
        if ex.selected:  # shapes are judged by Gram matrices without discrepancy: they are as much too narrow
            spread = float(np.max(np.sqrt(np.diag(post.cov)[rows] / np.diag(plain.cov)[rows]), initial=1.0))
        values = parameters_of(robot, ex, index, w[rows], cov[rows, rows], spread)
        names = ", ".join(robot.joint_names[j] for j in c.joints)
        units = {k: v["unit"] for k, v in values.items()}
        out.append({
            "effect": c.slug,
            "joints": [robot.joint_names[j] for j in c.joints],
            "where": c.effect.where(names, {k: v["value"] for k, v in values.items()}, units),
            "parameters": values,
            "evidence": {
                "log_odds": ex.problem.odds(others(ex, index), (index,)),
                "probability": _probability(ex, index),
                "heldout_gain": held_out_gain(ex, index)[0],
            },
            "certain": certain(robot, ex, index, w[rows], cov[rows, rows]),
            "alternatives": _alternatives(robot, ex, index),
        })  # fmt: skip
    return sorted(out, key=lambda f: -f["evidence"]["log_odds"])


def torque_scale_finding(robot: Robot, ex: Explanation) -> list[dict[str, Any]]:
    """The torque of all joints logged too large or too small by one factor, where that is beyond what inertials may be.

    A nuisance parameter with a stated prior, until its posterior says that it differs from one by more than the stated
    uncertainty of the inertials.  Its odds are by Savage and Dickey's ratio of densities.
    """
    if ex.selected is None or ex.data.nuisances == 0:
        return []
    w, std = ex.selected.torque_scale()
    least = float(ex.data.scale[0])
    beyond = float(stats.norm.sf((least - w) / std) + stats.norm.cdf((-least - w) / std))
    if beyond < CERTAIN:
        return []
    odds = stats.norm.logpdf(0.0, 0.0, GAIN_COMMON) - stats.norm.logpdf(0.0, w, std)
    gain, spread, way = 1.0 / (1.0 + w), std / (1.0 + w) ** 2, "large" if w > 0 else "small"
    return [{
        "effect": "torque_gain",
        "joints": list(robot.joint_names),
        "where": f"all joints: in proportion to the whole torque; the real torque is {gain:.3g} x the logged",
        "parameters": {"gain": {"value": gain, "std": spread, "unit": "1"}},
        # Without it the inertials stand in for it, as wrong as that takes: on unseen data it is worth nothing.
        "evidence": {"log_odds": float(odds), "probability": beyond, "heldout_gain": 0.0},
        "certain": (
            f"The torque of all joints is logged {100 * abs(w):.3g} +- {100 * std:.2g} % too {way} for the stated "
            "masses; only a known payload tells wrong torque constants from masses all wrong alike."
        ),
        "alternatives": [],
    }]  # fmt: skip


def _rivals(ex: Explanation, index: int) -> tuple[dict[Key, float], dict[Key, str]]:
    """Log odds of every effect that could stand in a finding's place, and of none (slug "").

    Beside them the special case of the named law that stays where an effect takes the place of the rest only.
    """
    c = ex.data.candidates[index]
    rest = others(ex, index)
    taken = {(ex.data.candidates[i].slug, ex.data.candidates[i].joints) for i in rest}
    best = {
        key: value
        for key, value in best_of_groups(ex.problem, rest).items()
        if set(key[1]) & set(c.joints) and key[0] not in SILENT and key not in taken
    }
    own, joints = best[c.slug, c.joints][0], list(c.joints)
    # Of what acts on several joints no more is feigned at one of them than comes from there.
    there = max(own, 0.0) * ex.problem.parts(rest)[joints, index] if len(joints) > 1 else np.inf
    mine = (c.slug, c.joints)
    odds = {key: _fair(ex, index, CATALOGUE[key[0]], value, own, there) for key, value in best.items() if key != mine}
    odds[mine] = own
    stays: dict[Key, str] = {}
    for key, (value, special) in _pairs(ex, rest, c).items():
        if value > odds.get(key, -np.inf):
            odds[key], stays[key] = value, special
    # What the search preferred by its own rules is at least as probable as what it did not take.  Rivals keep their
    # odds against each other: were each held down to the finding's, all would share alike, the hopeless ones too.
    above = max(max(odds.values()) - own, 0.0)
    odds = {key: value if key == mine else value - above for key, value in odds.items()}
    odds["", ()] = 0.0
    return odds, stays


def _fair(
    ex: Explanation, index: int, rival: AbstractEffect, best: tuple[float, int], own: float, most: float | np.ndarray
) -> float:
    """Log odds of a rival in a finding's place, what imperfect laws could feign of the difference left out of account.

    Args:
        ex: The explanation.
        index: The finding.
        rival: The effect in its place.
        best: The rival's log odds, and the candidate that has them.
        own: The finding's.
        most: Log odds that can be feigned at each of its joints.
    """
    c, value, excess = ex.data.candidates[index], best[0], best[0] - own

    def feigned(chosen: tuple[int, ...]) -> float:
        """What imperfect laws of a set could feign of the odds of the rival, or of those against it."""
        if not rival.feigned:
            return 0.0
        explained = ex.problem.explained(chosen, friction=rival.friction)[list(c.joints)]
        return float(np.sum(np.minimum(rival.feigned**2 * explained, most)))

    if rival.slug in c.effect.contains:
        return value  # a special case has already lost by more than what an imperfect law could feign
    if c.slug in rival.contains:
        # A law that contains the named one was not needed; even odds where the search would have taken it.  Below, as
        # much of its handicap counts as imperfect laws have a part in the hurdle: on clean data, the evidence.
        guard = feigned(ex.chosen)
        hurdle = guard + PREFER
        return own + min(excess, 0.0) - PREFER * guard / hurdle * (1.0 - max(excess, 0.0) / hurdle)
    # Within what imperfect laws could feign, a rival is nearly as good as the named law: of the laws that there would
    # be in its place.  A torque constant that the inertials absorb but for a hundredth explains far more than what
    # tells it from others.  Log odds count in that unit: one of it is what a law needs to be preferred.
    if not np.isfinite(value) or excess >= 0.0:
        return value
    return own + excess * PREFER / max(feigned((*others(ex, index), best[1])), PREFER)


def _pairs(ex: Explanation, rest: tuple[int, ...], c: Candidate) -> dict[Key, tuple[float, str]]:
    """Log odds of a special case of the named law with one more effect, and which case, under the effect's name."""
    odds: dict[Key, tuple[float, str]] = {}
    for i, special in enumerate(ex.data.candidates):
        if special.slug not in c.effect.contains or special.joints != c.joints:
            continue
        base = ex.problem.odds(rest, (i,))
        for (slug, joints), (value, _) in best_of_groups(ex.problem, (*rest, i)).items():
            known = slug in SILENT or slug in c.effect.contains or slug == c.slug
            if joints == c.joints and not known and special.slug not in CATALOGUE[slug].contains:
                odds[slug, joints] = max(odds.get((slug, joints), (-np.inf, "")), (base + value, special.slug))
    return odds


def _shares(odds: dict) -> dict:
    top = max(odds.values())
    weight = {k: float(np.exp(v - top)) for k, v in odds.items()}
    return {k: v / sum(weight.values()) for k, v in weight.items()}


def _probability(ex: Explanation, index: int) -> float:
    c = ex.data.candidates[index]
    if ex.selected:
        return ex.selected.probability[c.slug, c.joints]
    return _shares(_rivals(ex, index)[0])[c.slug, c.joints]


def _alternatives(robot: Robot, ex: Explanation, index: int) -> list[dict[str, Any]]:
    c = ex.data.candidates[index]
    best: dict[str, tuple[float, str]] = {}
    stays: dict[Key, str] = {}
    if ex.selected:
        shares = {k: p for k, p in ex.selected.rivals(index).items() if k[0] not in SILENT}
    else:
        odds, stays = _rivals(ex, index)
        shares = _shares(odds)
    for key, p in shares.items():
        slug = key[0]
        if slug and slug != c.slug and p > WORTH_SAYING:
            best[slug] = max(best.get(slug, (0.0, "")), (p, stays.get(key, "")))
    return [
        {"effect": slug, "probability": p, "separate_by": _separation(c.effect, CATALOGUE[slug], stay)}
        for slug, (p, stay) in sorted(best.items(), key=lambda item: -item[1][0])
    ]


def _separation(one: AbstractEffect, other: AbstractEffect, stays: str) -> str:
    motion = one.confused_with.get(other.slug) or other.confused_with.get(one.slug)
    motion = motion or f"{one.needs}; and, for {other.title}, {other.needs}"
    return f"Record {motion}" + (f" ({CATALOGUE[stays].title} is there in either case)." if stays else ".")


def ranking(robot: Robot, ex: Explanation, most: int = 25) -> list[dict[str, Any]]:
    """Candidates by evidence, each alone and given the explanation, for the report."""
    rows = []
    chosen = {(ex.data.candidates[c].slug, ex.data.candidates[c].joints) for c in ex.chosen}
    # Alone: over nothing but the inertials, with the noise of the final model.
    chi = ex.problem.scores(()) - ex.problem.log_prior
    best: dict[tuple[str, tuple[int, ...]], float] = {}
    for c, gain in zip(ex.data.candidates, chi, strict=True):
        best[c.slug, c.joints] = max(best.get((c.slug, c.joints), -np.inf), float(gain))
    possible = [(key, gain) for key, gain in best.items() if np.isfinite(gain)]
    for (slug, joints), gain in sorted(possible, key=lambda item: -item[1])[:most]:
        rows.append({
            "effect": slug, "joints": [robot.joint_names[j] for j in joints], "delta_bic": 2.0 * gain,
            "probability": 1.0 if (slug, joints) in chosen else 0.0, "chosen": (slug, joints) in chosen,
            "stage": "alone",
        })  # fmt: skip
    return rows
