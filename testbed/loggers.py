"""Loggers: rates, clocks, resolution and noise between the controller's channels and the file."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Logger:
    """What a controller keeps.

    Attributes:
        rate: Rows a second [Hz].
        jitter: Standard deviation of when a row is sampled, in periods.
        told: Whether the column t knows of that.
        counts: Resolution of the positions, shape (n,) [rad or m].
        noise: Standard deviation of the torque sensors, shape (n,) [N m or N].
        steps: Resolution of the torques, shape (n,) [N m or N].
        speed: Whether qd is logged, too.
    """

    rate: float
    jitter: float
    told: bool
    counts: np.ndarray
    noise: np.ndarray
    steps: np.ndarray
    speed: bool = False

    @property
    def sensor_noise(self) -> np.ndarray:
        """Standard deviation of a logged torque about the true one, its steps included, shape (n,)."""
        return np.sqrt(self.noise**2 + self.steps**2 / 12.0)


def random_logger(rng: np.random.Generator, slide: np.ndarray, size: np.ndarray, rate: float | None = None) -> Logger:
    """A logger of some make, for joints whose torques have these sizes (RMS)."""
    n = len(slide)
    bits = rng.integers(17, 23)
    return Logger(
        rate=float(rate or rng.choice([100, 125, 250, 250, 500, 500, 500, 1000])),
        jitter=float(rng.choice([0.0, 0.0, 0.0, 0.03, 0.1])), told=bool(rng.random() < 0.7),
        counts=np.where(slide, 10.0 ** rng.uniform(-6.5, -5.5), 2.0 * np.pi / 2.0**bits),
        noise=size * 10.0 ** rng.uniform(-2.7, -1.7) * rng.uniform(0.7, 1.4, n),
        steps=size * 10.0 ** rng.uniform(-4.0, -2.3), speed=bool(rng.random() < 0.3),
    )  # fmt: skip


def clock(logger: Logger, rng: np.random.Generator, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """When the rows of a recording are due and when they are taken, by the channels' clock [s], shape (R,) each."""
    due = np.arange(t[0] + 1.0 / logger.rate, t[-1] - 1.0 / logger.rate, 1.0 / logger.rate)
    due = due + rng.uniform(0.0, 1.0 / logger.rate)  # no clock starts with another's
    return due, due + np.clip(logger.jitter * rng.normal(size=len(due)), -0.3, 0.3) / logger.rate


def logged(
    logger: Logger, rng: np.random.Generator, t: np.ndarray, q: np.ndarray, qd: np.ndarray, tau: np.ndarray,
    rows: tuple[np.ndarray, np.ndarray] | None = None,
) -> dict[str, np.ndarray]:  # fmt: skip
    """One recording: t, q, tau, qd where it is logged, and what no file shows: tau_true, and `began`.

    `began` is the time by the channels' clock at which the log's is zero.

    Args:
        logger: Its make.
        rng: Random numbers.
        t, q, qd, tau: Every STEP, as the channels of the controller have them; shapes (T,) and (T, n).
        rows: What `clock` gave, where that was asked before.
    """
    due, taken = rows or clock(logger, rng, t)
    at = lambda x: np.stack([np.interp(taken, t, c) for c in x.T], axis=1)  # noqa: E731
    positions = at(q) + 0.3 * logger.counts * rng.normal(size=(len(taken), q.shape[1]))
    true = at(tau)
    noisy = true + logger.noise * rng.normal(size=true.shape)
    out = {
        "t": (taken if logger.told else due) - due[0] + 1.0,
        "q": np.round(positions / logger.counts) * logger.counts,
        "tau": np.round(noisy / logger.steps) * logger.steps, "tau_true": true,
        "began": due[0] - 1.0,
    }  # fmt: skip
    if logger.speed:
        out["qd"] = at(qd) + 2.0 * logger.counts * logger.rate * rng.normal(size=true.shape) * 0.1
    return out
