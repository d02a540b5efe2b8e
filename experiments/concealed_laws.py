"""Laws to conceal in a real recording: torque that one more effect would have needed, or a fault of the log.

Along positions that SciPy smooths, by NumPy and MuJoCo.  Frictions, springs, ripples, payloads and pushes are of
another form than the library's; offsets, gains, delays, rotors, zeros and a leaning base have one form only.
"""

import dataclasses
from collections.abc import Callable

import mujoco
import numpy as np
from scipy import signal

from irb140_jax.recordings import Recording

EVERY = 100.0  # Hz, at which MuJoCo is asked


@dataclasses.dataclass
class Motion:
    """One recording along smoothed positions.

    Attributes:
        number: Which of the recordings it is.
        t: Time [s], shape (T,).
        q, qd, qdd: Motion [rad; rad/s; rad/s^2], shape (T, n).
        tau: Logged torque [N m], shape (T, n).
        tool, jacobian: Position of the last body's centre of mass [m], shape (T, 3), and its Jacobian, (T, 3, n).
        gravity: Torque (T, n) that gravity asks of the model's joints, from its vector in world axes (3,) [m/s^2].
    """

    number: int
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    tool: np.ndarray
    jacobian: np.ndarray
    gravity: Callable[[np.ndarray], np.ndarray]


@dataclasses.dataclass
class Hidden:
    """A change of the logs and the truth about it, in the words of `testbed.plants.Hidden`.

    Attributes:
        change: New positions and torques from a motion and the logged positions.
        slug, joints, parameters, accept, tolerate: See there.
    """

    change: Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]
    slug: str
    joints: tuple[int, ...]
    parameters: dict[str, float]
    accept: tuple[str, ...]
    tolerate: tuple[str, ...] = ()


def motion_of(model: mujoco.MjModel, log: Recording, number: int, cut: float) -> Motion:
    """The motion of a log, by SciPy, and what MuJoCo says along it."""
    rate = 1.0 / float(np.median(np.diff(log.t)))
    even = log.t[0] + np.arange(int((log.t[-1] - log.t[0]) * rate) + 1) / rate
    on_even = np.stack([np.interp(even, log.t, x) for x in log.q.T], axis=1)
    smooth = signal.sosfiltfilt(signal.butter(4, cut, fs=rate, output="sos"), on_even, axis=0)
    qd = np.gradient(smooth, 1.0 / rate, axis=0)
    qdd = np.gradient(qd, 1.0 / rate, axis=0)
    back = lambda x: np.stack([np.interp(log.t, even, c) for c in x.T], axis=1)  # noqa: E731
    q, qd, qdd = back(smooth), back(qd), back(qdd)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(model.njnt)]
    order = [names.index(name) for name in log.joint_names]
    at = np.unique(np.r_[0 : len(log.t) : max(round(rate / EVERY), 1), len(log.t) - 1])
    data, tool, jacobians = mujoco.MjData(model), np.zeros((len(at), 3)), np.zeros((len(at), 3, model.nv))
    for k, i in enumerate(at):
        data.qpos[order] = q[i]
        mujoco.mj_fwdPosition(model, data)
        tool[k] = data.xipos[-1]
        mujoco.mj_jac(model, data, jacobians[k], None, data.xipos[-1], model.nbody - 1)
    spread = lambda x: np.stack([np.interp(log.t, log.t[at], c) for c in x.reshape(len(at), -1).T], axis=1)  # noqa: E731

    def gravity(g: np.ndarray) -> np.ndarray:
        asked, before = np.zeros((len(at), model.nv)), model.opt.gravity.copy()
        model.opt.gravity[:], data.qvel[:] = g, 0.0
        for k, i in enumerate(at):
            data.qpos[order] = q[i]
            mujoco.mj_forward(model, data)
            asked[k] = data.qfrc_bias
        model.opt.gravity[:] = before
        return spread(asked)[:, order]

    jacobian = spread(jacobians).reshape(len(log.t), 3, model.nv)[:, :, order]
    return Motion(number, log.t, q, qd, qdd, log.tau, spread(tool), jacobian, gravity)


# --- What is hidden: each from the motions, a joint, the size of its torque [N m] and random numbers --------------


