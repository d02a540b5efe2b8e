"""Diagnose cases with the package as it is and keep what came out: the only module here that calls `irb140_jax`.

    python -m testbed.runner work                       # cases 0 to 99 of *work*
    python -m testbed.runner check --count 300          # ... of *check*: every run of it is a look that counts
    python -m testbed.runner final --commit HASH
    python -m testbed.runner work --servo known         # servos in closed loop, of which gains are known
    python -m testbed.runner work --outside             # physics outside the usual mixture, most of it without a name
    python -m testbed.runner work --label new --call irb140_jax.another:diagnose

One JSON line a case is appended to results/testbed_DRAW.jsonl as it is done, so an interrupted run goes on where it
stopped; `--label` names the file of another engine, or of other conditions (--noise 0.1 --longer 10, --error 0.3).  A
diagnosis goes the way of a user's: a file of the model and files of
the recordings are written, read, checked and diagnosed.
"""

import dataclasses
import importlib
import json
import pathlib
import re
import tempfile
import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import tyro
from scipy import signal

from testbed.cases import OUTSIDE, PASS, Case, Variation, make
from testbed.plants import torque_along
from testbed.servos import Form, make_servo

RESULTS = pathlib.Path(__file__).parents[1] / "results"
KEPT = ("verdict", "findings", "unexplained", "not_testable", "fit", "notes", "summary")


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    draw: tyro.conf.Positional[Literal["work", "check", "final"]] = "work"
    count: int = 100
    """Cases 0 to count - 1."""
    commit: str = ""
    """Hash that seeds "final"."""
    label: str = ""
    """Of another engine or other conditions: results/testbed_DRAW_LABEL.jsonl."""
    noise: float = 1.0
    longer: float = 1.0
    error: float | None = None
    outside: bool = False
    """Physics outside the usual mixture, most of it without a name."""
    servo: Form | None = None
    """A case of servos in closed loop: what is logged, or known of its gains."""
    call: str = "irb140_jax.mismatch:diagnose"
    """What diagnoses: module:function of a robot and recordings, with a `Result`."""
    engine: str = ""
    """Commit of the package that diagnoses, kept with each result."""
    out: pathlib.Path = RESULTS
    until: str = ""
    """Begin no case after this time of day, HH:MM."""


def judged(case: Case, diagnose: Callable[..., Any] | None = None) -> dict[str, Any]:
    """What the package says of a case, the truth, and what both are compared by.

    Args:
        case: The case.
        diagnose: What diagnoses in place of the package's own function.

    Returns:
        draw, index, kinds, truth: Of the case.
        seconds: That the diagnosis took.
        diagnosis: The document's parts that say something about the robot; None where it was refused or failed.
        refused, failed: What the package said instead, or the exception's name and text.
        unseen: Error of nominal, refit and corrected on motions that nobody fitted, RMS a joint [N m or N].
        band: Frequency below which it was compared [Hz]; noise_in_band: what of the torque sensors' noise lies there;
            left_in_band: what the true plant leaves there along the positions as they are known.
        impossible: Links whose exported inertials no body has, by model.
    """
    # Here, so that cases can be made where the package is not installed.
    from irb140_jax import mismatch
    from irb140_jax.errors import InputError

    out: dict[str, Any] = {"draw": case.draw, "index": case.index, "kinds": case.hidden, "truth": case.truth,
                           "diagnosis": None}  # fmt: skip
    began = time.perf_counter()
    try:
        with tempfile.TemporaryDirectory() as folder:
            robot, recordings, unseen = read_case(case, pathlib.Path(folder))
        result = (diagnose or mismatch.diagnose)(robot, recordings)
        out["seconds"] = time.perf_counter() - began
        out["diagnosis"] = {k: v for k, v in result.diagnosis.to_json().items() if k in KEPT}
        out["sentences"] = [x["sentence"] for x in result.views.to_json()["inertials"] if x["sentence"]]
        out |= _compared(case, result, [mismatch.predict(result.model, r) for r in unseen])
        if case.prescribed:
            out["left_in_band"] = left_by_the_truth(case, robot, recordings, out["band"])
    except InputError as error:
        out["refused"] = re.sub(r"\S*/(?=\w+\.\w+)", "", str(error))  # file names, without this machine's folders
    except Exception as error:  # a crash is a result, too
        out["failed"] = f"{type(error).__name__}: {error}"
    return out


def read_case(case: Case, folder: pathlib.Path):
    """The robot, the recordings and those that nobody fits, written to a folder and read as a user's files are."""
    from irb140_jax.recordings import drive_of_model, read_recording
    from irb140_jax.robot import load_robot

    (folder / "model.xml").write_text(case.xml, encoding="utf-8")
    robot, read = load_robot(folder / "model.xml"), []
    drive = drive_of_model(folder / "model.xml", robot.joint_names)
    for i, r in enumerate([*case.recordings, *case.held_out]):
        path = folder / f"{'recording' if i < len(case.recordings) else 'unseen'}{i}.npz"
        columns = {f"{k}.{name}": r[k][:, j] for k in ("q", "qd", "tau", "qdes") if k in r
                   for j, name in enumerate(case.joint_names)}  # fmt: skip
        np.savez(path, allow_pickle=False, t=r["t"], **columns)
        read.append(read_recording(path, robot, drive=drive))
    return robot, read[: len(case.recordings)], read[len(case.recordings) :]


