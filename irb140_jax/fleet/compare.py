"""What several diagnoses have in common, what differs, and by how much."""

import itertools
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np

from irb140_jax.errors import InputError
from irb140_jax.fleet.heterogeneity import LEVEL, Difference, all_within, cochran, differences, holm, pooled
from irb140_jax.fleet.sentences import said_of_effect, said_of_parameter
from irb140_jax.mismatch.result import Diagnosis, Estimate, Finding

SCHEMA = 1  # of compare.json
ORDER = ("differs", "named_in_some", "cannot_tell", "same")


class Given(NamedTuple):
    """A diagnosis to be compared, and what it is called here."""

    name: str
    diagnosis: Diagnosis


Site = tuple[str, tuple[str, ...]]  # an effect and its joints


def compare(given: Sequence[Given], same_within: float = 0.1) -> dict[str, Any]:
    """Compare the parameters of the same effects on the same joints.

    Args:
        given: The diagnoses, the first of which others are compared with.
        same_within: Share of a parameter by which diagnoses may differ and are still called the same.

    Returns:
        What compare.json holds.

    Raises:
        InputError: They can't be compared: fewer than two, other joints, or the same recording in two of them.
    """
    _check(given)
    sites = dict.fromkeys(_site(f) for one in given for f in one.diagnosis.findings)
    every = [_parameters(given, site) for site in sites]
    tested = [p for parameters in every for p in parameters if p["p"] is not None]
    for p, adjusted in zip(tested, holm([p["p"] for p in tested]), strict=True):
        p["p_holm"] = adjusted
    names = [one.name for one in given]
    for p in [p for parameters in every for p in parameters]:
        p["says"] = _judged(p, same_within)
        p["sentence"] = said_of_parameter(p, names, same_within)
    effects = [_effect(given, site, own) for site, own in zip(sites, every, strict=True)]
    effects.sort(key=lambda one: (ORDER.index(one["says"]), -min(len(one["named_in"]), 99)))
    return _rounded({
        "schema": SCHEMA,
        "of": [_origin(one) for one in given],
        "same_within": same_within,
        "level": LEVEL,
        "effects": effects,
        "notes": _notes(given),
        "version": version("irb140_jax"),
    })  # fmt: skip


def _check(given: Sequence[Given]) -> None:
    if len(given) < 2:
        raise InputError("compare: only one diagnosis was given; give two or more of one robot or of one kind of robot")
    first = given[0]
    joints = first.diagnosis.provenance.robot.joints
    for one in given[1:]:
        others = one.diagnosis.provenance.robot.joints
        if others != joints:
            raise InputError(f"{one.name}: is of joints {', '.join(others)}, and {first.name} of {', '.join(joints)}; "
                             "compare diagnoses of the same joints")  # fmt: skip
    for one, other in itertools.combinations(given, 2):
        mine, theirs = ({r.sha256: r.file for r in x.diagnosis.provenance.recordings} for x in (one, other))
        if twice := sorted(set(mine) & set(theirs)):
            raise InputError(f"{other.name}: its recording {theirs[twice[0]]} is in {one.name}, too, so they are not "
                             "independent; compare diagnoses of different recordings")  # fmt: skip


def _site(finding: Finding) -> Site:
    return finding.effect, finding.joints


def _finding(one: Given, site: Site) -> Finding | None:
    return next((f for f in one.diagnosis.findings if _site(f) == site), None)


def _parameters(given: Sequence[Given], site: Site) -> list[dict[str, Any]]:
    """Every parameter of an effect with its values and, where there are two or more, tests and intervals."""
    found = [_finding(one, site) for one in given]
    names = dict.fromkeys(name for f in found if f for name in f.parameters)
    return [_parameter(name, [f.parameters.get(name) if f else None for f in found]) for name in names]


