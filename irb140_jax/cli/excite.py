"""irb140 excite."""

import dataclasses
from typing import Annotated, ClassVar

from tyro.conf import arg

from irb140_jax.cli.options import Folder, OutFile
from irb140_jax.cli.shown import progress, tell_kept
from irb140_jax.errors import InputError

# Share of the processor time that is over when a step begins, as measured on the demonstration.
STEPS = {
    "motion (2 of 4)": 0.35,
    "motion (3 of 4)": 0.45,
    "motion (4 of 4)": 0.55,
    "choosing the pieces": 0.65,
    "refining the motion (1 of": 0.72,
    "refining the motion (2 of": 0.85,
}


@dataclasses.dataclass(frozen=True)
class Excite:
    """Write the motion that best answers the open questions of a diagnosis."""

    EXAMPLES: ClassVar = """\
irb140 excite d --out motion.csv                              40 s at 250 rows per second
irb140 excite d --out motion.csv --duration 20 --rate 500     shorter, for a faster controller
irb140 diagnose old.csv new.csv --out d2                      then, with the recording of that motion"""

    folder: Folder
    """Folder of a diagnosis."""

    out: OutFile
    """CSV file with t, q.<joint>, qd.<joint>, qdd.<joint>: the motion for the robot, from rest to rest."""

    duration: Annotated[float, arg(metavar="SECONDS")] = 40.0
    """Approximate length of the motion."""

    rate: Annotated[float, arg(metavar="HZ")] = 250.0
    """Rows per second."""

    seed: int = 0
    """Seed of the search; the same seed gives the same motion."""

    def run(self) -> None:
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: it has to be 0 or larger")
        from irb140_jax.report import is_our_table, results_file, write_table

        ours = lambda path: is_our_table(path, ("q.", "qd.", "qdd."))  # noqa: E731
        with results_file(self.out, ours) as results:
            table, sentences = self._motion()
            results.write(lambda folder: write_table(table, folder / results.name))
            tell_kept(results)
        print(*sentences, sep="\n")
        print(f"{self.out}: {len(table['t'])} rows, {self.rate:g} a second")

    def _motion(self) -> tuple[dict, list[str]]:
        """The motion as columns, and what it decides."""
        from irb140_jax.mismatch import load_model, load_undecided, propose
        from irb140_jax.recordings.excite import motion_columns
        from irb140_jax.report import proposal_sentences

        robot, open_ = load_model(self.folder).robot, load_undecided(self.folder)
        with progress(STEPS) as tell:
            proposal = propose(robot, open_, seed=self.seed, duration=self.duration, rate=self.rate, progress=tell)
        return motion_columns(proposal.motion, robot.joint_names), proposal_sentences(robot, open_, proposal)
