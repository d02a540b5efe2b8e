"""irb140 inspect."""

import dataclasses
import pathlib
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns
from irb140_jax.cli.shown import console
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.recordings.inspection import Inspection


@dataclasses.dataclass(frozen=True)
class Inspect:
    """Show what recordings hold and in which units; write a column map."""

    EXAMPLES: ClassVar = """\
irb140 inspect log.csv                                                what it holds, and in which units
irb140 inspect log.mcap --robot arm.urdf --write-columns map.toml     a draft of the map, to be checked
irb140 inspect log.csv --robot arm.urdf --columns map.toml            the log, read with the map"""

    recordings: Annotated[Positional[tuple[pathlib.Path, ...]], arg(metavar="REC [REC ...]")]
    """Recordings: CSV, Parquet, NPZ, MAT, ROS bags, MCAP, LeRobot."""

    robot: Annotated[pathlib.Path | None, arg(metavar="MODEL.xml")] = None
    """MJCF or URDF of the robot. It gives the joint names and helps to find the units of torques."""

    columns: Columns = None
    """TOML file that maps other column names and units; it is tried on the recordings."""

    write_columns: Annotated[pathlib.Path | None, arg(metavar="FILE.toml")] = None
    """Write the column map guessed from the first recording."""

    def run(self) -> None:
        if not self.recordings:
            raise InputError("inspect: no recording was named; give at least one: irb140 inspect REC")
        if self.write_columns is None:
            self._show()
            return
        from irb140_jax.report import results_file

        out = self.write_columns
        if out.is_dir() or out.exists() and out.stat().st_size:
            raise InputError(f"--write-columns {out}: this file exists already and may hold your own changes; name "
                             "another file, or move it away")
        inputs = [path for path in (*self.recordings, self.robot, self.columns) if path]
        with results_file(out, lambda path: False, inputs) as results:
            text = self._show()[0].map
            results.write(lambda folder: (folder / results.name).write_text(text, encoding="utf-8"))
        print(f"{out}: check every line, then: irb140 diagnose {self.recordings[0]} --columns {out} "
              f"{f'--robot {self.robot} ' if self.robot else ''}--out DIR")

    def _show(self) -> list["Inspection"]:
        from irb140_jax.recordings.inspection import inspect_recording
        from irb140_jax.report.inspection import print_inspection
        from irb140_jax.robot import load_robot

        robot = load_robot(self.robot, fix_base=True) if self.robot else None
        looks = [inspect_recording(path, robot, self.columns) for path in self.recordings]
        if self.robot and robot is not None:  # joints without channels are held, as in a diagnosis
            for i, look in enumerate(looks):
                joints = [name for name in robot.joint_names if {f"q.{name}", f"tau.{name}"} <= look.names]
                if 0 < len(joints) < robot.n:
                    chosen = load_robot(self.robot, joints, fix_base=True)
                    looks[i] = inspect_recording(self.recordings[i], chosen, self.columns)
        for look in looks:
            print_inspection(look, console())
        return looks
