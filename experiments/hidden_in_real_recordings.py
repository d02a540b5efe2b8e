"""Physics concealed in recordings of real machines: the machine is real, and only what is added to its log is known.

    python experiments/hidden_in_real_recordings.py                        # every machine and effect
    python experiments/hidden_in_real_recordings.py --machines staubli_tx40 --share 0.05
    python experiments/hidden_in_real_recordings.py --table                # print what is stored

A recording is diagnosed as it was logged; then the torque that one more effect would have needed along the same motion
is added to the torque (or the log is changed as its fault would change it), and it is diagnosed again.  What is named
more is right or false; a name that the machine's own log has says nothing.  The laws are in `concealed_laws.py`.
"""

import dataclasses
import json
import pathlib
import sys
import tempfile
import time
from typing import Any

import mujoco
import numpy as np
import study_provenance
import tyro
from concealed_laws import EFFECTS, motion_of, over, rms
from real_machines_varied import machines

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording, read_recording, write_recording
from irb140_jax.robot import Robot, load_robot

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # testbed/ stands beside experiments/ and is installed by nobody

from testbed import scoring  # noqa: E402

CUT = {"staubli_tx40": 40.0, "dfki_double_pendulum": 20.0, "bam_xl330": 15.0}  # Hz, of the positions
STORED = "hidden_in_real_recordings.jsonl"
POWERED = 0.25  # of the torque of the recording in which a joint logs most
KEPT = {"findings": ("effect", "joints", "parameters", "evidence", "alternatives"), "unexplained": ("joints", "where"),
        "not_testable": ("effect", "joints")}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Config:
    """What to hide where."""

    machines: tuple[str, ...] = tuple(CUT)
    effects: tuple[str, ...] = ()
    """All that are defined, where none is given."""
    share: float = 0.1
    """RMS of the added torque over that of the joint."""
    seed: int = 0
    out: pathlib.Path = ROOT / "results"
    table: bool = False


def driven(recordings: list[Recording]) -> list[Recording]:
    """Those in which every joint is driven: one that swings unpowered logs no torque, whatever more it would need."""
    sizes = np.array([np.std(r.tau, axis=0) for r in recordings])
    return [r for r, size in zip(recordings, sizes, strict=True) if np.all(size > POWERED * sizes.max(axis=0))]


Name = tuple[str, tuple[str, ...]]  # effect, joints
BEFORE = "named before, too"
ADDS_UP = ("coulomb_friction", "viscous_friction", "rotor_inertia", "torque_offset")  # to what the machine has of it


def run(config: Config) -> None:
    """Diagnose every machine as it is and with each effect, and keep what came out."""
    wanted = [(k, f) for k, f in EFFECTS.items() if not config.effects or k in config.effects]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for machine, file, logs in machines(folder):
            if machine not in config.machines:
                continue
            robot, model = load_robot(file), mujoco.MjModel.from_xml_path(str(file))
            recordings = driven([read_recording(p, robot) for p in logs])
            motions = [motion_of(model, r, i, CUT[machine]) for i, r in enumerate(recordings)]
            bare = diagnosed(robot, recordings, folder)
            keep(config, {"machine": machine, "hidden": "nothing"} | bare)
            for k, (effect, make) in enumerate(wanted):
                rng = np.random.default_rng([config.seed, list(EFFECTS).index(effect)])
                j = int(rng.integers(robot.n))
                if effect == "coupling" and robot.n == 1:
                    continue
                torque = config.share * rms(over(motions, lambda m: m.tau[:, j]))  # noqa: B023
                hidden = make(motions, j, torque, rng)
                changed = [hidden.change(m, r.q) for m, r in zip(motions, recordings, strict=True)]
                logs = [dataclasses.replace(r, q=q, qd=None, qdd=None, tau=tau)
                        for r, (q, tau) in zip(recordings, changed, strict=True)]  # fmt: skip
                joints = [robot.joint_names[i] for i in hidden.joints]
                truth = {"slug": hidden.slug, "joints": joints, "parameters": hidden.parameters,
                         "accept": hidden.accept, "tolerate": hidden.tolerate}  # fmt: skip
                line = {"machine": machine, "hidden": effect, "share": config.share, "truth": truth}
                line |= diagnosed(robot, logs, folder)
                keep(config, line)
                print(f"{k + 1}/{len(wanted)} {row(line, bare)}", flush=True)


def diagnosed(robot: Robot, recordings: list[Recording], folder: pathlib.Path) -> dict[str, Any]:
    """The parts of a diagnosis that are judged, of recordings that go through files as a user's do."""
    files = [write_recording(r, folder / f"{i}.npz") for i, r in enumerate(recordings)]
    began = time.perf_counter()
    result = diagnose(robot, [read_recording(p, robot) for p in files]).diagnosis.to_json()
    kept = {part: [{k: x[k] for k in keys} for x in result[part]] for part, keys in KEPT.items()}
    return {"seconds": round(time.perf_counter() - began, 1), "diagnosis": kept}


