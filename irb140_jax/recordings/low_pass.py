"""The low-pass that both sides of the torque equation pass, and the differentiators of the same length."""

import dataclasses
import functools

import numpy as np
from scipy import signal

AT_ONCE = 32  # low-passed rows in one product: about as long as the filter
KAISER_BETA = 6.0  # about 63 dB in the stop band: below the noise of any torque log


@dataclasses.dataclass(frozen=True)
class Band:
    """The frequencies the comparison uses.

    Attributes:
        torque: Cut-off of the low-pass on both sides of the equation [Hz].
        position: Cut-off of the smoother that differentiates q [Hz].
        rate: Rate at which motion and columns are evaluated [Hz].
        step: Every `step`-th low-passed sample is kept.
    """

    torque: float
    position: float
    rate: float
    step: int

    def low_pass(self) -> np.ndarray:
        """Taps of the symmetric low-pass at `rate`."""
        return kernels(self.torque, self.rate)[0]

    def apply(self, x: np.ndarray) -> np.ndarray:
        """Low-pass along axis 0 and keep every `step`-th sample; the filter's ends are left out."""
        taps, count = self.low_pass(), len(self.kept(len(x)))
        flat = x.reshape(len(x), -1)
        out = np.zeros((count, flat.shape[1]))
        # A few rows of the filter's matrix at a time: products of matrices, where sample by sample would be slow.
        filters = np.zeros((AT_ONCE, (AT_ONCE - 1) * self.step + len(taps)))
        for i, row in enumerate(filters):
            row[i * self.step : i * self.step + len(taps)] = taps
        for first in range(0, count, AT_ONCE):
            part = flat[first * self.step :][: filters.shape[1]]
            out[first : first + AT_ONCE] = filters[: count - first, : len(part)] @ part
        return out.reshape(count, *x.shape[1:])

    def kept(self, length: int) -> np.ndarray:
        """Indices of the samples that `apply` keeps."""
        half = (len(self.low_pass()) - 1) // 2
        return np.arange(half, length - half, self.step)


@functools.cache
def kernels(cutoff: float, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Taps of a windowed-sinc low-pass and of its first and second time derivative.

    The derivatives are least squares over all frequencies to w H and w^2 H of the low-pass H, errors taken relative to
    1/w and 1/w^2: differentiating the windowed sinc itself leaves steps at its ends, worth 3 % of qdd inside the band.
    """
    half = max(int(np.ceil(2.0 * rate / cutoff)), 2)
    k = np.arange(-half, half + 1)
    x = k / rate
    h = np.sinc(2 * cutoff * x) * np.i0(KAISER_BETA * np.sqrt(np.clip(1.0 - (k / half) ** 2, 0.0, None)))
    h = h / h.sum()
    w = np.linspace(0.0, np.pi * rate, 16 * half)
    response, weight = np.cos(np.outer(w, x)) @ h, 1.0 / (w + 0.5 * np.pi / x[-1])
    odd, even = 2.0 * np.sin(np.outer(w, x[half + 1 :])), 2.0 * (np.cos(np.outer(w, x[half + 1 :])) - 1.0)
    b = np.linalg.lstsq(weight[:, None] * odd, weight * w * response, rcond=None)[0]
    c = np.linalg.lstsq(weight[:, None] ** 2 * even, -(weight**2) * w**2 * response, rcond=None)[0]
    h1, h2 = np.concatenate([b[::-1], [0.0], -b]), np.concatenate([c[::-1], [-2.0 * c.sum()], c])
    # Exact on what they must be exact on: constants, ramps (h, h1) and parabolas (h2).
    return h, -h1 / (h1 @ x), h2 * 2.0 / (h2 @ x**2)


def filtered(x: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Zero-phase FIR along axis 0, ends reflected, shape of x."""
    half = (len(taps) - 1) // 2
    return convolved(np.pad(x, ((half, half), (0, 0)), mode="reflect"), taps)


def convolved(x: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Zero-phase FIR along axis 0 where it is filled, shape (T + 1 - len(taps), n)."""
    return signal.oaconvolve(x, taps[:, None], mode="valid", axes=0)
