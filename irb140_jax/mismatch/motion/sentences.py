"""What a proof in motion says in plain sentences."""

from collections.abc import Mapping
from typing import Any

MODELS = ("nominal", "refit", "corrected")
SAID_AT = (0.1, 0.5, 2.0)  # [s]
LEAST = 1e-3  # [mm] a tool that moves less is on the axis


def sentences(proof: Mapping[str, Any]) -> list[str]:
    """How far off the models are, until when the comparison means anything, and what was applied as torque."""
    horizon, (what, row), by_torque = proof["horizon"], subject(proof), proof["driven_by"] == "torque"
    middle = {name: row[name]["median"] for name in (*MODELS, "moved")}
    said = []
    for time in SAID_AT:
        k = horizon.index(time)
        if middle["moved"][k] is not None:
            given = _listed({name: middle[name][k] for name in MODELS}, row["unit"])
            moved = _with_unit(middle["moved"][k], row["unit"])
            said.append(f"After {time:g} s {what} is off by {given}; the robot has moved it by {moved} (medians of "
                        f"{proof['windows']} starts).")  # fmt: skip
    if (last := lost(proof)) is not None:
        alone = ": driven by torque alone, without a controller, small errors grow, and" if by_torque else ", and"
        said.append(f"From {last:g} s on every model is farther off than {what} has moved{alone} there the comparison "
                    "means nothing.")  # fmt: skip
    if (run := proof["whole_run"]) is not None:
        whole = run["tool"] if row is proof["tool"] else run["joints"][what]
        errors, moved = _listed(whole, row["unit"]), _with_unit(whole["moved"], row["unit"])
        said.append(f"Over whole recordings ({run['seconds']:g} s at most) it is off by {errors}; the robot is {moved} "
                    "from its start (medians over time).")  # fmt: skip
    if proof["followed"]:
        why = "without any inertia in one of the models, so that torque alone can't drive it" if by_torque else (
            "not driven, for its gains are not known or one of the models has no inertia there")
        said.append(f"{', '.join(proof['followed'])}: {why}; in all models it follows the recording.")
    if outside := [*proof["as_torque"], *proof["as_law"]]:
        alone = [f"{_with_unit(row['file']['median'][horizon.index(time)], row['unit'])} after {time:g} s"
                 for time in SAID_AT if middle["moved"][horizon.index(time)] is not None]  # fmt: skip
        how = ["what it lacks was applied as a torque computed along the recorded motion, which favours the corrected "
               "model"] * bool(proof["as_torque"])  # fmt: skip
        if proof["as_law"]:
            what_acts = ", ".join(proof["as_law"]) if proof["as_torque"] else "it"
            how.append(f"in the corrected model {what_acts} acts at each state that the simulation reaches")
        said.append(f"corrected.xml can't hold {', '.join(outside)} in whole or in part; {'; '.join(how)}. With "
                    f"the file alone {what} is off by {', '.join(alone)}.")  # fmt: skip
    return said


def subject(proof: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]]:
    """What is talked of: the tool, or where the joints don't move that, the joint that moves most."""
    far = lambda row: max((x for x in row["moved"]["median"] if x is not None), default=0.0)  # noqa: E731
    if far(proof["tool"]) > LEAST:
        return "the tool", proof["tool"]
    joint = max(proof["joints"], key=lambda name: far(proof["joints"][name]))
    return joint, proof["joints"][joint]


def lost(proof: Mapping[str, Any]) -> float | None:
    """Time from which every model's error exceeds what the robot moves [s]; None if that does not happen."""
    (_, row), out = subject(proof), None
    for k in reversed(range(len(proof["horizon"]))):
        moved = row["moved"]["median"][k]
        best = min((x for name in MODELS if (x := row[name]["median"][k]) is not None), default=float("inf"))
        if moved is None:
            continue
        if best <= moved:
            break
        out = proof["horizon"][k]
    return out


def _listed(errors: Mapping[str, float | None], unit: str) -> str:
    each = [f"{_with_unit(errors[name], unit)} ({name})" for name in MODELS]
    return f"{', '.join(each[:-1])} and {each[-1]}"


def _with_unit(x: float | None, unit: str) -> str:
    return "more than can be told" if x is None else f"{x:.3g} {unit}"
