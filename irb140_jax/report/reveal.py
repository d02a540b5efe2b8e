"""What was hidden beside what was found."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple


class Reveal(NamedTuple):
    """The truth of a demonstration, sorted by what the diagnosis made of it.

    Attributes:
        found: Hidden effects named on the right joints; each as {"effect", "joints", "parameters": {name: (true,
            diagnosed value, its std, unit)}}.
        missed: Hidden effects that no finding names.
        extra: Findings that were not hidden.
        seal: Hash of the truth, shown before the diagnosis began.
    """

    found: tuple[Mapping, ...]
    missed: tuple[Mapping, ...]
    extra: tuple[Mapping, ...]
    seal: str

    @property
    def right(self) -> bool:
        """Whether everything hidden was found, and nothing else."""
        return not self.missed and not self.extra


def revealed(hidden: Sequence[Mapping], diagnosis: Mapping, seal: str) -> Reveal:
    """Sort hidden effects by what the diagnosis says of them.

    Args:
        hidden: Each as {"effect", "joints", "parameters": {name: {"value", "unit"}}}, like the findings.
        diagnosis: What diagnosis.json holds.
        seal: Hash of the truth.
    """
    findings = {_key(finding): finding for finding in diagnosis["findings"]}
    truth = {_key(effect): effect for effect in hidden}
    return Reveal(
        found=tuple(_beside(effect, findings[key]) for key, effect in truth.items() if key in findings),
        missed=tuple(effect for key, effect in truth.items() if key not in findings),
        extra=tuple(finding for key, finding in findings.items() if key not in truth),
        seal=seal,
    )


def _key(effect: Mapping) -> tuple[str, frozenset[str]]:
    """What has to agree: the name, and the joints in any order."""
    return effect["effect"], frozenset(effect["joints"])


def _beside(hidden: Mapping, finding: Mapping) -> dict:
    """Every diagnosed parameter beside its true value (None where the truth doesn't state it)."""
    true = hidden.get("parameters", {})
    parameters = {
        name: (true[name]["value"] if name in true else None, given["value"], given["std"], given["unit"])
        for name, given in finding["parameters"].items()
    }
    return {"effect": finding["effect"], "joints": finding["joints"], "parameters": parameters}
