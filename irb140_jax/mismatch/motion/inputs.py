"""What a simulation of windows of recordings is given: starts, commands, and torque between the samples."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from irb140_jax.mismatch.motion.models import asked
from irb140_jax.mismatch.motion.windows import FINEST, FINEST_SERVO, Window
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.drive import Drive


@dataclasses.dataclass(frozen=True)
class Inputs:
    """Windows of recordings, all as long as the longest: what lies beyond the end of one is not to be used.

    Attributes:
        recordings: The conditioned recordings.
        cut: The windows.
        parts: Steps of the simulation in one of the recordings' grid.
        step: Of that grid [s].
    """

    recordings: Sequence[Conditioned]
    cut: Sequence[Window]
    parts: int
    step: float

    @property
    def samples(self) -> int:
        """Of the longest window, its start among them."""
        return max(w.last - w.first for w in self.cut) + 1

    @property
    def start(self) -> np.ndarray:
        """Positions [rad or m], shape (B, n)."""
        return np.stack([self._of(w).q[w.first] for w in self.cut])

    @property
    def speed(self) -> np.ndarray:
        """Speeds half a step of the simulation before, shape (B, n)."""
        half = 0.5 * self.step / self.parts
        return np.stack([self._of(w).qd[w.first] - half * self._of(w).qdd[w.first] for w in self.cut])

    @property
    def began(self) -> np.ndarray:
        """Time since its recording began at which each starts [s], shape (B,)."""
        return np.array([self._of(w).t[w.first] - self._of(w).began for w in self.cut])

    @property
    def drives(self) -> list[Drive | None]:
        """Of each window's servos, None where torque was logged."""
        return [servo.drive if (servo := self._of(w).servo) else None for w in self.cut]

    def between(self, of: Callable[[Window], np.ndarray], late: Sequence[float] | None = None) -> np.ndarray:
        """Values at the steps of the simulation, straight from one row of a recording to the next, (B, S, n).

        Args:
            of: From a window to values at all rows of its recording, (T, n).
            late: Time by which they come later in each window [s].
        """
        out = np.zeros((len(self.cut), (self.samples - 1) * self.parts, self.recordings[0].q.shape[1]))
        for b, w in enumerate(self.cut):
            x, steps = of(w), (w.last - w.first) * self.parts
            at = w.first + np.arange(steps) / self.parts - (late[b] / self.step if late else 0.0)
            at = np.clip(at, 0.0, len(x) - 1)
            low = np.minimum(at.astype(int), len(x) - 2)
            out[b, :steps] = x[low] + (at - low)[:, None] * (x[low + 1] - x[low])
        return out

    def control(self, drives: Sequence[Drive | None] | None = None, late: Sequence[float] | None = None) -> np.ndarray:
        """Of the servos, (B, S, n): zero where torque was logged.

        Args:
            drives: Of each window's servos, by default those of its recording.
            late: Time by which commands act later in each window [s].
        """
        of = dict(zip(self.cut, drives or self.drives, strict=True))

        def wanted(w: Window) -> np.ndarray:
            r, drive = self.recordings[w.recording], of[w]
            if r.servo is None or drive is None:
                return np.zeros_like(r.q)
            return asked(dataclasses.replace(r.servo, drive=drive))

        return self.between(wanted, late)

    def positions(self) -> np.ndarray:
        """Where the robot went, on the recordings' grid, NaN beyond the end of a window, (B, samples, n)."""
        out = np.full((len(self.cut), self.samples, self.recordings[0].q.shape[1]), np.nan)
        for b, w in enumerate(self.cut):
            out[b, : w.last - w.first + 1] = self._of(w).q[w.first : w.last + 1]
        return out

    def _of(self, w: Window) -> Conditioned:
        return self.recordings[w.recording]


def time_steps(recordings: Sequence[Conditioned]) -> tuple[float, int]:
    """Step of the recordings' grid [s], and how many of a simulation are in it."""
    step = float(np.mean([r.t[1] - r.t[0] for r in recordings]))
    finest = FINEST if all(r.servo is None for r in recordings) else FINEST_SERVO
    return step, max(1, int(np.ceil(step / finest)))
