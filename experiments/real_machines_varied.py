"""Whether the names found on a real machine outlast another sampling rate, a late start and a cut in the middle.

    python experiments/real_machines_varied.py [--out results]

Nothing about the machine differs between the variations, so no name should.
"""

import dataclasses
import json
import pathlib
import tempfile
from collections.abc import Callable, Iterator

import numpy as np
import real_double_pendulum
import tyro
from real_bam_xl330 import JUDGED

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.errors import RecordingError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording, read_recording, write_recording
from irb140_jax.recordings.machines.bam_xl330 import servo_runs, write_servo
from irb140_jax.recordings.machines.cycloidal_play import write_cycloidal
from irb140_jax.recordings.machines.dfki_double_pendulum import write_pendulum
from irb140_jax.recordings.machines.staubli_tx40 import write_tx40
from irb140_jax.robot import load_robot

LATE = 1.0  # s


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write."""

    out: pathlib.Path = pathlib.Path("results")


def machines(folder: pathlib.Path) -> Iterator[tuple[str, pathlib.Path, list[pathlib.Path]]]:
    """Every machine with torque: name, model as given, and the recordings that its own experiment fits, as files."""
    model, (train, _) = write_tx40(folder / "tx40")
    yield "staubli_tx40", model, [train]
    models, runs = write_pendulum(folder / "pendulum", "C.1")
    test = real_double_pendulum.TEST["C.1"]
    yield "dfki_double_pendulum", models["correct"], [p for n, p in runs.items() if not n.endswith(test)]
    files = [write_servo(folder / "servo", name) for name, (kp, _) in servo_runs().items() if kp != JUDGED]
    yield "bam_xl330", files[0][0], [path for _, path in files]
    model, path = write_cycloidal(folder / "gear", "base_onyx runin1")
    yield "cycloidal_play", model, [path]


def rows(r: Recording, keep: np.ndarray, name: str) -> Recording:
    """Some rows of a recording as one of its own: what was logged, nothing that was derived from it."""
    return Recording(r.t[keep], r.q[keep], r.tau[keep], r.joint_names, source=f"{name} {r.source}")


def halves(r: Recording) -> list[Recording]:
    """The first and the second half."""
    first = r.t < 0.5 * (r.t[0] + r.t[-1])
    return [rows(r, first, "first half of"), rows(r, ~first, "second half of")]


VARIATIONS: dict[str, Callable[[Recording], list[Recording]]] = {
    "as logged": lambda r: [rows(r, np.ones(len(r.t), bool), "all of")],
    "at half the sampling rate": lambda r: [rows(r, np.arange(len(r.t)) % 2 == 0, "every second row of")],
    "without the first second": lambda r: [rows(r, r.t > r.t[0] + LATE, "late")],
    "each recording as two": halves,
}


def main() -> None:
    """Diagnose every variation of every machine, print and store the names."""
    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    kept = config.out / "real_machines_varied.json"
    results: dict[str, dict[str, list[str]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for machine, model, files in machines(pathlib.Path(folder)):
            robot = load_robot(model)
            recordings = [read_recording(path, robot) for path in files]
            for name, vary in VARIATIONS.items():
                varied = []
                for i, part in enumerate(part for r in recordings for part in vary(r)):
                    # Through a file, as a user's recording comes.
                    path = write_recording(part, pathlib.Path(folder) / f"{i}.parquet")
                    try:
                        varied.append(read_recording(path, robot))
                    except RecordingError as error:  # half a run may hold nothing but rest
                        print(f"left out: {error}", flush=True)
                found = diagnose(robot, varied).diagnosis.to_json()["findings"]
                said = sorted(f"{f['effect']} on {', '.join(f['joints'])}" for f in found)
                results.setdefault(machine, {})[name] = said
                print(f"{machine}, {name}: {'; '.join(said) or 'nothing'}", flush=True)
                kept.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
