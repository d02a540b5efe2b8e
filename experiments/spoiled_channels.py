"""How often the checks refuse sound recordings and spoiled ones:  python experiments/spoiled_channels.py

Sound: MuJoCo hides one effect in an arm, with inertials 20 % wrong and torque noise of 5 %.  Spoiled: recordings of the
IRB 140 in which one thing about the channels is wrong.  Writes results/spoiled_channels.json and its paragraph in
docs/recordings.md.
"""

import dataclasses
import json
import pathlib
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
import tyro
from pages import ROOT

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.errors import InputError
from irb140_jax.recordings import Recording, read_recording, write_recording
from irb140_jax.recordings.conceal import Concealment, Noise, conceal, random_robot
from irb140_jax.recordings.concealed.catalogue import HIDDEN
from irb140_jax.recordings.excite import three_motions
from irb140_jax.robot import Robot, irb140_path, load_robot, robot_from_model

SECONDS = 8.0
SHARES = (0.2, 0.8)  # of a joint's torque
JOINTS = (1, 2, 4)  # of the random arms, beside the IRB 140
SPOILED = 5  # arms, each recorded fast, from point to point, and slowly
GEAR = 100.0
WORD = "<!-- spoiled channels -->"

Way = Callable[[Recording], Recording]


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write."""

    out: pathlib.Path = ROOT / "results"


def arms() -> Iterator[tuple[str, str | pathlib.Path, Robot]]:
    """Name, model and robot of every arm."""
    yield "irb140", irb140_path(), load_robot(irb140_path())
    for n in JOINTS:
        xml = random_robot(n, n)
        yield f"random arm of {n}", xml, robot_from_model(mujoco.MjModel.from_xml_string(xml), "random")


def refused(recordings: Sequence[Recording], robot: Robot) -> list[bool]:
    """Whether reading each one's file ends in an error."""
    out = []
    with tempfile.TemporaryDirectory() as folder:
        for k, r in enumerate(recordings):
            path = write_recording(r, pathlib.Path(folder) / f"{k}.csv")
            try:
                read_recording(path, robot)
                out.append(False)
            except InputError:
                out.append(True)
    return out


def sound() -> dict[str, Any]:
    """Recordings with one effect each: how many there are, how many are refused, and of which cases."""
    count, lost, seed, which = 0, 0, 1000, []
    for name, model, robot in arms():
        for slug in HIDDEN:
            for share in SHARES:
                seed += 1
                motions = three_motions(robot, SECONDS, seed=seed)
                first = seed % max(robot.n - HIDDEN[slug].joints_acted_on + 1, 1)
                joints = robot.joint_names[first : first + HIDDEN[slug].joints_acted_on]
                try:
                    case = conceal(model, [Concealment(slug, joints, share)], motions, seed=seed,
                                   noise=Noise(torque=0.05), inertial_error=0.2)  # fmt: skip
                except InputError as error:  # no such effect on this arm, or none with which the loop is stable
                    print(name, slug, share, error, flush=True)
                    continue
                out = refused(case.recordings, robot)
                count, lost = count + len(out), lost + sum(out)
                which += [f"{slug} of {share:.0%} on the {name}"] * any(out)
                print(name, slug, share, out, flush=True)
    return {"recordings": count, "refused": lost, "of": which}


def ways(n: int) -> Iterator[tuple[str, Way]]:
    """Everything that is made wrong, by a name; those that are tried joint by joint share one."""
    change = dataclasses.replace
    yield "positions in degrees", lambda r: change(r, q=np.degrees(r.q))
    yield "torque on the motor side", lambda r: change(r, tau=r.tau / GEAR)
    yield "all signs of the torque reversed", lambda r: change(r, tau=-r.tau)
    for j in range(n):
        one = np.where(np.arange(n) == j, -1.0, 1.0)
        yield "one torque's sign reversed", lambda r, one=one: change(r, tau=r.tau * one)
    for j in range(n - 1):
        order = np.arange(n)
        order[[j, j + 1]] = j + 1, j
        yield "torques of neighbours exchanged", lambda r, order=order: change(r, tau=r.tau[:, order])
    for j in range(n):
        turned = np.where(np.arange(n) == j, 0.5 * np.pi, 0.0)
        yield "one zero a right angle off", lambda r, turned=turned: change(r, q=r.q + turned)


def spoiled() -> dict[str, list[int]]:
    """How many of each arm's recordings are refused, one number a joint or pair where a way is tried on each."""
    robot, out = load_robot(irb140_path()), {}
    recordings: list[Recording] = []
    for seed in range(SPOILED):
        motions = three_motions(robot, SECONDS, seed=seed)
        recordings += conceal(irb140_path(), (), motions, seed=seed).recordings
    out["nothing"] = [sum(refused(recordings, robot))]
    for name, way in ways(robot.n):
        out.setdefault(name, []).append(sum(refused([way(r) for r in recordings], robot)))
        print(name, out[name], flush=True)
    return {"recordings": [len(recordings)], **out}


def paragraph(result: dict) -> str:
    """What the page says."""
    fine, wrong = result["sound"], dict(result["spoiled"])
    (of,), (none,) = wrong.pop("recordings"), wrong.pop("nothing")
    span = lambda x: f"{min(x)}" if min(x) == max(x) else f"{min(x)} to {max(x)}"  # noqa: E731
    sizes = ", ".join(map(str, JOINTS))
    so_many = lambda k: f"{k or 'none'} {'is' if k == 1 else 'are'} refused"  # noqa: E731
    which = f" ({', '.join(fine['of'])})" if fine["of"] else ""
    lines = (
        f"MuJoCo made {fine['recordings']} recordings with one of {len(HIDDEN)} hidden effects: the IRB 140 and",
        f"random arms of {sizes} joints, inertials 20 % wrong, 5 % torque noise, effects of 20 and 80 % of a joint's",
        f"torque. Of these {so_many(fine['refused'])}{which}. Of {of} recordings of the IRB 140",
        f"(fast, point to point, slow) {so_many(none)} as they are. Spoiled in one way each, of {of} are refused,",
        "by joint or pair of joints:",
    )
    each = "\n".join(f"- {name}: {span(x)}" for name, x in wrong.items())
    return "\n".join((WORD, *lines, "", each, "", WORD))


def main() -> None:
    """Count, and write."""
    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    result = {"spoiled": spoiled(), "sound": sound()}
    (config.out / "spoiled_channels.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if config.out.resolve() == (ROOT / "results").resolve():
        page = ROOT / "docs" / "recordings.md"
        text = page.read_text(encoding="utf-8")
        said = re.compile(f"{WORD}.*?{WORD}", re.S)
        page.write_text(said.sub(lambda _: paragraph(result), text, count=1), encoding="utf-8")


if __name__ == "__main__":
    main()
