"""What of a stored diagnosis is right: facts of one case; `figures` sums them up."""

import json
import re
from typing import Any

import numpy as np

from testbed.rubbing import ORDINARY

# These act on all joints, so that their list of joints decides nothing.
EVERYWHERE = ("time_delay", "gravity_tilt", "payload", "contact", "external_wrench")
GAIN_WITHIN = 0.05
# What a note has to speak of besides the joint, so that a repaired sample is no statement about a dead channel.
OF_THE_LOG = re.compile(r"dead|froz|constant|zero|stuck|differs between|\blate\b|delay|saturat", re.I)
SLIGHT = "is structure that no effect explains: "  # and after it the joints, in a note
NOT_A_BODY = re.compile(r"(?:mass|Ixx|Iyy|Izz)[^,;]*? (?:->|to|is|of) -\d[\d.e+-]* kg")


def matches(finding: dict[str, Any], hidden: dict[str, Any], names: tuple[str, ...] = ("accept", "tolerate")) -> bool:
    """Whether a finding says something that is true by this part of the truth."""
    if not any(finding["effect"] in hidden[k] for k in names):
        return False
    return finding["effect"] in EVERYWHERE or set(finding["joints"]) <= set(hidden["joints"])


def false_names(line: dict[str, Any], ordinary: bool = False) -> list[dict[str, Any]]:
    """Findings that nothing in the truth allows; ordinary friction aside, or only that."""
    dead = set(line["truth"]["dead"])
    live = [h for h in line["truth"]["hidden"] if not (len(h["joints"]) == 1 and set(h["joints"]) <= dead)]
    return [
        f for f in line["diagnosis"]["findings"]
        if (f["effect"] in ORDINARY) == ordinary
        and not all(any(matches(f | {"joints": [j]}, h) for h in live) for j in f["joints"])
    ]  # fmt: skip


def probabilities(line: dict[str, Any]) -> list[tuple[str, float, bool]]:
    """Effect, stated probability and whether it is right, of every finding."""
    wrong = [id(f) for ordinary in (True, False) for f in false_names(line, ordinary)]
    found = line["diagnosis"]["findings"]
    return [(f["effect"], float(f["evidence"]["probability"]), id(f) not in wrong) for f in found]


def intervals(line: dict[str, Any], *, unexplained: bool = False) -> list[tuple[str, str, float, float, float]]:
    """Effect, parameter, value, standard deviation and truth of all that is named and known in the same meaning.

    Args:
        line: A stored result.
        unexplained: Only of joints on which there is structure that no effect explains.
    """
    out, left = [], {joint for u in line["diagnosis"]["unexplained"] for joint in u["joints"]}
    for f in line["diagnosis"]["findings"]:
        if unexplained and not left & set(f["joints"]):
            continue
        for h in line["truth"]["hidden"]:
            same = f["effect"] == h["slug"] and (f["effect"] in EVERYWHERE or set(f["joints"]) == set(h["joints"]))
            for name, true in h["parameters"].items() if same else ():
                p = f["parameters"].get(name)
                if p and p["value"] is not None and p["std"]:
                    out.append((f["effect"], name, float(p["value"]), float(p["std"]), float(true)))
    return out


def stated_classes(line: dict[str, Any]) -> list[dict[str, Any]]:
    """How each special thing with a name came out.

    Returns:
        kind; how: "named", "in the class", "not testable", "unexplained" or "missed"; size: names in the class.
    """
    said, out = line["diagnosis"], []
    for h in line["truth"]["hidden"]:
        if h["role"] != "special" or not h["accept"] or set(h["joints"]) <= set(line["truth"]["dead"]):
            continue
        how, size = "missed", 0
        for f in said["findings"]:
            options = [f["effect"], *(a["effect"] for a in f["alternatives"])]
            there = set(f["joints"]) & set(h["joints"])
            if there and set(options) & set(h["accept"]):
                named = f["effect"] in h["accept"]
                if how != "named":
                    how, size = "named" if named else "in the class", len(set(options))
        if how == "missed" and any(
            n["effect"] in h["accept"] and set(n["joints"]) & set(h["joints"]) for n in said["not_testable"]
        ):  # fmt: skip
            how = "not testable"
        if how == "missed" and any(set(u["joints"]) & set(h["joints"]) for u in said["unexplained"]):
            how = "unexplained"
        out.append({"kind": h["kind"], "slug": h["slug"], "how": how, "size": size})
    return out


