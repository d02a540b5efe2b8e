"""irb140 demo."""

import dataclasses
import json
import pathlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from irb140_jax.cli.diagnose import diagnosed, show
from irb140_jax.cli.shown import console, progress
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.mismatch import Result


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

        with progress() as tell:
            tell("MuJoCo drives an arm with something hidden in it")
            case = demo_case(self.seed)
        terminal = console()
        terminal.print(
            f"Something may be hidden in these recordings. SHA-256 of the truth: {case.seal}", soft_wrap=True
        )
        robot = irb140()

        def from_files(folder: pathlib.Path) -> "Result":
            """The diagnosis of the recordings as files, the same that `irb140 diagnose` would make of them."""
            paths = [folder / "recordings" / f"{recording.source}.csv" for recording in case.recordings]
            for recording, path in zip(case.recordings, paths, strict=True):
                write_recording(recording, path)
            return diagnosed(robot, [read_recording(path, robot) for path in paths])

        result = _write_demo(out, from_files, case.truth, case.seal)
        show(result, out)
        print_reveal(revealed(case.truth["effects"], result.diagnosis, case.seal), terminal)


def _write_demo(out: pathlib.Path, made: Callable[[pathlib.Path], "Result"], truth: dict, seal: str) -> "Result":
    """Write recordings, diagnosis, report and truth of a demonstration, whole or not at all."""
    from irb140_jax.mismatch import save
    from irb140_jax.report import html_report, revealed, whole_folder

    with whole_folder(out) as folder:
        result = made(folder)
        save(result, folder)
        reveal = revealed(truth["effects"], result.diagnosis, seal)
        (folder / "report.html").write_text(html_report(result.diagnosis, result.views, reveal, out), encoding="utf-8")
        (folder / "truth.json").write_text(json.dumps(truth | {"seal": seal}, indent=1) + "\n", encoding="utf-8")
    return result
