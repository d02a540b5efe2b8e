"""What was hidden beside what was found."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from irb140_jax.mismatch.result import Diagnosis, Estimate, Finding


class Found(NamedTuple):
    """A hidden effect that was named on the right joints.

    Attributes:
        effect: Its slug.
        joints: Names of its joints.
        parameters: By name: the true value in the unit of the estimate (None where the truth doesn't state it), and
            the estimate.
    """

    effect: str
    joints: tuple[str, ...]
    parameters: dict[str, tuple[float | None, Estimate]]


class Reveal(NamedTuple):
    """The truth of a demonstration, sorted by what the diagnosis made of it.

    Attributes:
        found: Hidden effects named on the right joints.
        missed: Hidden effects that no finding names, as truth.json has them.
        extra: Findings that were not hidden.
        seal: Hash of the truth, shown before the diagnosis began.
    """

    found: tuple[Found, ...]
    missed: tuple[Mapping, ...]
    extra: tuple[Finding, ...]
    seal: str

    @property
    def right(self) -> bool:
        """Whether everything hidden was found, and nothing else."""
        return not self.missed and not self.extra


def revealed(hidden: Sequence[Mapping], diagnosis: Diagnosis, seal: str) -> Reveal:
    """Sort hidden effects by what the diagnosis says of them.

    Args:
        hidden: Each as {"effect", "joints", "parameters": {name: {"value", "unit"}}}.
        diagnosis: The diagnosis.
        seal: Hash of the truth.
    """
    # What has to agree: the name, and the joints in any order.
    findings = {(finding.effect, frozenset(finding.joints)): finding for finding in diagnosis.findings}
    truth = {(effect["effect"], frozenset(effect["joints"])): effect for effect in hidden}
    return Reveal(
        found=tuple(_beside(effect, findings[key]) for key, effect in truth.items() if key in findings),
        missed=tuple(effect for key, effect in truth.items() if key not in findings),
        extra=tuple(finding for key, finding in findings.items() if key not in truth),
        seal=seal,
    )


def _beside(hidden: Mapping, finding: Finding) -> Found:
    """Every diagnosed parameter beside its true value."""
    true = hidden.get("parameters", {})
    parameters = {name: (true[name]["value"] if name in true else None, p) for name, p in finding.parameters.items()}
    return Found(finding.effect, finding.joints, parameters)
