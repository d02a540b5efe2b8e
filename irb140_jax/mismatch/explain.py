"""The loop at the heart of a diagnosis: columns, noise, search, and again with finer shapes and the corrected load."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from irb140_jax.effects import AbstractEffect, Scales
from irb140_jax.mismatch.along import Loads, Prepared, columns_along, prepared, scales_of, seen_by
from irb140_jax.mismatch.assemble import BLOCKS, Data, assemble, first_noise, problem
from irb140_jax.mismatch.candidates import Candidate, Library, library, reshaped
from irb140_jax.mismatch.evidence import Grams, Posterior, grams, posterior
from irb140_jax.mismatch.model import Named, better_known, composed
from irb140_jax.mismatch.name import guessed, search
from irb140_jax.mismatch.noise import Noise, noise_from_residuals
from irb140_jax.mismatch.prior import inertial_prior_factor
from irb140_jax.mismatch.problem import Problem
from irb140_jax.mismatch.rows import Stretch, stretch
from irb140_jax.mismatch.scout import left_over, scouted, suggested
from irb140_jax.mismatch.silent import SoftFriction
from irb140_jax.mismatch.tangent import Point, point
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.low_pass import Band
from irb140_jax.robot import Robot

WEIGHTLESS = 0.43  # standard deviations of a payload's mass: with less, the odds that there is any are below two to one
SETTLED = 2  # rounds in which the noise and what leaves it agree
PASSES = 3  # the noise and the load are those of the model found before; three rounds settle both


@dataclasses.dataclass(frozen=True)
class Explanation:
    """What explains the recordings, and everything needed to judge it.

    Attributes:
        lib: The library in its last state: refined shapes.
        scales: Sizes of the recordings.
        data: Low-passed rows.
        noise: Whitening under the explanation.
        noise_of: Indices of the candidates that leave this noise.
        problem: Search problem.
        grams: Gram matrices by block.
        chosen: Indices of the candidates in the explanation.
        factor: Square root of the inertial prior at relative standard deviation 1, shape (10 n, 10 n).
    """

    lib: Library
    scales: Scales
    data: Data
    noise: Noise
    noise_of: tuple[int, ...]
    problem: Problem
    grams: Grams
    chosen: tuple[int, ...]
    factor: np.ndarray

    @property
    def members(self) -> list:
        """The chosen candidates."""
        return [self.data.candidates[c] for c in self.chosen]

    def columns(self, chosen: tuple[int, ...] | None = None) -> np.ndarray:
        """Columns of the full model: inertials, then the amplitudes of the chosen candidates."""
        chosen = self.chosen if chosen is None else chosen
        return np.concatenate([np.arange(self.data.nuisances), self.problem.columns(chosen)])


def explain(
    robot: Robot,
    recordings: Sequence[Conditioned],
    band: Band,
    effects: Sequence[AbstractEffect],
    uncertainty: float,
    progress: Callable[[str], None] = lambda _: None,
) -> Explanation:
    """Search for what the model leaves out.

    Args:
        robot: The nominal model.
        recordings: Conditioned, at least one.
        band: Of the comparison.
        effects: The library.
        uncertainty: Relative standard deviation of the inertials.
        progress: Told what is being done.
    """
    factor, effects = inertial_prior_factor(robot, 1.0), (*effects, SoftFriction())
    progress("rigid body along the recordings")
    along = [prepared(robot, r) for r in recordings]
    scales = scales_of(along)
    lib = scouted(library(robot, effects, scales), along, band, factor, uncertainty, scales)
    loads: list[Loads | None] = [None] * len(recordings)
    at: Point | None = None
    chosen: tuple[int, ...] = ()
    noise: Noise | None = None

    def explained(turn: int, blocks: int) -> Explanation:
        ex = explained_at(at, turn, blocks)
        if at and not at.rests_on <= {(m.slug, m.joints) for m in ex.members}:
            # Under leaning gravity that nothing is named for, inertials can feign the tilt.
            del ex
            return explained_at(None, turn, blocks)
        return ex

    def explained_at(at: Point | None, turn: int, blocks: int) -> Explanation:
        progress(f"columns of {len(lib.candidates)} candidate explanations along the recordings (round {turn})")
        both = zip(along, loads, strict=True)
        rows = [stretch(lib, r, i, band, factor, load, at) for i, (r, load) in enumerate(both)]
        data = assemble(lib, rows, uncertainty)
        progress(f"searching sets of explanations (round {turn})")
        return _settled(lib, scales, data, factor, chosen, noise, blocks, settled=turn > 1)

    for turn in range(1, PASSES):
        ex = explained(turn, blocks=1)
        found = fitted(ex.data, full_posterior(ex.data, ex.problem, ex.grams, ex.chosen), ex.chosen, factor)
        named = _named(found)
        better = better_known(robot, np.asarray(robot.phi) + found[0].reshape(-1, 10), named)
        along, at = [seen_by(better, r) for r in along], point(robot, found[0], named)
        loads = [_loads(lib, found, r, i) for i, r in enumerate(along)]
        (lib, chosen), noise = _refined(ex), ex.noise
        del ex  # hundreds of megabytes, before the next
    ex = _of_some_weight(explained(PASSES, BLOCKS))
    # The last search may have found another set than that whose noise it was weighted by.
    return explained_by(ex, ex.chosen)


def _settled(
    lib: Library, scales: Scales, data: Data, factor: np.ndarray, chosen: tuple[int, ...], noise: Noise | None,
    blocks: int, *, settled: bool,
) -> Explanation:  # fmt: skip
    """Search and noise in turn: noise that the last explanation left may hide an effect that it named wrongly."""
    # The noise of the round before is nearly right; the first is a guess, under which a full search would take minutes
    # where there is much structure without a name.
    rounds = (search,) if noise else (guessed, search)
    noise = noise or first_noise(data)
    for find in rounds:
        prob, g = problem(data, noise, blocks=1, settled=settled)
        chosen = find(prob, chosen)
        noise = _noise_under(data, prob, chosen, noise, rounds=1)
        del prob, g  # hundreds of megabytes, before the next are made
    prob, g = problem(data, noise, blocks, settled=settled)
    return Explanation(lib, scales, data, noise, chosen, prob, g, search(prob, chosen), factor)


def _of_some_weight(ex: Explanation) -> Explanation:
    """The explanation without what should have a mass and has none, and with what is then found: see `WEIGHTLESS`."""
    post, weightless = full_posterior(ex.data, ex.problem, ex.grams, ex.chosen), set()
    for c, part in zip(ex.members, parts(ex.data, ex.chosen), strict=True):
        mass = part.start
        if c.effect.tied and post.mean[mass] < WEIGHTLESS * np.sqrt(post.cov[mass, mass]):
            weightless.add((c.slug, c.joints))
    if not weightless:
        return ex
    none = np.array([(c.slug, c.joints) in weightless for c in ex.data.candidates])
    prob = dataclasses.replace(ex.problem, lowest=np.where(none[:, None], np.inf, ex.problem.lowest))
    return dataclasses.replace(ex, problem=prob, chosen=search(prob, tuple(i for i in ex.chosen if not none[i])))


def explained_by(ex: Explanation, chosen: tuple[int, ...]) -> Explanation:
    """The explanation with a set of candidates, weighted by the noise that these leave.

    Where none of them has a name, nothing makes products with the inertials: what is corrected is the refit.
    """
    data, named = ex.data, any(ex.data.candidates[i].slug != "inertials" for i in chosen)
    if set(chosen) == set(ex.noise_of) and (named or all(s.bare for s in data.stretches)):
        return dataclasses.replace(ex, chosen=chosen)
    if not named:
        data = dataclasses.replace(data, stretches=[s.stripped() for s in data.stretches])
    noise = _noise_under(data, ex.problem, chosen, ex.noise, SETTLED)
    prob, g = problem(data, noise)
    prob = dataclasses.replace(prob, lowest=ex.problem.lowest)  # what has no weight has none here
    return dataclasses.replace(ex, data=data, noise=noise, noise_of=chosen, problem=prob, grams=g, chosen=chosen)


def parts(data: Data, chosen: tuple[int, ...]) -> list[slice]:
    """Where each member of a set has its amplitudes in a posterior of inertials and amplitudes."""
    widths = [len(data.candidates[i].columns) for i in chosen]
    ends = data.nuisances + np.cumsum(widths, dtype=int)
    return [slice(int(end) - width, int(end)) for end, width in zip(ends, widths, strict=True)]


def full_posterior(data: Data, prob: Problem, g: Grams, chosen: tuple[int, ...], without=None) -> Posterior:
    """Posterior of inertials and chosen amplitudes, in prior units."""
    columns, named = _columns(data, prob, chosen)
    post = posterior(g.of(columns).total(without), np.arange(len(columns)), named)
    return dataclasses.replace(post, columns=columns)


def noise_left(
    stretches: list[Stretch], scale: np.ndarray, named: list[slice], noise: Noise, rounds: int = SETTLED
) -> Noise:
    """Noise that columns leave, fitted under noise that was guessed before, and again under what they leave.

    Args:
        stretches: With these columns alone.
        scale: Their prior standard deviations.
        named: Those of each named effect; see `posterior`.
        noise: The guess.
        rounds: How often.
    """
    every, n = np.arange(len(scale)), stretches[0].y.shape[1]
    use, unsure = [s.use for s in stretches], [s.unsure for s in stretches]
    for _ in range(rounds):
        post = posterior(grams(stretches, noise, scale, len(scale), 1).total(), every, named)
        residuals = [s.y - s.X @ (post.mean * scale) for s in stretches]
        # Effective parameters: shrunk ones count for less; shared ones are split over the joints.
        used = len(scale) - float(np.trace(post.cov))
        noise = noise_from_residuals(residuals, use, np.full(n, used / n), unsure)
    return noise


def _noise_under(data: Data, prob: Problem, chosen: tuple[int, ...], noise: Noise, rounds: int) -> Noise:
    columns, named = _columns(data, prob, chosen)
    stretches = [dataclasses.replace(s, X=s.X[..., columns]) for s in data.stretches]
    return noise_left(stretches, data.scale[columns], named, noise, rounds)


def _columns(data: Data, prob: Problem, chosen: tuple[int, ...]) -> tuple[np.ndarray, list[slice]]:
    """Columns of inertials and chosen amplitudes, and which of those are each named effect's."""
    each = zip(chosen, parts(data, chosen), strict=True)
    named = [part for i, part in each if data.candidates[i].slug != "inertials"]
    return np.concatenate([np.arange(data.nuisances), prob.columns(chosen)]), named


