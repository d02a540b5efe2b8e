"""Does this recording belong to this robot?  Units, signs and order of the channels, judged by the nominal model.

The model is allowed to be wrong, that is what the program is for: half the mass missing, friction above everything, a
tilted base, a payload.  So only what no physics could bring about is refused, and doubt passes.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.optimize import linear_sum_assignment, nnls

from irb140_jax.dynamics import inverse_dynamics_batch
from irb140_jax.errors import RecordingError
from irb140_jax.recordings.check import MOVING
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot

FAR = 20.0  # rad; three turns: beyond the reach of any joint that has limits
CERTAIN, NONE = 0.7, 0.15  # shares of a torque's variance that count as explained and as not explained
MIN_SHARE = 0.4  # of the model's torque that a joint must log to have a sign or a place worth judging
TOO_SMALL, TOO_LARGE = 1 / 20, 20.0  # torque over the model's torque that no payload or friction explains


class Torques(NamedTuple):
    """What the nominal model says of a motion: shape (SAMPLES, n) each, [N m or N].

    Attributes:
        gravity: Torque at rest in the same poses.
        moving: What motion adds to it.
    """

    gravity: np.ndarray
    moving: np.ndarray

    @property
    def total(self) -> np.ndarray:
        return self.gravity + self.moving


def check_against_model(recording: Recording, seen: Glance, robot: Robot) -> None:
    """Refuse a recording whose positions are in degrees or whose torque has a wrong unit, sign or joint.

    Raises:
        RecordingError: The nominal model says so beyond doubt.
    """
    hinge = ~np.asarray(robot.is_slide)
    moving = seen.travel > np.where(hinge, MOVING[0], MOVING[1])
    model = nominal_torques(robot, seen.q, seen.qd, seen.qdd)
    _check_angles(recording, seen, robot, model, moving & hinge)
    # A joint that is carried along unpowered logs a little of anything, even drag of the wrong sign.
    driven = moving & (np.std(seen.tau, axis=0) > MIN_SHARE * np.std(model.total, axis=0))
    _check_order(recording, seen, model, moving)
    share = {sign: explained_shares(seen, model, sign, springs=True) for sign in (1, -1)}
    _check_sign(recording, share, driven)
    _check_scale(recording, seen, model, moving)


def nominal_torques(robot: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> Torques:
    """Gravity and motion torque of the nominal model along a motion, arrays of shape (SAMPLES, n)."""
    at, still = jnp.asarray(q), jnp.zeros(q.shape)
    gravity = np.asarray(inverse_dynamics_batch(robot, at, still, still))
    total = np.asarray(inverse_dynamics_batch(robot, at, jnp.asarray(qd), jnp.asarray(qdd)))
    return Torques(gravity, total - gravity)


def explained_shares(seen: Glance, model: Torques, sign: int, *, springs: bool) -> np.ndarray:
    """Share of tau_k that joint j's physics can explain, with every amplitude of the given sign, shape (n, n).

    tau_k ~ sign (a gravity_j + b motion_j + c qd_j + d sign(qd_j) + e qdd_j) + offset [+ k q_j],   a to e >= 0

    Masses, friction and rotor inertia can't be negative, so a fit that needs them negative has the sign wrong; a spring
    may pull either way, which is why it is left free where the sign is at stake.
    """
    n = seen.q.shape[1]
    shares = np.zeros((n, n))
    for j in range(n):
        slow = 0.02 * np.abs(seen.qd[:, j]).max() + 1e-12
        features = np.stack([model.gravity[:, j], model.moving[:, j], seen.qd[:, j], np.tanh(seen.qd[:, j] / slow),
                             seen.qdd[:, j]], axis=1)
        free = np.stack([np.ones(len(seen.q)), *([seen.q[:, j]] if springs else [])], axis=1)
        basis = np.linalg.qr(free)[0]
        left = lambda x: x - basis @ (basis.T @ x)  # noqa: B023, E731
        features = left(features)
        features = features / np.maximum(np.linalg.norm(features, axis=0), 1e-300)
        # Solved in the few dimensions that the features and torques span, not in all samples.
        Q, R = np.linalg.qr(features)
        targets = left(seen.tau)
        for k in range(n):
            power = targets[:, k] @ targets[:, k]
            if power <= 0.05 * len(seen.q) * np.var(seen.tau[:, k]):
                continue  # an offset and a spring explain it: it says nothing of anything else
            inside = sign * (Q.T @ targets[:, k])
            shares[j, k] = (inside @ inside - nnls(R, inside)[1] ** 2) / power
    return shares


def _check_angles(recording: Recording, seen: Glance, robot: Robot, model: Torques, hinges: np.ndarray) -> None:
    if not hinges.any():
        return
    names, source = recording.joint_names, recording.source
    remedy = "convert q to radians on the joint side, or map it with --columns and [scale] \"q.*\" = \"deg\""
    far = np.max(np.abs(recording.q[:, hinges]))
    given = np.median(_misfit(seen.tau, model.total)[hinges])
    if given < 0.7:
        return  # in radians the model already tells most of the torque
    for j in np.flatnonzero(hinges & np.isfinite(robot.lower) & np.isfinite(robot.upper)):
        lower, upper = float(robot.lower[j]), float(robot.upper[j])
        largest = float(np.max(np.abs(recording.q[:, j])))
        beyond = largest - max(abs(lower), abs(upper))
        if largest > FAR and beyond > 0.5 * FAR:
            raise RecordingError(f"{source}: column q.{names[j]} reaches {largest:.1f} rad, the model's limits are "
                                 f"{lower:.3g} and {upper:.3g} rad: this looks like degrees or the motor side; "
                                 f"{remedy}; if the joint does turn that far, correct the limits in the model")
    to_radians = np.where(np.asarray(robot.is_slide), 1.0, np.pi / 180)
    # As degrees, the same numbers are a motion 57 times slower: one of the two agrees with the torque.
    other = nominal_torques(robot, *(x * to_radians for x in (seen.q, seen.qd, seen.qdd)))
    degrees = np.median(_misfit(seen.tau, other.total)[hinges])
    if given > 5.0 and degrees < 1.2 and far > 2.0 or given > 1.0 and degrees < 0.4 and far > 2 * np.pi:
        raise RecordingError(f"{source}: the columns q.* look like degrees: in radians the model's torque is off by "
                             f"{given:.1f} times what is logged, in degrees by {degrees:.1f} times; {remedy}")


def _check_sign(recording: Recording, share: dict[int, np.ndarray], driven: np.ndarray) -> None:
    right, wrong = np.diag(share[1]), np.diag(share[-1])
    reversed_ = [j for j in np.flatnonzero(driven) if wrong[j] > CERTAIN and right[j] < NONE]
    if reversed_:
        names = [recording.joint_names[j] for j in reversed_]
        raise RecordingError(f"{recording.source}: column{'s' if len(names) > 1 else ''} "
                             f"{', '.join('tau.' + x for x in names)} of the wrong sign: the reversed torque is what "
                             f"the model and friction would need; map it with --columns and [scale] \"tau.{names[0]}\" "
                             "= -1; if it is q that is reversed, or gravity or a zero in the model is turned round, "
                             "mend that")


def _check_order(recording: Recording, seen: Glance, model: Torques, moving: np.ndarray) -> None:
    shares = explained_shares(seen, model, 1, springs=False)
    # Misfit of the model's torque of joint j, as it is, to tau_k.
    misfit = np.stack([_misfit(seen.tau, model.total[:, [j]]) for j in range(len(shares))])
    size = np.std(seen.tau, axis=0)[None, :] / np.maximum(np.std(model.total, axis=0)[:, None], 1e-9)
    by_share = shares > CERTAIN, np.diag(shares) < CERTAIN / 2, linear_sum_assignment(-shares)[1]
    by_misfit = misfit < 0.5, np.diag(misfit) > 0.6, linear_sum_assignment(misfit)[1]
    for fits, unfit, best in (by_share, by_misfit):
        # Every joint of an exchange must be fitted by its partner's column and not by its own.
        sure = {j for j, k in enumerate(best) if j != k and moving[j] and fits[j, k] and unfit[j] and unfit[k]
                and size[j, k] > MIN_SHARE}
        pairs = [j for j in sorted(sure) if best[j] in sure]
        if pairs:
            names = recording.joint_names
            text = ", ".join(f"tau.{names[best[j]]} fits joint {names[j]}" for j in pairs)
            raise RecordingError(f"{recording.source}: torque columns look exchanged: {text}; put the columns in "
                                 "order, or exchange them with --columns FILE.toml")


def _check_scale(recording: Recording, seen: Glance, model: Torques, moving: np.ndarray) -> None:
    """Torque in another unit or on the motor side: it follows the model on every joint, and is far too small or "
      "large."""
    follows = [j for j in np.flatnonzero(moving) if np.var(model.total[:, j]) > 0 and np.var(seen.tau[:, j]) > 0
               and np.corrcoef(model.total[:, j], seen.tau[:, j])[0, 1] > 0.9]
    ratios = [float(np.std(seen.tau[:, j]) / np.std(model.total[:, j])) for j in follows]
    if ratios and (max(ratios) < TOO_SMALL or min(ratios) > TOO_LARGE):
        j = follows[int(np.argmax(ratios))]
        raise RecordingError(f"{recording.source}: column tau.{recording.joint_names[j]} has the shape of the model's "
                             f"torque but is {max(ratios):.3g} times as large, and no other joint fits better; N m on "
                             "the joint side are wanted: multiply motor torque by the gear ratio, current by the "
                             "torque constant too, with --columns and [scale]")


def _misfit(tau: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Spread of what the model leaves over the spread of the torque, per joint."""
    return np.std(tau - model, axis=0) / np.maximum(np.std(tau, axis=0), 1e-9)
