"""A plant: an arm as it was built, what acts on its joints, its drives, and the clocks of its log."""

import dataclasses
from collections.abc import Callable

import numpy as np
from scipy import interpolate

from testbed import drives, flexible, rigid
from testbed.arms import Arm
from testbed.motions import STEP, Motion

Law = Callable[[Motion, np.ndarray], np.ndarray]  # motion and rigid-body torque (T, n) -> torque of the motors (T, n)
Drive = Callable[[Motion, np.ndarray], np.ndarray]  # motion and torque on the joints (T, n) -> the torque asked for


@dataclasses.dataclass(frozen=True)
class Hidden:
    """One thing that is true of a plant and not of its model.

    Attributes:
        kind: What it is, in the testbed's own words.
        slug: The contract's name for it, or None where it has none.
        joints: Indices of the joints whose torque it changes by itself.
        parameters: In the contract's meaning, as far as they have one there.
        accept: Names that are right.
        tolerate: Names that are not wrong beside it.
        role: "special"; "ordinary" friction; or "instrument", which may but need not be named.
        unnamed: Whether saying that something is left, or a note, is right, too.
        depends: Words: what is left there is rightly said to depend on something if one of them is in the sentence.
    """

    kind: str
    slug: str | None
    joints: tuple[int, ...]
    parameters: dict[str, float] = dataclasses.field(default_factory=dict)
    accept: tuple[str, ...] = ()
    tolerate: tuple[str, ...] = ()
    role: str = "special"
    unnamed: bool = False
    depends: tuple[str, ...] = ()


@dataclasses.dataclass
class Plant:
    """The true arm and everything that its model lacks.

    Attributes:
        nominal: The arm of the model.
        arm: As it was built.
        laws: Torques that motors give beside the rigid body's.
        transmission: The one joint that is flexible or has play, if any.
        drives: From the torque on the joints to the one asked for, one after the other.
        zero: Added to the logged positions, shape (n,) [rad or m].
        misread: Joints whose position is read wrongly: joint -> error at a true position [rad or m].
        late: By how much each torque channel lags behind the positions, shape (n,) [s].
        dead: Channels that show something else: joint -> function of time and torque, (T,) each.
        hidden: The truth.
        taken: Joints whose friction has been seen to: slug -> joints.
    """

    nominal: Arm
    arm: Arm
    laws: list[Law] = dataclasses.field(default_factory=list)
    transmission: flexible.Transmission | None = None
    drives: list[Drive] = dataclasses.field(default_factory=list)
    zero: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    misread: dict[int, Callable[[np.ndarray], np.ndarray]] = dataclasses.field(default_factory=dict)
    late: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    dead: dict[int, Callable[[np.ndarray, np.ndarray], np.ndarray]] = dataclasses.field(default_factory=dict)
    hidden: list[Hidden] = dataclasses.field(default_factory=list)
    taken: dict[str, set[int]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        n = self.arm.n
        self.zero, self.late = (x if len(x) else np.zeros(n) for x in (self.zero, self.late))


@dataclasses.dataclass(frozen=True)
class Sizes:
    """What the joints do along the motions of a case.

    Attributes:
        tau, qd, qdd: RMS of each joint's, shape (n,).
        low, high: Where its positions lie, shape (n,).
        inertia: What it carries on average, its rotor left out, shape (n,).
        motions: The motions, every tenth of a second.
    """

    tau: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    inertia: np.ndarray
    motions: list[Motion]


def sizes_of(arm: Arm, motions: list[Motion]) -> Sizes:
    """Sizes along motions of the bare rigid arm."""
    every = round(0.1 / STEP)
    few = [
        dataclasses.replace(m, t=m.t[::every], q=m.q[::every], qd=m.qd[::every], qdd=m.qdd[::every]) for m in motions
    ]
    q, qd, qdd = (np.concatenate([getattr(m, name) for m in few]) for name in ("q", "qd", "qdd"))
    rms = lambda x: np.sqrt(np.mean(x**2, axis=0))  # noqa: E731
    tau = rms(rigid.torque(arm, q, qd, qdd))
    inertia = np.array([np.mean(rigid.own_inertia(arm, q[::10], j)) for j in range(arm.n)])
    # A vertical axis at rest needs next to nothing: sizes are never below a hundredth of the largest.
    return Sizes(np.maximum(tau, 0.01 * tau.max()), rms(qd), rms(qdd), q.min(axis=0), q.max(axis=0), inertia, few)


def torque(plant: Plant, motion: Motion) -> np.ndarray:
    """Torque asked of the drives along a motion, (T, n), before clocks and dead channels."""
    rigid_torque = rigid.torque(plant.arm, motion.q, motion.qd, motion.qdd)
    tau = rigid_torque.copy()
    if plant.transmission is not None:
        tau = flexible.torque(plant.arm, motion, plant.transmission)
    for law in plant.laws:
        tau = tau + law(motion, rigid_torque - plant.arm.rotor * motion.qdd)
    for drive in plant.drives:
        tau = drive(motion, tau)
    return tau


def channels(plant: Plant, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Positions and torques as the controller's channels have them, every STEP, (T, n) each."""
    tau = drives.late(motion.t, torque(plant, motion), plant.late)
    for j, shown in plant.dead.items():
        tau[:, j] = shown(motion.t, tau[:, j])
    return as_read(plant, motion.q), tau


def as_read(plant: Plant, q: np.ndarray) -> np.ndarray:
    """Positions as the encoders show them, (T, n), at true ones."""
    shown = q + plant.zero
    for j, error in plant.misread.items():
        shown[:, j] += error(q[:, j])
    return shown


def torque_along(
    plant: Plant, t: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, number: int
) -> np.ndarray:
    """Torque channels along a motion that is known at some times only, such as a measured one, (T, n).

    Args:
        plant: Which.
        t: By the channels' clock [s], shape (T,).
        q, qd, qdd: Positions as logged, and their derivatives, shape (T, n).
        number: Of the recording.
    """
    fine = np.arange(t[0], t[-1], STEP)
    at = lambda x: interpolate.CubicSpline(t, x)(fine)  # noqa: E731
    true, speed, bend = 2.0 * q - as_read(plant, q), at(qd), at(qdd)
    for j in plant.misread:
        path = interpolate.CubicSpline(t, true[:, j])
        speed[:, j], bend[:, j] = path(fine, 1), path(fine, 2)
    tau = channels(plant, Motion(fine, at(true), speed, bend, number))[1]
    return np.stack([np.interp(t, fine, c) for c in tau.T], axis=1)


def on(j: int, law: Callable[[Motion, np.ndarray], np.ndarray]) -> Law:
    """A law of one joint, (motion, its rigid-body torque (T,)) -> (T,), as one of the arm."""

    def of_arm(motion: Motion, load: np.ndarray) -> np.ndarray:
        tau = np.zeros_like(motion.q)
        tau[:, j] = law(motion, load[:, j])
        return tau

    return of_arm