def gains(line: dict[str, Any]) -> list[bool]:
    """Whether each wrong torque constant was named within 5 %."""
    out = []
    for h in line["truth"]["hidden"]:
        if h["slug"] == "torque_gain":
            said = [f["parameters"]["gain"]["value"] for f in line["diagnosis"]["findings"]
                    if f["effect"] == "torque_gain" and set(h["joints"]) <= set(f["joints"])]  # fmt: skip
            out.append(any(abs(g / h["parameters"]["gain"] - 1.0) <= GAIN_WITHIN for g in said))
    return out


def floors(line: dict[str, Any], of: str = "noise_in_band") -> list[float]:
    """Stated noise over the torque sensors', or over what the true plant leaves (`left_in_band`), one a live joint."""
    noise, dead = line.get(of, {}), line["truth"]["dead"]
    fit = line["diagnosis"]["fit"]
    return [fit[j]["noise_floor"] / noise[j] for j in noise
            if j not in dead and j in fit and fit[j].get("noise_floor") and noise[j] > 0.0]  # fmt: skip


def located(line: dict[str, Any]) -> list[tuple[str, str]]:
    """How each special thing without a name came out: "located", "named alike", "noted" or "not said"."""
    said, out = line["diagnosis"], []
    for h in line["truth"]["hidden"]:
        if not h["unnamed"]:
            continue
        how, joints = "not said", set(h["joints"])
        if any(OF_THE_LOG.search(x) and 2 * sum(j in x for j in joints) >= len(joints) for x in said.get("notes", [])):
            how = "noted"
        # Of each joint a part that begins with its name; what it depends on may be another joint.
        slight = [part for x in said.get("notes", []) for part in x.partition(SLIGHT)[2].split("; ")]
        if any(part.startswith(f"{j} ") for part in slight for j in joints):
            how = "noted"
        if any(matches(f, h, ("accept",)) for f in said["findings"]):
            how = "named alike"
        if any(set(u["joints"]) & joints for u in said["unexplained"]):
            how = "located"
        out.append((h["kind"], how))
    return out


def places(line: dict[str, Any]) -> list[tuple[str, bool]]:
    """Of each thing without a name that is located: its kind, and whether what it depends on is said rightly."""
    return [
        (h["kind"], any(word in u["where"].partition(" depends on ")[2].partition(";")[0] for word in h["depends"]))
        for h in line["truth"]["hidden"] if h.get("depends")
        for u in line["diagnosis"]["unexplained"] if set(u["joints"]) & set(h["joints"])
    ]  # fmt: skip


def unseen_ratio(line: dict[str, Any]) -> float:
    """Error of the corrected model over refit's on unseen motions, each joint weighed by its torque."""
    live = [j for j in line["truth"]["torque"] if j not in line["truth"]["dead"]]
    size = lambda which: np.sqrt(np.mean([(line["unseen"][which][j] / line["truth"]["torque"][j]) ** 2 for j in live]))  # noqa: E731
    return float(size("corrected") / max(size("refit"), 1e-12))


def impossible_stated(line: dict[str, Any]) -> bool:
    """Whether any sentence states a mass or moment of inertia below zero."""
    return bool(NOT_A_BODY.search(json.dumps([line["diagnosis"], line.get("sentences", [])])))


def verdict_right(line: dict[str, Any]) -> bool:
    """Whether the verdict is one that the truth allows."""
    hidden, dead = line["truth"]["hidden"], line["truth"]["dead"]
    live = [h for h in hidden if not set(h["joints"]) <= set(dead)]
    allowed = {"undecided"} if dead else set()
    if any(h["slug"] and h["role"] != "instrument" for h in live):
        allowed |= {"physics_left_out"}
    if any(h["unnamed"] for h in hidden):
        allowed |= {"unexplained"} | ({"physics_left_out"} if any(h["accept"] for h in live) else set())
    if all(h["role"] == "instrument" for h in live):
        allowed |= {"no_mismatch", "parameters_only"}
    return line["diagnosis"]["verdict"] in allowed
