"""Diagnose three real machines from commands and positions alone, and judge what was named on motion not seen.

    python experiments/real_servos.py [--machines unitree_go2 bam_xl330 so101] [--out results]

unitree_go2: each leg by itself, on two splits; torque of the servo law is what is judged, as in the baseline that came
with the data.  so101: Kp as published for the servo and known to 40 %, no Kd, five joints; its positions are simulated
from the commands of the motions that are kept back.  bam_xl330: the duty cycle that was logged is withheld, and so it
is judged.  Every machine's result is a file of its own.
"""

import dataclasses
import json
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import tyro
from scipy import signal

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import Result, diagnose, predict
from irb140_jax.mismatch.motion.models import compiled_robot, positions_of, simulated
from irb140_jax.recordings import Recording
from irb140_jax.recordings.drive import ARRAYS, Drive
from irb140_jax.recordings.machines import (
    go2_model,
    go2_recording,
    go2_split,
    servo_commands,
    servo_model,
    servo_runs,
    so101_model,
    so101_recording,
)
from irb140_jax.recordings.machines.so101 import FITTED as ARM_MOTIONS
from irb140_jax.recordings.machines.so101 import HELD_OUT as ARM_UNSEEN
from irb140_jax.recordings.machines.unitree_go2 import HELD_OUT, LEGS, PARTS, SWEEPS, go2_joints
from irb140_jax.recordings.servo import taken_up, with_torque
from irb140_jax.robot import load_robot

ACCELERATING = 8.0  # Hz, the low-pass of accelerations of the hobby arm: twice the fastest of its sweep
SWEEP_PARTS = ((80.0, 90.0), (100.0, 103.0), (106.0, 108.0), (110.0, 112.0), (114.0, 116.0), (118.0, 119.5))  # s
CUTOFF, ENDS = 15.0, 0.15  # Hz and s of the baseline's comparison: both sides filtered both ways, ends left out
# Root mean square over the legs on held-out sweeps, with offsets and a delay [N m].
BASELINE = {"A": (0.093, 0.058, 0.266), "B": (0.136, 0.092, 0.305)}
RIGID = {"A": (0.401, 0.403, 1.237), "B": (0.465, 0.489, 1.451)}
JUDGED = 400  # gain of the pendulum's runs that are kept back
SIMULATED = 1e-3  # s of a step


@dataclasses.dataclass(frozen=True)
class Config:
    """Which machines, and where to write."""

    machines: tuple[str, ...] = ("unitree_go2", "bam_xl330", "so101")
    out: pathlib.Path = pathlib.Path("results")


def told(result: Result) -> dict[str, Any]:
    """What a diagnosis says, without its provenance, and its proof in motion over whole runs."""
    diagnosis, motion = result.diagnosis.to_json(), result.views.motion
    said = {key: diagnosis[key] for key in ("verdict", "summary", "findings", "unexplained", "fit", "notes")}
    return said | {"whole_run": motion and motion["whole_run"]}


def off(result: Result, runs: Sequence[Recording]) -> dict[str, list[np.ndarray]]:
    """Positions less those simulated from the commands of runs that the fit did not see, by model [rad].

    The corrected model is its file with the friction that MJCF can't hold, and without whatever else it can't.
    """
    robot, out = result.model.robot, {name: [] for name in ("nominal", "refit", "corrected")}
    models = simulated(result.model, compiled_robot(robot, SIMULATED), SIMULATED)
    assert models is not None
    for run in runs:
        drive = completed(run.drive, result.model.drive)
        times = np.arange(run.t[0], run.t[-1], SIMULATED)
        asked = np.stack([np.interp(times, run.t, x) for x in taken_up(run, drive).T], axis=1)[None]
        for name, apart in out.items():
            start, still, began = run.q[:1], np.zeros_like(run.q[:1]), np.zeros(1)
            went = positions_of([models], name, [drive], start, still, np.zeros_like(asked), asked, began)[0, :-1]
            apart.append(run.q - np.stack([np.interp(run.t, times, x) for x in went.T], axis=1))
    return out


def completed(stated: Drive | None, found: Drive | None) -> Drive:
    """A run's drive as it was found; of runs with another Kp, what is not stated of it and all times."""
    assert stated is not None and found is not None
    if np.array_equal(stated.kp, found.kp):
        return found
    gains = {k: np.where(np.isnan(getattr(stated, k)), getattr(found, k), getattr(stated, k)) for k in ("kp", "kd")}
    return dataclasses.replace(stated, **gains, delay=found.delay, lag=found.lag)


def go2() -> dict[str, Any]:
    """Diagnoses of every leg on both splits, and their errors on held-out sweeps."""
    out: dict[str, Any] = {"baseline": BASELINE, "rigid_of_the_baseline": RIGID, "splits": {}}
    for split in HELD_OUT:
        legs = {}
        for leg in LEGS:
            robot, run = load_robot(go2_model(), go2_joints(leg)), go2_recording(leg)
            result = diagnose(robot, go2_split(run, split)[0])
            unseen = off(result, [run])
            rows = np.concatenate([np.arange(SWEEPS[k - 1], SWEEPS[k]) for k in HELD_OUT[split]])
            legs[leg] = {
                "heldout": heldout(result, run, HELD_OUT[split]), **told(result),
                "position_rmse": {name: rms(x[0][rows]).tolist() for name, x in unseen.items()},
            }  # fmt: skip
            print(split, leg, legs[leg]["heldout"], flush=True)
        over = {
            model: np.sqrt(np.mean([np.square(x["heldout"][model]) for x in legs.values()], axis=0)).tolist()
            for model in ("nominal", "refit", "corrected")
        }
        out["splits"][split] = {"rmse_by_part": dict(over, parts=list(PARTS)), "legs": legs}
    return out


