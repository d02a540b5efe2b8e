"""The rows of all recordings side by side, with the prior scale of every column."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.columns.loose_inertials import LOOSE_INERTIALS
from irb140_jax.mismatch.regression.rows import Stretch

LOOSE_STD = 1.0  # relative error of inertials that are wrong beyond their stated uncertainty
FEWEST_ROWS = 40  # of a joint: any explanation fits fewer, and what is left of them is no measure of noise
ROUNDING = 1e-9  # of a joint's torque: a column that moves less moves nothing
BLOCKS = 5  # contiguous blocks per recording: folds where one recording alone tells of a joint or a finding


@dataclasses.dataclass(frozen=True)
class Data:
    """Low-passed rows of all recordings with columns [inertials | amplitudes | loose inertials].

    Attributes:
        stretches: One per recording.
        scale: Prior standard deviation of each column's coefficient, shape (K,).
        candidates: Library candidates followed by loose inertials of each link.
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
        typical = np.min(np.where(seen, torque[:, None] / np.where(seen, rms, 1), np.inf), axis=0)
    typical[~np.isfinite(typical)] = 0.0
    for effect, sites, shapes, first in lib.blocks:
        width = effect.law.width
        typical[first : first + len(sites) * shapes.shape[1] * width] *= effect.prior.typical
    for c in lib.candidates:
        if c.effect.prior.tied:
            moves = typical[c.columns] > 0.0
            typical[c.columns] = np.where(moves, np.min(typical[c.columns], where=moves, initial=np.inf), 0.0)
    scale = np.concatenate([np.full(nuisances, uncertainty), typical, np.full(nuisances, LOOSE_STD)])
    extra = []
    for k in range(lib.robot.n):
        columns, free = lib.size + 10 * k + np.arange(10), np.full(10, np.inf)
        extra.append(Candidate(LOOSE_INERTIALS, (k,), np.zeros(0), columns, tuple(range(10)), -free, free))
    return Data(out, scale, (*lib.candidates, *extra), nuisances)
