"""The command line's work for those who write Python: files or arrays in, a diagnosis out."""

import dataclasses
import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from irb140_jax import mismatch, recordings, report
from irb140_jax.errors import InputError
from irb140_jax.mismatch import CorrectedRobot, DiagnoseConfig, Finding, Result
from irb140_jax.mismatch.result import Verdict
from irb140_jax.recordings import Recording
from irb140_jax.recordings import drive as drives
from irb140_jax.report import text
from irb140_jax.robot import Robot, irb140, load_robot
from irb140_jax.tables import table_html

Path = str | os.PathLike[str]


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a diagnosis says, with the corrected model.

    Attributes:
        result: Everything: the diagnosis, the model, data of the report's drawings, what is open.
    """

    result: Result

    @property
    def document(self) -> dict[str, Any]:
        """What diagnosis.json holds."""
        return self.result.diagnosis.to_json()

    @property
    def verdict(self) -> Verdict:
        """One of no_mismatch, parameters_only, physics_left_out, unexplained, undecided."""
        return self.result.diagnosis.verdict

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Named effects with joints, parameters, evidence and rivals, strongest first."""
        return self.result.diagnosis.findings

    @property
    def summary(self) -> str:
        """A short paragraph."""
        return self.result.diagnosis.summary

    @property
    def corrected(self) -> CorrectedRobot:
        """The corrected model as dynamics in JAX."""
        return mismatch.corrected_robot(self.result.model)

    def predict(self, recording: Recording) -> dict[str, np.ndarray]:
        """Torque along a recording by the "nominal", "refit" and "corrected" model, each (T, n) [N m or N]."""
        return mismatch.predict(self.result.model, recording)

    def html(self, folder: Path = "DIR") -> str:
        """The report, one page; `folder` stands in the commands that it proposes."""
        return report.html_report(self.result.diagnosis, self.result.views, folder=os.fspath(folder))

    def save(self, folder: Path) -> pathlib.Path:
        """Write what `irb140 diagnose` writes; whole or not at all, over a former diagnosis only.

        Raises:
            InputError: Something else is there, or nothing can be written.
        """
        out = pathlib.Path(folder)

        def write(fresh: pathlib.Path) -> None:
            mismatch.save(self.result, fresh)
            (fresh / "report.html").write_text(self.html(out), encoding="utf-8")

        with report.results_folder(out, "irb140_jax.Diagnosis.save", []) as results:
            return results.write(write)

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict}: {self.summary})"

    def _repr_html_(self) -> str:
        rows = []
        for finding in self.findings:
            shown = [f"{text.words(name)} {text.with_std(p.value, p.std)} {p.unit}"
                     for name, p in finding.parameters.items()]  # fmt: skip
            joints, probability = ", ".join(finding.joints), text.percent(finding.evidence.probability)
            rows.append((text.words(finding.effect), joints, "; ".join(shown), probability))
        said = f"{text.VERDICTS[self.verdict]}. {self.summary}"
        return table_html(("effect", "joints", "parameters", "probability"), rows, said)


def diagnose(
    recordings: Path | Recording | Sequence[Path | Recording],
    robot: Path | Robot | None = None,
    *,
    inertial_uncertainty: float = 0.05,
    columns: Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Name the physics that a model leaves out of recordings.

    Args:
        recordings: Files, or recordings that were read or made; one or several.
        robot: MJCF or URDF file, or a robot; by default the ABB IRB 140 that ships with the package.
        inertial_uncertainty: Relative standard deviation of the model's inertial parameters.
        columns: TOML file that maps other column names and units.
        progress: Told what is being done, for example `print`.

    Raises:
        InputError: The robot or a recording can't be used; the message says what would mend it.
    """
    given = [recordings] if isinstance(recordings, str | os.PathLike | Recording) else list(recordings)
    if not given:
        raise InputError("diagnose: no recording was given; give at least one file or Recording")
    if not 0.0 < inertial_uncertainty <= 1.0:
        raise InputError(f"diagnose: inertial_uncertainty is {inertial_uncertainty}; give a share above 0 and up to 1")
    arm = _robot(robot)
    model = {} if robot is None or isinstance(robot, Robot) else {
        "drive": drives.drive_of_model(os.fspath(robot), arm.joint_names)
    }  # fmt: skip
    read = [r if isinstance(r, Recording) else read_recording(r, arm, columns, **model) for r in given]
    for r in read:
        if r.joint_names != arm.joint_names:
            raise InputError(f"diagnose: {r.source} holds joints {', '.join(r.joint_names)}; the robot {arm.name} has "
                             f"{', '.join(arm.joint_names)}")  # fmt: skip
    files = {"--robot": None if isinstance(robot, Robot) else robot, "--columns": columns, "--out": "DIR"}
    words = tuple(word for option, path in files.items() if path is not None for word in (option, os.fspath(path)))
    config = DiagnoseConfig(inertial_uncertainty=inertial_uncertainty, words=words)
    return Diagnosis(mismatch.diagnose(arm, read, config, progress))


def read_recording(
    path: Path, robot: Path | Robot | None = None, columns: Path | None = None, **options: Any
) -> Recording:
    """Read a recording and check it; see `irb140_jax.recordings.read_recording`.

    Args:
        path: The file.
        robot: As in `diagnose`; gives the joints' names and what torque is plausible.
        columns: TOML file that maps other column names and units.
        options: Passed on.
    """
    columns = None if columns is None else pathlib.Path(columns)
    return recordings.read_recording(pathlib.Path(path), _robot(robot), columns, **options)


def _robot(robot: Path | Robot | None) -> Robot:
    """The robot meant."""
    if robot is None:
        return irb140()
    return robot if isinstance(robot, Robot) else load_robot(pathlib.Path(robot))
