"""irb140 demo."""

import dataclasses
import pathlib
import shutil
from json import dumps
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import arg

from irb140_jax.cli.diagnose import diagnosed, show
from irb140_jax.cli.shown import console, progress, tell_kept
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.mismatch import Result
    from irb140_jax.recordings.conceal import ConcealedCase
    from irb140_jax.report import Reveal


@dataclasses.dataclass(frozen=True)
class Demo:
    """Hide an effect, diagnose blind, then reveal the truth."""

    EXAMPLES: ClassVar = """\
irb140 demo                         into irb140-demo-1
irb140 demo --seed 7 --out demo     another effect, joint and strength"""

    seed: int = 1
    """Seed for the effect, its joint and strength, the wrong inertials, the motions and the noise."""

    out: Annotated[pathlib.Path | None, arg(metavar="DIR")] = None
    """Folder for recordings, diagnosis, report and truth; by default irb140-demo-SEED in the current folder."""

    json: bool = False
    """Print diagnosis.json to stdout, and the text for people to stderr."""

    def run(self) -> None:
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: it has to be 0 or larger")
        from irb140_jax.report import results_folder

        out = self.out or pathlib.Path(f"irb140-demo-{self.seed}")
        with results_folder(out, "irb140 demo") as results:
            self._run(out, results)

    def _run(self, out: pathlib.Path, results) -> None:
        from irb140_jax.recordings.conceal import demo_case
        from irb140_jax.report import print_reveal, revealed

        with progress() as tell:
            tell("MuJoCo drives an arm with something hidden in it")
            case = demo_case(self.seed)
        terminal = console(stderr=self.json)
        said = f"Something may be hidden in these recordings. SHA-256 of the truth: {case.seal}"
        terminal.print(said, soft_wrap=True)
        result = _from_files(case, results.workspace, out)
        reveal = revealed(case.truth["effects"], result.diagnosis, case.seal)
        folder = results.write(lambda folder: _write(result, reveal, case, results.workspace, folder, out))
        tell_kept(results)
        show(result, out if folder == results.folder else folder, json=self.json)
        print_reveal(reveal, terminal)


def _from_files(case: "ConcealedCase", workspace: pathlib.Path, out: pathlib.Path) -> "Result":
    """The diagnosis of the recordings as files, the same that `irb140 diagnose` would make of them in `out`."""
    from irb140_jax.recordings import read_recording, write_recording
    from irb140_jax.robot import irb140

    paths = [workspace / "recordings" / f"{recording.source}.csv" for recording in case.recordings]
    for recording, path in zip(case.recordings, paths, strict=True):
        write_recording(recording, path)
    robot = irb140()
    read = [
        dataclasses.replace(read_recording(path, robot), path=str(out / path.relative_to(workspace))) for path in paths
    ]
    # `out` holds the recordings, so the diagnosis alone is repeated into another folder.
    return diagnosed(robot, read, words=("--out", f"{out}-2"))


def _write(
    result: "Result", reveal: "Reveal", case: "ConcealedCase", workspace: pathlib.Path, folder: pathlib.Path,
    out: pathlib.Path,
) -> None:  # fmt: skip
    """Recordings, diagnosis, report and truth into an empty folder, which will be `out`."""
    from irb140_jax.mismatch import save
    from irb140_jax.recordings.conceal import sealed
    from irb140_jax.report import html_report

    shutil.copytree(workspace, folder, dirs_exist_ok=True)
    save(result, folder)
    (folder / "report.html").write_text(html_report(result.diagnosis, result.views, reveal, out), encoding="utf-8")
    truth = case.truth | {"sealed": sealed(case.truth), "seal": case.seal}
    (folder / "truth.json").write_text(dumps(truth, indent=1) + "\n", encoding="utf-8")
