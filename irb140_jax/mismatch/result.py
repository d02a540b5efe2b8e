"""What a diagnosis says: the records that diagnosis.json is made of."""

import dataclasses
from typing import Any, Literal

from irb140_jax.mismatch.records import check_schema, plain, read

SCHEMA = 2  # of diagnosis.json
Verdict = Literal["no_mismatch", "parameters_only", "physics_left_out", "unexplained", "undecided"]


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A physical parameter; a number that is not finite is None, as in all records here.

    Attributes:
        value: In `unit`.
        std: Its standard deviation, in `unit`.
        unit: SI, for example "N m s/rad"; "1" where there is none.
    """

    value: float | None
    std: float | None
    unit: str


@dataclasses.dataclass(frozen=True)
class Evidence:
    """What speaks for a finding.

    Attributes:
        log_odds: Natural logarithm of its posterior odds against the explanation without it.
        probability: That it acts at its joints, instead of one of its alternatives or nothing.
        heldout_gain: Share that it removes of the squared error which inertial parameters of any size and the other
            findings, fitted in its place, leave on unseen data; of all joints, each in units of its noise.
    """

    log_odds: float | None
    probability: float | None
    heldout_gain: float | None


@dataclasses.dataclass(frozen=True)
class Alternative:
    """An effect that the data can't tell from a finding.

    Attributes:
        effect: Its slug.
        probability: That it acts there instead.
        separate_by: Which recording would tell them apart, one sentence.
    """

    effect: str
    probability: float | None
    separate_by: str


@dataclasses.dataclass(frozen=True)
class Finding:
    """An effect that the model leaves out.

    Attributes:
        effect: Its slug.
        joints: Names of the joints whose torque it changes.
        where: At which positions, speeds, loads, times or frequencies it acts, one sentence.
        parameters: Of its law, by name.
        evidence: What speaks for it.
        certain: What holds whichever of the alternatives is true, one sentence with numbers.
        alternatives: Most probable first.
    """

    effect: str
    joints: tuple[str, ...]
    where: str
    parameters: dict[str, Estimate]
    evidence: Evidence
    certain: str
    alternatives: tuple[Alternative, ...]


@dataclasses.dataclass(frozen=True)
class Unexplained:
    """Structure in the torque that no effect of the library explains.

    Attributes:
        joints: Names of the joints where it is.
        where: How large it is and what it depends on, one sentence.
        share: Part of the remaining residual's variance that is predictable on unseen data; None of a joint that
            something stops.
        p_value: Share of time-shifted copies of the residual that are as predictable; None likewise.
    """

    joints: tuple[str, ...]
    where: str
    share: float | None
    p_value: float | None


@dataclasses.dataclass(frozen=True)
class NotTestable:
    """An effect that these recordings could not have shown.

    Attributes:
        effect: Its slug.
        joints: Names of the joints where that is so.
        needs: The motion or test that would show it, one sentence.
    """

    effect: str
    joints: tuple[str, ...]
    needs: str


@dataclasses.dataclass(frozen=True)
class Fit:
    """Torque errors at one joint on unseen data, root mean square [N m or N]; None where it was not judged.

    Attributes:
        rmse_nominal: Of the model as given.
        rmse_refit: Of the rigid body with refitted inertials.
        rmse_corrected: Of the corrected model.
        noise_floor: What the sensors scatter by.
    """

    rmse_nominal: float | None = None
    rmse_refit: float | None = None
    rmse_corrected: float | None = None
    noise_floor: float | None = None


@dataclasses.dataclass(frozen=True)
class DiagnosedRobot:
    """The nominal model.

    Attributes:
        name: Its name.
        joints: Names of the joints diagnosed.
        sha256: Of its numbers.
    """

    name: str
    joints: tuple[str, ...]
    sha256: str


@dataclasses.dataclass(frozen=True)
class DiagnosedRecording:
    """A recording.

    Attributes:
        file: Its name.
        sha256: Of the file, or of the numbers where there is none.
        rows: Samples.
        rate: Mean rate [Hz].
        duration: From the first to the last sample [s].
    """

    file: str
    sha256: str
    rows: int
    rate: float
    duration: float


@dataclasses.dataclass(frozen=True)
class Provenance:
    """Where a diagnosis comes from.

    Attributes:
        version: Of the package.
        command: With which it is made again, but for the folder.
        robot: The nominal model.
        recordings: That were compared with it.
        options: By name.
        date: The day, in UTC.
    """

    version: str
    command: str
    robot: DiagnosedRobot
    recordings: tuple[DiagnosedRecording, ...]
    options: dict[str, Any]
    date: str


@dataclasses.dataclass(frozen=True)
class Diagnosis:
    """What diagnosis.json holds; numbers have six significant digits.

    Attributes:
        verdict: In one word.
        findings: Strongest first.
        unexplained: What no effect explains.
        not_testable: What the recordings could not have shown.
        fit: Torque errors, by the names of the joints.
        notes: Repairs, assumptions, warnings and joints not judged, a sentence each.
        provenance: Where it comes from.
        summary: A short paragraph for a person.
    """

    verdict: Verdict
    findings: tuple[Finding, ...]
    unexplained: tuple[Unexplained, ...]
    not_testable: tuple[NotTestable, ...]
    fit: dict[str, Fit]
    notes: tuple[str, ...]
    provenance: Provenance
    summary: str

    def to_json(self) -> dict[str, Any]:
        """The contents of diagnosis.json."""
        return {"schema": SCHEMA} | plain(self)

    @classmethod
    def from_json(cls, data: Any) -> "Diagnosis":
        """The inverse of `to_json`.

        Raises:
            KeyError: An entry is missing.
            ValueError: It is of another schema, or an entry is of another type.
        """
        check_schema(data, SCHEMA)
        return read(cls, data)
