"""irb140 predict."""

import dataclasses
import pathlib
from typing import Annotated

from tyro.conf import Positional, arg

from irb140_jax.cli.options import Columns, Folder, OutFile


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
