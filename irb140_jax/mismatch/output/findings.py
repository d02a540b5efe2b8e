"""From an explanation to findings: parameters with intervals, evidence, alternatives, and what can't be tested."""

from typing import Any

import numpy as np
from scipy import special

from irb140_jax.effects import Effect
from irb140_jax.effects.base import separating_motion
from irb140_jax.mismatch.output.certain import certain
from irb140_jax.mismatch.selection.explanation import Explanation, parts
from irb140_jax.mismatch.selection.selected import NAMED
from irb140_jax.mismatch.selection.space import RARE
from irb140_jax.mismatch.validation.held_out import held_out_gains
from irb140_jax.mismatch.validation.intervals import parameters_of
from irb140_jax.robot import Robot

LEAST_PROBABILITY = 0.02  # of an alternative that is listed


def findings(robot: Robot, ex: Explanation) -> list[dict[str, Any]]:
    """The contract's findings, strongest first."""
    post = ex.posterior()
    w = post.mean * ex.data.scale[post.columns]
    cov = post.cov * np.outer(ex.data.scale[post.columns], ex.data.scale[post.columns])
    out, gains = [], held_out_gains(ex)
    for index, rows in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
        c = ex.data.candidates[index]
        if c.is_inertials:
            continue
        values = parameters_of(robot, ex, index, w[rows], cov[rows, rows])
        names = ", ".join(robot.joint_names[j] for j in c.joints)
        units = {k: v["unit"] for k, v in values.items()}
        out.append({
            "effect": c.slug,
            "joints": [robot.joint_names[j] for j in c.joints],
            "where": c.effect.sentence(names, {k: v["value"] for k, v in values.items()}, units),
            "parameters": values,
            "evidence": {
                "log_odds": _log_odds(ex, index),
                "probability": ex.probability(index),
                "heldout_gain": gains[index],
            },
            "certain": certain(robot, ex, index, w[rows], cov[rows, rows], gains[index]),
            "alternatives": _alternatives(ex, index),
        })  # fmt: skip
    return sorted(out, key=lambda f: -f["evidence"]["log_odds"])


def torque_scale_odds(ex: Explanation) -> tuple[float, float]:
    """Log odds that one scale of all torques is off, and its probability.

    A nuisance parameter with a stated prior; the prior odds are those of any rare effect.
    """
    odds = ex.space.torque_scale_odds(ex.chosen, ex.settings) + np.log(RARE)
    return float(odds), float(special.expit(odds))


def torque_scale_finding(robot: Robot, ex: Explanation) -> list[dict[str, Any]]:
    """The torque of all joints logged too large or too small by one factor, where that is probable."""
    odds, probability = torque_scale_odds(ex)
    if not ex.scaled:
        return []
    w, std = ex.torque_scale()
    gain, spread, way = 1.0 / (1.0 + w), std / (1.0 + w) ** 2, "large" if w > 0 else "small"
    return [{
        "effect": "torque_gain",
        "joints": list(robot.joint_names),
        "where": (
            f"all joints: in proportion to the rigid-body torque; the real torque is {gain:.3g} times the logged one"
        ),
        "parameters": {"gain": {"value": gain, "std": spread, "unit": "1"}},
        # Without it refitted inertials explain the same torque, so it removes no error on unseen data.
        "evidence": {"log_odds": odds, "probability": probability, "heldout_gain": 0.0},
        "certain": (
            f"The logged torque of all joints is {100 * abs(w):.3g} +- {100 * std:.2g} % too {way} for the stated "
            "masses; only a known payload can tell wrong torque constants from masses that are all wrong by one factor."
        ),
        "alternatives": [],
    }]  # fmt: skip


def _log_odds(ex: Explanation, index: int) -> float:
    """Log posterior odds of a finding against the set without it; of friction also against ordinary friction."""
    c, rest = ex.data.candidates[index], ex.others(index)
    options = [rest]
    if c.effect.place.is_friction and not c.effect.prior.ordinary:
        taken = {(m.slug, m.joints) for m in ex.members}
        usual = [i for i, o in enumerate(ex.data.candidates) if o.effect.prior.ordinary and o.joints == c.joints]
        options.append((*rest, *(i for i in usual if (ex.data.candidates[i].slug, c.joints) not in taken)))
    joints = list(c.joints)
    return ex.log_posterior(ex.chosen, joints) - max(ex.log_posterior(o, joints) for o in options)


def _alternatives(ex: Explanation, index: int) -> list[dict[str, Any]]:
    """Effects that may be true in a finding's place, and what to record; a part of its law is no alternative to it."""
    c, effects = ex.data.candidates[index], ex.lib.effects
    best: dict[str, float] = {}
    for (slug, _), p in ex.rivals(index).items():
        if slug in effects and slug != c.slug and p > LEAST_PROBABILITY:
            best[slug] = max(best.get(slug, 0.0), p)
    parts = {slug: p for slug, p in best.items() if slug in c.effect.law.contains}
    others = {slug: p for slug, p in best.items() if slug not in parts}
    alone = {slug: p for slug, p in parts.items() if NAMED * p > sum(others.values())}
    stays = [effects[slug] for slug in parts if slug not in alone]
    return [
        {
            "effect": slug, "probability": p,
            "separate_by": _separation(c.effect, effects[slug], [e for e in stays if e.slug != slug]),
        }
        for slug, p in sorted((others | alone).items(), key=lambda item: -item[1])
    ]  # fmt: skip


def _separation(one: Effect, other: Effect, stays: list[Effect]) -> str:
    motion = separating_motion(one, other) or f"{one.needs}; and, for {other.title}, {other.needs}"
    both = " and ".join(s.title for s in stays)
    present = f" ({both} {'is' if len(stays) == 1 else 'are'} there in either case)" if stays else ""
    return f"Record {motion}{present}."


def ranking(robot: Robot, ex: Explanation, most: int = 25) -> list[dict[str, Any]]:
    """Candidates by evidence, each alone and given the explanation, for the report."""
    rows = []
    chosen = {(ex.data.candidates[c].slug, ex.data.candidates[c].joints) for c in ex.chosen}
    # Alone: over nothing but the inertials, with noise and discrepancy of the final model.
    chi = ex.gains((), range(len(ex.data.candidates))) - ex.space.log_prior - ex.space.kinds.one_more(())
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
