"""Does `irb140 diagnose-many` hold what it says?  Killed at random and resumed, the same table; two cores against one.

    python experiments/many_units.py --out results/many_units.json

50 units of one recording each, of a two-joint arm in which MuJoCo hides an effect, three of them broken on purpose.
The ratio of wall times means something on an idle machine only, so the load is told.  `ratio_if_alone` is what it would
be if no process ever waited: twice the processor time on one core over that on two.
"""

import argparse
import contextlib
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from irb140_jax.recordings import write_recording
from irb140_jax.recordings.conceal import Concealment, conceal, random_robot
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import robot_from_model

EFFECTS = ("viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset", "")


def make_units(folder: pathlib.Path, count: int, seconds: float, broken: int = 3) -> None:
    """Units of one arm, each a recording with an effect of its own strength, the last few broken."""
    import mujoco

    folder.mkdir(parents=True)
    arm = random_robot(7, 2, slides=0.0)
    (folder / "arm.xml").write_text(arm)
    robot = robot_from_model(mujoco.MjModel.from_xml_string(arm))
    for k in range(count):
        effect, joint = EFFECTS[k % len(EFFECTS)], robot.joint_names[k // len(EFFECTS) % robot.n]
        hidden = [Concealment(effect, (joint,), share=0.1 + 0.002 * k)] if effect else []
        motion = fourier_motion(robot, seconds, 500.0, seed=100 + k)
        made = conceal(arm, hidden, [motion], seed=k, rate=250.0).recordings[0]
        path = folder / f"unit-{k + 1:03}.csv"
        write_recording(made, path)
        if k >= count - broken:
            lines = path.read_text().splitlines(keepends=True)
            path.write_text("".join(lines[: 20 * (1 + count - k)] + lines[1:2]))  # the time goes back


def command(folder: pathlib.Path, out: pathlib.Path, jobs: int) -> list[str]:
    """The words of a run."""
    words = ["diagnose-many", str(folder), "--out", str(out), "--jobs", str(jobs)]
    return [sys.executable, "-m", "irb140_jax", *words]


def timed(folder: pathlib.Path, out: pathlib.Path, jobs: int, cores: set[int]) -> tuple[float, float]:
    """Wall time of a whole run on some cores, and the processor time of all its processes [s]."""
    start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(command(folder, out, jobs), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.sched_setaffinity(process.pid, cores)  # long before it starts anything
    if process.wait():
        raise SystemExit(f"a run ended with {process.returncode}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - start, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def killed(folder: pathlib.Path, out: pathlib.Path, jobs: int, times: int, seed: int, whole: float) -> dict:
    """Kill a run at random moments, with a signal that nothing can handle, then let it come to its end."""
    rng, moments, halves = random.Random(seed), [], 0
    for _ in range(times):
        process = subprocess.Popen(
            command(folder, out, jobs), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        moment = rng.uniform(0.0, 0.4 * whole)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(moment)
        os.kill(process.pid, signal.SIGKILL)  # the parent alone: its processes have to notice
        process.wait()
        moments.append(round(moment, 1))
        time.sleep(0.3)
        halves += sum(not (unit / "diagnosis.json").exists() for unit in (out / "diagnoses").glob("*"))
    last, _ = timed(folder, out, jobs, set(os.sched_getaffinity(0)))
    return {"killed_after_s": moments, "half_folders": halves, "last_run_s": round(last, 1)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--units", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--kills", type=int, default=6)
    asked = parser.parse_args()
    work = pathlib.Path(tempfile.mkdtemp(prefix="many-units-"))
    cores = sorted(os.sched_getaffinity(0))
    try:
        folder = work / "units"
        make_units(folder, asked.units, asked.seconds)
        print(f"{asked.units} units made", flush=True)
        timed(folder, work / "warm", len(cores), set(cores))  # fills the compilation cache
        load = os.getloadavg()[0]
        one, one_cpu = timed(folder, work / "one", 1, {cores[0]})
        two, two_cpu = timed(folder, work / "two", 2, set(cores[:2]))
        print(f"one core {one:.1f} s, two {two:.1f} s, ratio {one / two:.2f}", flush=True)
        kills = killed(folder, work / "killed", 2, asked.kills, 1, two)
        tables = {name: (work / name / "table.parquet").read_bytes() for name in ("warm", "one", "two", "killed")}
        result = {
            "units": asked.units, "seconds_a_recording": asked.seconds, "cores": len(cores), "load_before": load,
            "load_after": os.getloadavg()[0], "one_core_s": round(one, 2), "two_cores_s": round(two, 2),
            "ratio": round(one / two, 3), "one_core_cpu_s": round(one_cpu, 2), "two_cores_cpu_s": round(two_cpu, 2),
            "ratio_if_alone": round(2.0 * one_cpu / two_cpu, 3), **kills,
            "same_table_after_kills": tables["killed"] == tables["two"],
            "same_table_on_one_core": tables["one"] == tables["two"] == tables["warm"],
        }  # fmt: skip
        asked.out.write_text(json.dumps(result, indent=1) + "\n")
        print(json.dumps(result, indent=1))
    finally:
        shutil.rmtree(work, ignore_errors=True)


if __name__ == "__main__":
    main()
