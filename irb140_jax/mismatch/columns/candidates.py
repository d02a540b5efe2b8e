"""Every candidate explanation, and where its columns stand.

A *candidate* is an effect at a site with a shape.  Its columns stand beside the rigid-body regressor; one pass over the
data forms the Gram matrix of each stretch of each joint, and from then on no search touches the data again.
"""

import dataclasses
from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np

from irb140_jax.effects import Effect, Scales
from irb140_jax.mismatch.columns.loose_inertials import LOOSE_INERTIALS
from irb140_jax.robot import Robot


@dataclasses.dataclass(frozen=True)
class Candidate:
    """An effect at a site with a shape, and where its amplitudes stand among all columns.

    Attributes:
        effect: The effect.
        joints: Indices of the joints of the site.
        shape: Shape parameters, shape (s,).
        columns: Indices of the amplitudes used, among all amplitudes of the library.
        variant: Which of the effect's columns those are.
        lowest, highest: Admissible range of each.
    """

    effect: Effect
    joints: tuple[int, ...]
    shape: np.ndarray
    columns: np.ndarray
    variant: tuple[int, ...]
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def slug(self) -> str:
        """The effect's name in the vocabulary."""
        return self.effect.slug

    @property
    def is_inertials(self) -> bool:
        """Whether it is no left-out physics but a link whose inertials are wrong: never reported as a finding."""
        return self.effect is LOOSE_INERTIALS


@dataclasses.dataclass(frozen=True)
class Library:
    """All candidates for a robot, and the layout of their columns.

    Attributes:
        robot: The nominal robot.
        candidates: What may be left out.
        blocks: (effect, sites (S, m), shapes (S, G, s), first column) of each effect, in the order of the columns.
        size: Number of amplitudes.
    """

    robot: Robot
    candidates: tuple[Candidate, ...]
    blocks: tuple[tuple[Effect, np.ndarray, np.ndarray, int], ...]
    size: int

    @property
    def effects(self) -> dict[str, Effect]:
        """The effects by slug."""
        return {effect.slug: effect for effect, *_ in self.blocks}

    @cached_property
    def entries(self) -> tuple[np.ndarray, np.ndarray]:
        """Joint and amplitude of every column that isn't zero throughout, in the order in which they are evaluated."""
        joints, amplitudes = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
        for effect, sites, shapes, first in self.blocks:
            rows = np.tile(np.arange(self.robot.n), (len(sites), 1)) if effect.place.everywhere else sites
            width = effect.law.width
            S, G, m = len(sites), shapes.shape[1], rows.shape[1]
            amplitude = first + np.arange(S * G * width).reshape(S, G, 1, width)
            joints.append(np.broadcast_to(rows[:, None, :, None], (S, G, m, width)).ravel())
            amplitudes.append(np.broadcast_to(amplitude, (S, G, m, width)).ravel())
        return np.concatenate(joints), np.concatenate(amplitudes)

    @cached_property
    def in_log(self) -> np.ndarray:
        """Which of these columns are of laws of the log."""
        laws = np.zeros(self.size, dtype=bool)
        for effect, _, _, first in self.blocks:
            laws[first:] = effect.place.at.in_log
        return laws[self.entries[1]]

    def spread(self, entries: np.ndarray, out: np.ndarray) -> None:
        """Write the non-zero columns, (T, entries), into zeros by joint and amplitude, (T, n, size)."""
        joints, amplitudes = self.entries
        out[:, joints, amplitudes] = entries

    def torque(self, entries: np.ndarray, columns: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Torque (T, n) of some amplitudes, from the non-zero columns (T, entries)."""
        joints, amplitudes = self.entries
        weight = np.zeros(self.size)
        weight[columns] = w
        used = np.flatnonzero(np.isin(amplitudes, columns))
        out = np.zeros((len(entries), self.robot.n))
        for e in used:
            out[:, joints[e]] += weight[amplitudes[e]] * entries[:, e]
        return out


def library(robot: Robot, effects: Sequence[Effect], scales: Scales, *, scan: bool = False) -> Library:
    """Lay out the candidates of all effects at all sites, with their grids or, to `scan`, with the shapes of a scan."""
    blocks, candidates, first = [], [], 0
    for effect in effects:
        sites = effect.place.sites(robot)
        if len(sites) == 0:
            continue
        grid = effect.shapes.scan if scan and effect.shapes.scan else effect.shapes.grid
        shapes = np.stack([grid(scales, joints) for joints in sites])
        width = effect.law.width
        blocks.append((effect, sites, shapes, first))
        for s, joints in enumerate(sites):
            low, high = effect.bounds(robot, joints)
            for g in range(shapes.shape[1]):
                base = first + (s * shapes.shape[1] + g) * width
                for variant in effect.law.variants:
                    v = np.array(variant)
                    candidates.append(
                        Candidate(effect, tuple(map(int, joints)), shapes[s, g], base + v, variant, low[v], high[v])
                    )
        first += len(sites) * shapes.shape[1] * width
    return Library(robot, tuple(candidates), tuple(blocks), first)


def of_kinds(lib: Library, slugs: Collection[str]) -> Library:
    """The library of some of its effects, in all their shapes.

    Each effect is a program of its own, so nothing is compiled anew.
    """
    blocks, moved, first = [], {}, 0
    for effect, sites, shapes, old in lib.blocks:
        if effect.slug in slugs:
            blocks.append((effect, sites, shapes, first))
            moved[effect.slug] = first - old
            first += len(sites) * shapes.shape[1] * effect.law.width
    left = (c for c in lib.candidates if c.slug in moved)
    candidates = tuple(dataclasses.replace(c, columns=c.columns + moved[c.slug]) for c in left)
    return Library(lib.robot, candidates, tuple(blocks), first)


def reshaped(lib: Library, shapes: Sequence[np.ndarray]) -> Library:
    """The library with other shapes, (S, G, s) for each block; only values change, so nothing is compiled anew."""
    blocks = tuple((*old[:2], new, old[3]) for old, new in zip(lib.blocks, shapes, strict=True))
    candidates = []
    for c in lib.candidates:
        effect, sites, new, first = next(b for b in blocks if b[0] is c.effect)
        site = next(i for i, joints in enumerate(sites) if tuple(joints) == c.joints)
        width = effect.law.width
        position = (int(c.columns[0]) - c.variant[0] - first) // width - site * new.shape[1]
        candidates.append(dataclasses.replace(c, shape=new[site, position]))
    return dataclasses.replace(lib, candidates=tuple(candidates), blocks=blocks)
