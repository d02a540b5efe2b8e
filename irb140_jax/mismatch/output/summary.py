"""Verdict and sentences: what a person reads first."""

from typing import Any

import numpy as np

from irb140_jax.mismatch.inertials.consistent import consistent
from irb140_jax.mismatch.regression.gaussian import eliminated, gain_of
from irb140_jax.mismatch.selection.explanation import Explanation, fitted
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.unexplained import Unexplained
from irb140_jax.robot import Robot

CLEARLY_BETTER = np.log(100.0)  # log odds that refitted inertials need over the nominal ones
FEW_LINKS = 2  # of which the summary says by how much their inertials are wrong
NOTABLE_SHIFT = 3.0  # standard deviations by which a link's inertials must change to be worth a sentence


def verdict(
    ex: Explanation, proof: HeldOut, found: list[dict[str, Any]], rest: list[Unexplained], open_: dict[int, str]
) -> str:
    """The contract's verdict.

    `unexplained` where structure is left and nothing is named, or where the structure left on a joint is larger than
    what was named there.  `undecided` where a joint is open, unless a finding is on a joint that is not open, or
    removes more of an open joint's error than is left there: then the open joints are a note.
    """
    nominal, refit, corrected = (proof.rmse(x) for x in (proof.nominal, proof.refit, proof.corrected))
    named = np.sqrt(np.clip(nominal**2 - corrected**2, 0.0, None))
    names = ex.lib.robot.joint_names
    at = {names.index(joint) for finding in found for joint in finding["joints"]}
    decided = any(j not in open_ or refit[j] ** 2 > 2.0 * corrected[j] ** 2 for j in at)
    if any(not found or u.rms > named[u.joint] for u in rest):
        return "unexplained"
    if open_ and not decided:
        return "undecided"
    if found:
        return "physics_left_out"
    return "parameters_only" if _inertials_matter(ex) else "no_mismatch"


def _inertials_matter(ex: Explanation) -> bool:
    """Whether refitted inertials are clearly more probable than the nominal ones."""
    if any(ex.data.candidates[c].slug == "inertials" for c in ex.chosen):
        return True
    space, instrument = ex.space, np.arange(ex.space.inertials, ex.space.offset)
    every = space.with_y(np.concatenate([instrument, np.arange(space.inertials)]))
    H = space.gram(ex.settings, every, every)
    left, _ = eliminated(H, np.arange(len(instrument)))
    return gain_of(left, len(instrument) + np.arange(space.inertials)) > CLEARLY_BETTER


def inertial_views(robot: Robot, ex: Explanation) -> list[dict[str, Any]]:
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
        elif shift > NOTABLE_SHIFT:
            sentence = (
                f"Refitting changes the inertial parameters of the link behind {name} by {shift:.1f} standard "
                "deviations of their stated uncertainty."
            )
        out.append({
            "link": name, "shift_sigma": shift, "mass_nominal": float(robot.mass[k]),
            "mass_refit": float(possible[k, 0]) if known[k] and k not in loose else None, "sentence": sentence,
        })  # fmt: skip
    return out


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
        unit = "N" if robot.is_slide[j] else "N m"
        if rms[j] > 0.1 * rms.max():
            said.append(f"{robot.joint_names[j]} by {rms[j]:.3g} {unit} RMS")
    return " and of ".join(said) or "no joint"


def unexplained_entry(robot: Robot, u: Unexplained) -> dict[str, Any]:
    """The contract's entry for structure that no effect explains."""
    name = robot.joint_names[u.joint]
    unit = "N" if robot.is_slide[u.joint] else "N m"
    return {
        "joints": [name],
        "where": f"{name}: {u.rms:.3g} {unit} RMS that no effect explains; it depends on {u.variable}",
        "share": u.share,
        "p_value": u.p_value,
    }


def summary(
    kind: str, found: list[dict[str, Any]], rest: list[Unexplained], fit: dict[str, Any],
    inertials: list[dict[str, Any]], robot: Robot, sources: list[str], missing: list[str], titles: dict[str, str],
) -> str:  # fmt: skip
    """A short paragraph for a person; `missing` are sentences on the data that a decision would need.

    Effects go by their titles, by slug.
    """
    what = f"{len(sources)} recording{'s' if len(sources) != 1 else ''} of {robot.n} joint{'s' if robot.n != 1 else ''}"
    show = f"{what} show{'s' if len(sources) == 1 else ''}"
    parts = {
        "no_mismatch": (
            f"The model explains {what} down to the noise of the sensors; this motion shows nothing that it leaves out."
        ),
        "parameters_only": (
            f"Refitted inertial parameters explain the torque of {what}; this motion shows no physics that the model "
            "leaves out."
        ),
        "physics_left_out": f"{show} physics that the model leaves out.",
        "undecided": f"{what} can't tell whether the model leaves anything out.",
        "unexplained": f"{show} structure in the torque that neither the model nor any effect of the library explains.",
    }
    said = [parts[kind]]
    if kind == "undecided":
        said += [f"{_capital(sentence)}." for sentence in missing]
    by_effect: dict[str, list[str]] = {}
    for f in found:
        by_effect.setdefault(f["effect"], []).append(_listed(f["joints"]))
    for effect, places in by_effect.items():
        one_joint_each = all(len(f["joints"]) == 1 for f in found if f["effect"] == effect)
        where = f"on {_listed(places)}" if one_joint_each else _listed([f"on {place}" for place in places])
        said.append(f"{_capital(titles[effect])} {where}.")
    for f in found:
        if f["alternatives"]:
            title, joints = titles[f["effect"]], _listed(f["joints"])
            rivals = _listed([titles[a["effect"]] for a in f["alternatives"]], "or")
            said.append(
                f"{_capital(title)} on {joints} may instead be {rivals}, in whole or in part; these data can't tell."
            )
    changed = [i for i in inertials if i["sentence"]]
    if len(changed) > FEW_LINKS:
        said.append(f"Refitting changes the inertial parameters of the links behind "
                    f"{_listed([i['link'] for i in changed])} beyond their stated uncertainty.")  # fmt: skip
    else:
        said += [i["sentence"] for i in changed]
    if rest and kind != "unexplained":
        joints = _listed([robot.joint_names[u.joint] for u in rest])
        said.append(f"On {joints} structure is left in the torque that no effect of the library explains.")
    judged = [j for j in fit if fit[j]["noise_floor"] is not None]
    concerned = [j for f in found for j in f["joints"] if j in judged] or judged
    before = "rmse_refit" if found else "rmse_nominal"
    worst = max(concerned, key=lambda j: fit[j][before] / max(fit[j]["noise_floor"], 1e-12))
    f = fit[worst]
    unit = "N" if robot.is_slide[robot.joint_names.index(worst)] else "N m"
    said.append(
        f"On unseen data the torque error of {worst} is {f['rmse_nominal']:.3g} {unit} RMS with the model as given, "
        f"{f['rmse_refit']:.3g} with refitted inertials and {f['rmse_corrected']:.3g} with the corrected model; the "
        f"noise of the sensors is {f['noise_floor']:.3g}."
    )
    return " ".join(said)


def _capital(words: str) -> str:
    """The words with a capital first letter; names in them keep theirs."""
    return f"{words[0].upper()}{words[1:]}"


def _listed(words: list[str], last: str = "and") -> str:
    words = list(dict.fromkeys(words))
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"
