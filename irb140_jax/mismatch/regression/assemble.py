"""The rows of all recordings side by side, with the prior scale of every column."""

import dataclasses

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.columns.loose_inertials import LOOSE_INERTIALS
from irb140_jax.mismatch.regression.rows import Stretch

ROUNDING = 1e-9  # of a joint's torque: a column that moves less moves nothing


@dataclasses.dataclass(frozen=True)
class Data:
    """Low-passed rows of all recordings; columns are numbered as in `Stretch`.

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

    @property
    def motions(self) -> np.ndarray:
        """Which motion each stretch is of, shape (stretches,): repeats of one have its number, others are on their own.
        """
        return np.array([s.motion if s.motion >= 0 else -1 - s.recording for s in self.stretches])


def judged(stretches: list[Stretch]) -> list[Stretch]:
    """The rows, with none of joints of which too few tell."""
    tells = sum(s.use.sum(axis=0) for s in stretches) >= settings.FEWEST_ROWS_OF_JOINT
    return [dataclasses.replace(s, use=s.use & tells) for s in stretches]


def assembled(lib: Library, stretches: list[Stretch], uncertainty: float) -> Data:
    """Rows that hold the columns of a whole library, those of joints judged, with the prior scale of every column."""
    joints, amplitudes = lib.entries
    power = sum(np.einsum("te,te->e", x, x) for x in (s.amplitudes[:, joints, amplitudes] for s in stretches))
    rows = judged(stretches)
    scale = prior_scale(lib, rows, uncertainty, np.asarray(power))
    return Data(rows, scale, with_loose_inertials(lib), 10 * lib.robot.n)


def prior_scale(lib: Library, stretches: list[Stretch], uncertainty: float, power: np.ndarray) -> np.ndarray:
    """Prior standard deviation of every column's coefficient, shape (K,).

    Args:
        lib: The candidates.
        stretches: One per recording, rows of joints judged.
        uncertainty: Stated relative standard deviation of the inertials.
        power: Sum of the squares of each column that isn't zero throughout, over all rows, shape (entries,).
    """
    nuisances = 10 * lib.robot.n
    rows = sum(len(s.t) for s in stretches)
    torque = np.sqrt(sum(np.sum(s.tau**2, axis=0) for s in stretches) / rows)
    joints, amplitudes = lib.entries
    rms, typical = np.sqrt(power / rows), np.full(lib.size, np.inf)
    tells = np.any([s.use.any(axis=0) for s in stretches], axis=0)
    seen = (rms > ROUNDING * torque[joints]) & tells[joints]
    np.minimum.at(typical, amplitudes[seen], torque[joints[seen]] / rms[seen])
    typical[~np.isfinite(typical)] = 0.0
    for effect, sites, shapes, first in lib.blocks:
        width = effect.law.width
        typical[first : first + len(sites) * shapes.shape[1] * width] *= effect.prior.typical
    for c in lib.candidates:
        if c.effect.prior.tied:
            moves = typical[c.columns] > 0.0
            typical[c.columns] = np.where(moves, np.min(typical[c.columns], where=moves, initial=np.inf), 0.0)
    return np.concatenate([np.full(nuisances, uncertainty), typical, np.full(nuisances, settings.LOOSE_INERTIALS)])


def with_loose_inertials(lib: Library) -> tuple[Candidate, ...]:
    """The candidates of a library, and the inertials of each link as one more."""
    free, out = np.full(10, np.inf), list(lib.candidates)
    for k in range(lib.robot.n):
        columns = lib.size + 10 * k + np.arange(10)
        out.append(Candidate(LOOSE_INERTIALS, (k,), np.zeros(0), columns, tuple(range(10)), -free, free))
    return tuple(out)
