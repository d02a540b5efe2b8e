"""irb140 diagnose."""

import dataclasses
import math
import pathlib
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Out
from irb140_jax.cli.shown import console, progress
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.mismatch import Result
    from irb140_jax.recordings import Recording
    from irb140_jax.robot import Robot


@dataclasses.dataclass(frozen=True)
class Diagnose:
    """Name the physics that a model leaves out of recordings."""

    recordings: Annotated[Positional[tuple[pathlib.Path, ...]], arg(metavar="REC [REC ...]")]
    """Recordings (CSV, Parquet or NPZ), best of several motions."""

    out: Out
    """Folder for diagnosis.json and report.html: new, empty, or a former diagnosis, which is replaced."""

    robot: Annotated[pathlib.Path | None, arg(metavar="MODEL.xml")] = None
    """MJCF or URDF of the robot; by default the ABB IRB 140 that ships with the package."""

    inertial_uncertainty: Annotated[float, arg(metavar="SHARE")] = 0.05
    """Relative standard deviation of the model's inertial parameters (CAD error)."""

    columns: Columns = None
    """TOML file that maps other column names and units."""

    def run(self) -> None:
        from irb140_jax.report.folder import check_folder

        check_folder(self.out)
        if not self.recordings:
            raise InputError("diagnose: no recording was named; give at least one: irb140 diagnose REC --out DIR")
        if not (math.isfinite(self.inertial_uncertainty) and self.inertial_uncertainty > 0):
            raise InputError(
                f"--inertial-uncertainty {self.inertial_uncertainty}: allowed is a positive share, say 0.05 for 5 %"
            )

        from irb140_jax.recordings import read_recording
        from irb140_jax.robot import irb140, load_robot

        robot = load_robot(self.robot) if self.robot else irb140()
        recordings = [read_recording(path, robot, columns=self.columns) for path in self.recordings]
        result = diagnosed(robot, recordings, self.inertial_uncertainty, self._words())
        _write(result, self.out)
        show(result, self.out)

    def _words(self) -> tuple[str, ...]:
        """Options that name files, as the diagnosis keeps them."""
        files = {"--robot": self.robot, "--columns": self.columns}
        return tuple(word for option, path in files.items() if path for word in (option, path.name))


def diagnosed(
    robot: "Robot", recordings: list["Recording"], inertial_uncertainty: float = 0.05, words: tuple[str, ...] = ()
) -> "Result":
    """The diagnosis, with its progress shown."""
    from irb140_jax.mismatch import DiagnoseConfig, diagnose

    with progress() as tell:
        config = DiagnoseConfig(inertial_uncertainty=inertial_uncertainty, words=words)
        return diagnose(robot, recordings, config, tell)


def _write(result: "Result", out: pathlib.Path) -> None:
    """Write diagnosis, model and report, whole or not at all."""
    from irb140_jax.mismatch import save
    from irb140_jax.report import html_report, whole_folder

    with whole_folder(out) as folder:
        save(result, folder)
        (folder / "report.html").write_text(html_report(result.diagnosis, result.views, folder=out), encoding="utf-8")


def show(result: "Result", out: pathlib.Path) -> None:
    """The plain-language summary, and where the rest is."""
    from irb140_jax.report import print_diagnosis

    terminal = console()
    print_diagnosis(result.diagnosis, result.views, terminal)
    terminal.print(f"Report: {out / 'report.html'}", soft_wrap=True)
