"""irb140 predict."""

import dataclasses
import pathlib
from typing import Annotated

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Folder, OutFile
from irb140_jax.cli.shown import tell_kept

MODELS = ("nominal", "refit", "corrected")


@dataclasses.dataclass(frozen=True)
class Predict:
    """Write the torque of diagnosed models along a recording."""

    folder: Folder
    """Folder of a diagnosis."""

    recording: Annotated[Positional[pathlib.Path], arg(metavar="REC")]
    """The recording whose motion is used; it needs no torque."""

    out: OutFile
    """CSV file with t, tau_nominal.<joint>, tau_refit.<joint>, tau_corrected.<joint>."""

    columns: Columns = None
    """TOML file that maps other column names and units."""

    def run(self) -> None:
        from irb140_jax.report import is_our_table, results_file, write_table

        inputs = [path for path in (self.recording, self.columns) if path]
        with results_file(self.out, lambda path: is_our_table(path, ("tau_",)), inputs) as results:
            table = self._table()
            results.write(lambda folder: write_table(table, folder / results.name))
            tell_kept(results)
        print(f"{self.out}: {len(table['t'])} rows")

    def _table(self) -> dict:
        from irb140_jax.mismatch import load_model, predict, prediction_times
        from irb140_jax.recordings import read_recording

        model = load_model(self.folder)
        recording = read_recording(self.recording, model.robot, columns=self.columns, torque="optional")
        torque = predict(model, recording)
        table = {"t": prediction_times(recording)}
        for name in MODELS:
            table |= {f"tau_{name}.{joint}": torque[name][:, i] for i, joint in enumerate(recording.joint_names)}
        return table
