"""The whole study: every table and figure, published beside ours, and a page that says what holds.

    python experiments/reproduce_all.py                               # the study's arm: what is not there yet
    python experiments/reproduce_all.py --again                       # all of it, from nothing
    python experiments/reproduce_all.py --robot arm.xml [--joints n]  # the same tables for any other arm
    python experiments/reproduce_all.py --robot arm.xml --quick       # without the searches by the closed loop
    python experiments/reproduce_all.py --smoke                       # all steps as small as can be, in a new folder

A step whose result is there for the same choices is left out; an interrupted step goes on after the last part it
stored, that of --again, too, if one goes on without --again.  The network is trained by a process beside the others,
as neither it nor they keep two cores busy; what measures time waits until it has the machine to itself.  The page,
docs/study.md for the study's arm, is written anew each time.  One thing on it is run by itself, because it takes hours:
searches along the study's circle, `tracking_swarms.py --circle`.
"""

import contextlib
import dataclasses
import functools
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import embedded_model
import noisy_swarms
import study_page
import table3_swarms
import table4_control
import tables_1_2_arm
import time_per_iteration
import torque_swarms
import tracking_swarms
import tyro
from study_arm import StudyArm, StudyConfig

RECORD = "study_steps.json"


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """Which arm, and where to write.

    Attributes:
        again: First forget what is there, parts of steps included; files of results stay until they are made anew.
        quick: Leave out the searches by the closed loop, which take most of the time; the page says so.
    """

    again: bool = False
    quick: bool = False


@dataclasses.dataclass(frozen=True)
class Step:
    """A part of the study.

    Attributes:
        title: What it makes.
        run: Makes it; what is not done when it returns is a process.
        outputs: Files that are there when it is done.
        depends: What its result depends on; a change makes it run again.
        times: Whether it measures time, and has to be alone.
    """

    title: str
    run: Callable[[], subprocess.Popen[bytes] | None]
    outputs: tuple[pathlib.Path, ...]
    depends: str
    times: bool = False

    @property
    def mark(self) -> str:
        """What it depends on, in one number."""
        return hashlib.sha256(self.depends.encode()).hexdigest()


def steps(config: Config, arm: StudyArm) -> list[Step]:
    """All parts, in the order in which they need each other."""
    folder, figures = config.folder(arm), config.figure_folder(arm)
    shared = {name: getattr(config, name) for name in ("robot", "joints", "smoke", "devices")}
    shared |= {"out": folder, "figures": figures}
    found, so_far = [], f"{arm.name} {arm.x.tolist()}"
    for title, module, results, pictures in (
        ("tables 1 and 2: the arm", tables_1_2_arm, ("tables_1_2",), ()),
        ("table 3, figures 6 to 9: swarms on known answers", table3_swarms, ("table3_swarms", "table3_sets"),
         [f"figure{k}.svg" for k in range(6, 10)]),
        ("table 4, figures 14 to 17: sliding mode control", table4_control, ("table4_control",),
         [f"figure{k}.svg" for k in range(14, 18)]),
        ("beyond: swarms whose every evaluation has new noise", noisy_swarms, ("noisy_swarms",), ()),
        ("beyond: swarms on tracking, smoothness, energy", tracking_swarms, ("tracking_swarms",),
         ["figure_tracking.svg"]),
        ("beyond: swarms on torque", torque_swarms, ("torque_swarms",), ()),
        ("time of an iteration", time_per_iteration, ("time_per_iteration",), ()),
        ("beyond: the model on an embedded controller", embedded_model, ("embedded_model",), ()),
    ):  # fmt: skip
        outputs = (*(folder / f"{name}.json" for name in results), *(figures / name for name in pictures))
        own = module.Config(**shared)
        so_far += f" {title} {own.said()}"
        times = module in (torque_swarms, time_per_iteration, embedded_model)
        found.append(Step(title, lambda m=module, c=own: m.main(c), outputs, so_far, times))
    if config.quick:
        found = [step for step in found if "tracking" not in step.title]
    network = pathlib.Path(__file__).with_name("mlp_kinematics.py")
    # The network learns the IRB 140's own kinematics, whatever the arm; it has a smoke run of its own.
    if network.is_file() and arm.is_studys and not config.smoke:
        command = [sys.executable, str(network), "--out", str(folder), "--figures", str(figures)]
        outputs = (folder / "mlp_kinematics.json", figures / "figure12.svg")
        run = lambda: subprocess.Popen(command)  # noqa: E731
        found.insert(0, Step("figure 12: the network for the kinematics", run, outputs, "mlp"))
    return found


def forget(folder: pathlib.Path) -> None:
    """Take away what tells a step that it, or a part of it, is done."""
    for name in (RECORD, "table3_swarms.jsonl"):
        (folder / name).unlink(missing_ok=True)
    for name in ("table4_runs", "tracking_runs", "mlp_kinematics"):
        shutil.rmtree(folder / name, ignore_errors=True)


def run(config: Config, arm: StudyArm) -> pathlib.Path:
    """Every step that is not done, then the page; returns its path."""
    record = config.folder(arm) / RECORD
    if config.again:
        forget(config.folder(arm))
    done = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}
    parts = steps(config, arm)
    beside: list[Callable[[], None]] = []

    def end(step: Step, started: float, process: subprocess.Popen[bytes] | None = None) -> None:
        if process and process.wait():
            raise subprocess.CalledProcessError(process.returncode, process.args)
        done[step.title] = step.mark
        record.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")
        print(f"      {step.title}: done in {time.perf_counter() - started:.0f} s", flush=True)

    with contextlib.ExitStack() as running:
        for number, step in enumerate(parts, start=1):
            print(f"[{number}/{len(parts)}] {step.title}", flush=True)
            if done.get(step.title) == step.mark and all(path.is_file() for path in step.outputs):
                print("      there already", flush=True)
                continue
            while step.times and beside:
                beside.pop()()
            started, process = time.perf_counter(), step.run()
            if process is None:
                end(step, started)
                continue
            running.callback(process.terminate)  # does nothing once it has ended
            beside.append(functools.partial(end, step, started, process))
        while beside:
            beside.pop()()
    return study_page.write(config, arm)


def main() -> None:
    config = tyro.cli(Config)
    if config.smoke and config.out is None:
        config = dataclasses.replace(config, out=pathlib.Path(tempfile.mkdtemp(prefix="study_")))
    print(run(config, config.arm()))


if __name__ == "__main__":
    main()
