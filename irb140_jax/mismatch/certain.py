"""What holds of a finding whichever of its alternatives is true: the torque itself, not its name."""

import numpy as np

from irb140_jax.mismatch.explanation import Explanation
from irb140_jax.robot import Robot

MOST_OF = 0.05  # of the finding's power: joints with less of it are not listed
MOVING = 0.9  # |direction of motion| from which a row counts as one way or the other
TWO_WAYS = ("torque_offset",)  # beside friction: what is a level of torque while the joint moves


def certain(robot: Robot, ex: Explanation, index: int, w: np.ndarray, cov: np.ndarray, gain: float) -> str:
    """One sentence with numbers that every explanation in a finding's place must agree with.

    The torque that the finding stands for, at its joints, and what it is worth on unseen data; of friction and offsets
    the mean torque of either direction of motion, which does not depend on how it is divided among names.

    Args:
        robot: The nominal model.
        ex: The explanation.
        index: The finding.
        w: Its amplitudes, shape (k,).
        cov: Their covariance, shape (k, k).
        gain: Share of the squared error on unseen data that it removes.
    """
    c = ex.data.candidates[index]
    columns = ex.data.nuisances + c.columns
    torque = [s.X[..., columns] @ w for s in ex.data.stretches]
    use = [s.use for s in ex.data.stretches]
    power = np.array([sum(np.sum(x[u[:, j], j] ** 2) for x, u in zip(torque, use, strict=True))
                      for j in range(robot.n)])  # fmt: skip
    rows = np.maximum(sum(u.sum(axis=0) for u in use), 1)
    logged = np.sqrt(sum(np.sum(np.where(s.use, s.tau, 0.0) ** 2, axis=0) for s in ex.data.stretches) / rows)
    rms = np.sqrt(power / rows)
    listed = [j for j in np.argsort(-power) if power[j] > MOST_OF * power.sum()]
    sizes = [
        f"{rms[j]:.3g} {_unit(robot, j)} RMS on {robot.joint_names[j]} ({_percent(rms[j] / max(logged[j], 1e-300))} of "
        "what is logged there)"
        for j in listed
    ]
    said = f"Beyond what rigid bodies explain, the torque needs {_listed(sizes)}"
    said += f"; it removes {_percent(float(np.clip(gain, 0.0, 0.9999)))} of the squared error on unseen data"
    if len(c.joints) == 1 and (c.effect.friction or c.slug in TWO_WAYS):
        said += _two_ways(robot, ex, c.joints[0], columns, w, cov)
    return said + "."


def _two_ways(
    robot: Robot, ex: Explanation, j: int, columns: np.ndarray, w: np.ndarray, cov: np.ndarray
) -> str:
    """Mean torque of the finding while the joint moves towards + and towards -."""
    fast = [np.abs(s.qd[:, j]) > (1.0 - MOVING) * np.max(np.abs(s.qd[:, j]), initial=0.0) for s in ex.data.stretches]
    said = []
    for sign, word in ((1.0, "+"), (-1.0, "-")):
        mean = [
            s.X[s.use[:, j] & f & (sign * s.qd[:, j] > 0.0), j][:, columns]
            for s, f in zip(ex.data.stretches, fast, strict=True)
        ]
        rows = np.concatenate(mean)
        if len(rows) == 0:
            return ""
        a = rows.mean(axis=0)
        std = np.sqrt(max(a @ cov @ a, 0.0))
        said.append(f"{a @ w:.3g} +- {std:.1g} {_unit(robot, j)} while it moves towards {word}")
    return f"; it is on average {said[0]} and {said[1]}"


def _unit(robot: Robot, j: int) -> str:
    return "N" if robot.is_slide[j] else "N m"


def _percent(share: float) -> str:
    decimals = 2 if 0.99 < share < 1.0 else 1 if share < 0.1 else 0
    return f"{100.0 * share:.{decimals}f} %"


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
