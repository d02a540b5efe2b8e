"""How far the fit moved each link's inertial parameters, in numbers and sentences."""

import dataclasses

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.inertials.consistent import consistent
from irb140_jax.mismatch.selection.explanation import Explanation, fitted
from irb140_jax.robot import Robot


@dataclasses.dataclass(frozen=True)
class LinkShift:
    """What refitting did to a link's inertial parameters.

    Attributes:
        link: The joint that it is behind.
        shift_sigma: Largest change in standard deviations of the stated uncertainty.
        mass_nominal: Of the model as given [kg].
        mass_refit: Of the refitted one [kg]; None where the data don't know it.
        sentence: For a person; empty where the change is small.
    """

    link: str
    shift_sigma: float
    mass_nominal: float
    mass_refit: float | None
    sentence: str


def link_shifts(robot: Robot, ex: Explanation) -> tuple[LinkShift, ...]:
    """How far each link's inertials changed, in standard deviations of their stated uncertainty, with a sentence.

    A torque does not show a link's mass but sums over links (base parameters); so a sentence says by what torque the
    refitted inertials differ, and a mass is given only where the data know it, of a body that can be.
    """
    post = ex.posterior()
    dphi, _, _ = fitted(ex.data, post, ex.chosen, ex.factor)
    phi = np.asarray(robot.phi)
    possible = consistent(phi + dphi.reshape(-1, 10), phi)
    loose = {j for m in ex.members if m.slug == "inertials" for j in m.joints}
    uncertainty = ex.data.scale[0] if ex.data.nuisances else 0.05
    known = _masses_known(ex, post.cov)
    out = []
    for k, name in enumerate(robot.joint_names):
        own = slice(10 * k, 10 * k + 10)
        theta = np.linalg.lstsq(ex.factor[own, own], dphi[own], rcond=1e-9)[0] / max(uncertainty, 1e-12)
        shift = float(np.max(np.abs(theta)))
        sentence = ""
        if k in loose:
            sentence = (
                f"From the link behind {name} onwards, inertial parameters are wrong beyond their stated "
                f"uncertainty of {100 * uncertainty:.3g} %: refitting them changes the torque of "
                f"{_torque_change(robot, ex, dphi, k)}."
            )
        elif shift > settings.NOTABLE_SHIFT:
            sentence = (
                f"Refitting changes the inertial parameters of the link behind {name} by {shift:.1f} standard "
                "deviations of their stated uncertainty."
            )
        mass = float(possible[k, 0]) if known[k] and k not in loose else None
        out.append(LinkShift(name, shift, float(robot.mass[k]), mass, sentence))
    return tuple(out)


def _masses_known(ex: Explanation, cov: np.ndarray) -> np.ndarray:
    """Links whose mass the data know twice as well as the model states it, shape (n,)."""
    masses = ex.factor[::10]
    prior = ex.data.scale[: ex.data.nuisances]
    before, after = (
        np.einsum("ki,ij,kj->k", masses * prior, c, masses * prior)
        for c in (np.eye(ex.data.nuisances), cov[: ex.data.nuisances, : ex.data.nuisances])
    )
    return after < 0.25 * np.maximum(before, 1e-300)


def _torque_change(robot: Robot, ex: Explanation, dphi: np.ndarray, k: int) -> str:
    """Torque by which inertials changed from a link onwards, in words, at the joints where it changes most."""
    theta = np.linalg.lstsq(ex.factor, dphi, rcond=1e-9)[0]
    theta[: 10 * k] = 0.0
    change = [s.rigid @ theta for s in ex.data.stretches]
    rows = np.maximum(sum(s.use.sum(axis=0) for s in ex.data.stretches), 1)
    rms = np.sqrt(sum(np.sum(np.where(s.use, x, 0.0) ** 2, axis=0)
                      for s, x in zip(ex.data.stretches, change, strict=True)) / rows)  # fmt: skip
    said = []
    for j in np.argsort(-rms)[:2]:
        unit = robot.torque_units[j]
        if rms[j] > 0.1 * rms.max():
            said.append(f"{robot.joint_names[j]} by {rms[j]:.3g} {unit} RMS")
    return " and of ".join(said) or "no joint"
