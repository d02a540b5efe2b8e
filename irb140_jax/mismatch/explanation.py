"""A set of candidates beside the rigid body: what it is in the data, and what it leaves as noise."""

import dataclasses

import numpy as np

from irb140_jax.effects import Scales
from irb140_jax.mismatch.assemble import Data, problem
from irb140_jax.mismatch.candidates import Candidate, Library
from irb140_jax.mismatch.evidence import Grams, Posterior, grams, posterior
from irb140_jax.mismatch.noise import Noise, noise_from_residuals
from irb140_jax.mismatch.problem import Problem
from irb140_jax.mismatch.rows import Stretch
from irb140_jax.mismatch.selection.selected import Selected

SETTLED = 2  # rounds in which the noise and what leaves it agree


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
        selected: What a search with model discrepancy found, where there was one.
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
    selected: Selected | None = None

    @property
    def members(self) -> list:
        """The chosen candidates."""
        return [self.data.candidates[c] for c in self.chosen]

    def columns(self, chosen: tuple[int, ...] | None = None) -> np.ndarray:
        """Columns of the full model: inertials, then the amplitudes of the chosen candidates."""
        chosen = self.chosen if chosen is None else chosen
        return np.concatenate([np.arange(self.data.nuisances), self.problem.columns(chosen)])


def estimate(ex: Explanation) -> Posterior:
    """Posterior of inertials and chosen amplitudes, with the model discrepancy integrated out where there is one."""
    if ex.selected and ex.selected.chosen == ex.chosen:
        return ex.selected.posterior()
    return full_posterior(ex.data, ex.problem, ex.grams, ex.chosen)


def parts(data: Data, chosen: tuple[int, ...]) -> list[slice]:
    """Where each member of a set has its amplitudes in a posterior of inertials and amplitudes, (len(chosen),)."""
    widths = [len(data.candidates[i].columns) for i in chosen]
    ends = data.nuisances + np.cumsum(widths, dtype=int)
    return [slice(int(end) - width, int(end)) for end, width in zip(ends, widths, strict=True)]


def full_posterior(
    data: Data, prob: Problem, g: Grams, chosen: tuple[int, ...], without: np.ndarray | None = None
) -> Posterior:
    """Posterior of inertials and chosen amplitudes, in prior units, its mean of shape (10 n + amplitudes,).

    Args:
        data: Low-passed rows.
        prob: Search problem.
        g: Gram matrices by block.
        chosen: Indices of the candidates.
        without: Which blocks are left out, none by default, shape (blocks,).
    """
    columns, named = _columns(data, prob, chosen)
    post = posterior(g.of(columns).total(without), np.arange(len(columns)), named)
    return dataclasses.replace(post, columns=columns)


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


def noise_left(
    stretches: list[Stretch], scale: np.ndarray, named: list[slice], noise: Noise, rounds: int = SETTLED
) -> Noise:
    """Noise that columns leave, fitted under noise that was guessed before, and again under what they leave.

    Args:
        stretches: With these columns alone, X of shape (R, n, columns).
        scale: Their prior standard deviations, shape (columns,).
        named: Those of each named effect; see `posterior`.
        noise: The guess.
        rounds: How often.

    Returns:
        The noise of each joint.
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


def noise_under(data: Data, prob: Problem, chosen: tuple[int, ...], noise: Noise, rounds: int) -> Noise:
    """Noise that the inertials and a set of candidates leave; see `noise_left`."""
    columns, named = _columns(data, prob, chosen)
    stretches = [dataclasses.replace(s, X=s.X[..., columns]) for s in data.stretches]
    return noise_left(stretches, data.scale[columns], named, noise, rounds)


def explained_by(ex: Explanation, chosen: tuple[int, ...]) -> Explanation:
    """The explanation with a set of candidates, weighted by the noise that these leave.

    Where none of them has a name, nothing makes products with the inertials: what is corrected is the refit.
    """
    data, named = ex.data, any(ex.data.candidates[i].slug != "inertials" for i in chosen)
    if set(chosen) == set(ex.noise_of) and (named or all(s.bare for s in data.stretches)):
        return dataclasses.replace(ex, chosen=chosen)
    if not named:
        data = dataclasses.replace(data, stretches=[s.stripped() for s in data.stretches])
    noise = noise_under(data, ex.problem, chosen, ex.noise, SETTLED)
    prob, g = problem(data, noise)
    prob = dataclasses.replace(prob, lowest=ex.problem.lowest)  # what has no weight has none here
    return dataclasses.replace(ex, data=data, noise=noise, noise_of=chosen, problem=prob, grams=g, chosen=chosen)


def _columns(data: Data, prob: Problem, chosen: tuple[int, ...]) -> tuple[np.ndarray, list[slice]]:
    """Columns of inertials and chosen amplitudes, and which of those are each named effect's."""
    each = zip(chosen, parts(data, chosen), strict=True)
    named = [part for i, part in each if data.candidates[i].slug != "inertials"]
    return np.concatenate([np.arange(data.nuisances), prob.columns(chosen)]), named