def heldout(result: Result, run: Recording, sweeps: tuple[int, ...]) -> dict[str, list[float]]:
    """Error of each model's torque on some sweeps, low-passed as the baseline's [N m], by joint."""
    drive = result.model.drive
    assert drive is not None
    made = with_torque(run, drive)
    step = float(np.median(np.diff(run.t)))
    sos = signal.butter(2, 2.0 * CUTOFF * step, output="sos")
    models = predict(result.model, made)
    rows = np.zeros(len(run.t), dtype=bool)
    for k in sweeps:
        rows[SWEEPS[k - 1] : SWEEPS[k]] = True
    rows &= (run.t > run.t[0] + ENDS) & (run.t < run.t[-1] - ENDS)
    left = {name: signal.sosfiltfilt(sos, made.tau - torque, axis=0)[rows] for name, torque in models.items()}
    return {name: np.sqrt(np.mean(x**2, axis=0)).tolist() for name, x in left.items()}


def so101() -> dict[str, Any]:
    """A diagnosis of five joints, and one of the wrist roll that is blocked."""
    robot = load_robot(so101_model(), tuple(so101_recording("multisine").joint_names))
    result = diagnose(robot, [so101_recording(motion) for motion in ARM_MOTIONS])
    apart = off(result, [so101_recording(motion) for motion in ARM_UNSEEN])
    # A model that flies away has no error that could be told.
    each = {name: rms(np.concatenate(x)) for name, x in apart.items()}
    whole = told(result) | {"position_rmse": {k: x.tolist() if np.isfinite(x).all() else None for k, x in each.items()}}
    roll = load_robot(so101_model(), ("wrist_roll",))
    stop = told(diagnose(roll, [only(so101_recording("single_joint_wrist_roll"), "wrist_roll")]))
    return {"motions": list(ARM_MOTIONS), "arm": whole, "blocked_wrist_roll": stop,
            "accelerations": accelerations(so101_recording("chirp_sweep"))}  # fmt: skip


def accelerations(run: Recording) -> list[dict[str, Any]]:
    """Amplitude of the acceleration of each joint in parts of a motion, as commanded and as reached [rad/s^2]."""
    step = float(np.median(np.diff(run.t)))
    sos = signal.butter(4, 2.0 * ACCELERATING * step, output="sos")
    assert run.qdes is not None
    asked, went = (np.gradient(np.gradient(signal.sosfiltfilt(sos, x, axis=0), step, axis=0), step, axis=0)
                   for x in (run.qdes, run.q))  # fmt: skip
    size = lambda x: (np.sqrt(2.0) * rms(x)).tolist()  # noqa: E731
    parts = [(run.t > begin) & (run.t < end) for begin, end in SWEEP_PARTS]
    return [{"from": begin, "to": end, "asked": size(asked[rows]), "reached": size(went[rows])}
            for (begin, end), rows in zip(SWEEP_PARTS, parts, strict=True)]  # fmt: skip


def rms(x: np.ndarray) -> np.ndarray:
    """Root mean square of each column."""
    return np.sqrt(np.mean(x**2, axis=0))


def only(r: Recording, joint: str) -> Recording:
    """A recording of one joint alone."""
    j = [r.joint_names.index(joint)]
    assert r.qdes is not None and r.drive is not None
    parts = {name: getattr(r.drive, name)[j] for name in ARRAYS}
    drive = dataclasses.replace(r.drive, **parts, said=(r.drive.said[j[0]],))
    return Recording(t=r.t, q=r.q[:, j], tau=r.tau[:, j], qdes=r.qdes[:, j], joint_names=(joint,), source=r.source,
                     drive=drive)


def bam(folder: pathlib.Path) -> dict[str, Any]:
    """The pendulum's diagnosis from goals and positions."""
    model = folder / "servo.xml"
    model.write_text(servo_model(), encoding="utf-8")
    robot = load_robot(model)
    result = diagnose(robot, [servo_commands(name) for name, (kp, _) in servo_runs().items() if kp != JUDGED])
    apart = off(result, [servo_commands(name) for name, (kp, _) in servo_runs().items() if kp == JUDGED])
    mean = {name: float(np.mean([np.abs(x).mean() for x in each])) for name, each in apart.items()}
    return told(result) | {"position_error": mean}


def main() -> None:
    import tempfile

    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    for machine in config.machines:
        with tempfile.TemporaryDirectory() as folder:
            result = {"unitree_go2": go2, "so101": so101, "bam_xl330": lambda f=folder: bam(pathlib.Path(f))}[machine]()
        path = config.out / f"real_servo_{machine}.json"
        path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(path, flush=True)


if __name__ == "__main__":
    main()
