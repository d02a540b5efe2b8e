"""The first table of the report: what was found, by effect and joint."""

from collections.abc import Mapping, Sequence

from irb140_jax.mismatch.result import Diagnosis, Finding, Fit
from irb140_jax.report import text

SURE = 0.95  # probability from which a cell is drawn as certain


def overview(diagnosis: Diagnosis, joints: Sequence[str], units: Mapping[str, str]) -> list[dict]:
    """Rows of the table: one for each effect, then what has no name or is blocked, then the error left over the noise.

    Args:
        diagnosis: The diagnosis.
        joints: Names of the joints, the columns.
        units: Units of their torques.

    Returns:
        Rows {"name", "cells": one {"value", "more", "kind"} for each joint}; `kind` holds "sure" where a
        finding is probable, "open" where it has alternatives, "rest" where there is no name.
    """
    rows: dict[str, dict[str, dict]] = {}
    for finding in diagnosis.findings:
        for joint in finding.joints:
            rows.setdefault(text.words(finding.effect), {})[joint] = _found(finding)
    for rest in diagnosis.unexplained:
        for joint in rest.joints:
            if rest.share is None:
                rows.setdefault("blocked", {})[joint] = {"value": "yes", "more": "", "kind": "rest"}
                continue
            cell = {"value": text.percent(rest.share), "more": "of the rest", "kind": "rest"}
            rows.setdefault("without a name", {})[joint] = cell
    left = {joint: _left(diagnosis.fit.get(joint), units.get(joint, "")) for joint in joints}
    rows["error left"] = left
    blank = {"value": "", "more": "", "kind": ""}
    return [{"name": name, "cells": [cells.get(joint, blank) for joint in joints]} for name, cells in rows.items()]


def _found(finding: Finding) -> dict:
    """A finding in one cell: its first parameter and its probability."""
    p = finding.evidence.probability
    first = next(iter(finding.parameters.values()), None)
    value, unit = (text.with_std(first.value, first.std), f"{first.unit} · ") if first else ("yes", "")
    rivals = len(finding.alternatives)
    more = unit + text.percent(p) + (f", {rivals} alternative{'s' if rivals > 1 else ''}" if rivals else "")
    kind = ["sure"] * (p is not None and p >= SURE) + ["open"] * (rivals > 0)
    return {"value": value, "more": more, "kind": " ".join(kind)}


def _left(fit: Fit | None, unit: str) -> dict:
    """What the corrected model still misses, in torque and in multiples of the noise."""
    if fit is None or fit.rmse_corrected is None:
        return {"value": "not judged", "more": "", "kind": "none"}
    noise = fit.noise_floor
    times = f"{text.number(fit.rmse_corrected / noise, 2)} × noise" if noise else ""
    return {"value": f"{text.number(fit.rmse_corrected)} {unit}", "more": times, "kind": ""}
