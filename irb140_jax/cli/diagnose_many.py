"""irb140 diagnose-many."""

import dataclasses
import os
import pathlib
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from irb140_jax.cli.diagnose import Diagnose
from irb140_jax.cli.options import Columns, Hold
from irb140_jax.cli.shown import console, progress, rough
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.fleet import Unit
    from irb140_jax.fleet.run import Progress, Task
    from irb140_jax.fleet.store import ResultsStore


@dataclasses.dataclass(frozen=True)
class DiagnoseMany:
    """Diagnose every robot of a folder; run it again to go on."""

    EXAMPLES: ClassVar = """\
irb140 diagnose-many fleet                            into fleet-diagnoses, a process for every core
irb140 diagnose-many fleet --robot arm.urdf --out d   one model for all units that have none of their own
irb140 diagnose-many fleet --out d --shard 2/8        the second of eight machines that share a disk"""

    folder: Annotated[Positional[pathlib.Path], arg(metavar="DIR")]
    """Folder of the units. Each folder in it is a unit: its recordings are diagnosed together. A recording that lies
    beside those folders is a unit of its own. A model (.xml, .urdf) or column map (.toml) in a unit's folder is for
    that unit, one in DIR for all others."""

    out: Annotated[pathlib.Path | None, arg(metavar="DIR")] = None
    """Folder for the diagnoses, table.parquet and index.html, by default DIR-diagnoses beside DIR; or that of a former
    run, whose finished units are kept."""

    jobs: Annotated[int | None, arg(metavar="N")] = None
    """Processes, each with one thread; by default one for every core."""

    shard: Annotated[str, arg(metavar="i/N")] = "1/1"
    """Diagnose only the i-th of N parts; run the others elsewhere with the same --out."""

    robot: Annotated[pathlib.Path | None, arg(metavar="MODEL.xml")] = None
    """MJCF or URDF for units without a model; by default that in DIR, else the ABB IRB 140 that ships with the
    package."""

    inertial_uncertainty: Annotated[float, arg(metavar="SHARE")] = 0.05
    """Relative standard deviation of the models' inertial parameters (CAD error)."""

    columns: Columns = None
    """TOML file that maps other column names and units, for units without one."""

    hold: Hold = ()
    """A joint that did not move, and its position [rad or m]; may be given several times."""

    fix_base: bool = False
    """Hold the base, where it floats in the model."""

    def run(self) -> None:
        Diagnose.check_uncertainty(self.inertial_uncertainty)
        jobs = self.jobs if self.jobs is not None else _cores()
        if jobs < 1:
            raise InputError(f"--jobs {jobs}: it has to be 1 or larger")
        for option, path in (("--robot", self.robot), ("--columns", self.columns)):
            if path and not path.is_file():
                raise InputError(f"{option} {path}: there is no such file; check the path")
        from irb140_jax.fleet import results_store, shard_of, units_in, write_table_and_page
        from irb140_jax.report.many import headline

        real = self.folder.resolve()
        units = units_in(self.folder, self.robot, self.columns)
        mine, out = shard_of(units, self.shard), self.out or real.with_name(f"{real.name}-diagnoses")
        inputs = [path for path in (self.folder, self.robot, self.columns) if path]
        with results_store(out, self.shard, self._settings(), inputs) as store:
            refused = self._diagnose(mine, store, jobs, out)
            rows = write_table_and_page(store, units, real.name, inputs)
        terminal = console()
        terminal.print(headline(rows, len(units) - len(rows)), soft_wrap=True, markup=False)
        for row in refused:
            terminal.print(f"  {row['unit']}: {row['message']}", soft_wrap=True, markup=False)
        terminal.print(f"Table: {out / 'table.parquet'}, page: {out / 'index.html'}", soft_wrap=True, markup=False)

    def _diagnose(
        self, mine: list["Unit"], store: "ResultsStore", jobs: int, out: pathlib.Path
    ) -> list[dict[str, Any]]:
        """Diagnose the units of this part; the rows of those for which that was not possible."""
        from irb140_jax.fleet import diagnose_units

        with progress() as tell:
            try:
                for step in diagnose_units(mine, store, self._work(), jobs):
                    tell(_said(step))
            except (KeyboardInterrupt, SystemExit):
                tell(f"stopped; the same command goes on with what is left, in {out}")
                raise
        rows = [row for unit in mine if (row := store.row(unit.name))]
        return [row for row in rows if row["status"] != "diagnosed"]

    def _work(self) -> "Work":
        return Work(self.inertial_uncertainty, self.hold, self.fix_base)

    def _settings(self) -> dict[str, Any]:
        from importlib.metadata import version

        return dataclasses.asdict(self._work()) | {"version": version("irb140_jax")}


@dataclasses.dataclass(frozen=True)
class Work:
    """Diagnoses one unit as `irb140 diagnose` does; can be sent to another process."""

    inertial_uncertainty: float
    hold: tuple[str, ...]
    fix_base: bool

    def __call__(self, task: "Task") -> None:
        from irb140_jax.compilation_cache import set_up_compilation_cache
        from irb140_jax.report.made import write_manifest

        set_up_compilation_cache()
        unit, folder, place = task.unit, task.folder, task.place
        folder.mkdir()
        # `irb140 diagnose` does not replace what another command wrote: the command that is kept names another folder.
        command = Diagnose(
            unit.recordings, pathlib.Path(f"{place}-2"), unit.robot, self.inertial_uncertainty, unit.columns,
            self.hold, fix_base=self.fix_base,
        )
        command.write(command.diagnosed(), folder, place)
        write_manifest(folder, "irb140 diagnose-many")


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _said(step: "Progress") -> str:
    """How far the run is, one line."""
    left = f", {rough(step.left)} left" if step.left is not None and step.done < step.every else ""
    what = f": {step.unit}: {step.status.replace('_', ' ')}" if step.unit else ""
    return f"{step.done} of {step.every} done{left}{what}"