def _named(found: tuple[np.ndarray, list[Candidate], list[np.ndarray]]) -> list[Named]:
    """The effects of an explanation (see `fitted`) with their numbers."""
    _, members, amplitudes = found
    return [Named(c.effect, c.joints, c.variant, w, c.shape) for c, w in zip(members, amplitudes, strict=True)]


def _loads(lib: Library, found: tuple[np.ndarray, list[Candidate], list[np.ndarray]], r: Prepared, index: int) -> Loads:
    """Loads of an explanation (see `fitted`) along a recording."""
    dphi, members, amplitudes = found
    return composed(lib, columns_along(lib, r, recording=index), members, amplitudes, dphi, dphi).loads


def fitted(
    data: Data, post: Posterior, chosen: tuple[int, ...], factor: np.ndarray
) -> tuple[np.ndarray, list[Candidate], list[np.ndarray]]:
    """Shift of the inertial parameters (10 n,), and the named effects with their amplitudes, from a posterior."""
    w = post.mean * data.scale[post.columns]
    dphi, members, amplitudes = factor @ w[: data.nuisances], [], []
    for i, part in zip(chosen, parts(data, chosen), strict=True):
        c = data.candidates[i]
        if c.slug == "inertials":
            dphi = dphi + factor[:, 10 * c.joints[0] : 10 * c.joints[0] + 10] @ w[part]
        else:
            members.append(c)
            amplitudes.append(w[part])
    return dphi, members, amplitudes


