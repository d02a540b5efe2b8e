"""Effects that these recordings can neither name nor rule out."""

from collections.abc import Sequence
from typing import NamedTuple

from scipy import special

from irb140_jax.effects import At, Effect
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.result import Finding
from irb140_jax.mismatch.selection.averages import probabilities
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.testable import is_part_of


class OpenEffect(NamedTuple):
    """An effect of which the recordings leave open whether it is there.

    Attributes:
        effect: The effect.
        joints: Names of its joints.
        probability: That it is there.
    """

    effect: Effect
    joints: tuple[str, ...]
    probability: float


def open_effects(ex: Explanation, found: Sequence[Finding]) -> list[OpenEffect]:
    """What is less probable than a name and not substantially improbable, most probable first.

    Not what stands among the alternatives of a finding, nor what is a finding, a part of one or the whole of it.

    Args:
        ex: The explanation.
        found: The findings.
    """
    names, members = ex.lib.robot.joint_names, ex.members
    told = {(a.effect, j) for f in found for a in f.alternatives for j in f.joints}
    told |= {(f.effect, j) for f in found for j in f.joints}
    every, out = ex.averaged_over, []
    by_site = {(c.slug, c.joints): c for c in every}
    least = special.expit(-settings.SUBSTANTIAL)
    for site, p in probabilities(every, ex.averaged).items():
        c = by_site[site]
        joints = tuple(names[j] for j in c.joints)
        if c.is_inertials or not least < p < settings.NAMED or any((c.slug, j) in told for j in joints):
            continue
        # Which channels are out of step is judged apart, with rivals of its own.
        timed = c.effect.place.at is At.LOG_TIMING and ex.late
        if not timed and not any(is_part_of(c, m) or is_part_of(m, c) for m in members):
            out.append(OpenEffect(c.effect, joints, p))
    return sorted(out, key=lambda x: -x.probability)


def open_notes(open_: Sequence[OpenEffect]) -> list[str]:
    """A note on each, with the motion that would decide."""
    return [
        f"These recordings leave open whether there is also {o.effect.title} on {', '.join(o.joints)} (probability "
        f"{o.probability:.2f}). To decide it takes {o.effect.needs}."
        for o in open_
    ]
