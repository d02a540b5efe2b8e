"""What is certain of a finding whichever of its alternatives is true: the torque itself, not its name."""

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.robot import Robot

LEVELS = ("torque_offset",)  # effects beside friction that are a level of torque while the joint moves


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
        gain: Share that it removes of the squared error which the rest of the model, fitted in its place, leaves.
    """
    c = ex.data.candidates[index]
    columns = ex.data.nuisances + c.columns
    torque = [s.torque(columns, w) for s in ex.data.stretches]
    use = [s.use for s in ex.data.stretches]
    power = np.array([sum(np.sum(x[u[:, j], j] ** 2) for x, u in zip(torque, use, strict=True))
                      for j in range(robot.n)])  # fmt: skip
    rows = np.maximum(sum(u.sum(axis=0) for u in use), 1)
    logged = np.sqrt(sum(np.sum(np.where(s.use, s.tau, 0.0) ** 2, axis=0) for s in ex.data.stretches) / rows)
    rms = np.sqrt(power / rows)
    listed = [j for j in np.argsort(-power) if power[j] > settings.LISTED_POWER * power.sum()]
    sizes = [
        f"{rms[j]:.3g} {robot.torque_units[j]} RMS on {robot.joint_names[j]} ("
        f"{_percent(rms[j] / max(logged[j], 1e-300))} of its logged torque)"
        for j in listed
    ]
    said = f"Besides the rigid-body model, a torque of {_listed(sizes)} is needed"
    # Inertial parameters that may be anything take up most of some torques, so the share can be small.
    others = any(i != index and not ex.data.candidates[i].is_inertials for i in ex.chosen)
    said += f"; adding it removes {_percent(float(np.clip(gain, 0.0, 0.9999)))} of the squared error that inertial "
    said += f"parameters of any size{' and the other findings' * others} leave on unseen data without it"
    if len(c.joints) == 1 and (c.effect.place.is_friction or c.slug in LEVELS):
        said += _mean_by_direction(robot, ex, c.joints[0], columns, w, cov)
    return said + "."


def _mean_by_direction(
    robot: Robot, ex: Explanation, j: int, columns: np.ndarray, w: np.ndarray, cov: np.ndarray
) -> str:
    """Mean torque of the finding in either direction of motion, in words; empty if a direction has no rows."""
    fast = [np.abs(s.qd[:, j]) > settings.SLOW * np.max(np.abs(s.qd[:, j]), initial=0.0) for s in ex.data.stretches]
    said = []
    for sign in (1.0, -1.0):
        moving = [
            s.of(columns, j)[s.use[:, j] & f & (sign * s.qd[:, j] > 0.0)]
            for s, f in zip(ex.data.stretches, fast, strict=True)
        ]
        rows = np.concatenate(moving)
        if len(rows) == 0:
            return ""
        mean = rows.mean(axis=0)
        std = np.sqrt(max(mean @ cov @ mean, 0.0))
        said.append(f"{mean @ w:.3g} +- {std:.1g} {robot.torque_units[j]}")
    return (
        f"; it is on average {said[0]} while the joint moves in its positive direction and {said[1]} while it moves in "
        "its negative direction"
    )


def _percent(share: float) -> str:
    decimals = 2 if 0.99 < share < 1.0 else 1 if share < 0.1 else 0
    return f"{100.0 * share:.{decimals}f} %"


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