def _parameter(name: str, values: Sequence[Estimate | None]) -> dict[str, Any]:
    out: dict[str, Any] = {
        "parameter": name, "unit": next(v.unit for v in values if v),
        "values": [v and {"value": v.value, "std": v.std} for v in values],
        "pooled": None, "differences": [], "largest": None, "q": None, "p": None, "p_holm": None, "most_unlike": None,
    }  # fmt: skip
    whole = {k: (v.value, v.std) for k, v in enumerate(values) if v and v.std and v.value is not None}
    if len(whole) < 2:
        return out
    known, (x, s) = list(whole), np.array(list(whole.values())).T
    out["q"], out["p"] = cochran(x, s)
    out["pooled"] = pooled(x, s)._asdict()
    pairs = [d._replace(first=known[d.first], second=known[d.second]) for d in differences(x, s)]
    out["largest"] = pairs[0]._asdict()
    out["differences"] = [d._asdict() for d in sorted(pairs)]
    if len(known) > 2:
        out["most_unlike"] = known[_most_unlike(x, s)]
    return out


def _most_unlike(x: np.ndarray, s: np.ndarray) -> int:
    """Which value is farthest from the mean of the others, in standard deviations of that difference."""
    others = [pooled(np.delete(x, k), np.delete(s, k)) for k in range(len(x))]
    return int(np.argmax([abs(x[k] - o.value) / np.hypot(s[k], o.std) for k, o in enumerate(others)]))


def _judged(p: Mapping[str, Any], same_within: float) -> str:
    if p["p"] is None:
        return "named_in_some"
    pairs, margin = [Difference(**d) for d in p["differences"]], same_within * abs(p["pooled"]["value"])
    if all_within(pairs, margin):
        return "same"
    return "differs" if p["p_holm"] < LEVEL else "cannot_tell"


def _effect(given: Sequence[Given], site: Site, parameters: list[dict[str, Any]]) -> dict[str, Any]:
    """An effect: which diagnoses name it, and why the others may not."""
    named = [k for k, one in enumerate(given) if _finding(one, site)]
    said = [p["says"] for p in parameters] or ["cannot_tell"]
    says = min([*said, *(["named_in_some"] if len(named) < len(given) else [])], key=ORDER.index)
    without = [{"of": k, "why": _why_not(given[k], site)} for k in range(len(given)) if k not in named]
    sentence = said_of_effect(named, without, [one.name for one in given])
    return {"effect": site[0], "joints": list(site[1]), "says": says, "named_in": named, "not_named_in": without,
            "sentence": sentence, "parameters": parameters}  # fmt: skip


def _why_not(one: Given, site: Site) -> str:
    """Why a diagnosis doesn't name an effect that another one names, as far as it says."""
    slug, joints = site
    for f in one.diagnosis.findings:
        if set(f.joints) & set(joints) and slug in [a.effect for a in f.alternatives]:
            return f"alternative:{f.effect}"
        if f.effect == slug and set(f.joints) & set(joints):
            return f"other_joints:{','.join(f.joints)}"
    if any(b.effect == slug and set(b.joints) & set(joints) for b in one.diagnosis.not_testable):
        return "not_testable"
    return "undecided" if one.diagnosis.verdict == "undecided" else "not_found"


def _origin(one: Given) -> dict[str, Any]:
    origin = one.diagnosis.provenance
    return {"name": one.name, "verdict": one.diagnosis.verdict, "date": origin.date,
            "robot": origin.robot.name, "recordings": [r.file for r in origin.recordings]}  # fmt: skip


def _notes(given: Sequence[Given]) -> list[str]:
    notes = []
    if len({one.diagnosis.provenance.robot.sha256 for one in given}) > 1:
        notes.append("The diagnoses start from different models of the robot; each parameter counts from its own "
                     "model's value.")  # fmt: skip
    if len({one.diagnosis.provenance.version for one in given}) > 1:
        notes.append("The diagnoses were made by different versions of the program.")
    if vague := [one.name for one in given if one.diagnosis.verdict in ("undecided", "unexplained")]:
        notes.append(f"{', '.join(vague)}: the verdict is undecided or unexplained, so an effect not named there may "
                     "still act.")  # fmt: skip
    return notes


def _rounded(x: Any) -> Any:
    """Numbers to six digits, as in diagnosis.json."""
    if isinstance(x, dict):
        return {key: _rounded(value) for key, value in x.items()}
    if isinstance(x, list):
        return [_rounded(value) for value in x]
    return float(f"{x:.6g}") if isinstance(x, float) else x
