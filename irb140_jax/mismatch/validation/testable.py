"""What these recordings could have shown and what not: every effect, at a strength that matters on a lively motion.

Along a slow motion hardly anything is large, so a share of the torque there says nothing: 6 % of it would be a rotor as
heavy as the arm.  Strengths are therefore those of a lively motion of the same robot within its limits.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from scipy import ndimage

from irb140_jax.effects import Effect, Scales
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import columns_along, prepared, unbounded, without
from irb140_jax.mismatch.columns.candidates import Library
from irb140_jax.mismatch.regression.gaussian import eliminated
from irb140_jax.mismatch.result import Finding, NotTestable
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.excite import Excitation, fourier_motion, within
from irb140_jax.robot import Robot


class AtSite(Protocol):
    """An effect at a site: a candidate, or what is kept of one."""

    @property
    def effect(self) -> Effect: ...  # noqa: D102

    @property
    def joints(self) -> tuple[int, ...]: ...  # noqa: D102


Site = tuple[str, tuple[int, ...]]
Seen = dict[Site, tuple[float, int]]  # standard deviations by which an effect stands out, and its candidate


class Reference(NamedTuple):
    """What matters on the lively motion.

    Attributes:
        amplitudes: Of every column of the library, that is `REFERENCE_SHARE` of a joint's torque; zero for columns that
            are zero there, too; shape (lib.size,).
        torque: RMS of the nominal model's torque [N m or N], shape (n,).
    """

    amplitudes: np.ndarray
    torque: np.ndarray

    def in_prior_units(self, columns: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Amplitudes of some columns over their prior scale; zero for what these recordings hardly excite at all."""
        amplitudes = self.amplitudes[columns]
        excited = scale > 1e-9 * np.abs(amplitudes)
        return np.divide(amplitudes, scale, out=np.zeros(len(scale)), where=excited)