def law(j: int, f: Callable[[Motion], np.ndarray]) -> Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """More torque at one joint."""

    def change(m: Motion, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        tau = m.tau.copy()
        tau[:, j] += f(m)
        return q, tau

    return change


def over(motions: list[Motion], f: Callable[[Motion], np.ndarray]) -> np.ndarray:
    """Something of all motions."""
    return np.concatenate([f(m) for m in motions])


def everywhere(motions: list[Motion]) -> tuple[int, ...]:
    """Every joint."""
    return tuple(range(motions[0].q.shape[1]))


def rms(x: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(x**2)))


def spring(motions, j, torque, rng):
    """A counterbalance whose slope grows a little over the range."""
    q = over(motions, lambda m: m.q[:, j])
    rest = rng.uniform(q.min(), q.max())
    shape = lambda m: np.sinh((m.q[:, j] - rest) / (2.0 * np.ptp(q)))  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "gravity_spring", (j,), {}, ("gravity_spring",),
                  ("torque_offset",))  # fmt: skip


def ripple(motions, j, torque, rng):
    """Cogging with a tenth of its second harmonic."""
    cycles = 10.0 ** rng.uniform(0.5, 1.2) / np.ptp(over(motions, lambda m: m.q[:, j]))
    shape = lambda m: np.sin(2 * np.pi * cycles * m.q[:, j]) + 0.1 * np.sin(4 * np.pi * cycles * m.q[:, j] + 1)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "torque_ripple", (j,),
                  {"amplitude": size, "cycles_per_rad": cycles}, ("torque_ripple",))  # fmt: skip


def offset(motions, j, torque, rng):
    """A drive's offset."""
    return Hidden(law(j, lambda m: torque + 0 * m.t), "torque_offset", (j,), {"offset": torque},
                  ("torque_offset", "asymmetric_friction"))  # fmt: skip


def gain(motions, j, torque, rng):
    """A drive's torque constant that is stated too large: three times the share, for it needs no motion of its own."""
    more = 3.0 * torque / rms(over(motions, lambda m: m.tau[:, j]))
    return Hidden(law(j, lambda m: more * m.tau[:, j]), "torque_gain", (j,), {"gain": 1 / (1 + more)}, ("torque_gain",))


def delay(motions, j, torque, rng):
    """All torques logged 10 ms early."""

    def change(m, q):
        return q, np.stack([np.interp(m.t + 0.01, m.t, x) for x in m.tau.T], axis=1)

    return Hidden(change, "time_delay", everywhere(motions), {"delay": 0.01}, ("time_delay",), ("channel_skew",))


def rotor(motions, j, torque, rng):
    """More inertia of a drive."""
    inertia = torque / rms(over(motions, lambda m: m.qdd[:, j]))
    return Hidden(law(j, lambda m: inertia * m.qdd[:, j]), "rotor_inertia", (j,), {"inertia": inertia},
                  ("rotor_inertia",))  # fmt: skip


def dry(motions, j, torque, rng):
    """More dry friction, rounded over half a per cent of the speed; friction that grows with load has a level, too."""
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    return Hidden(law(j, lambda m: torque * m.qd[:, j] / np.hypot(m.qd[:, j], slow)), "coulomb_friction", (j,),
                  {"coulomb": torque}, ("coulomb_friction", "load_dependent_friction"))  # fmt: skip


def viscous(motions, j, torque, rng):
    """More viscous friction that bends a little."""
    size = rms(over(motions, lambda m: m.qd[:, j]))
    return Hidden(law(j, lambda m: torque * 4.0 * np.arcsinh(m.qd[:, j] / (4.0 * size))), "viscous_friction", (j,),
                  {"viscous": torque / size}, ("viscous_friction",))  # fmt: skip


def bump(motions, j, torque, rng):
    """A place where dry friction is higher."""
    q = over(motions, lambda m: m.q[:, j])
    centre, width = np.quantile(q, rng.uniform(0.3, 0.7)), 0.1 * np.ptp(q)
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    shape = lambda m: m.qd[:, j] / np.hypot(m.qd[:, j], slow) / (1.0 + ((m.q[:, j] - centre) / width) ** 2)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "position_dependent_friction", (j,), {},
                  ("position_dependent_friction",), ("coulomb_friction",))  # fmt: skip


