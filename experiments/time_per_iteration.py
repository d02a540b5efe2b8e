"""Time of an iteration of either swarm, as the text compares it: processor time, the two taking turns.

    python experiments/time_per_iteration.py [--smoke]

Writes time_per_iteration.json.
"""

import dataclasses
import json
import time

import jax
import tyro
from study_arm import StudyArm, StudyConfig
from study_provenance import made
from study_readings import Reading
from table3_swarms import FULL, minima

from irb140_jax.compilation_cache import set_up_compilation_cache

READINGS = {"PSO": Reading("pso", velocity_limit=0.2, place="anywhere"),
            "QPSO": Reading("qpso", velocity_limit=0.02, perturbed=False, place="anywhere"),
            "QPSO, 12 bits": Reading("qpso", "w 0.99 to 0.4", 0.5, False, "D3, 12 bits", True)}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What to run.

    Attributes:
        repetitions: Of each algorithm.
    """

    repetitions: int = 15


def run(config: Config, arm: StudyArm) -> list[dict]:
    """Processor time of one iteration of all seeds [ms], every repetition."""
    size = dict(particles=12, iterations=10, seeds=3) if config.smoke else FULL
    spent: dict[str, list[float]] = {name: [] for name in READINGS}
    for repetition in range((2 if config.smoke else config.repetitions) + 1):
        for name, reading in READINGS.items():
            started = time.process_time()
            jax.block_until_ready(minima(reading, arm, size).fitness)
            if repetition:  # the first one compiles
                spent[name].append(1e3 * (time.process_time() - started) / size["iterations"])
    return [{"name": name, "reading": str(READINGS[name]), "per_iteration_ms": x} for name, x in spent.items()]


def main(config: Config) -> None:
    """Measure, write."""
    set_up_compilation_cache()
    arm = config.arm()
    result = {"made": made(config.said()), "rows": run(config, arm)}
    text = json.dumps(result, indent=1) + "\n"
    (config.folder(arm) / "time_per_iteration.json").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(tyro.cli(Config))
