"""irb140 diagnose."""

import dataclasses
import pathlib
from json import dumps
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Hold, KnownPayload, Out
from irb140_jax.cli.payloads import known_payloads
from irb140_jax.cli.robots import held_positions, recorded_robot
from irb140_jax.cli.shown import console, progress, tell_kept
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.mismatch import Result
    from irb140_jax.recordings import Recording
    from irb140_jax.robot import Robot

# Share of the processor time that is over when a step begins, as measured on the demonstration.
STEPS = {
    "rigid body along": 0.05,
    "explanations along the recordings (round 1)": 0.24,
    "sets of explanations (round 1)": 0.35,
    "explanations along the recordings (round 2)": 0.56,
    "sets of explanations (round 2)": 0.65,
    "explanations along the recordings (round 3)": 0.80,
    "sets of explanations (round 3)": 0.87,
    "proving on data": 0.95,
}


@dataclasses.dataclass(frozen=True)
class Diagnose:
    """Name the physics that a model leaves out of recordings."""

    EXAMPLES: ClassVar = """\
irb140 diagnose fast.csv slow.csv --out d                        the ABB IRB 140, in SI units
irb140 diagnose log.parquet --robot arm.urdf --out d             your robot, as MJCF or URDF
irb140 diagnose left.csv --robot two_arms.urdf --hold torso=0.2 --out d    one arm of two, with all other joints held
irb140 diagnose log.csv --robot arm.xml --columns map.toml --out d     other names and units
irb140 diagnose bare.csv loaded.csv --known-payload loaded.csv=2.5 --out d    what the tool carried is known
irb140 diagnose log.csv --out d --json > diagnosis.json          for a program"""

    recordings: Annotated[Positional[tuple[pathlib.Path, ...]], arg(metavar="REC [REC ...]")]
    """Recordings (CSV, Parquet, NPZ, MAT, ROS bag, MCAP, LeRobot); several different motions are best."""

    out: Out
    """Folder for diagnosis.json and report.html: a new or empty one, or a former diagnosis, which is replaced."""

    robot: Annotated[pathlib.Path | None, arg(metavar="MODEL.xml")] = None
    """MJCF or URDF of the robot; by default the ABB IRB 140 that ships with the package."""

    inertial_uncertainty: Annotated[float, arg(metavar="SHARE")] = 0.05
    """Relative standard deviation of the model's inertial parameters (CAD error)."""

    columns: Columns = None
    """TOML file that maps other column names and units."""

    hold: Hold = ()
    """A joint that did not move, and its position [rad or m]; may be given several times. Other joints without
    columns are assumed to be at the model's reference, mostly zero."""

    known_payload: KnownPayload = ()
    """A recording in which the tool carried a mass that the model does not hold, and that mass [kg], with where it sits
    beside the tool [m] if not there: loaded.csv=2.5@0,0,0.05. It fixes the scale of all torques; may be given several
    times."""

    fix_base: bool = False
    """Hold the base, where it floats in the model."""

    json: bool = False
    """Print diagnosis.json to stdout, and the text for people to stderr."""

    def run(self) -> None:
        if not self.recordings:
            raise InputError("diagnose: no recording was named; give at least one: irb140 diagnose REC --out DIR")
        self.check_uncertainty(self.inertial_uncertainty)
        from irb140_jax.report import results_folder

        inputs = [path for path in (*self.recordings, self.robot, self.columns) if path]
        with results_folder(self.out, "irb140 diagnose", inputs) as results:
            result = self.diagnosed()
            folder = results.write(lambda folder: self.write(result, folder, self.out))
            tell_kept(results)
            show(result, self.out if folder == results.folder else folder, json=self.json)

    @staticmethod
    def check_uncertainty(share: float) -> None:
        """Refuse what is no share, or no number."""
        if not 0.0 < share <= 1.0:
            raise InputError(
                f"--inertial-uncertainty {share:g}: allowed is a share above 0 and up to 1, say 0.05 for 5 %"
            )

    def diagnosed(self) -> "Result":
        """The diagnosis of the recordings."""
        from irb140_jax.recordings import drive_of_model, read_recording
        from irb140_jax.robot import irb140_path, movable_joints

        hold, carried = held_positions(self.hold), known_payloads(self.known_payload, self.recordings)
        robot = recorded_robot(self.robot, self.recordings, self.columns, hold, self.fix_base)
        known = movable_joints(self.robot or irb140_path())
        drive = drive_of_model(self.robot or irb140_path(), robot.joint_names)
        recordings = [
            read_recording(path, robot, self.columns, known_joints=known, drive=drive, payload=carried.get(path))
            for path in self.recordings
        ]
        return diagnosed(robot, recordings, self.inertial_uncertainty, self._words(), known)

    @staticmethod
    def write(result: "Result", folder: pathlib.Path, out: pathlib.Path) -> None:
        """Diagnosis, model and report into an empty folder, which will be `out`."""
        from irb140_jax.mismatch import save
        from irb140_jax.report import html_report

        save(result, folder)
        (folder / "report.html").write_text(html_report(result.diagnosis, result.views, folder=out), encoding="utf-8")

    def _words(self) -> tuple[str, ...]:
        """Options that name files, folders or joints, as the diagnosis keeps them."""
        files = {"--robot": self.robot, "--columns": self.columns}
        named = [word for option, path in files.items() if path for word in (option, str(path))]
        held = [word for joint in self.hold for word in ("--hold", joint)]
        carried = [word for payload in self.known_payload for word in ("--known-payload", payload)]
        return (*named, *held, *carried, *(["--fix-base"] if self.fix_base else []), "--out", str(self.out))


def diagnosed(
    robot: "Robot", recordings: list["Recording"], inertial_uncertainty: float = 0.05, words: tuple[str, ...] = (),
    known_joints: tuple[str, ...] = (),
) -> "Result":
    """The diagnosis, with its progress shown."""
    from irb140_jax.mismatch import DiagnoseConfig, diagnose

    with progress(STEPS) as tell:
        config = DiagnoseConfig(inertial_uncertainty=inertial_uncertainty, words=words, known_joints=known_joints)
        return diagnose(robot, recordings, config, tell)


def show(result: "Result", out: pathlib.Path, *, json: bool = False) -> None:
    """The plain-language summary, and where the rest is; both beside the diagnosis as JSON, where that is wanted."""
    from irb140_jax.report import print_diagnosis

    terminal = console(stderr=json)
    print_diagnosis(result.diagnosis, result.views, terminal)
    terminal.print(f"Report: {out / 'report.html'}", soft_wrap=True)
    if json:
        print(dumps(result.diagnosis.to_json(), indent=1, allow_nan=False))
