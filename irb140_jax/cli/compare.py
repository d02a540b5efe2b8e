"""irb140 compare."""

import dataclasses
import pathlib
from json import dumps
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from irb140_jax.cli.diagnose import Diagnose
from irb140_jax.cli.options import Columns, Hold
from irb140_jax.cli.shown import console, tell_kept
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.fleet.compare import Given
    from irb140_jax.mismatch import Result

FILES = ("compare.json", "compare.html")


@dataclasses.dataclass(frozen=True)
class Compare:
    """Say what diagnoses of several days or units share, and what differs."""

    EXAMPLES: ClassVar = """\
irb140 compare may june july --out c                    three diagnoses of one robot
irb140 compare fleet-diagnoses/diagnoses/* --out c      all units of a fleet
irb140 compare may.csv june.csv --robot arm.xml --out c     recordings, each of which is diagnosed first"""

    given: Annotated[Positional[tuple[pathlib.Path, ...]], arg(metavar="A B [...]")]
    """Folders of diagnoses, or recordings, or folders of recordings that belong together; the first is that which the
    others are compared with."""

    out: Annotated[pathlib.Path, arg(metavar="DIR")] = pathlib.Path("comparison")
    """Folder for compare.json, compare.html, and the diagnoses of recordings: new, empty, or a former comparison."""

    same_within: Annotated[float, arg(metavar="SHARE")] = 0.1
    """Share of a parameter by which two may differ and are still called the same."""

    robot: Annotated[pathlib.Path | None, arg(metavar="MODEL.xml")] = None
    """For recordings: MJCF or URDF of the robot; by default the ABB IRB 140 that ships with the package."""

    inertial_uncertainty: Annotated[float, arg(metavar="SHARE")] = 0.05
    """For recordings: relative standard deviation of the model's inertial parameters (CAD error)."""

    columns: Columns = None
    """For recordings: TOML file that maps other column names and units."""

    hold: Hold = ()
    """For recordings: a joint that did not move, and its position [rad or m]; may be given several times."""

    fix_base: bool = False
    """For recordings: hold the base, where it floats in the model."""

    def run(self) -> None:
        if len(self.given) < 2:
            raise InputError("compare: give two or more: irb140 compare A B --out DIR")
        if not 0.0 < self.same_within < 1.0:
            raise InputError(f"--same-within {self.same_within:g}: give a share between 0 and 1, say 0.1 for 10 %")
        Diagnose.check_uncertainty(self.inertial_uncertainty)
        from irb140_jax.fleet.compare import compare
        from irb140_jax.report import results_folder
        from irb140_jax.report.compared import print_comparison

        inputs = [path for path in (*self.given, self.robot, self.columns) if path]
        with results_folder(self.out, "irb140 compare", inputs) as results:
            named = dict(zip(_names(self.given), self.given, strict=True))
            made: dict[str, tuple[Diagnose, Result]] = {}
            comparison = compare([self._given(name, path, made) for name, path in named.items()], self.same_within)
            folder = results.write(lambda folder: _write(comparison, made, folder))
            tell_kept(results)
        terminal = console()
        print_comparison(comparison, terminal)
        terminal.print(f"Page: {(self.out if folder == results.folder else folder) / FILES[1]}", soft_wrap=True)

    def _given(self, name: str, path: pathlib.Path, made: dict[str, tuple[Diagnose, "Result"]]) -> "Given":
        """A diagnosis as it is there, or made of recordings."""
        from irb140_jax.fleet.compare import Given
        from irb140_jax.fleet.layout import unit_of
        from irb140_jax.mismatch import load_diagnosis

        if (path / "diagnosis.json").exists():
            return Given(name, load_diagnosis(path))
        unit = unit_of(path, self.robot, self.columns)
        if unit.problem:
            raise InputError(f"{unit.problem}; or give the folder of a diagnosis")
        command = Diagnose(
            unit.recordings, self.out, unit.robot, self.inertial_uncertainty, unit.columns, self.hold,
            fix_base=self.fix_base,
        )
        made[name] = command, command.diagnosed()
        return Given(name, made[name][1].diagnosis)


def _write(comparison: dict[str, Any], made: dict[str, tuple[Diagnose, "Result"]], folder: pathlib.Path) -> None:
    """The comparison, and the diagnoses that it needed."""
    from irb140_jax.report.compared import comparison_html

    for name, (command, result) in made.items():
        own = folder / "diagnoses" / name
        own.mkdir(parents=True)
        command.write(result, own, own)
    (folder / FILES[0]).write_text(dumps(comparison, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (folder / FILES[1]).write_text(comparison_html(comparison), encoding="utf-8")


def _names(paths: tuple[pathlib.Path, ...]) -> list[str]:
    """What each is called: the end of its path, as much of it as tells them apart."""
    real = [path.resolve() for path in paths]
    for one in real:
        if real.count(one) > 1:
            raise InputError(f"compare: {one.name} was given twice; give each once")
    for length in range(1, 1 + max(len(path.parts) for path in real)):
        names = ["-".join([*path.parts[-length:-1], path.stem if path.is_file() else path.name]) for path in real]
        if len(set(names)) == len(names):
            break
    return [name.strip("/-") for name in names]