def keep(config: Config, line: dict[str, Any]) -> None:
    """Store a result in the place of its former one."""
    path = config.out / STORED
    same = lambda x: (x["machine"], x["hidden"], x.get("share"))  # noqa: E731
    rest = [x for x in stored(config) if same(x) != same(line)]
    line["engine"] = study_provenance.commit()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(json.dumps(x) + "\n" for x in [*rest, line]), encoding="utf-8")


def stored(config: Config) -> list[dict[str, Any]]:
    """All that is stored."""
    path = config.out / STORED
    return [json.loads(x) for x in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []


def judged(line: dict[str, Any], bare: dict[str, Any]) -> dict[str, Any]:
    """How a hidden effect came out, beside the diagnosis of the recording as it was logged.

    Returns:
        how: As of `testbed.scoring.stated_classes`, or `BEFORE` where the log as it was has the same name already.
        value: Of each parameter that is known, what was added, what is said to be there more, and how surely.
        more, lost: Names beside it that the log as it was did not have, or that are gone.
    """
    truth = line["truth"]
    hidden = truth | {"kind": line["hidden"], "role": "special"}
    case = {"truth": {"hidden": [hidden], "dead": []}, "diagnosis": line["diagnosis"]}
    at = lambda d: {(f["effect"], tuple(f["joints"])): f for f in d["diagnosis"]["findings"]}  # noqa: E731
    now, before = at(line), at(bare)
    wrong = {k for k, f in now.items() if not scoring.matches(f, hidden)}
    allowed = lambda f: scoring.matches(f, hidden, ("accept", "tolerate"))  # noqa: E731
    values = {}
    several = len(truth["joints"]) > 1
    for key in (k for k in now if k[0] == truth["slug"] and (several or set(k[1]) == set(truth["joints"]))):
        for name, true in truth["parameters"].items():
            said = now[key]["parameters"].get(name)
            had = before[key]["parameters"][name] if key in before and truth["slug"] in ADDS_UP else None
            if said and said["std"]:
                value = said["value"] - (had["value"] if had else 0.0)
                values[name] = (true, value, float(np.hypot(said["std"], had["std"] if had else 0.0)))
    how = scoring.stated_classes(case)[0]["how"]
    mine = [_true_names(found, truth) for found in (now, before)]
    return {
        "how": BEFORE if mine[0] and mine[0] <= mine[1] else how, "value": values,
        "more": sorted(wrong - set(before)),
        "lost": sorted(k for k, f in before.items() if k not in now and not allowed(f)),
    }  # fmt: skip


def _true_names(found: dict[Name, dict[str, Any]], truth: dict[str, Any]) -> set[Name]:
    """Findings at a joint of what is hidden that name it, or have it among their alternatives."""
    options = {k: {f["effect"], *(a["effect"] for a in f["alternatives"])} for k, f in found.items()}
    return {k for k, said in options.items() if set(k[1]) & set(truth["joints"]) and said & set(truth["accept"])}


def row(line: dict[str, Any], bare: dict[str, Any]) -> str:
    """A line of the table."""
    j = judged(line, bare)
    name = lambda k: f"{k[0]} on {', '.join(k[1]) if len(k[1]) < 3 else 'all'}"  # noqa: E731
    values = "; ".join(f"{k} {s:.3g} ± {std:.2g} ({true:.3g})" for k, (true, s, std) in j["value"].items())
    where = ", ".join(line["truth"]["joints"]) if len(line["truth"]["joints"]) < 3 else "all joints"
    more, lost = ("; ".join(map(name, j[k])) or "none" for k in ("more", "lost"))
    cells = (f"`{line['machine']}`", f"{100 * line['share']:.0f} %", f"{line['hidden']} on {where}", j["how"],
             values or "—", more, lost)  # fmt: skip
    return f"| {' | '.join(cells)} |"


def table(config: Config) -> str:
    """What is stored, as a table."""
    lines = stored(config)
    bare = {x["machine"]: x for x in lines if x["hidden"] == "nothing"}
    head = ["| machine | share | hidden | it is | parameters (true) | named beside it | no longer named |",
            "|" + "---|" * 7]  # fmt: skip
    return "\n".join([*head, *(row(x, bare[x["machine"]]) for x in lines if x["hidden"] != "nothing")])


def main() -> None:
    """Run, or print what is stored."""
    config = tyro.cli(Config)
    if not config.table:
        set_up_compilation_cache()
        run(config)
    print(table(config))


if __name__ == "__main__":
    main()
