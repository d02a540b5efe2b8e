"""Torque in another unit, or on the motor's side: of the model's shape, and far too large or too small."""

import numpy as np

from irb140_jax.recordings.doubt import Doubt
from irb140_jax.recordings.glance import Glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torque_shape import BETTER, ratio_to_model, share_explained, terms
from irb140_jax.recordings.torques import Torques

ALIKE = 1.5  # largest over smallest of factors that are one
FAR_OFF = 5.0  # times too large or small, alike on most joints, that no wrong mass explains; 4 times that if not alike


def unit_doubts(recording: Recording, seen: Glance, model: Torques, judged: np.ndarray) -> list[Doubt]:
    """Torque of the model's shape that is far too large or too small, on most joints or on some: another unit or side.

    Of some joints nothing is said below a factor of twenty: one may carry many times what the model gives it.
    """
    ratio = {int(j): r for j in np.flatnonzero(judged) if (r := ratio_to_model(seen, model, int(j))) > 0.0}
    doubted = ratio if 2 * len(ratio) > judged.sum() else {}
    sizes = np.array(list(doubted.values()))
    if not _far_off(sizes):
        one = lambda j: _far_off(np.array([ratio[j]])) and not _may_carry(seen, model, judged, j, ratio[j])  # noqa: E731
        doubted = {j: r for j, r in ratio.items() if one(j)}
        sizes = np.array(list(doubted.values()))
    if not doubted:
        return []
    names = [recording.joint_names[j] for j in doubted]
    middle, worst = float(np.exp(np.mean(np.log(sizes)))), int(np.argmax(np.abs(np.log(sizes))))
    factors = {f"tau.{name}": float(f"{1.0 / s:.3g}") for name, s in zip(names, sizes, strict=True)}
    listed = ", ".join(f"\"{k}\" = {v:g}" for k, v in factors.items())
    guess = "percent of the rated torque or mA" if middle > 1.0 else "motor side, ampere or a share of the rated"
    if _alike(sizes) and 800.0 < middle < 1250.0:
        guess = "mN m"
    others = [f"tau.{name}" for name in names if name != names[worst]]
    so_with = f", and so with {', '.join(others)}" if others else ""
    said = (
        f"column tau.{names[worst]} has the shape of the model's torque but is {sizes[worst]:.3g} times as large"
        f"{so_with}: this looks like {guess}; N m on the joint side are wanted"
    )
    remedy = (
        "multiply motor torque by the gear ratio, current by the torque constant too, percent by a hundredth of the "
        f"rated torque, with --columns and [scale]; near the model's torque would be {listed}"
    )
    return [Doubt("unit", tuple(doubted), said, remedy, factors)]


def _alike(sizes: np.ndarray) -> bool:
    return float(sizes.max() / sizes.min()) < ALIKE


def _far_off(sizes: np.ndarray) -> bool:
    """Whether torques so many times the model's are all too large or all too small for a wrong mass."""
    if not len(sizes):
        return False
    far = FAR_OFF if len(sizes) > 1 and _alike(sizes) else 4.0 * FAR_OFF
    middle = np.exp(np.mean(np.log(sizes)))
    return bool(middle > far and sizes.min() > FAR_OFF or middle < 1.0 / far and sizes.max() < 1.0 / FAR_OFF)


def _may_carry(seen: Glance, model: Torques, judged: np.ndarray, j: int, ratio: float) -> bool:
    """Whether a rotor or a load that the model leaves out may make this joint's torque so many times the model's."""
    size = np.std(seen.tau, axis=0)
    if ratio < 1.0 or judged.sum() == 1:
        return False
    # The joints below a load carry it, too, and a rotor's torque has the shape of the acceleration.
    rotor = share_explained(terms(seen.qd[:, j], seen.qdd[:, j]), seen.tau[:, j])
    given = share_explained(terms(seen.qd[:, j], model.total[:, j]), seen.tau[:, j])
    return bool(size[j] < np.delete(size * judged, j).max() or 1.0 - rotor < BETTER * (1.0 - given))