def _compared(case: Case, result: Any, torques: list[dict[str, np.ndarray]]) -> dict[str, Any]:
    model, names = result.model, case.joint_names
    rms = lambda x: dict(zip(names, np.sqrt(np.mean(x**2, axis=0)).tolist(), strict=True))  # noqa: E731
    unseen = {}
    for which in ("nominal", "refit", "corrected"):
        # Without the first and the last half second, where filters have no neighbours.
        off = [(tau[which] - r["tau_true"])[_inner(r["t"])] for tau, r in zip(torques, case.held_out, strict=True)]
        unseen[which] = rms(np.concatenate(off))
    band = getattr(getattr(model, "band", None), "torque", None)
    noise = [low_passed(r["tau"] - r["tau_true"], r["t"], band) for r in case.recordings if "tau" in r]
    bodies = {k: np.asarray(getattr(model, f"phi_{k}")) for k in ("refit", "corrected") if hasattr(model, f"phi_{k}")}
    impossible = {k: [names[j] for j, p in enumerate(v) if not possible(p)] for k, v in bodies.items()}
    known = {"noise_in_band": rms(np.concatenate(noise))} if noise else {}
    return {"unseen": unseen, "band": band, "impossible": impossible} | known


def left_by_the_truth(case: Case, robot: Any, recordings: list[Any], band: float) -> dict[str, float]:
    """What nobody can explain: logged torque less that of the true plant along the motion as the package knows it.

    The torque sensors' noise, and what errors of positions, of their derivatives and of clocks make of the plant's own
    torque, in the rows that the package compares; RMS a joint [N m or N].
    """
    from irb140_jax.mismatch.regression.sufficient_data import comparable

    left, rows = np.zeros(robot.n), np.zeros(robot.n)
    for r in comparable(robot, recordings)[2]:
        number = int(re.findall(r"\d+", r.source)[-1])
        true = torque_along(case.plant, r.t + case.recordings[number]["began"], r.q, r.qd, r.qdd, number)
        use = r.usable & _inner(r.t)[:, None]
        left += np.sum(np.where(use, low_passed(r.tau - true, r.t, band), 0.0) ** 2, axis=0)
        rows += use.sum(axis=0)
    return dict(zip(case.joint_names, np.sqrt(left / np.maximum(rows, 1)).tolist(), strict=True))


def _inner(t: np.ndarray) -> np.ndarray:
    return (t > t[0] + 0.5) & (t < t[-1] - 0.5)


def low_passed(x: np.ndarray, t: np.ndarray, cut: float | None) -> np.ndarray:
    """What of x (T, n) lies below `cut` [Hz]; everything where there is none."""
    rate = 1.0 / float(np.median(np.diff(t)))
    if cut is None or cut > 0.45 * rate:
        return x
    return signal.sosfiltfilt(signal.butter(4, cut, fs=rate, output="sos"), x, axis=0)


def possible(phi: np.ndarray) -> bool:
    """Whether a body can have mass, first moments and inertia [m, mcx, mcy, mcz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz].

    Its 4 x 4 pseudo-inertia must not be negative: Wensing, Kim, Slotine, IEEE RA-L 3(1), 2018.
    """
    m, h = phi[0], phi[1:4]
    I = np.array([[phi[4], phi[5], phi[6]], [phi[5], phi[7], phi[8]], [phi[6], phi[8], phi[9]]])  # noqa: E741
    pseudo = np.block([[0.5 * np.trace(I) * np.eye(3) - I, h[:, None]], [h[None, :], np.array([[m]])]])
    return bool(np.linalg.eigvalsh(pseudo)[0] > -1e-9 * max(float(np.trace(pseudo)), 1e-12))


def read(path: pathlib.Path) -> list[dict[str, Any]]:
    """Stored results, one a line; none where there is no file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []


def stored(draw: str, label: str = "", out: pathlib.Path = RESULTS) -> pathlib.Path:
    """Where the results of a draw are kept."""
    return out / f"testbed_{draw}{'_' + label if label else ''}.jsonl"


def compact(x: Any) -> Any:
    """Numbers to six digits, arrays as lists, so that a line stays short."""
    if isinstance(x, dict):
        return {k: compact(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [compact(v) for v in x]
    return float(f"{float(x):.6g}") if isinstance(x, float | np.floating) else x


def main() -> None:
    """Diagnose the cases that are not yet stored."""
    config = tyro.cli(Config)
    from irb140_jax.compilation_cache import set_up_compilation_cache

    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    module, _, function = config.call.partition(":")
    diagnose = getattr(importlib.import_module(module), function)
    parts = (config.servo and f"servo_{config.servo}", config.outside and "outside", config.label)
    label = "_".join(x for x in parts if x)
    path = stored(config.draw, label, config.out)
    done = {r["index"] for r in read(path)}
    for index in range(config.count):
        if config.until and time.strftime("%H:%M") >= config.until:
            break
        if index in done:
            continue
        if config.servo:
            case = make_servo(config.draw, index, config.servo, config.commit)
        else:
            vary = Variation(config.noise, config.longer, config.error)
            case = make(config.draw, index, config.commit, vary, OUTSIDE if config.outside else PASS)
        out = {**judged(case, diagnose), "engine": config.engine}
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(compact(out)) + "\n")
        said = out["diagnosis"]["verdict"] if out["diagnosis"] else out.get("refused") or out["failed"]
        print(f"{config.draw} {index} {' + '.join(out['kinds'])}: {said} ({out.get('seconds', 0.0):.0f} s)", flush=True)


if __name__ == "__main__":
    main()
