"""One unit as one row of the table: flat, and nothing in it that differs between two runs on the same files."""

import json
from typing import Any

from irb140_jax.fleet.layout import Unit
from irb140_jax.mismatch.records import plain
from irb140_jax.mismatch.result import Diagnosis

# Worst first.  A unit that could not be diagnosed stands apart, with what would mend it.
SEVERITY = {"unexplained": 4, "physics_left_out": 3, "undecided": 2, "parameters_only": 1, "no_mismatch": 0}
FACTORS = {"given": "rmse_nominal", "refit": "rmse_refit", "corrected": "rmse_corrected"}


def row_of(unit: Unit, diagnosis: Diagnosis) -> dict[str, Any]:
    """The row of a diagnosis.

    Args:
        unit: What was diagnosed.
        diagnosis: Its diagnosis.
    """
    origin, found = diagnosis.provenance, diagnosis.findings
    over_noise = {
        joint: {name: (getattr(f, key) or 0.0) / f.noise_floor for name, key in FACTORS.items()}
        for joint, f in diagnosis.fit.items() if f.noise_floor
    }  # fmt: skip
    worst = max(over_noise, key=lambda joint: over_noise[joint]["given"], default=None)
    of_worst = over_noise[worst] if worst else {}
    return {
        **_blank(unit, "diagnosed"),
        "severity": SEVERITY[diagnosis.verdict],
        "verdict": diagnosis.verdict,
        "robot": origin.robot.name,
        "joints": len(origin.robot.joints),
        "seconds": _short(sum(r.duration for r in origin.recordings)),
        "worst_joint": worst,
        **{f"{name}_over_noise": _short(value) for name, value in of_worst.items()},
        "effects": [f"{f.effect}:{','.join(f.joints)}" for f in found],
        "probabilities": [f.evidence.probability for f in found],
        "open": sum(bool(f.alternatives) for f in found),
        "unexplained": [joint for u in diagnosis.unexplained for joint in u.joints],
        "summary": diagnosis.summary,
        "findings": json.dumps(plain(found), ensure_ascii=False),
        "fit": json.dumps(plain(diagnosis.fit), ensure_ascii=False),
    }


def row_without(unit: Unit, status: str, message: str) -> dict[str, Any]:
    """The row of a unit that could not be diagnosed.

    Args:
        unit: The unit.
        status: "refused" for what a user can mend, "failed" for what the program is at fault for.
        message: One line that says why.
    """
    for path in unit.files:  # the table is the same from wherever it is made
        message = message.replace(str(path), path.name)
    return {**_blank(unit, status), "message": " ".join(message.split())}


def _blank(unit: Unit, status: str) -> dict[str, Any]:
    return {
        "unit": unit.name, "status": status, "severity": None, "verdict": None, "robot": None, "joints": None,
        "recordings": [path.name for path in unit.recordings], "seconds": None, "worst_joint": None,
        **dict.fromkeys([f"{name}_over_noise" for name in FACTORS]), "effects": [], "probabilities": [], "open": None,
        "unexplained": [], "summary": None, "findings": None, "fit": None, "message": None,
    }  # fmt: skip


def _short(x: float) -> float:
    """To six digits, as diagnosis.json."""
    return float(f"{x:.6g}")
