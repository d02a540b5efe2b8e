"""The command line, one dataclass a command.  Heavy imports wait until a command runs: --help answers at once."""

import contextlib
import dataclasses
import io
import json
import math
import os
import pathlib
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import tyro
from tyro.conf import Positional, arg, subcommand

from irb140_jax.allocator import keep_memory
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.mismatch import Result
    from irb140_jax.recordings import Recording
    from irb140_jax.robot import Robot

Out = Annotated[pathlib.Path, arg(metavar="DIR")]
OutFile = Annotated[pathlib.Path, arg(metavar="FILE.csv")]
Folder = Annotated[Positional[pathlib.Path], arg(metavar="DIR")]
Columns = Annotated[pathlib.Path | None, arg(metavar="FILE.toml")]


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
        result = _diagnosed(robot, recordings, self.inertial_uncertainty)
        _write(result, self.out)
        _show(result, self.out)


@dataclasses.dataclass(frozen=True)
class Predict:
    """Write the torque of diagnosed models along a recording."""

    folder: Folder
    """Folder of a diagnosis."""

    recording: Annotated[Positional[pathlib.Path], arg(metavar="REC")]
    """The recording whose motion is used."""

    out: OutFile
    """CSV file with t, tau_nominal.<joint>, tau_refit.<joint>, tau_corrected.<joint>."""

    columns: Columns = None
    """TOML file that maps other column names and units."""

    def run(self) -> None:
        from irb140_jax.report.folder import check_file, whole_file

        check_file(self.out)

        import pandas as pd

        from irb140_jax.mismatch import load_model, predict, prediction_times
        from irb140_jax.recordings import read_recording

        model = load_model(self.folder)
        recording = read_recording(self.recording, model.robot, columns=self.columns)
        torque = predict(model, recording)
        t = prediction_times(recording)
        table = {"t": t}
        for name in ("nominal", "refit", "corrected"):
            table |= {f"tau_{name}.{joint}": torque[name][:, i] for i, joint in enumerate(recording.joint_names)}
        with whole_file(self.out) as path:
            pd.DataFrame(table).to_csv(path, index=False, float_format="%.9g")
        print(f"{self.out}: {len(t)} rows")


@dataclasses.dataclass(frozen=True)
class Demo:
    """Hide an effect, diagnose blind, then reveal the truth."""

    seed: int = 0
    """Draws the effect, its joint and strength, the wrong inertials, the motions and the noise."""

    out: Annotated[pathlib.Path | None, arg(metavar="DIR")] = None
    """Folder for recordings, diagnosis, report and truth; by default irb140-demo-SEED in the current one."""

    def run(self) -> None:
        from irb140_jax.report.folder import check_folder

        out = self.out or pathlib.Path(f"irb140-demo-{self.seed}")
        check_folder(out)
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: it has to be 0 or larger")

        from irb140_jax.recordings import read_recording, write_recording
        from irb140_jax.recordings.conceal import demo_case
        from irb140_jax.report import print_reveal, revealed
        from irb140_jax.robot import irb140

        with _progress() as progress:
            progress("MuJoCo drives an arm with something hidden in it")
            case = demo_case(self.seed)
        console = _console()
        console.print(f"Something may be hidden in these recordings. SHA-256 of the truth: {case.seal}", soft_wrap=True)
        robot = irb140()

        def from_files(folder: pathlib.Path) -> "Result":
            """The diagnosis of the recordings as files, the same that `irb140 diagnose` would make of them."""
            paths = [folder / "recordings" / f"{recording.source}.csv" for recording in case.recordings]
            for recording, path in zip(case.recordings, paths, strict=True):
                write_recording(recording, path)
            return _diagnosed(robot, [read_recording(path, robot) for path in paths])

        result = _write_demo(out, from_files, case.truth, case.seal)
        _show(result, out)
        print_reveal(revealed(case.truth["effects"], result.diagnosis, case.seal), console)


@dataclasses.dataclass(frozen=True)
class Excite:
    """Write the motion that separates what is undecided."""

    folder: Folder
    """Folder of a diagnosis."""

    out: OutFile
    """CSV file with t, q.<joint>, qd.<joint>, qdd.<joint>: the motion to play, from rest to rest."""

    duration: Annotated[float, arg(metavar="SECONDS")] = 40.0
    """About how long the motion may last."""

    rate: Annotated[float, arg(metavar="HZ")] = 250.0
    """Rows per second."""

    seed: int = 0
    """Of the search; the same seed gives the same motion."""

    def run(self) -> None:
        from irb140_jax.report.folder import check_file, whole_file

        check_file(self.out)
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: it has to be 0 or larger")

        import pandas as pd

        from irb140_jax.mismatch import load_model, load_undecided, propose
        from irb140_jax.recordings.excite import motion_columns
        from irb140_jax.report import proposal_sentences

        robot, open_ = load_model(self.folder).robot, load_undecided(self.folder)
        with _progress() as progress:
            proposal = propose(
                robot, open_, seed=self.seed, duration=self.duration, rate=self.rate, progress=progress
            )
        table = pd.DataFrame(motion_columns(proposal.motion, robot.joint_names))
        with whole_file(self.out) as path:
            table.to_csv(path, index=False, float_format="%.9g")
        print(*proposal_sentences(robot, open_, proposal), sep="\n")
        print(f"{self.out}: {len(table)} rows, {self.rate:g} a second")


