"""Friction laws by their own differential equations, along prescribed positions; each returns a torque, shape (T,).

Torque is what the motor has to give: of the same sign as the speed while sliding.
"""

import math

import numpy as np


def dry(v: np.ndarray, level: np.ndarray | float, still: float, form: str = "root") -> np.ndarray:
    """Coulomb friction without a step: "root" v/sqrt(v^2 + still^2), "arc" 2/pi atan(pi v / (2 still))."""
    return level * (v / np.sqrt(v**2 + still**2) if form == "root" else 2 / np.pi * np.arctan(np.pi * v / 2 / still))


def falling(v: np.ndarray, coulomb: float, static: float, speed: float) -> np.ndarray:
    """Level at speed v of friction that falls, by Hess and Soom's form: coulomb + (static - coulomb)/(1 + (v/vs)^2)."""
    return coulomb + (static - coulomb) / (1.0 + (v / speed) ** 2)


def lugre(v: np.ndarray, dt: float, level: np.ndarray, stiffness: float, damping: float) -> np.ndarray:
    """LuGre: dz/dt = v - stiffness |v| z / level, torque stiffness z + damping dz/dt, exact at constant speed.

    Source: Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40(3), 1995.

    Args:
        v: Speed [rad/s].
        dt: Step [s].
        level: Steady torque at each sample's speed, shape (T,) [N m].
        stiffness: Of the bristles [N m/rad].
        damping: Of the bristles [N m s/rad].
    """
    between = 0.5 * (v + np.concatenate([-v[:1], v[:-1]]))  # of each step; there is none before the first sample
    keep = np.exp(-stiffness * np.abs(between) * dt / level)
    goal = np.sign(between) * level / stiffness
    z = recurrence(keep, (1.0 - keep) * goal)
    return stiffness * z + damping * (v - stiffness * np.abs(v) * z / level)


def dahl(q: np.ndarray, coulomb: float, stiffness: float, exponent: float = 1.0) -> np.ndarray:
    """Dahl: dF/dq = stiffness |1 - F/coulomb sign(v)|^exponent sign(1 - F/coulomb sign(v)), exact over each step.

    Source: P. R. Dahl, Aerospace Corp. TOR-0158, 1968.
    """
    dq = np.diff(q, prepend=q[:1])
    if exponent == 1.0:
        keep = np.exp(-stiffness / coulomb * np.abs(dq))
        return coulomb * recurrence(keep, (1.0 - keep) * np.sign(dq))
    f, out, power = 0.0, np.empty(len(q)), 1.0 - exponent
    for i, (s, way) in enumerate(zip(np.sign(dq).tolist(), (np.abs(dq) * stiffness / coulomb).tolist(), strict=True)):
        if s:
            left = max(1.0 - s * f, 0.0)
            rest = left**power - power * way if left else 0.0
            f = s * (1.0 - (max(rest, 0.0) ** (1.0 / power) if left else 0.0))
        out[i] = f
    return coulomb * out


def maxwell_slip(q: np.ndarray, level: np.ndarray, shares: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Generalised Maxwell slip: springs side by side, each slipping at its share of the level of the moment.

    Source: Al-Bender, Lampaert, Swevers, IEEE TAC 50(11), 2005, with slip that follows the level at once.

    Args:
        q: Position [rad].
        level: Steady torque at each sample's speed, shape (T,) [N m].
        shares: Of the elements, summing to 1, shape (m,).
        stiffness: Of the elements [N m/rad], shape (m,).
    """
    pull = np.diff(q, prepend=q[:1])[:, None] * stiffness
    most = level[:, None] * shares
    f, out = np.zeros(len(shares)), np.empty(len(q))
    for i in range(len(q)):
        f = np.minimum(np.maximum(f + pull[i], -most[i]), most[i])
        out[i] = f.sum()
    return out


def curve(rng: np.random.Generator, low: float, high: float, rough: float) -> tuple[np.ndarray, np.ndarray]:
    """A random curve of position, of unit standard deviation: what teeth and bearings do along a range.

    Returns:
        Positions and values, for `np.interp`; waves from the whole range down to a fiftieth of it, as 1/k^rough.
    """
    x = np.linspace(low, high, 2000)
    k = np.arange(1, 51)
    angle = 2.0 * np.pi * np.outer((x - low) / (high - low), k) + rng.uniform(0.0, 2.0 * np.pi, 50)
    y = np.sin(angle) @ (rng.normal(size=50) / k**rough)
    return x, (y - y.mean()) / y.std()


def heated(v: np.ndarray, dt: float, viscous: float, per_heat: float, time: float) -> np.ndarray:
    """Viscous friction thinned by its own heat h: time dh/dt = thin v^2/mean(v^2) - h, thin = exp(-per_heat h).

    Args:
        v: Speed [rad/s].
        dt: Step [s].
        viscous: When cold [N m s/rad].
        per_heat: Logarithm by which viscosity falls when the heat h is 1, that of the mean power.
        time: Constant of warming up [s].
    """
    h, thin, grow, out = 0.0, 1.0, dt / time, np.empty(len(v))
    power = (v**2 / max(float(np.mean(v**2)), 1e-12)).tolist()
    for i, p in enumerate(power):
        thin = math.exp(-per_heat * h)
        out[i] = thin
        h += grow * (thin * p - h)
    return viscous * out * v


def recurrence(keep: np.ndarray, add: np.ndarray) -> np.ndarray:
    """z[i] = keep[i] z[i-1] + add[i], from zero."""
    z, out = 0.0, []
    for a, b in zip(keep.tolist(), add.tolist(), strict=True):
        z = a * z + b
        out.append(z)
    return np.array(out)
