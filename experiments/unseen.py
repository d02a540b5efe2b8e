"""How near a corrected model comes to the torque of a recording that nothing saw, and how near its laws could come."""

import dataclasses

import numpy as np

from irb140_jax.mismatch.columns.along import columns_along, prepared, seen_by
from irb140_jax.mismatch.columns.torques import better_known, library_of
from irb140_jax.mismatch.corrected.model import CorrectedModel, predict, torques_along
from irb140_jax.recordings.conceal import ConcealedCase, Noise
from irb140_jax.recordings.condition import condition
from irb140_jax.recordings.low_pass import filtered, kernels


def unseen_errors(model: CorrectedModel, case: ConcealedCase, noise: Noise) -> dict[str, dict[str, float]]:
    """RMS errors on the case's last recording over the torque sensors' sigma, joint by joint, without the spikes.

    Returns:
        "unseen": of the model.  "unseen_limit": of the same laws and shapes, with the inertials and amplitudes that fit
        this very recording's torque best, joint by joint and without its noise: what no
        other inertials and amplitudes could better, with these laws and shapes.
        "unseen_exact": of the model again, given the positions without the encoders' noise and rounding: what smoothing
        positions better could not mend.
    """
    recording, log = case.recordings[-1], case.secret.logs[-1]
    true = np.stack([np.interp(recording.t, log.t, x) for x in log.tau.T], axis=1)
    sigma = noise.torque * np.array([case.secret.survey.rms(j) for j in range(true.shape[1])])
    sound = np.abs(recording.tau - true) < 6.0 * sigma  # without the spikes, which no model owes

    def error(torque: np.ndarray) -> dict[str, float]:
        off = np.where(sound, recording.tau - torque, 0.0)
        rms = np.sqrt(np.sum(off**2, axis=0) / sound.sum(axis=0)) / sigma
        return dict(zip(model.robot.joint_names, rms.tolist(), strict=True))

    exact = dataclasses.replace(recording, q=np.stack([np.interp(recording.t, log.t, x) for x in log.q.T], axis=1))
    columns, grid = _columns(model, case)
    at_grid = np.stack([np.interp(grid, recording.t, x) for x in true.T], axis=1)
    best = np.empty_like(at_grid)
    for j in range(best.shape[1]):
        A = columns[:, j]
        best[:, j] = A @ np.linalg.lstsq(A, at_grid[:, j], rcond=1e-9)[0]
    best = np.stack([np.interp(recording.t, grid, x) for x in best.T], axis=1)
    return {
        "unseen": error(predict(model, recording)["corrected"]),
        "unseen_limit": error(best),
        "unseen_exact": error(predict(model, exact)["corrected"]),
    }


def _columns(model: CorrectedModel, case: ConcealedCase) -> tuple[np.ndarray, np.ndarray]:
    """What a joint's torque may be made of along the last recording, shape (T, n, K), each of size 1; and its times."""
    smooth = condition(case.recordings[-1], model.band, pad=True)
    torques, lib = torques_along(model, smooth), library_of(model.robot, model.named)
    along = seen_by(better_known(model.robot, model.phi_corrected, model.named), prepared(model.robot, smooth))
    found = columns_along(lib, along, torques.loads)
    one = np.ones(1)
    effects = [lib.torque(found, np.array([k]), one) for c in lib.candidates for k in c.columns]
    parts = np.concatenate([along.regressor_at(slice(None)), np.stack([torques.nominal, *effects], axis=-1)], axis=-1)
    flat = filtered(parts.reshape(len(parts), -1), kernels(model.band.position, model.band.rate)[0])
    size = np.linalg.norm(flat, axis=0)
    return (flat / np.where(size > 0.0, size, 1.0)).reshape(parts.shape), smooth.t
