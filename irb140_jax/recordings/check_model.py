"""Does this recording belong to this robot?  Units, signs and order of the channels, judged by the nominal model.

The model is allowed to be wrong, that is what the program is for: half the mass missing, friction above everything, a
tilted base, a payload.  So only what no physics could bring about is refused, and doubt passes.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np
from scipy.optimize import linear_sum_assignment

from irb140_jax.effects.delay import HALVES
from irb140_jax.errors import RecordingError
from irb140_jax.recordings.channels import ORDER, channel_doubts
from irb140_jax.recordings.check import MOVING
from irb140_jax.recordings.doubt import Doubt
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.hidden_payload import explained_by_a_payload
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torque_shape import (
    MIN_SHARE,
    explained,
    friction,
    lateness,
    lateness_of_all,
    ratio_to_model,
    share_of_power,
)
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.robot import Robot

FAR = 20.0  # rad; three turns: beyond the reach of any joint that has limits
CERTAIN, NONE = 0.7, 0.15  # shares of a torque's variance that count as explained and as not explained
LONGEST_DELAY = 2.0 * max(HALVES)  # s; a diagnosis finds shorter ones itself


def check_against_model(recording: Recording, seen: Glance, robot: Robot) -> Recording:
    """Refuse a recording whose positions are in degrees or whose channels have a wrong unit, sign, zero or joint.

    Returns:
        The recording, with a note where a channel looks wrong and a payload would look the same, or where torque comes
        so late that it looks reversed, or that no diagnosis finds it.

    Raises:
        RecordingError: The nominal model says so beyond doubt.
    """
    hinge = ~np.asarray(robot.is_slide)
    living = True if recording.torque_lost is None else ~recording.torque_lost.any(axis=0)
    moving = (seen.travel > np.where(hinge, *MOVING)) & living
    model = nominal_torques(robot, seen.q, seen.qd, seen.qdd)
    _check_angles(recording, seen, robot, model, moving & hinge)
    # A joint that is carried along unpowered logs a little of anything, even drag of the wrong sign.
    driven = moving & (np.std(seen.tau, axis=0) > MIN_SHARE * np.std(model.total, axis=0))
    late = {int(j): lateness(seen, model, int(j)) for j in _reversed(seen, model, driven)}
    on_time = moving & ~np.isin(np.arange(robot.n), [j for j, delay in late.items() if delay > 0.0])
    passed = []
    for doubt in (
        *_order_doubts(recording, seen, model, on_time), *_sign_doubts(recording, seen, model, driven & on_time),
        *channel_doubts(recording, seen, robot, on_time, driven),
    ):  # fmt: skip
        if not explained_by_a_payload(doubt, seen, robot, model, on_time):
            raise RecordingError(f"{recording.source}: {doubt.said}: {doubt.remedy}")
        said = (f"{doubt.said}; a payload that the model leaves out, or another centre of mass, would explain about "
                "as much, and nothing is changed")  # fmt: skip
        passed += [said] if said not in passed else []
    said = [f"tau.{recording.joint_names[j]} comes about {1000 * delay:.0f} ms after what the model needs: a drive "
            "that lags, or channels out of step" for j, delay in late.items() if delay > 0.0]  # fmt: skip
    if not said and abs(delay := lateness_of_all(seen, model, moving)) > LONGEST_DELAY:
        when = "after" if delay > 0.0 else "before"
        said = [f"The torque of most joints comes about {abs(1000 * delay):.0f} ms {when} what the model needs: drives "
                "that lag, or channels out of step. Shift the torque by as much in time: a diagnosis finds delays up "
                f"to {1000 * LONGEST_DELAY:.0f} ms, and takes a longer one for something else"]  # fmt: skip
    return dataclasses.replace(recording, notes=(*recording.notes, *passed, *said))


def explained_shares(seen: Glance, model: Torques) -> np.ndarray:
    """Share of tau_k's variance that joint j's physics can explain, shape (n, n).

    tau_k ~ a gravity_j + b motion_j + c qd_j + d sign(qd_j) + e qdd_j + offset,   a to e >= 0
    """
    n = seen.q.shape[1]
    centred = lambda x: x - x.mean(axis=0)  # noqa: E731
    features = [np.stack([model.gravity[:, j], model.moving[:, j], *own_motion(seen, j)], axis=1) for j in range(n)]
    targets = centred(seen.tau)
    return np.array([[share_of_power(centred(features[j]), targets[:, k]) for k in range(n)] for j in range(n)])


def motion_shares(seen: Glance, model: Torques) -> tuple[np.ndarray, np.ndarray]:
    """How much of what gravity can't explain follows friction and inertia of the joint itself, shape (n,) each.

    tau_j ~ sign (c qd_j + d sign(qd_j) + e qdd_j + b motion_j) + whatever follows positions,   b to e >= 0

    Friction and inertia can't be negative; gravity can: a payload may hang on the other side.  So everything that
    follows positions is taken out first.

    Returns:
        Shares of the variance that is left, with the sign given and with the sign reversed; 0 where hardly any is left.
    """
    n = seen.q.shape[1]
    basis = np.linalg.qr(np.concatenate([np.ones((len(seen.q), 1)), seen.q, model.gravity], axis=1))[0]
    left = lambda x: x - basis @ (basis.T @ x)  # noqa: E731
    targets, shares = left(seen.tau), np.zeros((2, n))
    for j in range(n):
        if np.var(targets[:, j]) > 0.05 * np.var(seen.tau[:, j]):
            features = left(np.stack([model.moving[:, j], *own_motion(seen, j)], axis=1))
            shares[:, j] = [share_of_power(features, sign * targets[:, j]) for sign in (1, -1)]
    return shares[0], shares[1]


def own_motion(seen: Glance, j: int) -> tuple[np.ndarray, ...]:
    """Viscous friction, dry friction and rotor inertia of joint j, to scale."""
    return *friction(seen.qd[:, j]), seen.qdd[:, j]


def _check_angles(recording: Recording, seen: Glance, robot: Robot, model: Torques, hinges: np.ndarray) -> None:
    if not hinges.any():
        return
    names, source = recording.joint_names, recording.source
    remedy = "convert q to radians on the joint side, or map it with --columns and [scale] \"q.*\" = \"deg\""
    far = np.max(np.abs(recording.q[:, hinges]))
    whole, held = (_misfit(seen.tau, part)[hinges] for part in (model.total, model.gravity))
    given = np.median(whole)
    # Accelerations of coarse positions are noise, which would pass for a wrong unit; gravity needs positions only.
    if given < 0.7 or np.min(held) < 0.7:
        return  # in radians the model already tells most of the torque, or gravity most of one joint's
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
    # A torque of the shape that the model has in radians is rather in another unit, unless degrees tell its size, too.
    shaped = np.median([ratio_to_model(seen, model, int(j)) for j in np.flatnonzero(hinges)]) > 0.0
    if given > 5.0 and degrees < (0.4 if shaped else 1.2) and far > 2.0 or (
        given > 1.0 and degrees < 0.4 and far > 2 * np.pi
    ):
        raise RecordingError(f"{source}: the columns q.* look like degrees: in radians the model's torque is off by "
                             f"{given:.1f} times what is logged, in degrees by {degrees:.1f} times; {remedy}; "
                             "if q is in radians, tau is in another unit")


def _reversed(seen: Glance, model: Torques, driven: np.ndarray) -> np.ndarray:
    """Driven joints whose torque would fit with the sign reversed, and does not as it is."""
    right, wrong = motion_shares(seen, model)
    # Where that says little, the reversed torque itself must fit, on a joint where a payload could not turn it round:
    # one that carries much of the arm, or one that gravity hardly touches.
    size = np.std(model.total, axis=0)
    sure = (size > 0.1 * size.max()) | (np.std(model.moving, axis=0) > 2 * np.std(model.gravity, axis=0))
    fits = sure & (_misfit(-seen.tau, model.total) < 0.35) & (_misfit(seen.tau, model.total) > 1.5)
    return np.flatnonzero(driven & ((wrong > CERTAIN) & (right < NONE) | fits))


def _sign_doubts(recording: Recording, seen: Glance, model: Torques, driven: np.ndarray) -> Iterator[Doubt]:
    reversed_ = _reversed(seen, model, driven)
    if len(reversed_):
        names = [recording.joint_names[j] for j in reversed_]
        sign = np.where(np.isin(np.arange(len(driven)), reversed_), -1.0, 1.0)
        yield Doubt(
            "reversed torque", tuple(reversed_.tolist()), f"column{'s' if len(names) > 1 else ''} "
            f"{', '.join('tau.' + x for x in names)} of the wrong sign: the reversed torque is what the model and "
            "friction would need", f"map it with --columns and [scale] \"tau.{names[0]}\" = -1; if it is q that is "
            "reversed, or gravity or a zero in the model is turned round, mend that",
            {f"tau.{x}": -1.0 for x in names}, explained(seen, model, driven, sign * seen.tau),
        )  # fmt: skip


def _order_doubts(recording: Recording, seen: Glance, model: Torques, moving: np.ndarray) -> Iterator[Doubt]:
    shares = explained_shares(seen, model)
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
            names, order = recording.joint_names, np.arange(len(best))
            order[pairs] = best[pairs]
            text = ", ".join(f"tau.{names[best[j]]} fits joint {names[j]}" for j in pairs)
            yield Doubt(
                "exchanged torque", tuple(pairs), f"torque columns look exchanged: {text}", ORDER, {},
                explained(seen, model, moving & moving[order], seen.tau[:, order]),
            )  # fmt: skip
            return


def _misfit(tau: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Spread of what the model leaves over the spread of the torque, per joint."""
    return np.std(tau - model, axis=0) / np.maximum(np.std(tau, axis=0), 1e-9)
