"""irb140 diagnose."""

import dataclasses
import pathlib
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Out
from irb140_jax.cli.shown import console, progress, tell_kept
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
        if not self.recordings:
            raise InputError("diagnose: no recording was named; give at least one: irb140 diagnose REC --out DIR")
        if not 0.0 < self.inertial_uncertainty <= 1.0:  # so that what is no number is refused, too
            raise InputError(
                f"--inertial-uncertainty {self.inertial_uncertainty:g}: allowed is a share above 0 and up to 1, say "
                "0.05 for 5 %"
            )
        from irb140_jax.report import results_folder

        inputs = [path for path in (*self.recordings, self.robot, self.columns) if path]
        with results_folder(self.out, "irb140 diagnose", inputs) as results:
            result = self._diagnosed()
            folder = results.write(lambda folder: _write(result, folder))
            tell_kept(results)
            show(result, self.out if folder == results.folder else folder)

    def _diagnosed(self) -> "Result":
        from irb140_jax.recordings import read_recording
        from irb140_jax.robot import irb140, load_robot

        robot = load_robot(self.robot) if self.robot else irb140()
        recordings = [read_recording(path, robot, columns=self.columns) for path in self.recordings]
        return diagnosed(robot, recordings, self.inertial_uncertainty, self._words())

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


def _write(result: "Result", folder: pathlib.Path) -> None:
    """Diagnosis, model and report into an empty folder."""
    from irb140_jax.mismatch import save
    from irb140_jax.report import html_report

    save(result, folder)
    (folder / "report.html").write_text(html_report(result.diagnosis, result.views), encoding="utf-8")


def show(result: "Result", out: pathlib.Path) -> None:
    """The plain-language summary, and where the rest is."""
    from irb140_jax.report import print_diagnosis

    terminal = console()
    print_diagnosis(result.diagnosis, result.views, terminal)
    terminal.print(f"Report: {out / 'report.html'}", soft_wrap=True)
