"""In which band of frequencies model and log are compared: where positions carry motion and torque means something."""

import equinox as eqx
import numpy as np
from scipy import ndimage

from irb140_jax import dynamics
from irb140_jax.arrays import on_device
from irb140_jax.recordings.condition import Conditioned, condition, even
from irb140_jax.recordings.low_pass import Band, filtered, kernels
from irb140_jax.recordings.payload import carrying
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.smooth import noise_density, signal_limit
from irb140_jax.robot import Robot

MAX_TORQUE_BAND = 20.0  # Hz; above this, arms are not rigid and motor torque holds mostly current ripple
MIN_TORQUE_BAND = 4.0  # Hz; friction reversals are steps, a narrower band would blur them into the inertia
WORKING_RATE = 200.0  # Hz; columns are evaluated at least this often
SLOW = 3.0  # Hz; below, model and log may differ by the very friction that is looked for
INCOHERENT = 0.05  # share of the model's torque that may be noise: what biases parameters by as much
DRIVEN = 0.5  # share of a servo's motion at some frequency that its command must drive, as signals stand above noise


def choose_band(recordings: list[Recording], robot: Robot) -> Band:
    """The band in which positions carry motion, and the model's torque means something, in all recordings alike.

    The positions' spectrum must stand above their noise, and differentiated positions must not fill the model's torque
    with what the logged torque knows nothing of (noise, play, flexibility), for regressors that hold noise bias every
    parameter towards zero.  And what moves a servo must be its command; see `_driven_limit`.

    Args:
        recordings: At least one, with torque: that of servos is made of their commands.
        robot: The nominal model.

    Returns:
        The band [Hz]: its torque cut-off is between `MIN_TORQUE_BAND` and `MAX_TORQUE_BAND` where rates allow that.
    """
    top, rates = [], []
    for recording in recordings:
        t, q, _, _ = even(recording)
        rate = (len(t) - 1) / (t[-1] - t[0])
        rates.append(rate)
        density = noise_density(recording, t, rate)
        top.append([signal_limit(x, d, rate) for x, d in zip(q.T, density, strict=True)])
    # The fastest recording decides; within it, the middling joint: a still joint says nothing, a noisy one too much.
    limit = max((float(np.median([f for f in row if f > 0] or [0.0])) for row in top), default=0.0)
    slowest = float(min(rates))
    highest = max(min(MAX_TORQUE_BAND, slowest / 6.0), 1.0)
    band = _band(float(np.clip(2.0 * limit, min(MIN_TORQUE_BAND, highest), highest)), slowest)
    smooth = [condition(r, band) for r in recordings]
    limit = min(_coherent_limit(recordings, smooth, robot, band), _driven_limit(smooth, band))
    return _band(max(limit, min(MIN_TORQUE_BAND, highest)), slowest)


def _band(torque: float, rate: float) -> Band:
    """The band with this torque cut-off for recordings of this rate."""
    working = min(max(WORKING_RATE, 8.0 * torque), rate)
    return Band(torque, min(1.6 * torque, 0.4 * rate), working, max(1, int(working / (2.2 * torque))))


