"""irb140 excite."""

import dataclasses
from typing import Annotated

from tyro.conf import arg

from irb140_jax.cli.options import Folder, OutFile
from irb140_jax.cli.shown import progress
from irb140_jax.errors import InputError


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
        with progress() as tell:
            proposal = propose(robot, open_, seed=self.seed, duration=self.duration, rate=self.rate, progress=tell)
        table = pd.DataFrame(motion_columns(proposal.motion, robot.joint_names))
        with whole_file(self.out) as path:
            table.to_csv(path, index=False, float_format="%.9g")
        print(*proposal_sentences(robot, open_, proposal), sep="\n")
        print(f"{self.out}: {len(table)} rows, {self.rate:g} a second")