def loaded(motions, j, torque, rng):
    """Dry friction in proportion to the load, rounded."""
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    shape = lambda m: np.abs(m.tau[:, j]) * m.qd[:, j] / np.hypot(m.qd[:, j], slow)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "load_dependent_friction", (j,), {},
                  ("load_dependent_friction",), ("coulomb_friction",))  # fmt: skip


def coupling(motions, j, torque, rng):
    """Friction on the difference of the speeds of two neighbours."""
    n = motions[0].q.shape[1]
    k = j - 1 if j == n - 1 else j + 1
    slope = torque / rms(over(motions, lambda m: m.qd[:, j] - m.qd[:, k]))

    def change(m, q):
        tau, rub = m.tau.copy(), slope * (m.qd[:, j] - m.qd[:, k])
        tau[:, j] += rub
        tau[:, k] -= rub
        return q, tau

    return Hidden(change, "transmission_coupling", tuple(sorted((j, k))), {}, ("transmission_coupling",),
                  ("viscous_friction",))  # fmt: skip


def zero(motions, j, torque, rng):
    """A zero that is off by 3 degrees."""

    def change(m, q):
        q = q.copy()
        q[:, j] += 0.05
        return q, m.tau

    return Hidden(change, "encoder_offset", (j,), {"offset": 0.05}, ("encoder_offset",), ("gravity_tilt",))


def tilt(motions, j, torque, rng):
    """A base that leans by 3 degrees; masses as the model has them."""
    about = rng.uniform(0.0, 2.0 * np.pi)
    g = 9.81 * np.array([np.sin(0.05) * np.cos(about), np.sin(0.05) * np.sin(about), -np.cos(0.05)])
    change = lambda m, q: (q, m.tau + m.gravity(g) - m.gravity(np.array([0, 0, -9.81])))  # noqa: E731
    return Hidden(change, "gravity_tilt", everywhere(motions), {"tilt": 0.05}, ("gravity_tilt",), ("encoder_offset",))


def payload(motions, j, torque, rng):
    """A point mass at the last link's centre of mass."""

    def asked(m):
        rate = 1.0 / float(np.median(np.diff(m.t)))
        x = signal.sosfiltfilt(signal.butter(2, 15.0, fs=rate, output="sos"), m.tool, axis=0)
        a = np.gradient(np.gradient(x, m.t, axis=0), m.t, axis=0)
        return np.einsum("tin,ti->tn", m.jacobian, a - np.array([0, 0, -9.81]))

    felt, tau = (np.sqrt(np.mean(over(motions, f) ** 2, axis=0)) for f in (asked, lambda m: m.tau))
    mass = torque / tau[j] * float(np.min(tau / np.maximum(felt, 1e-9)))
    change = lambda m, q: (q, m.tau + mass * asked(m))  # noqa: E731
    return Hidden(change, "payload", everywhere(motions), {"mass": mass}, ("payload",))


def push(motions, j, torque, rng):
    """A push on the last link for a fifth of a recording, at most a second, that comes and goes as a raised cosine."""
    m = motions[int(rng.integers(len(motions)))]
    for_s = min(1.0, 0.2 * float(np.ptp(m.t)))
    begin = m.t[0] + rng.uniform(0.3, 0.6) * float(np.ptp(m.t))
    way = rng.normal(size=3)
    felt, tau = (np.sqrt(np.mean(x**2, axis=0)) for x in (np.einsum("i,tin->tn", way, m.jacobian), m.tau))
    force = 5.0 * torque / tau[j] * way / float(np.max(felt / tau))

    def change(motion, q):
        if motion.number != m.number:
            return q, motion.tau
        edge = np.clip(np.minimum(motion.t - begin, begin + for_s - motion.t) / (0.1 * for_s), 0.0, 1.0)
        grown = 0.5 - 0.5 * np.cos(np.pi * edge)
        return q, motion.tau - grown[:, None] * np.einsum("i,tin->tn", force, motion.jacobian)

    return Hidden(change, "external_wrench", everywhere(motions), {}, ("external_wrench",), ("contact",))


EFFECTS = {f.__name__: f for f in (spring, ripple, offset, gain, delay, rotor, dry, viscous, bump, loaded, coupling,
                                   zero, tilt, payload, push)}  # fmt: skip
