"""Springs, walls and pushes; torques are the motors', against what the surroundings do."""

import numpy as np


def hardening(q: np.ndarray, rest: float, stiffness: float, cubic: float) -> np.ndarray:
    """Spring that gets stiffer: stiffness x + cubic x^3 with x = q - rest, shape (T,)."""
    x = q - rest
    return stiffness * x + cubic * x**3


def wall(x: np.ndarray, jacobian: np.ndarray, normal: np.ndarray, at: float, hertz: float, loss: float, dt: float):
    """A tool on a wall by Hunt and Crossley's law: force = hertz depth^1.5 (1 + loss d depth/dt), never pulling.

    Args:
        x: Path of the tool, (T, 3) [m].
        jacobian: How joints move it, (T, 3, n).
        normal: Out of the wall, a unit vector, shape (3,).
        at: Where the wall is along the normal [m].
        hertz: [N/m^1.5].
        loss: [s/m].
        dt: Step [s].

    Returns:
        Torque of the motors (T, n), depth (T,) and force (T,).
    """
    depth = np.maximum(at - x @ normal, 0.0)
    force = np.maximum(hertz * depth**1.5 * (1.0 + loss * np.gradient(depth, dt)), 0.0)
    return -np.einsum("t,i,tin->tn", force, normal, jacobian), depth, force


def foam(x: np.ndarray, v: np.ndarray, low: float, high: float, depth: float) -> np.ndarray:
    """Foam beyond `low` and `high`, pressed at speed v: (how deep / depth)^2, a third less on the way out, (T,)."""
    into = np.minimum(x - low, 0.0) + np.maximum(x - high, 0.0)
    return np.sign(into) * (into / depth) ** 2 * np.where(into * v > 0.0, 1.0, 2.0 / 3.0)


def push(t: np.ndarray, jacobian: np.ndarray, force: np.ndarray, begin: float, end: float, rise: float) -> np.ndarray:
    """A force on the tool that grows over `rise` seconds about `begin` and fades about `end`, by raised cosines."""
    ramp = lambda at: 0.5 - 0.5 * np.cos(np.pi * np.clip((t - at) / rise + 0.5, 0.0, 1.0))  # noqa: E731
    return -np.einsum("t,i,tin->tn", ramp(begin) - ramp(end), force, jacobian)
