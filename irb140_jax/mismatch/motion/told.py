"""What a proof in motion says in plain sentences."""

from collections.abc import Mapping
from typing import Any

MODELS = ("nominal", "refit", "corrected")
SAID_AT = (0.1, 0.5, 2.0)  # [s]


def sentences(proof: Mapping[str, Any]) -> list[str]:
    """How far off the models are, until when the comparison means anything, and what was applied as torque."""
    tool, horizon = proof["tool"], proof["horizon"]
    middle = {name: tool[name]["median"] for name in ("nominal", "refit", "corrected", "moved")}
    said = []
    for time in SAID_AT:
        k = horizon.index(time)
        if middle["moved"][k] is not None:
            given = _listed({name: middle[name][k] for name in MODELS})
            said.append(f"After {time:g} s the tool is off by {given}; the robot has moved it by "
                        f"{_mm(middle['moved'][k])} (medians of {proof['windows']} starts).")  # fmt: skip
    if (last := lost(proof)) is not None:
        said.append(f"From {last:g} s on every model is farther off than the tool has moved: driven by torque alone, "
                    "without a controller, small errors grow, and there the comparison means nothing.")  # fmt: skip
    if (run := proof["whole_run"]) is not None and run["tool"]["corrected"] is not None:
        errors = _listed(run["tool"])
        said.append(f"Over whole recordings, {run['seconds']:g} s at most, it is off by {errors} (medians over time).")
    if proof["followed"]:
        said.append(f"{', '.join(proof['followed'])}: without any inertia in one of the models, so that torque alone "
                    "can't drive it; in all models it follows the recording.")  # fmt: skip
    if proof["as_torque"]:
        said.append(f"corrected.xml can't hold {', '.join(proof['as_torque'])} in whole or in part; what it lacks was "
                    "applied as a torque computed along the recorded motion.")  # fmt: skip
    return said


def lost(proof: Mapping[str, Any]) -> float | None:
    """Time from which every model's error exceeds what the tool moves [s]; None if that does not happen."""
    tool, out = proof["tool"], None
    for k in reversed(range(len(proof["horizon"]))):
        moved = tool["moved"]["median"][k]
        best = min((x for name in ("nominal", "refit", "corrected") if (x := tool[name]["median"][k]) is not None),
                   default=float("inf"))  # fmt: skip
        if moved is None:
            continue
        if best <= moved:
            break
        out = proof["horizon"][k]
    return out


def _listed(errors: Mapping[str, float | None]) -> str:
    each = [f"{_mm(errors[name])} ({name})" for name in MODELS]
    return f"{', '.join(each[:-1])} and {each[-1]}"


def _mm(x: float | None) -> str:
    return "far too much to tell" if x is None else f"{x:.3g} mm"
