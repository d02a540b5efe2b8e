"""Finer grids about the shapes that were found, and where on them the best shape is."""

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate, Library, reshaped
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.regression.proposals import left_over, suggested
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.explanation import Explanation


def refined(ex: Explanation, whole: Library, found: dict[Site, np.ndarray]) -> tuple[Library, tuple[int, ...]]:
    """The whole library with finer grids around the best shapes, and grids that the residual suggests; and the set.

    Args:
        ex: The explanation.
        whole: The library.
        found: Shapes of what was found, taken where they follow from amplitudes.
    """
    left = left_over(ex.data, ex.columns(), ex.noise.total)
    shapes, best = [], {i: ex.data.candidates[i].shape for i in ex.chosen}
    for effect, sites, old, _ in whole.blocks:
        new = old.copy()
        for s, joints in enumerate(sites):
            mine = [i for i in best if (ex.data.candidates[i].slug, ex.data.candidates[i].joints)
                    == (effect.slug, tuple(joints))]  # fmt: skip
            if mine and effect.shapes.finer:
                best[mine[0]], peak = _peak(ex, mine[0])
                if effect.shapes.follows:
                    peak = found[site_of(ex.data.candidates[mine[0]])]
                new[s] = effect.shapes.finer(old[s], peak)
            elif effect.shapes.proposal and not mine:
                new[s] = suggested(effect, left, ex.scales, joints, old[s])
        shapes.append(new)
    lib = reshaped(whole, shapes)
    return lib, tuple(nearest_shape(ex.data.candidates[i], shape, lib) for i, shape in best.items())


def is_coarse(ex: Explanation, left: Noise) -> bool:
    """Whether finer shapes may still leave less at some joint: the noise left there is not yet what it was thought.

    Shapes that follow from amplitudes have no finer grid.

    Args:
        ex: The explanation.
        left: Noise that it leaves.
    """
    shaped = [j for m in ex.members if m.effect.shapes.finer and not m.effect.shapes.follows for j in m.joints]
    was, now = (np.sqrt(np.mean(noise.total**2, axis=0)) for noise in (ex.noise, left))
    return bool(np.any(np.abs(np.log(now / was))[shaped] > settings.SETTLED_NOISE))


def nearest_shape(c: Candidate, shape: np.ndarray, lib: Library) -> int:
    """The candidate of a library nearest to a shape of one of another; loose inertials come after all effects."""
    if c.is_inertials:
        return len(lib.candidates) + c.joints[0]
    site = (c.slug, c.joints, c.variant)
    alike = [i for i, o in enumerate(lib.candidates) if (o.slug, o.joints, o.variant) == site]
    return min(alike, key=lambda i: float(np.sum(np.abs(lib.candidates[i].shape - shape))))


def _peak(ex: Explanation, index: int) -> tuple[np.ndarray, np.ndarray]:
    """The best point of a member's grid, and where the grid is at its best to a fraction of its steps."""
    mine = ex.data.candidates[index]
    grid, odds = _grid_of(ex, index)
    best = grid[np.argmax(odds)] if np.isfinite(odds).any() else mine.shape
    return best, mine.effect.shapes.peak(grid, best, odds)


def _grid_of(ex: Explanation, index: int) -> tuple[np.ndarray, np.ndarray]:
    """A member's grid, shape (points, shape parameters), and log odds of its points beside the other members."""
    candidates, mine = ex.data.candidates, ex.data.candidates[index]
    site = (mine.slug, mine.joints, mine.variant)
    same = [i for i, c in enumerate(candidates) if (c.slug, c.joints, c.variant) == site]
    return np.array([candidates[i].shape for i in same]), ex.gains(ex.others(index), same)
