"""Verdict and sentences: what a person reads first."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from irb140_jax.effects import Effect
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.output.inertials import LinkShift
from irb140_jax.mismatch.output.open_effects import OpenEffect
from irb140_jax.mismatch.regression.gaussian import eliminated, gain_of
from irb140_jax.mismatch.result import Finding, Fit, Verdict
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.mismatch.validation.undecided_joints import without_effects
from irb140_jax.mismatch.validation.unexplained import Structure
from irb140_jax.robot import Robot


def verdict(
    ex: Explanation, proof: HeldOut, found: Sequence[Finding], rest: Sequence[Structure], open_: dict[int, str],
    blind: bool,
) -> Verdict:  # fmt: skip
    """The verdict.

    `unexplained` where structure is left and nothing is named, or where the structure left on a joint is larger than
    what was named there.  `undecided` where a joint is open, unless a finding is on a joint that is not open, or
    removes more of an open joint's error than is left there: then the open joints are a note.  Also where nothing is
    found and ordinary friction would not show on any joint (`blind`).  `parameters_only` also where inertials stand for
    an error that may as well be the torque sensors': the model as given is off all the same.
    """
    nominal, corrected = proof.rmse(proof.nominal), proof.rmse(proof.corrected)
    named = np.sqrt(np.clip(nominal**2 - corrected**2, 0.0, None))
    names = ex.lib.robot.joint_names
    at = {names.index(joint) for finding in found for joint in finding.joints}
    explained = without_effects(proof) ** 2 > 2.0 * corrected**2
    decided = any(j not in open_ or explained[j] for j in at)
    if any(not found or u.rms > named[u.joint] for u in rest):
        return "unexplained"
    if open_ and not decided:
        return "undecided"
    if found:
        return "physics_left_out"
    off = nominal > settings.ABOVE_NOISE * proof.rmse(proof.refit)
    if off.any() or _inertials_matter(ex):
        return "parameters_only"
    return "undecided" if blind else "no_mismatch"


def _inertials_matter(ex: Explanation) -> bool:
    """Whether refitted inertials are clearly more probable than the nominal ones."""
    if any(ex.data.candidates[c].slug == "inertials" for c in ex.chosen):
        return True
    space, instrument = ex.space, np.arange(ex.space.inertials, ex.space.offset)
    every = space.with_y(np.concatenate([instrument, np.arange(space.inertials)]))
    H = space.gram(ex.hyper, every, every)
    left, _ = eliminated(H, np.arange(len(instrument)))
    return gain_of(left, len(instrument) + np.arange(space.inertials)) > settings.CLEARLY_BETTER


def summary(
    kind: Verdict, found: Sequence[Finding], rest: Sequence[Structure], fit: dict[str, Fit],
    inertials: Sequence[LinkShift], robot: Robot, recordings: int, missing: Iterable[str],
    effects: Mapping[str, Effect], open_: Sequence[OpenEffect] = (),
) -> str:  # fmt: skip
    """A short paragraph for a person; `missing` are sentences on the data that a decision would need.

    Effects go by their titles, by slug. `fit` is while joints move: at rest dry friction is undetermined.  `open_` is
    what the recordings can't decide.
    """
    what = _counted(recordings, robot)
    show = f"{what} show{'s' if recordings == 1 else ''}"
    parts = {
        "no_mismatch": (
            f"The model explains {what} down to the noise of the sensors; this motion shows nothing that it leaves out."
        ),
        "parameters_only": (
            f"Refitted inertial parameters explain the torque of {what}; this motion shows no physics that the model "
            "leaves out."
        ),
        "physics_left_out": f"{show} physics that the model leaves out.",
        "undecided": open_sentence(recordings, robot),
        "unexplained": f"{show} structure in the torque that neither the model nor any effect of the library explains.",
    }
    said = [parts[kind]]
    if kind == "undecided":
        said += [f"{_capital(sentence)}." for sentence in missing]
    by_effect: dict[str, list[str]] = {}
    for f in found:
        by_effect.setdefault(f.effect, []).append(_listed(f.joints))
    for effect, places in by_effect.items():
        one_joint_each = all(len(f.joints) == 1 for f in found if f.effect == effect)
        where = f"on {_listed(places)}" if one_joint_each else _listed([f"on {place}" for place in places])
        said.append(f"{_capital(effects[effect].title)} {where}.")
    for f in found:
        if f.alternatives:
            title, joints = effects[f.effect].title, _listed(f.joints)
            rivals = _listed([effects[a.effect].title for a in f.alternatives], "or")
            said.append(
                f"{_capital(title)} on {joints} may instead be {rivals}, in whole or in part; these data can't tell."
            )
    if open_:
        more = _listed([f"{o.effect.title} on {_listed(o.joints)}" for o in open_], "or")
        said.append(f"These data leave open whether there is also {more}.")
    changed = [i for i in inertials if i.sentence]
    if len(changed) > settings.FEW_LINKS:
        said.append(f"Refitting changes the inertial parameters of the links behind "
                    f"{_listed([i.link for i in changed])} beyond their stated uncertainty.")  # fmt: skip
    else:
        said += [i.sentence for i in changed]
    if rest and kind != "unexplained":
        joints = _listed([robot.joint_names[u.joint] for u in rest])
        said.append(f"On {joints} structure is left in the torque that no effect of the library explains.")
    return " ".join([*said, _worst_error(robot, found, fit)])


def _worst_error(robot: Robot, found: Sequence[Finding], fit: dict[str, Fit]) -> str:
    """A sentence on the errors of the joint that is furthest above its noise, of those with a finding if there are."""
    judged = {name: f for name, f in fit.items() if f.noise_floor is not None}
    concerned = [name for f in found for name in f.joints if name in judged] or list(judged)
    before = lambda f: (f.rmse_refit if found else f.rmse_nominal) or 0.0  # noqa: E731
    worst = max(concerned, key=lambda name: before(fit[name]) / max(fit[name].noise_floor or 0.0, 1e-12))
    f, unit = fit[worst], robot.torque_units[robot.joint_names.index(worst)]
    return (
        f"On unseen data the torque error of {worst} while it moves is {f.rmse_nominal:.3g} {unit} RMS with the model "
        "as given, "
        f"{f.rmse_refit:.3g} with refitted inertials and {f.rmse_corrected:.3g} with the corrected model; the "
        f"noise of the sensors is {f.noise_floor:.3g}."
    )


def _counted(recordings: int, robot: Robot) -> str:
    """How many recordings and joints there are, in words."""
    many = f"{recordings} recording{'s' if recordings != 1 else ''}"
    return f"{many} of {robot.n} joint{'s' if robot.n != 1 else ''}"


def open_sentence(recordings: int, robot: Robot) -> str:
    """What the summary of an undecided diagnosis begins with."""
    return f"{_counted(recordings, robot)} can't tell whether the model leaves anything out."


def _capital(words: str) -> str:
    """The words with a capital first letter; names in them keep theirs."""
    return f"{words[0].upper()}{words[1:]}"


def _listed(words: Sequence[str], last: str = "and") -> str:
    words = list(dict.fromkeys(words))
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"
