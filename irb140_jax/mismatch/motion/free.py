"""Parameters of a corrected model that are free in a fit to the motion, and their prior.

The torque of commands has two things to say of them.  `as_predicted` takes the stated gains as right, as what
predicts torque does: friction may hold what is wrong with them, and torque gains have the stated width of Kp.
`as_estimated` is the posterior of laws and gains together: where masses say what Kp is, friction is in that torque.
"""

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


class Prior(NamedTuple):
    """What the torque says of a model's numbers.

    Attributes:
        post: Inertials and amplitudes, in prior units.
        gains: Real over stated torque of each servo, less one, and its standard deviation, shape (n, 2); the latter
            is zero where there is no Kp.
        kd: Kd of each beyond that of the drive that was found, and its standard deviation, shape (n, 2) [N m s/rad or
            N s/m].
    """

    post: Posterior
    gains: np.ndarray
    kd: np.ndarray


# From an explanation, the servos as they were given, and which blocks of the data are left out, shape (blocks,).
PriorOf = Callable[[Explanation, Drive, np.ndarray | None], Prior]


def as_predicted(ex: Explanation, drive: Drive, without: np.ndarray | None) -> Prior:
    """The gains as stated.

    Args:
        ex: The explanation.
        drive: As it was given.
        without: Which blocks of the data are left out, shape (blocks,).
    """
    post, _, _ = ex.prediction(without)
    kd = [width * ex.own_nuisance(j, DRIVE_KD)[1] for j, width in enumerate(np.nan_to_num(drive.kd_width))]
    about_none = lambda width: np.stack([np.zeros(len(kd)), width], axis=1)  # noqa: E731
    return Prior(post, about_none(np.nan_to_num(drive.kp_width)), about_none(kd))


def as_estimated(ex: Explanation, drive: Drive, without: np.ndarray | None) -> Prior:
    """Gains and laws together; arguments as those of `as_predicted`."""
    post, (_, _, own) = ex.posterior(without=without), ex.prediction(without)
    post = dataclasses.replace(post, mean=ex.of_bodies(post.mean, post.cov, ex.chosen, ex.space.inertials))
    gains, kd = np.zeros((2, len(drive.kp), 2))
    for j, (width, (found, _)) in enumerate(zip(np.nan_to_num(drive.kd_width), ex.of_drives(own), strict=True)):
        more, unsure = ex.kp_scale(j, drive, without)
        if np.nan_to_num(drive.kp_width[j]) > 0.0:
            gains[j] = 1.0 / (1.0 + more) - 1.0, unsure / (1.0 + more) ** 2
        mean, std = ex.own_nuisance(j, DRIVE_KD, without)
        kd[j] = width * (mean - found), width * std
    return Prior(post, gains, kd)


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
        drive: The servos as they were given.
        prior_of: How the prior follows from the torque.
    """

    parameters: tuple[FreeParameter, ...]
    unit: np.ndarray
    mean: np.ndarray
    precision: np.ndarray
    low: np.ndarray
    high: np.ndarray
    base: CorrectedModel
    ex: Explanation
    drive: Drive
    prior_of: PriorOf

    @staticmethod
    def of(
        ex: Explanation, model: CorrectedModel, data: Comparison, rotors: Sequence[int], prior_of: PriorOf
    ) -> "FreeParameters":
        """Those of a corrected model, with what the torque says of them as prior.

        Args:
            ex: The explanation.
            model: The corrected model.
            data: Model and recordings.
            rotors: Candidates that stand beside what is named.
            prior_of: How their prior follows from the torque.
        """
        assert data.servo is not None
        ex, drive = dataclasses.replace(ex, chosen=(*ex.chosen, *rotors)), data.servo.drive
        prior = prior_of(ex, drive, None)
        post = prior.post
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
        (gain,) = TORQUE_GAIN.law.parameters
        # No simulation holds a lag of the torque: in one the same time is lost by a later command and less damping.
        lag = ex.torque_lag(drive)
        damping = np.where(prior.kd[:, 1] > 0.0, np.hypot(prior.kd[:, 1], np.nan_to_num(drive.kp) * lag), 0.0)
        for j, (of_kp, of_kd) in enumerate(zip(prior.gains[:, 1].tolist(), damping.tolist(), strict=True)):
            widths += [(FreeParameter("torque_gain", j), of_kp, gain.low - 1.0, gain.high - 1.0)]
            widths += [(FreeParameter("kd", j), of_kd, -float(drive.kd[j]), np.inf)]
        if drive.common_delay_width:
            unsure = float(np.hypot(ex.command_delay(drive)[1], lag))
            widths += [(FreeParameter("later", -1), unsure, -float(np.min(drive.delay)), np.inf)]
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
        bare = FreeParameters(
            parameters, unit, np.zeros(len(unit)), precision, low, high, model, ex, drive, prior_of)  # fmt: skip
        return bare._about(prior)

    def _about(self, prior: Prior) -> "FreeParameters":
        """The same about other numbers of the same model."""
        made = fitted_model(self.ex, prior.post, (), prior.post, 0.0, self.base.band)
        base = dataclasses.replace(self.base, phi_corrected=made.phi_corrected, named=made.named, discrepancy=None)
        of_servos = {"torque_gain": prior.gains[:, 0], "kd": prior.kd[:, 0], "later": np.zeros(1)}
        own = [of_servos[w.kind][w.at] if w.kind in of_servos else base.named[w.at].amplitudes[w.column]
               for w in self.parameters]  # fmt: skip
        return dataclasses.replace(self, base=base, mean=np.clip(np.array(own) / self.unit, self.low, self.high))

    def centred(self, blocks: np.ndarray) -> "FreeParameters":
        """The same about what the torque says without some blocks of the data, shape (blocks,)."""
        return self._about(self.prior_of(self.ex, self.drive, blocks))

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

    def own_amplitudes(self) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Of each named effect its candidate, which parameters are its own amplitudes, and their prior widths.

        Own are those without which it would be a special case of itself.  Widths are before any torque, in `unit`s.
        """
        index, out = [i for i in self.ex.chosen if not self.ex.data.candidates[i].is_inertials], []
        for at, i in enumerate(index):
            c = self.ex.data.candidates[i]
            scale = self.ex.data.scale[self.ex.data.nuisances + c.columns]
            own = np.isin(c.variant, [k % c.effect.law.width for k in c.effect.law.own])
            rows = [k for k, w in enumerate(self.parameters) if w.kind == "law" and w.at == at and own[w.column]]
            if rows:
                columns = [self.parameters[k].column for k in rows]
                out.append((i, np.array(rows), scale[columns] / self.unit[rows]))
        return out

    def amplitudes(self, own: np.ndarray) -> dict[int, np.ndarray]:
        """Of each named candidate that they change, by its number."""
        index = [i for i in self.ex.chosen if not self.ex.data.candidates[i].is_inertials]
        out: dict[int, np.ndarray] = {}
        for what, value in zip(self.parameters, own, strict=True):
            if what.kind == "law":
                out.setdefault(index[what.at], self.base.named[what.at].amplitudes.copy())[what.column] = value
        return out
