"""irb140 predict."""

import dataclasses
import pathlib
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Folder, KnownPayload, OutFile
from irb140_jax.cli.payloads import known_payloads
from irb140_jax.cli.shown import tell_kept
from irb140_jax.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from irb140_jax.recordings import Recording
    from irb140_jax.report import Results

MODELS = ("nominal", "refit", "corrected")
Table = dict[str, "np.ndarray"]


@dataclasses.dataclass(frozen=True)
class Predict:
    """Write the torque of the diagnosed models along a recording."""

    EXAMPLES: ClassVar = """\
irb140 predict d new.csv --out torque.csv                 for another recording of the robot
irb140 predict d motion.csv --out torque.csv              for a motion without torque, as excite writes it
irb140 predict d new.csv --out torque.csv --measured      with the measured torque, for PlotJuggler"""

    folder: Folder
    """Folder of a diagnosis."""

    recording: Annotated[Positional[pathlib.Path], arg(metavar="REC")]
    """Recording whose motion is used; it needs no torque."""

    out: OutFile
    """CSV file with t, tau_nominal.<joint>, tau_refit.<joint>, tau_corrected.<joint>."""

    columns: Columns = None
    """TOML file that maps other column names and units."""

    known_payload: KnownPayload = ()
    """What the tool carries in the recording and the model does not hold [kg], see `irb140 diagnose`: new.csv=2.5."""

    measured: bool = False
    """Also write tau_measured.<joint> and the residual of each model, residual_<model>.<joint>, and a PlotJuggler
    layout beside the table."""

    def run(self) -> None:
        from irb140_jax.report import is_our_layout, is_our_table, results_file
        from irb140_jax.report.plotjuggler import SUFFIX

        inputs = [path for path in (self.recording, self.columns) if path]
        ours = lambda path: is_our_table(path, ("tau_", "residual_"))  # noqa: E731
        beside = {SUFFIX: is_our_layout} if self.measured else {}
        with results_file(self.out, ours, inputs, beside) as results:
            table, joints = self._table()
            results.write(lambda folder: self._write(table, joints, results, folder))
            tell_kept(results)
        print(f"{self.out}: {len(table['t'])} rows")
        if self.measured:
            print(f"To look at it: plotjuggler --layout {self.out.with_name(_layout(results))}")

    def _table(self) -> tuple[Table, tuple[str, ...]]:
        """The columns, and the joints' names."""
        from irb140_jax.mismatch import load_model, predict, prediction_times
        from irb140_jax.recordings import read_recording
        from irb140_jax.recordings.servo import with_torque

        model = load_model(self.folder)
        recording = read_recording(
            self.recording, model.robot, self.columns, torque="optional", known_joints=model.known_joints,
            drive=model.drive, payload=known_payloads(self.known_payload, [self.recording]).get(self.recording),
        )  # fmt: skip
        if recording.is_servo_log and recording.drive is not None and model.drive is not None:
            recording = with_torque(recording, recording.drive)
        if self.measured and not recording.has_torque:
            raise InputError(f"{self.recording}: holds no torque to compare with; leave --measured out")
        torque, joints = predict(model, recording), recording.joint_names
        t = prediction_times(recording)
        table = {"t": t}
        if self.measured:
            torque["measured"] = _at(t, recording)
        for name in ("measured", *MODELS) if self.measured else MODELS:
            table |= {f"tau_{name}.{joint}": torque[name][:, i] for i, joint in enumerate(joints)}
        for name in MODELS if self.measured else ():
            left = torque["measured"] - torque[name]
            table |= {f"residual_{name}.{joint}": left[:, i] for i, joint in enumerate(joints)}
        return table, joints

    def _write(self, table: Table, joints: tuple[str, ...], results: "Results", folder: pathlib.Path) -> None:
        from irb140_jax.report import write_layout, write_table

        write_table(table, folder / results.name)
        if self.measured:
            write_layout(table, results.name, joints, folder / _layout(results))


def _layout(results: "Results") -> str:
    from irb140_jax.report.plotjuggler import SUFFIX

    return pathlib.Path(results.name).stem + SUFFIX


def _at(t: "np.ndarray", recording: "Recording") -> "np.ndarray":
    """Measured torque at the rows of the file, those that reading left out included, shape (rows, n)."""
    import numpy as np

    return np.stack([np.interp(t, recording.t, tau) for tau in recording.tau.T], axis=1)
