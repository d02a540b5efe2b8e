"""From an explanation to findings: parameters with intervals, evidence, and alternatives."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.effects.base import separating_motion
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.output.certain import certain
from irb140_jax.mismatch.result import Alternative, Estimate, Evidence, Finding
from irb140_jax.mismatch.selection.explanation import Explanation, parts
from irb140_jax.mismatch.selection.torque_scale import scale_log_odds
from irb140_jax.mismatch.validation.held_out import held_out_gains
from irb140_jax.mismatch.validation.intervals import parameters_of, physical_of
from irb140_jax.mismatch.validation.unexplained import Structure
from irb140_jax.robot import Robot


def findings(
    robot: Robot, ex: Explanation, in_motion: Mapping[int, np.ndarray], rest: Sequence[Structure] = ()
) -> list[Finding]:
    """The findings, strongest first.

    Args:
        robot: The nominal model.
        ex: The explanation.
        in_motion: Amplitudes that were fitted to the motion, by candidate.  By how much they differ from those of the
            torque is added to the standard deviations: two views of one law.
        rest: Structure that no effect explains.
    """
    unexplained = np.zeros(robot.n)
    for s in rest:
        unexplained[s.joint] = max(unexplained[s.joint], s.rms)
    post = ex.posterior()
    w = post.mean * ex.data.scale[post.columns]
    cov = post.cov * np.outer(ex.data.scale[post.columns], ex.data.scale[post.columns])
    out, gains = [], held_out_gains(ex)
    for index, rows in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
        c = ex.data.candidates[index]
        if c.is_inertials:
            continue
        own, spread = w[rows], cov[rows, rows]
        values = parameters_of(robot, ex, index, own, spread, unexplained)
        if index in in_motion:
            own = in_motion[index]
            values = _in_motion(c, values, own)
            spread = spread + np.outer(own - w[rows], own - w[rows])
        joints = tuple(robot.joint_names[j] for j in c.joints)
        numbers, units = {k: v.value or 0.0 for k, v in values.items()}, {k: v.unit for k, v in values.items()}
        odds, gain = ex.log_odds(index), gains[index]
        out.append((odds, Finding(
            c.slug, joints, c.effect.sentence(", ".join(joints), numbers, units), values,
            Evidence(odds, ex.probability(index), gain),
            certain(robot, ex, index, own, spread, gain), _alternatives(ex, index),
        )))  # fmt: skip
    return [finding for _, finding in sorted(out, key=lambda one: -one[0])]


def _in_motion(c: Candidate, of_torque: Mapping[str, Estimate], w: np.ndarray) -> dict[str, Estimate]:
    """Parameters by amplitudes that were fitted to the motion, shape (k,), beside those of the torque."""
    now = dict(zip((p.name for p in c.effect.law.parameters), physical_of(c, w).tolist(), strict=True))
    return {
        name: dataclasses.replace(p, value=now[name], std=float(np.hypot(p.std or 0.0, now[name] - (p.value or 0.0))))
        for name, p in of_torque.items()
    }


def torque_scale_finding(robot: Robot, ex: Explanation, weighed: bool) -> list[Finding]:
    """The torque of all joints logged too large or too small by one factor, where that is probable.

    Args:
        robot: The nominal model.
        ex: The explanation.
        weighed: Whether the tool carried a known payload in some recordings.
    """
    if not ex.scaled:
        return []
    index = len(ex.data.candidates)
    odds, probability = scale_log_odds(ex.space, ex.chosen, ex.hyper), ex.probability(index)
    w, std = ex.torque_scale()
    gain, spread, way = 1.0 / (1.0 + w), std / (1.0 + w) ** 2, "large" if w > 0 else "small"
    by_what = "by what the known payload adds to it" if weighed else (
        "for the stated masses; only a known payload can tell wrong torque constants from masses that are all wrong by "
        "one factor")
    return [Finding(
        "torque_gain", robot.joint_names,
        f"all joints: in proportion to the rigid-body torque; the real torque is {gain:.3g} times the logged one",
        {"gain": Estimate(gain, spread, "1")},
        # Without it refitted inertials explain the same torque, so it removes no error on unseen data.
        Evidence(odds, probability, 0.0),
        f"The logged torque of all joints is {100 * abs(w):.3g} +- {100 * std:.2g} % too {way} {by_what}.",
        _alternatives(ex, index),
    )]  # fmt: skip


def _alternatives(ex: Explanation, index: int) -> tuple[Alternative, ...]:
    """Effects that may be true in a finding's place, and what to record; a part of its law is no alternative to it."""
    c, effects = ex.averaged_over[index], ex.lib.effects
    best: dict[str, float] = {}
    for (slug, _), p in ex.rivals(index).items():
        if slug in effects and slug != c.slug and p > settings.LISTED_PROBABILITY:
            best[slug] = max(best.get(slug, 0.0), p)
    parts = {slug: p for slug, p in best.items() if slug in c.effect.law.contains}
    others = {slug: p for slug, p in best.items() if slug not in parts}
    alone = {slug: p for slug, p in parts.items() if settings.NAMED * p > sum(others.values())}
    stays = [effects[slug] for slug in parts if slug not in alone]
    return tuple(
        Alternative(slug, p, _separation(c.effect, effects[slug], [e for e in stays if e.slug != slug]))
        for slug, p in sorted((others | alone).items(), key=lambda item: -item[1])
    )


def _separation(one: Effect, other: Effect, stays: list[Effect]) -> str:
    motion = separating_motion(one, other) or f"{one.needs}; and, for {other.title}, {other.needs}"
    both = " and ".join(s.title for s in stays)
    present = f" ({both} {'is' if len(stays) == 1 else 'are'} there in either case)" if stays else ""
    return f"Record {motion}{present}."
