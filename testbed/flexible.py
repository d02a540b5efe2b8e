"""Two-mass joints: a spring, maybe with play, between a motor whose path is given and a link that swings on it.

The link's bend u = q - q_link solves  torque at the link (q - u) = spring(u) + damping du/dt,  with everything else of
the arm on its path.  Each round takes the rigid-body torque along the path found last; what the bend changes of it
beyond the link's own inertia is small, so a few rounds settle it.
"""

import dataclasses

import numpy as np

from testbed import rigid
from testbed.arms import Arm
from testbed.motions import STEP, Motion

SUBSTEPS = 4  # of a step while a link flies through play: a flank of 60 Hz is then followed at 130 steps a period


@dataclasses.dataclass(frozen=True)
class Transmission:
    """A spring and a damper between motor and link.

    Attributes:
        joint: Where.
        stiffness: On the flank [N m/rad].
        damping: [N m s/rad], while the flank is touched.
        cubic: Stiffening, the torque of which is cubic u^3 [N m/rad^3].
        gap: Play, both ways together [rad].
    """

    joint: int
    stiffness: float
    damping: float
    cubic: float = 0.0
    gap: float = 0.0


def torque(arm: Arm, motion: Motion, joint: Transmission, rounds: int = 4) -> np.ndarray:
    """Torque of all motors, (T, n), rotors included; positions of `motion` are the motors'."""
    j, stiff_arm = joint.joint, dataclasses.replace(arm, rotor=np.where(np.arange(arm.n) == joint.joint, 0, arm.rotor))
    mass = rigid.own_inertia(arm, motion.q[::20], j)
    mass = np.interp(motion.t, motion.t[::20], mass)
    u = np.zeros((3, len(motion.t)))  # the bend, its rate and its acceleration
    for _ in range(rounds if joint.gap == 0.0 else 2):
        load = _along(stiff_arm, motion, j, u)[:, j] + mass * u[2]
        u = swing(load, mass, joint, u[0]) if joint.gap == 0.0 else flight(load, mass, joint)
    tau = _along(stiff_arm, motion, j, u)
    tau[:, j] += arm.rotor[j] * motion.qdd[:, j]
    return tau


def swing(load: np.ndarray, mass: np.ndarray, joint: Transmission, guess: np.ndarray) -> np.ndarray:
    """Bend of a spring without play: mass u'' + damping u' + K u + cubic u^3 = load, by Newmark's rule, shape (3, T).

    The cube is taken about the bend found last (`guess`), which Newton's method makes exact over the rounds.
    """
    spring = joint.stiffness + 3.0 * joint.cubic * guess**2
    load = load + 2.0 * joint.cubic * guess**3
    h, d = STEP, joint.damping
    v, rate, bend = float(load[0] / spring[0]), 0.0, 0.0
    out = np.empty((3, len(load)))
    for i, (f, m, k) in enumerate(zip(load.tolist(), mass.tolist(), spring.tolist(), strict=True)):
        ahead, rate_ahead = v + h * rate + 0.25 * h * h * bend, rate + 0.5 * h * bend
        bend = (f - d * rate_ahead - k * ahead) / (m + 0.5 * h * d + 0.25 * h * h * k)
        v, rate = ahead + 0.25 * h * h * bend, rate_ahead + 0.5 * h * bend
        out[:, i] = v, rate, bend
    return out


def flight(load: np.ndarray, mass: np.ndarray, joint: Transmission) -> np.ndarray:
    """Bend of a spring with play: nothing but the load's inertia within the gap, spring and damper on its flanks."""
    h, half, k, d = STEP / SUBSTEPS, 0.5 * joint.gap, joint.stiffness, joint.damping
    u = float(np.sign(load[0]) * half + load[0] / k)
    rate, out = 0.0, np.empty((3, len(load)))
    steps = range(SUBSTEPS)
    for i, (f, m) in enumerate(zip(load.tolist(), mass.tolist(), strict=True)):
        before = rate
        for _ in steps:
            if u > half:
                rate = (rate + h / m * (f - k * (u - half))) / (1.0 + h / m * d)
            elif u < -half:
                rate = (rate + h / m * (f - k * (u + half))) / (1.0 + h / m * d)
            else:
                rate += h / m * f
            u += h * rate
        out[:, i] = u, rate, (rate - before) / STEP
    return out


def _along(arm: Arm, motion: Motion, j: int, u: np.ndarray) -> np.ndarray:
    q, qd, qdd = motion.q.copy(), motion.qd.copy(), motion.qdd.copy()
    q[:, j], qd[:, j], qdd[:, j] = q[:, j] - u[0], qd[:, j] - u[1], qdd[:, j] - u[2]
    return rigid.torque(arm, q, qd, qdd)
