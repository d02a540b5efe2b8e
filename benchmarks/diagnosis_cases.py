"""What a person waits for: `irb140 diagnose` as a process, cold and from a warm compilation cache."""

import timing  # noqa: F401, I001  first: it sets the number of threads

import os
import pathlib
import subprocess
import sys
import tempfile
import time

from irb140_jax.recordings import write_recording
from irb140_jax.recordings.conceal import demo_case
from irb140_jax.robot import Robot

WARM = 3  # runs, of which the quickest counts: whatever else the machine does only adds
SEED = 1


def diagnosis(_: Robot) -> dict[str, float]:
    """Three recordings of the IRB 140, 20 s at 500 Hz: wall time on all cores [s], and the most memory [GB]."""
    with tempfile.TemporaryDirectory() as folder:
        logs = demo_case(SEED).recordings
        files = [str(write_recording(log, pathlib.Path(folder) / f"{k}.csv")) for k, log in enumerate(logs)]
        runs = [_run(files, folder) for _ in range(1 + WARM)]
    return {
        "diagnose_cold_s": runs[0][0],
        "diagnose_warm_s": min(seconds for seconds, _ in runs[1:]),
        "diagnose_gb": max(gigabytes for _, gigabytes in runs),
    }


def _run(files: list[str], folder: str) -> tuple[float, float]:
    """Wall time [s] and largest resident set [GB] of one diagnosis; programs are kept in the folder."""
    command = [sys.executable, "-c", "from irb140_jax.cli import main; main()", "diagnose", *files]
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS") and k != "NPROC"}
    # The benchmarks are pinned to one core; people are not.
    free = lambda: os.sched_setaffinity(0, range(os.cpu_count() or 1))  # noqa: E731
    start = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--out", f"{folder}/out"], stdout=subprocess.DEVNULL, preexec_fn=free,
        env=environment | {"IRB140_CACHE": f"{folder}/cache"},
    )  # fmt: skip
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status != 0:
        raise RuntimeError(f"{' '.join(command)} ended with status {status}")
    return seconds, usage.ru_maxrss / 1e6