def _refined(ex: Explanation) -> tuple[Library, tuple[int, ...]]:
    """Finer grids of shapes around the chosen ones, and grids that the residual suggests."""
    left = left_over(ex.data, ex.columns(), ex.noise.total)
    shapes = []
    for effect, sites, old, _ in ex.lib.blocks:
        new = old.copy()
        for s, joints in enumerate(sites):
            mine = [m for m in ex.members if m.slug == effect.slug and m.joints == tuple(joints)]
            if mine and effect.refines():
                new[s] = effect.finer(old[s], _peak(ex, mine[0], old[s]))
            elif effect.scouts and not mine:
                new[s] = suggested(effect, left, ex.scales, joints, old[s])
        shapes.append(new)
    refined = reshaped(ex.lib, shapes)
    return refined, tuple(_same(c, refined, ex.data) for c in ex.chosen)


def _peak(ex: Explanation, mine: Candidate, grid: np.ndarray) -> np.ndarray:
    """Where a member's grid is at its best beside the other members, to a fraction of its steps."""
    candidates, site = ex.data.candidates, (mine.slug, mine.joints, mine.variant)
    same = [i for i, c in enumerate(candidates) if (c.slug, c.joints, c.variant) == site]
    odds = ex.problem.scores(tuple(c for c in ex.chosen if c not in same))[same]
    return mine.effect.peak(grid, mine.shape, odds)


def _same(index: int, lib: Library, data: Data) -> int:
    """The candidate nearest in shape to one of the library before; loose inertials keep their place at the end."""
    old = data.candidates[index]
    if old.slug == "inertials":
        return index
    alike = [
        (float(np.sum(np.abs(c.shape - old.shape))), i)
        for i, c in enumerate(lib.candidates)
        if c.slug == old.slug and c.joints == old.joints and c.variant == old.variant
    ]
    return min(alike)[1]