def _coherent_limit(recordings: list[Recording], smooth: list[Conditioned], robot: Robot, band: Band) -> float:
    """Highest frequency [Hz] up to which the model's torque is not filled with what the log and friction don't show.

    Of the model's torque m, the part incoherent with the logged torque and the direction of motion is summed from
    `SLOW` upwards; it must stay below `INCOHERENT` of the whole power, for every joint.  What friction a regression
    below `SLOW` finds is taken off the logged torque first: where friction rules, m and the log would not match at all.
    """
    living = np.stack([np.ones(robot.n, dtype=bool) if r.torque_lost is None else ~r.torque_lost.any(axis=0)
                       for r in recordings])  # fmt: skip
    f = _frequencies(band)
    spectra = np.zeros((robot.n, len(f), 4, 4), dtype=complex)
    passive = lambda r: (r.stiffness, r.damping, r.frictionloss)  # noqa: E731
    moving = eqx.tree_at(passive, robot, (on_device(np.zeros(robot.n)),) * 3)
    for r, alive in zip(smooth, living, strict=True):
        loaded = carrying(moving, r.payload)
        m = np.asarray(dynamics.inverse_dynamics_batch(loaded, r.q, r.qd, r.qdd))
        friction = np.concatenate([r.direction, r.qd], axis=1)
        slow = filtered(np.concatenate([r.tau, m, r.qdd, friction], axis=1), kernels(SLOW, band.rate)[0])
        for j in np.flatnonzero(alive):
            inputs = np.concatenate([slow[:, [robot.n + j, 2 * robot.n + j]], slow[:, 3 * robot.n :]], axis=1)
            inputs = np.concatenate([inputs, np.ones((len(inputs), 1))], axis=1)
            w = np.linalg.lstsq(inputs, slow[:, j], rcond=1e-6)[0]
            x = np.stack([m[:, j], r.tau[:, j] - friction @ w[2:-1], r.direction[:, j], r.tau[:, j]], axis=1)
            spectra[j] += _cross_spectra(x, band)
    limit = band.torque
    for s in spectra[:, 1:]:
        power = s[:, 0, 0].real
        if power.sum() <= 0:
            continue
        unknown = np.where(f[1:] > SLOW, np.clip(power - _coherent_power(s[:, :3, :3]), 0.0, None), 0.0)
        # Noise in a model torque that is small beside the logged one does no harm.
        share = np.cumsum(unknown) / np.maximum(np.cumsum(power), np.cumsum(s[:, 3, 3].real))
        over = np.flatnonzero(share > INCOHERENT)
        if len(over):
            limit = min(limit, float(f[1:][over[0]]))
    return limit


def _driven_limit(smooth: list[Conditioned], band: Band) -> float:
    """Highest frequency [Hz] up to which it is its command that moves every servo, with friction's direction.

    A servo answers what the model leaves out as well.  Where that moves the joint, the servo's torque, made of the same
    positions, balances the motion whatever the model is, and a regression takes the servo's own law for the arm's: too
    little inertia and a delay.  A joint that its command does not even move slowly says nothing.

    Source: L. Ljung, System Identification, 2nd ed., 1999, sec. 13.4: bias of direct identification in closed loop.
    """
    servos = [r for r in smooth if r.servo is not None]
    f, limit = _frequencies(band), band.torque
    for j in range(servos[0].q.shape[1] if servos else 0):
        total = np.zeros((len(f), 3, 3), dtype=complex)
        for r in servos:
            assert r.servo is not None
            signals = np.stack([r.qd[:, j], r.servo.command_rate[:, j], r.direction[:, j]], axis=1)
            total += _cross_spectra(np.gradient(signals, axis=0), band)  # accelerations: their spectrum is flatter
        s = ndimage.convolve1d(total, np.full(3, 1.0 / 3.0), axis=0)
        share = _coherent_power(s) / np.maximum(s[:, 0, 0].real, 1e-300)
        slow = f <= SLOW
        lost = ~slow & (share < DRIVEN)
        if lost.any() and np.median(share[slow][1:]) > DRIVEN:
            limit = min(limit, float(f[np.argmax(lost)]))
    return limit


def _frequencies(band: Band) -> np.ndarray:
    """Frequencies of `_cross_spectra` [Hz]: windows of a second resolve 1 Hz."""
    return np.fft.rfftfreq(int(band.rate), 1.0 / band.rate)


def _cross_spectra(x: np.ndarray, band: Band) -> np.ndarray:
    """Cross-spectra of signals (T, k), summed over windows of a second, shape (F, k, k)."""
    window = int(band.rate)
    taper = np.hanning(window)[:, None]
    out = np.zeros((len(_frequencies(band)), x.shape[1], x.shape[1]), dtype=complex)
    for start in range(0, len(x) - window + 1, window // 2):
        piece = x[start : start + window]
        F = np.fft.rfft((piece - piece.mean(axis=0)) * taper, axis=0)
        out += np.einsum("fa,fb->fab", F.conj(), F)
    return out


def _coherent_power(s: np.ndarray) -> np.ndarray:
    """Power of the first of some signals that is coherent with the others, from cross-spectra (F, k, k), shape (F,)."""
    inputs, cross = s[:, 1:, 1:], s[:, 1:, 0]
    ridge = 1e-9 * np.trace(inputs, axis1=1, axis2=2).real[:, None, None] + 1e-300
    known = np.linalg.solve(inputs + ridge * np.eye(inputs.shape[1]), cross[..., None])[..., 0]
    return np.einsum("fa,fa->f", cross.conj(), known).real