Command = (
    Annotated[Diagnose, subcommand("diagnose")]
    | Annotated[Predict, subcommand("predict")]
    | Annotated[Demo, subcommand("demo")]
    | Annotated[Excite, subcommand("excite")]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command.

    Args:
        argv: Words of the command line, by default those of the process.

    Returns:
        Exit code: 0 done, 2 the input can't be used (one line on stderr says why, nothing is written).
    """
    if argv is None:  # the process is ours
        keep_memory()
    try:
        _run(argv)
    except InputError as error:
        print("irb140: " + " ".join(str(error).split()), file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130  # what a shell makes of an interrupted program
    except BrokenPipeError:  # whoever read our words has stopped, as in `irb140 --help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python would flush into the pipe at its end
        return 141
    return 0


def _run(argv: Sequence[str] | None) -> None:
    try:
        command = _parsed(argv)
        from irb140_jax.compilation_cache import set_up_compilation_cache

        set_up_compilation_cache()
        command.run()
    finally:
        sys.stdout.flush()  # here, where a pipe that nobody reads is an exception; at Python's end it is a complaint


def _parsed(argv: Sequence[str] | None) -> Diagnose | Predict | Demo | Excite:
    """The command with its options; what tyro says of wrong ones in a box becomes an error of one line."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(
                Command,  # pyright: ignore[reportArgumentType]
                prog="irb140",
                description="Which physics did your robot model leave out?",
                args=argv,
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        words = " ".join(re.sub(r"\x1b\[[0-9;]*m|[─│╭╮╰╯]", " ", said.getvalue()).split())
        raise InputError(words) from None


def _diagnosed(robot: "Robot", recordings: list["Recording"], inertial_uncertainty: float = 0.05) -> "Result":
    """The diagnosis, with its progress shown."""
    from irb140_jax.mismatch import DiagnoseConfig, diagnose

    with _progress() as progress:
        return diagnose(robot, recordings, DiagnoseConfig(inertial_uncertainty=inertial_uncertainty), progress)


def _write(result: "Result", out: pathlib.Path) -> None:
    """Write diagnosis, model and report, whole or not at all."""
    from irb140_jax.mismatch import save
    from irb140_jax.report import html_report, whole_folder

    with whole_folder(out) as folder:
        save(result, folder)
        (folder / "report.html").write_text(html_report(result.diagnosis, result.views), encoding="utf-8")


def _write_demo(out: pathlib.Path, diagnosed: Callable[[pathlib.Path], "Result"], truth: dict, seal: str) -> "Result":
    """Write recordings, diagnosis, report and truth of a demonstration, whole or not at all."""
    from irb140_jax.mismatch import save
    from irb140_jax.report import html_report, revealed, whole_folder

    with whole_folder(out) as folder:
        result = diagnosed(folder)
        save(result, folder)
        reveal = revealed(truth["effects"], result.diagnosis, seal)
        (folder / "report.html").write_text(html_report(result.diagnosis, result.views, reveal), encoding="utf-8")
        (folder / "truth.json").write_text(json.dumps(truth | {"seal": seal}, indent=1) + "\n", encoding="utf-8")
    return result


def _show(result: "Result", out: pathlib.Path) -> None:
    """The plain-language summary, and where the rest is."""
    from irb140_jax.report import print_diagnosis

    console = _console()
    print_diagnosis(result.diagnosis, result.views, console)
    console.print(f"Report: {out / 'report.html'}", soft_wrap=True)


def _console():
    """Where a person reads."""
    from rich.console import Console

    # Into a file or a pipe, tables keep their width instead of being folded to the 80 columns of no terminal.
    return Console(highlight=False, width=None if sys.stdout.isatty() else 120)


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Where a run tells what it is doing: a moving line on a terminal, plain lines elsewhere; always on stderr."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False)
    if console.is_terminal:
        with console.status("") as status:
            yield lambda sentence: status.update(sentence)
        return
    held: list[str] = []

    def tell(sentence: str) -> None:
        # The first sentence waits for the second: input that can't be used is refused in the first step, and then
        # stderr holds nothing but the line that says why.
        held.append(sentence)
        if len(held) == 2:
            print(held[0], file=sys.stderr, flush=True)
        if len(held) >= 2:
            print(sentence, file=sys.stderr, flush=True)

    yield tell
    if len(held) == 1:
        print(held[0], file=sys.stderr, flush=True)
