"""How far the model's torque, of any size, explains the logged one: as it is, or later in time."""

import numpy as np
from scipy.optimize import nnls

from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.torques import Torques

WELL, BADLY = 0.9, 0.6  # shares of a torque's variance that the model explains under a true hypothesis, and as given
BETTER = 5.0  # times less that is left unexplained under a true hypothesis
CHANGED = 0.05  # of the share by which a joint is concerned by a hypothesis
MIN_SHARE = 0.4  # of the model's torque that a joint must log to have a sign or a place worth judging
LATEST = 0.4  # s by which a torque may come late


def explained(seen: Glance, model: Torques, judged: np.ndarray, tau: np.ndarray | None = None) -> np.ndarray:
    """Share of each torque's variance that the model's torque, of any size, and the joint's friction explain, (n,)."""
    tau = seen.tau if tau is None else tau
    out = np.full(tau.shape[1], np.nan)
    for j in np.flatnonzero(judged):
        out[j] = share_explained(terms(seen.qd[:, j], model.total[:, j]), tau[:, j])
    return out


def terms(qd: np.ndarray, model: np.ndarray) -> np.ndarray:
    """The model's torque, viscous and dry friction of one joint, shape (T, 3)."""
    return np.stack([model, *friction(qd)], axis=1)


def friction(qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Viscous and dry friction of one joint, to scale, shape (T,) each."""
    slow = 0.02 * np.abs(qd).max() + 1e-12
    return qd, np.tanh(qd / slow)


def share_explained(features: np.ndarray, target: np.ndarray) -> float:
    """Share of the target's variance that a combination without negative amplitudes explains."""
    return share_of_power(features - features.mean(axis=0), target - target.mean())


def share_of_power(features: np.ndarray, target: np.ndarray) -> float:
    """Share of the target's power that a combination without negative amplitudes explains."""
    power = target @ target
    if power <= 0.0:
        return 0.0
    # Solved in the few dimensions that the features span, not in all samples.
    Q, R = np.linalg.qr(features / np.maximum(np.linalg.norm(features, axis=0), 1e-300))
    inside = Q.T @ target
    return float((inside @ inside - nnls(R, inside)[1] ** 2) / power)


def ratio_to_model(seen: Glance, model: Torques, j: int) -> float:
    """How many times the model's torque the logged one is, without friction; 0 where they have little in common."""
    features = terms(seen.qd[:, j], model.total[:, j])
    centred, target = features - features.mean(axis=0), seen.tau[:, j] - seen.tau[:, j].mean()
    size = np.linalg.norm(centred, axis=0)
    if size[0] <= 0.0 or not target.any():
        return 0.0
    Q, R = np.linalg.qr(centred / np.maximum(size, 1e-300))
    w, missed = nnls(R, Q.T @ target)
    power = target @ target
    whole = (Q.T @ target) @ (Q.T @ target) - missed**2
    clear = whole > WELL * power and (w[0] ** 2) > 0.25 * power
    return float(w[0] / size[0]) if clear else 0.0


def lateness(seen: Glance, model: Torques, j: int) -> float:
    """Time by which a joint's torque must be moved ahead for the model to explain it [s], 0 where that doesn't help.

    Args:
        seen: A quick look at a recording.
        model: Torque of the nominal model.
        j: The joint.
    """
    step = _step(seen)
    # A slow wave turned round is nearly the wave half a period late.
    turned = share_explained(terms(seen.qd[:, j], model.total[:, j]), -seen.tau[:, j])
    best = 1.0 - min(1.0 - WELL, (1.0 - turned) / 2.0), 0
    return max(best, *((_share_later(seen, model, j, k), k) for k in range(1, int(LATEST / step) + 1)))[1] * step


def lateness_of_all(seen: Glance, model: Torques, judged: np.ndarray) -> float:
    """Time by which all torques must be moved ahead for the model to explain most of them [s], below 0 if moved back.

    Returns:
        0 where that isn't clear.
    """
    step, joints = _step(seen), np.flatnonzero(judged)
    shifts = np.arange(-int(LATEST / step), int(LATEST / step) + 1)
    left = 1.0 - np.array([[_share_later(seen, model, int(j), int(k)) for j in joints] for k in shifts])
    best = int(np.argmin(np.sum(np.log(left + 0.01), axis=1)))
    clear = (left[best] < 1.0 - WELL) & (BETTER * left[best] < left[shifts == 0][0])
    return float(shifts[best] * step) if 2 * clear.sum() > len(joints) else 0.0


def _step(seen: Glance) -> float:
    return float(seen.t[-1] - seen.t[0]) / (len(seen.t) - 1)


def _share_later(seen: Glance, model: Torques, j: int, k: int) -> float:
    """Share of a joint's torque that is explained by the model k samples before."""
    rows = slice(0, len(seen.tau) - k) if k >= 0 else slice(-k, None)
    later = slice(k, None) if k >= 0 else slice(0, k)
    return share_explained(terms(seen.qd[:, j], model.total[:, j])[rows], seen.tau[later, j])
