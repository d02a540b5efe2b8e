"""The space that a search visits: priors and bounds of every candidate, beside the Gram matrices."""

from collections.abc import Sequence

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.gram import JointGram
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.evidence import Space
from irb140_jax.mismatch.selection.kinds import kinds_of


def space_of(
    joints: tuple[JointGram, ...], data: Data, common: int, lib: Library, first: Library, *, delays: int = 0,
    settled: bool = True,
) -> Space:  # fmt: skip
    """Gram matrices of every joint, with the prior probability and the bounds of every candidate.

    Args:
        joints: Gram matrices of every joint.
        data: Low-passed rows and candidates.
        common: Number of nuisance parameters that all joints share.
        lib: The library.
        first: The library before its shapes were refined: what was to be expected of them.
        delays: How many of those nuisances, the last ones, are delays of one joint each.
        settled: Whether the grids of shapes have been refined.
    """
    candidates = data.candidates
    width = max(len(c.columns) for c in candidates)
    lowest, highest = np.full((2, len(candidates), width), -np.inf)
    highest[:] = np.inf
    weights, least = np.zeros((len(candidates), width)), np.full(len(candidates), -np.inf)
    by_site = _by_site(candidates)
    for i, c in enumerate(candidates):
        s, k = data.scale[data.nuisances + c.columns], len(c.columns)
        unit = np.where(s > 0.0, s, 1.0)
        # What moves nothing here can't be found, nor can what is there only if all of it is more than nothing.
        unseen = (s == 0.0) & (c.lowest == 0.0) | (s == 0.0).all() | _throughout(data, c)
        low, high = c.lowest, c.highest
        if settled:
            low = np.where(np.isin(c.variant, c.effect.law.own), np.maximum(low, c.effect.shapes.settled), low)
        # Beyond these bounds an amplitude belongs to another shape of the grid; one shape alone follows the amplitude.
        if c.effect.prior.at_shape and (s > 0.0).all() and _differ(by_site[site_of(c)]):
            at_least, at_most = c.effect.prior.at_shape(c.shape)
            low = np.maximum(low, at_least[list(c.variant)])
            high = np.minimum(high, at_most[list(c.variant)])
        lowest[i, :k], highest[i, :k] = np.where(unseen, np.inf, low / unit), high / unit
        if c.effect.prior.adds_up:
            weights[i, :k], least[i] = s, c.lowest[0]
    return Space(
        joints, candidates, data.nuisances, data.nuisances + common, len(data.scale) + common,
        log_prior(data, lib, first), kinds_of(candidates, settings.RARE), lowest, highest, weights, least,
        np.zeros((2, len(candidates))), np.zeros(common), delays,
    )  # fmt: skip


def log_prior(data: Data, lib: Library, first: Library) -> np.ndarray:
    """Log prior odds of every candidate, shape (candidates,): of its shape, and of ordinary friction at a joint."""
    by_site = _by_site(data.candidates)
    narrowed = {
        (new[0].slug, tuple(map(int, joints))): _narrowed(new[2][s], old[2][s])
        for new, old in zip(lib.blocks, first.blocks, strict=True)
        for s, joints in enumerate(new[1])
    }

    def rare(c: Candidate) -> float:
        alike, prior = by_site[site_of(c)], -np.log(c.effect.shapes.scanned)
        if c.effect.shapes.follows and (at_shape := c.effect.prior.at_shape):
            # No parameter of its own: those that some amplitude may have share its prior, half either side of zero.
            tried = np.unique([o.shape for o in alike], axis=0)
            least, most = np.array([at_shape(shape) for shape in tried])[:, :, 0].T
            middle = np.mean(at_shape(c.shape))
            return float(prior - np.log(2.0 * np.sum((least <= middle) & (middle < most))))
        return float(prior - np.log(len(alike))) + narrowed.get(site_of(c), 0.0)

    usual = np.log(settings.COMMON / (1.0 - settings.COMMON))
    return np.array([usual if c.effect.prior.ordinary else rare(c) for c in data.candidates])


def _by_site(candidates: Sequence[Candidate]) -> dict[Site, list[Candidate]]:
    out: dict[Site, list[Candidate]] = {}
    for c in candidates:
        out.setdefault(site_of(c), []).append(c)
    return out


def _differ(candidates: Sequence[Candidate]) -> bool:
    """Whether candidates have more than one shape."""
    return any(not np.array_equal(c.shape, candidates[0].shape) for c in candidates)


def _narrowed(grid: np.ndarray, first: np.ndarray) -> float:
    """Log of the share of the first grid's extent that a refined one covers: its prior volume.

    Extents are ratios where a parameter is positive, and differences otherwise.
    """
    out = 0.0
    for new, old in zip(grid.T, first.T, strict=True):
        if np.all(first > 0.0) and np.all(new > 0.0):
            new, old = np.log(new), np.log(old)
        if np.ptp(old) > 0.0 and np.ptp(new) > 0.0:
            out += min(float(np.log(np.ptp(new) / np.ptp(old))), 0.0)
    return out


def _throughout(data: Data, c: Candidate) -> bool:
    """Whether what should happen once neither begins nor ends while it is recorded."""
    if c.effect.shapes.during is None:
        return False
    recording, begins, ends = c.effect.shapes.during(c.shape)
    seen = [s.t[np.any(s.use, axis=1)] - s.begin for s in data.stretches if s.recording == recording]
    t = np.concatenate([*seen, np.zeros(0)])
    return len(t) == 0 or (begins < t[0] + settings.EVENT_MARGIN and ends > t[-1] - settings.EVENT_MARGIN)