def reference(lib: Library, scales: Scales, rate: float) -> Reference:
    """Drive the nominal model along the lively motion.

    Args:
        lib: The library.
        scales: Sizes of the recordings, for robots without limits.
        rate: Of the samples [1/s].
    """
    robot = within(lib.robot, scales.low, scales.high)
    motion = played(fourier_motion(robot, rate=rate, **settings.LIVELY), scales.rest_speed)
    along = prepared(lib.robot, motion)
    effects = columns_along(lib, along)
    effects = without(lib.entries[1], effects, unbounded(lib.entries[1], effects))
    torque, amplitudes = np.sqrt(np.mean(along.nominal**2, axis=0)), np.zeros(lib.size)
    for effect, sites, shapes, first in lib.blocks:
        width = effect.law.width
        if effect.place.of_servos:
            # No servo drives the lively motion; what such a law takes off is what its shape says.
            amplitudes[first : first + len(sites) * shapes.shape[1] * width] = 1.0
            continue
        own = np.arange(width)[list(effect.law.own)]
        bounds = [effect.bounds(lib.robot, joints)[1] for joints in sites]
        together = [(own, effect.prior.proportion or [1.0] * len(own))]
        together += [([k], [1.0]) for k in range(width) if k not in own]
        for k in range(len(sites) * shapes.shape[1]):
            # Of the joints it acts on: all of them, for effects that act everywhere.
            joints = slice(None) if effect.place.everywhere else sites[k // shapes.shape[1]]
            for part, likely in together:
                columns = first + k * width + np.asarray(part)
                power = np.mean(lib.torque(effects, columns, np.asarray(likely)) ** 2, axis=0).sum()
                if power > 0.0:
                    amplitudes[columns] = np.asarray(likely) * settings.REFERENCE_SHARE * np.linalg.norm(torque[joints])
                    amplitudes[columns] /= np.sqrt(power)
                    most = bounds[k // shapes.shape[1]][part]
                    amplitudes[columns] *= np.min(np.minimum(most / np.maximum(amplitudes[columns], 1e-300), 1.0))
    return Reference(amplitudes, torque)


def played(motion: Excitation, rest_speed: np.ndarray) -> Conditioned:
    """A motion as if it were recorded, without torque; near rest, where sign(qd) is rounded off, nothing is usable.

    Laws that agree but for that rounding would seem to differ there.
    """
    rounded = np.abs(motion.qd) < settings.REST_ROUNDED * rest_speed
    around = 2 * int(np.ceil(settings.LEAK / (motion.t[1] - motion.t[0]))) + 1
    usable = ~ndimage.maximum_filter1d(rounded.astype(np.uint8), around, axis=0).astype(bool)
    direction, torque = np.tanh(motion.qd / rest_speed), np.zeros_like(motion.q)
    moving = (motion.name, motion.t, motion.q, motion.qd, motion.qdd, torque, usable, usable)
    return Conditioned(*moving, rest_speed, np.zeros_like(rest_speed), direction, np.zeros_like(motion.q), ())


def visibility(ex: Explanation, matters: Reference) -> Seen:
    """Of every effect at every site: how far it would stand out of the noise, and its candidate.

    Not of those that are named or part of a named one.

    Args:
        ex: The explanation; inertials and named effects are free.
        matters: From `reference`.

    Returns:
        Standard deviations and index of the candidate that stands out most.
    """
    H = ex.near(ex.chosen, np.arange(len(ex.data.scale) - ex.data.nuisances))
    seen: Seen = {}
    for i, c in enumerate(ex.data.candidates):
        if c.is_inertials or any(is_part_of(c, m) for m in ex.members):
            continue
        if c.effect.shapes.proposal and not matters.amplitudes[c.columns].any():
            continue  # a wall or a push at no place or time in particular
        scale = ex.data.scale[ex.data.nuisances + c.columns]
        strength = matters.in_prior_units(c.columns, scale)
        z = stands_out(H, c, c.columns, strength, ex.members)
        if z >= seen.get((c.slug, c.joints), (-1.0, 0))[0]:
            seen[c.slug, c.joints] = z, i
    return seen


def stands_out(
    H: np.ndarray, candidate: AtSite, columns: np.ndarray, strength: np.ndarray, members: Sequence[AtSite]
) -> float:
    """Standard deviations by which an effect stands out, in what it has beyond its special case.

    Args:
        H: Gram matrix with inertials and named effects eliminated.
        candidate: The effect at a site.
        columns: Its columns in H.
        strength: Amplitude of each in prior units.
        members: The named effects.
    """
    effect = candidate.effect
    own = np.arange(len(columns))[list(effect.law.own)]
    simple = set(effect.law.contains)
    # A named law at the site that is or has the special case is eliminated already.
    there = any(m.joints == candidate.joints and simple & {m.effect.slug, *m.effect.law.contains} for m in members)
    special = np.zeros(0, dtype=int) if there or not simple else np.delete(np.arange(len(columns)), own)
    left, _ = eliminated(H[np.ix_(columns, columns)], special)
    size = strength[own] @ left[np.ix_(own, own)] @ strength[own]
    return float(np.sqrt(max(size, 0.0)))


def is_part_of(one: AtSite, member: AtSite) -> bool:
    """Whether an effect is a named one or a part of it."""
    a, b = one.effect, member.effect
    return one.joints == member.joints and (a.slug == b.slug or a.slug in b.law.contains)


def shows_no_friction(seen: Seen, effects: Mapping[str, Effect]) -> bool:
    """Whether ordinary friction was searched for and would show on no joint: then nothing found says nothing."""
    ordinary = [z for (slug, _), (z, _) in seen.items() if effects[slug].prior.ordinary]
    return bool(ordinary) and max(ordinary) < settings.VISIBLE


def not_testable(
    robot: Robot, found: Sequence[Finding], seen: Seen, effects: Iterable[Effect]
) -> tuple[NotTestable, ...]:
    """Effects that this motion could not have shown, with the joints where that is so.

    Not those that are named, nor at a joint those that may stand in the place of what is named there.
    """
    needs = {effect.slug: effect.needs for effect in effects}
    told, blind = {(f.effect, j) for f in found for j in robot.joint_names}, dict[str, set[int]]()
    told |= {(a.effect, j) for f in found for a in f.alternatives for j in f.joints}
    for (slug, joints), (z, _) in seen.items():
        if z < settings.VISIBLE and not any((slug, robot.joint_names[j]) in told for j in joints):
            blind.setdefault(slug, set()).update(joints)
    return tuple(
        NotTestable(slug, tuple(robot.joint_names[j] for j in sorted(joints)), f"Needs {needs[slug]}.")
        for slug, joints in sorted(blind.items())
    )
