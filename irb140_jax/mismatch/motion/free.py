"""Parameters of a corrected model that are free in a fit to the motion, and their prior."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg

from irb140_jax.effects.torque_gain import EFFECT as TORQUE_GAIN
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.fitted import fitted_model
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.regression.gaussian import Posterior
from irb140_jax.mismatch.regression.nuisances import DRIVE_KD
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.selection.explanation import Explanation, parts
from irb140_jax.recordings.drive import Drive

JITTER = 1e-9  # on the diagonal of a correlation matrix, where the torque can't tell amplitudes apart

# A corrected model, what makes its drive of a recording's, and by how much later that acts [s].
ChangedModel = tuple[CorrectedModel, Callable[[Drive], Drive], float]


class FreeParameter(NamedTuple):
    """A free parameter, its law or joint, and which amplitude of a law.

    Amplitudes of a "law", or of a "rotor" that is not named; "torque_gain", real over stated torque of a servo, less
    one, and its "kd" [N m s/rad or N s/m]; by how much "later" commands act [s].
    """

    kind: str
    at: int
    column: int = 0


@dataclasses.dataclass(frozen=True)
class FreeParameters:
    """Free parameters, each in units of its prior standard deviation.

    Attributes:
        parameters: What each is.
        unit: That standard deviation, in SI units, shape (P,).
        mean: Of the prior, shape (P,).
        precision: Of the prior, shape (P, P).
        low, high: Bounds, shape (P,).
        base: The corrected model, with those rotors, whose parameters they are.
        ex: The explanation with the rotors among what is chosen.
    """

    parameters: tuple[FreeParameter, ...]
    unit: np.ndarray
    mean: np.ndarray
    precision: np.ndarray
    low: np.ndarray
    high: np.ndarray
    base: CorrectedModel
    ex: Explanation

    @staticmethod
    def of(ex: Explanation, model: CorrectedModel, data: Comparison, rotors: Sequence[int]) -> "FreeParameters":
        """Those of a corrected model; the torque says what their prior is, torque gains have the stated width of Kp.

        Args:
            ex: The explanation.
            model: The corrected model.
            data: Model and recordings.
            rotors: Candidates that stand beside what is named.
        """
        assert data.servo is not None
        ex = dataclasses.replace(ex, chosen=(*ex.chosen, *rotors))
        post, _, _ = ex.prediction()
        base = _with_posterior(ex, model, post)
        laws, widths, at = [], [], 0
        for i, part in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
            c = ex.data.candidates[i]
            if c.is_inertials:
                continue
            if not (c.effect.export.history or c.effect.shapes.once or c.effect.place.everywhere):
                bounds = enumerate(zip(c.lowest.tolist(), c.highest.tolist(), strict=True))
                kind = "rotor" if i in rotors else "law"
                laws += [(FreeParameter(kind, at, k), part.start + k, *ends) for k, ends in bounds]
            at += 1
        drive, (gain,) = data.servo.drive, TORQUE_GAIN.law.parameters
        kp_width = np.nan_to_num(drive.kp_width).tolist()
        for j in range(model.robot.n):
            kd = float(np.nan_to_num(drive.kd_width[j])) * ex.own_nuisance(j, DRIVE_KD)[1]
            widths += [(FreeParameter("torque_gain", j), kp_width[j], gain.low - 1.0, gain.high - 1.0)]
            widths += [(FreeParameter("kd", j), kd, -float(drive.kd[j]), np.inf)]
        if drive.common_delay_width:
            widths += [(FreeParameter("later", -1), ex.command_delay(drive)[1], -float(np.min(drive.delay)), np.inf)]
        widths = [x for x in widths if x[1] > 0.0]
        scale = ex.data.scale[post.columns]
        laws = [x for x in laws if scale[x[1]] > 0.0]  # others move nothing
        rows = [row for _, row, _, _ in laws]
        cov = post.cov[np.ix_(rows, rows)] * np.outer(scale[rows], scale[rows])
        std = np.sqrt(np.diag(cov))
        precision = np.eye(len(rows) + len(widths))
        precision[: len(rows), : len(rows)] = linalg.inv(cov / np.outer(std, std) + JITTER * np.eye(len(rows)))
        unit = np.concatenate([std, [x[1] for x in widths]])
        low, high = (np.array([x[k] for x in (*laws, *widths)]) / unit for k in (2, 3))
        parameters = (*(x[0] for x in laws), *(x[0] for x in widths))
        return FreeParameters(parameters, unit, np.zeros(len(unit)), precision, low, high, base, ex)._at(base)

    def _at(self, base: CorrectedModel) -> "FreeParameters":
        """The same about another model with these effects."""
        own = [base.named[w.at].amplitudes[w.column] if w.kind in ("law", "rotor") else 0.0 for w in self.parameters]
        return dataclasses.replace(self, base=base, mean=np.clip(np.array(own) / self.unit, self.low, self.high))

    def centred(self, blocks: np.ndarray) -> "FreeParameters":
        """The same about what the torque says without some blocks of the data, shape (blocks,)."""
        return self._at(_with_posterior(self.ex, self.base, self.ex.prediction(blocks)[0]))

    def values(self, x: np.ndarray) -> np.ndarray:
        """In SI units, shape (P,)."""
        return x * self.unit

    def model(self, x: np.ndarray) -> ChangedModel:
        """The model with these values, what makes its drive of a recording's, and by how much later that acts [s]."""
        own, named = self.values(x), list(self.base.named)
        for what, value in zip(self.parameters, own, strict=True):
            if what.kind in ("law", "rotor"):
                amplitudes = named[what.at].amplitudes.copy()
                amplitudes[what.column] = value
                named[what.at] = dataclasses.replace(named[what.at], amplitudes=amplitudes)
            elif what.kind == "torque_gain":
                named.append(Named(TORQUE_GAIN, (what.at,), (0,), *TORQUE_GAIN.law.amplitudes({"gain": 1.0 + value})))
        to_drive = lambda drive: dataclasses.replace(drive, kd=self.kd(own, drive))  # noqa: E731
        return dataclasses.replace(self.base, named=tuple(named)), to_drive, self._later(own)

    def kd(self, own: np.ndarray, drive: Drive) -> np.ndarray:
        """Kd of a drive [N m s/rad or N s/m] in torque as stated, which the torque gains multiply, shape (n,)."""
        out, gains = drive.kd.copy(), np.ones(len(drive.kd))
        for what, value in zip(self.parameters, own, strict=True):
            if what.kind == "kd":
                out[what.at] = max(out[what.at] + value, 0.0)
            elif what.kind == "torque_gain":
                gains[what.at] += value
        return out / gains

    def _later(self, own: np.ndarray) -> float:
        """By how much later commands act [s]."""
        return float(sum(value for what, value in zip(self.parameters, own, strict=True) if what.kind == "later"))

    def amplitudes(self, own: np.ndarray) -> dict[int, np.ndarray]:
        """Of each named candidate that they change, by its number."""
        index = [i for i in self.ex.chosen if not self.ex.data.candidates[i].is_inertials]
        out: dict[int, np.ndarray] = {}
        for what, value in zip(self.parameters, own, strict=True):
            if what.kind == "law":
                out.setdefault(index[what.at], self.base.named[what.at].amplitudes.copy())[what.column] = value
        return out


def _with_posterior(ex: Explanation, model: CorrectedModel, post: Posterior) -> CorrectedModel:
    """A corrected model with inertials and effects of another posterior."""
    made = fitted_model(ex, post, (), post, 0.0, model.band)
    return dataclasses.replace(model, phi_corrected=made.phi_corrected, named=made.named, discrepancy=None)
