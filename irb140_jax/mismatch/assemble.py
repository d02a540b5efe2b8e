"""From conditioned recordings to a search problem: columns, prior scales, noise, Gram matrices."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.candidates import Candidate, Library
from irb140_jax.mismatch.evidence import Grams, eliminated, grams
from irb140_jax.mismatch.noise import Noise, noise_from_residuals, ridge
from irb140_jax.mismatch.problem import Problem
from irb140_jax.mismatch.rows import Stretch
from irb140_jax.mismatch.silent import LooseInertials

TYPICAL_SHARE = 0.3  # prior standard deviation of an effect's torque, as a share of the joint's torque
LOOSE_STD = 1.0  # relative error of inertials that are wrong beyond their stated uncertainty
LOOSE_PRIOR = np.log(0.2)  # such a link is rarer than a left-out effect
# The last link's inertials and a payload's are one thing under two priors, whose widths mean little: a factor of three
# in each of ten parameters.  Unless that is not enough, or no mass explains it, what is wrong is what is held there.
LAST_PRIOR = -10.0 * np.log(3.0)
FEWEST_ROWS = 40  # of a joint: any explanation fits fewer, and what is left of them is no measure of noise
ROUNDING = 1e-9  # of a joint's torque: a column that moves less moves nothing
EVENT = 0.2  # s before what happens once, or after it, that must be recorded
BLOCKS = 5  # contiguous blocks per recording: for jackknife intervals, and folds where there is one recording


@dataclasses.dataclass(frozen=True)
class Data:
    """Low-passed rows of all recordings with columns [inertials | amplitudes | loose inertials].

    Attributes:
        stretches: One per recording.
        scale: Prior standard deviation of each column's coefficient, shape (K,).
        candidates: Library candidates followed by one loose-inertials candidate per link.
        nuisances: Number of inertial columns (10 n).
    """

    stretches: list[Stretch]
    scale: np.ndarray
    candidates: tuple[Candidate, ...]
    nuisances: int


def assemble(lib: Library, stretches: list[Stretch], uncertainty: float) -> Data:
    """Set the prior scale of every column, and leave out joints of which too few rows tell.

    Args:
        lib: The candidates.
        stretches: One per recording.
        uncertainty: Stated relative standard deviation of the inertials.
    """
    nuisances = 10 * lib.robot.n
    tells = sum(s.use.sum(axis=0) for s in stretches) >= FEWEST_ROWS
    out = [dataclasses.replace(s, use=s.use & tells) for s in stretches]
    rows = sum(len(s.t) for s in out)
    torque = np.sqrt(sum(np.sum(s.tau**2, axis=0) for s in out) / rows)
    amplitudes = [s.X[..., nuisances:-nuisances] for s in out]
    rms = np.sqrt(sum(np.einsum("tjk,tjk->jk", x, x) for x in amplitudes) / rows)
    with np.errstate(divide="ignore"):
        seen = rms > ROUNDING * torque[:, None]
        typical = np.min(np.where(seen, TYPICAL_SHARE * torque[:, None] / np.where(seen, rms, 1), np.inf), axis=0)
    typical[~np.isfinite(typical)] = 0.0
    for c in lib.candidates:
        if c.effect.tied:
            moves = typical[c.columns] > 0.0
            typical[c.columns] = np.where(moves, np.min(typical[c.columns], where=moves, initial=np.inf), 0.0)
    scale = np.concatenate([np.full(nuisances, uncertainty), typical, np.full(nuisances, LOOSE_STD)])
    loose = LooseInertials()
    extra = [
        Candidate(
            loose,
            (k,),
            np.zeros(0),
            lib.size + 10 * k + np.arange(10),
            tuple(range(10)),
            np.full(10, -np.inf),
            np.full(10, np.inf),
        )
        for k in range(lib.robot.n)
    ]
    return Data(out, scale, (*lib.candidates, *extra), nuisances)


def problem(data: Data, noise: Noise, blocks: int = BLOCKS, *, settled: bool = True) -> tuple[Problem, Grams]:
    """Gram matrices under a noise model, ready for the search; with fewer blocks where only their sum is needed.

    Args:
        data: The rows.
        noise: Their whitening.
        blocks: Per recording.
        settled: Whether the grids of shapes are as fine as they get.
    """
    g = grams(data.stretches, noise, data.scale, data.nuisances, blocks)
    H, _ = eliminated(g.total(), np.arange(data.nuisances))
    sites = len({(c.slug, c.joints) for c in data.candidates})
    shapes: dict[tuple[str, tuple[int, ...]], int] = {}
    for c in data.candidates:
        shapes[c.slug, c.joints] = shapes.get((c.slug, c.joints), 0) + 1
    # A payload whose mass the motion doesn't show can't be found: there the last link is like any other.
    held = any(c.effect.tied and data.scale[data.nuisances + c.columns[0]] > 0.0 for c in data.candidates)
    loose = np.full(data.stretches[0].y.shape[1], LOOSE_PRIOR)
    loose[-1] += LAST_PRIOR if held else 0.0
    rare = np.array([
        -np.log(sites * shapes[c.slug, c.joints] * c.effect.scanned)
        + (loose[c.joints[0]] if c.slug == "inertials" else 0.0)
        for c in data.candidates
    ])  # fmt: skip
    log_prior = np.where([c.effect.ordinary for c in data.candidates], -np.log(2.0), rare)
    width = max(len(c.columns) for c in data.candidates)
    lowest = np.full((len(data.candidates), width), -np.inf)
    highest = np.full((len(data.candidates), width), np.inf)
    summed, least = np.zeros((len(data.candidates), width)), np.full(len(data.candidates), -np.inf)
    for i, c in enumerate(data.candidates):
        s = data.scale[data.nuisances + c.columns]
        # What is there only if it is more than nothing, but moves nothing here, can't be found.
        unseen = (s == 0.0) & (c.lowest == 0.0) | (c.effect.once and _throughout(data, c))
        own = settled & np.isin(c.variant, c.effect.own)
        at_least = np.where(own, np.maximum(c.lowest, c.effect.settled), c.lowest)
        lowest[i, : len(c.columns)] = np.where(unseen, np.inf, at_least / np.where(s > 0, s, 1.0))
        highest[i, : len(c.columns)] = c.highest / np.where(s > 0, s, 1.0)
        if c.effect.adds_up:
            summed[i, : len(c.columns)], least[i] = s, c.lowest[0]
    energy = np.full((len(data.stretches), g.rows.shape[1]), 1e-300)
    for r, s in enumerate(data.stretches):
        for j in range(energy.shape[1]):
            white = noise.whitened(s.tau[:, j], j, r, s.unsure[:, j])
            energy[r, j] += np.sum(white[noise.usable(s.use[:, j], j)] ** 2)
    offset = data.nuisances
    entry = rare - log_prior
    return Problem(H, g.per_joint, energy, data.candidates, offset, log_prior, entry, lowest, highest, summed, least), g


def _throughout(data: Data, c: Candidate) -> bool:
    """Whether what should happen once neither begins nor ends while it is recorded."""
    recording, begins, ends = c.effect.during(c.shape)
    seen = [s.t[np.any(s.use, axis=1)] - s.begin for s in data.stretches if s.recording == recording]
    t = np.concatenate([*seen, np.zeros(0)])
    return len(t) == 0 or (begins < t[0] + EVENT and ends > t[-1] - EVENT)


def first_noise(data: Data) -> Noise:
    """Noise left when every column of the library may help: no larger for what the model leaves out."""
    n = data.stretches[0].y.shape[1]
    use = [s.use for s in data.stretches]
    residuals = [np.zeros_like(s.y) for s in data.stretches]
    dof = np.zeros(n)
    # What is no physics repeats the inertials and friction; so many columns more would only blur the estimate.
    silent = np.concatenate([data.nuisances + c.columns for c in data.candidates if c.effect.silent])
    for j in range(n):
        keep = np.any([np.any(s.X[:, j] != 0.0, axis=0) for s in data.stretches], axis=0) & (data.scale > 0)
        keep[silent] = False
        A = np.concatenate([s.X[s.use[:, j], j][:, keep] * data.scale[keep] for s in data.stretches])
        y = np.concatenate([s.y[s.use[:, j], j] for s in data.stretches])
        if len(y) < 10:
            continue
        v, dof[j] = ridge(A, y)
        for s, r in zip(data.stretches, residuals, strict=True):
            r[:, j] = s.y[:, j] - s.X[:, j][:, keep] @ (v * data.scale[keep])
    return noise_from_residuals(residuals, use, dof, [s.unsure for s in data.stretches])
