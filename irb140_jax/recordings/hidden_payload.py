"""Would a payload that the model leaves out look like a wrong channel?

A body on the last link, to one side, turns gravity on the wrist round as a reversed column does, and bends it upstream
as another zero does.  It is what a diagnosis is for, so a recording that it explains is not refused.
"""

import numpy as np
from scipy.optimize import nnls

from irb140_jax.recordings.doubt import Doubt
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.torque_shape import BETTER, terms
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.robot import Robot, with_phi


def explained_by_a_payload(doubt: Doubt, seen: Glance, robot: Robot, model: Torques, judged: np.ndarray) -> bool:
    """Whether a payload explains the torque as well as a mended channel does, or nearly as well as another zero.

    Another centre of mass of the last link turns gravity as another zero of its joint does, but for the inertia.

    Args:
        doubt: What is taken for wrong; where its `explained` is None, such as for units, no payload is asked for.
        seen: A quick look at the recording.
        robot: The nominal model.
        model: Its torque.
        judged: Joints that move and have a living torque channel, shape (n,).
    """
    if doubt.explained is None:
        return False
    both = judged & np.isfinite(doubt.explained)
    left = min(np.sum(1.0 - shares[both]) for shares in _explained_with_payload(seen, robot, model, judged))
    nearly = BETTER if doubt.kind == "zero" else 1.0
    return bool(left < nearly * np.sum(1.0 - doubt.explained[both]))


def _explained_with_payload(seen: Glance, robot: Robot, model: Torques, judged: np.ndarray) -> list[np.ndarray]:
    """Share of each torque that is explained with a payload, by each link that carries no other, shape (n,) each.

    tau_j ~ s_j model_j + c_j qd_j + d_j sign(qd_j) + m (torque of a kilogram) + h . (torque of a kilogram metre),
    centred, with s, c, d and m not below 0; m and h are the same for all joints.
    """
    joints, n = np.flatnonzero(judged), robot.n
    sizes = np.maximum(np.std(seen.tau, axis=0), 1e-9)
    centred = lambda x: (x - x.mean(axis=0)) / sizes  # noqa: E731
    target, count = centred(seen.tau), len(joints)
    out = []
    for link in sorted(set(range(n)) - set(robot.parent)):
        loaded = [with_phi(robot, robot.phi.at[link, k].add(1.0)) for k in range(4)]
        mass, *moments = (centred(nominal_torques(x, seen.q, seen.qd, seen.qdd).total - model.total) for x in loaded)
        shared = np.stack([mass, *moments, *(-x for x in moments)], axis=-1)[:, joints]
        rows = np.zeros((count, len(target), 3 * count + shared.shape[-1]))
        for i, j in enumerate(joints):
            features = terms(seen.qd[:, j], model.total[:, j])
            rows[i, :, 3 * i : 3 * i + 3] = (features - features.mean(axis=0)) / sizes[j]
            rows[i, :, 3 * count :] = shared[:, i]
        flat = rows.reshape(-1, rows.shape[-1])
        # Solved in the few dimensions that the columns span, not in all samples.
        Q, R = np.linalg.qr(flat)
        best = nnls(R, Q.T @ target[:, joints].T.ravel())[0]
        shares = np.full(n, np.nan)
        shares[joints] = 1.0 - np.mean((target[:, joints].T - rows @ best) ** 2, axis=1)
        out.append(shares)
    return out
