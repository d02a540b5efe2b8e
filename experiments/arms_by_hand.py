"""Arms, loops and physics that share nothing with this library: MJCF written by hand, laws of MuJoCo itself.

    python experiments/arms_by_hand.py                    # cases 0 to 71, one or two effects, clean logs
    python experiments/arms_by_hand.py abrupt             # cases 0 to 71, motions that start and stop at once
    python experiments/arms_by_hand.py rough              # cases 0 to 47, friction everywhere and one more, rough logs
    python experiments/arms_by_hand.py parts              # cases 0 to 53, second joints, tendons, walls ..., clean logs
    python experiments/arms_by_hand.py rough_parts        # the same beneath friction everywhere, rough logs
    python experiments/arms_by_hand.py --first 72 --last 107
    python experiments/arms_by_hand.py --table            # docs/arms-by-hand.md from what is there

`experiments/trials.py` hides physics by this library's own simulation of concealed effects.  A mistake in what a law
means could be in both.  Here friction is MuJoCo's `frictionloss`, viscosity its `damping`, a rotor its `armature`, a
spring its `stiffness`, a tilt its `gravity`, a payload a heavier last body, play and elasticity a second joint, a
coupling a tendon, a push a force on a body; what MuJoCo has not (ripple, lag, delay) is a line of NumPy.  Computed
torque on an arm whose inertials are 5 % wrong; two recordings of 15 s of a sum of sines, or three rough ones of 20 s:
sines, point to point, slow sines.

Cases are appended to results/arms_by_hand_*.jsonl as they are done, so an interrupted run goes on where it stopped.
"""

import dataclasses
import json
import pathlib
from collections.abc import Callable
from functools import partial
from typing import Literal

import mujoco
import numpy as np
import tyro
from arms_by_hand_report import key, read, say, without, write
from hand_arms import (
    ARMS,
    MOTIONS,
    Plant,
    Sizes,
    abrupt,
    clean,
    compiled,
    plant_of,
    recorded,
    rough,
    sizes_of,
    tree_of,
    wrong,
)
from hand_laws import BENEATH_ONLY, EVERYWHERE, INSTEAD_OF, LAWS, ORDINARY
from hand_parts import PARTS, add_tool

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot, robot_from_model


def case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm, its nominal model, two clean recordings, and what is hidden in them: every sixth round hides nothing."""
    return clean_case(seed, clean, 140)


def clean_case(seed: int, logger: Callable, stream: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """Such a case, of a logger and the motions that go with it."""
    rng = np.random.default_rng([seed, stream])
    arm = list(ARMS)[seed % len(ARMS)]
    count = 0 if (seed // len(ARMS)) % 6 == 5 else int(rng.choice([1, 1, 2]))
    clean_laws = [slug for slug in LAWS if slug not in BENEATH_ONLY]
    return arm, *hidden(arm, [str(slug) for slug in rng.choice(clean_laws, count, replace=False)], logger, rng)


def rough_case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm with MuJoCo's friction on all its joints, three rough recordings; all but every sixth round hide more."""
    rng = np.random.default_rng([seed, 141])
    arm = list(ARMS)[seed % len(ARMS)]
    beneath = [slug for slug in LAWS if slug not in ORDINARY]
    slugs = [] if (seed // len(ARMS)) % 6 == 5 else [str(rng.choice(beneath))]
    return arm, *hidden(arm, slugs, rough, rng)


def parts_case(seed: int, logger: Callable = clean) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm with a part that the nominal arm has not: every part on every arm in turn."""
    rng = np.random.default_rng([seed, 142])
    slug, round_ = list(PARTS)[seed % len(PARTS)], seed // len(PARTS)
    arm = list(ARMS)[(round_ + seed % len(PARTS)) % len(ARMS)]
    if slug == "transmission_coupling" and arm == "pendulum":
        arm = "two"  # it couples two joints
    tree = tree_of(arm)
    if slug == "contact":
        add_tool(tree)
    nominal = compiled(tree)
    sizes, j = sizes_of(nominal), int(rng.integers(nominal.nv))
    part = PARTS[slug](tree, j, rng.uniform(0.06, 0.25) * sizes.tau[j], sizes, rng)
    plant = plant_of(compiled(tree), nominal)
    wrong(plant.model, rng)
    part.fit(plant)
    joints = part.joints or [nominal.joint(i).name for i in range(nominal.nv)]
    truth = [{"effect": slug, "joints": joints, "parameters": {k: float(v) for k, v in part.values.items()}}]
    if logger is rough:
        truth += rubbed(nominal, plant, sizes, rng, {(INSTEAD_OF.get(slug), j)})
    recordings = [recorded(nominal, plant, rng, m, logger, i) for i, m in enumerate(MOTIONS[logger])]
    return arm, robot_from_model(nominal, source=arm), recordings, truth


def hidden(
    arm: str, slugs: list[str], logger: Callable, rng: np.random.Generator
) -> tuple[Robot, list[Recording], list[dict]]:
    """The nominal arm, recordings of one with other inertials and these laws, and their truth."""
    nominal = compiled(tree_of(arm))
    sizes, plant = sizes_of(nominal), plant_of(compiled(tree_of(arm)), nominal)
    wrong(plant.model, rng)
    at = [int(rng.integers(nominal.nv)) for _ in slugs]
    truth = [
        hide(slug, nominal, plant, j, rng.uniform(0.06, 0.25), sizes, rng) for slug, j in zip(slugs, at, strict=True)
    ]
    if logger is rough:
        instead = {(INSTEAD_OF.get(slug), j) for slug, j in zip(slugs, at, strict=True)}
        truth += rubbed(nominal, plant, sizes, rng, instead)
    recordings = [recorded(nominal, plant, rng, motion, logger) for motion in MOTIONS[logger]]
    return robot_from_model(nominal, source=arm), recordings, truth


def rubbed(
    nominal: mujoco.MjModel, plant: Plant, sizes: Sizes, rng: np.random.Generator, instead: set[tuple[str | None, int]]
) -> list[dict]:
    """Ordinary friction on all joints but where something stands instead of it, and its truth."""
    return [
        hide(slug, nominal, plant, j, share * rng.uniform(0.6, 1.4), sizes, rng)
        for slug, share in zip(ORDINARY, (0.15, 0.1), strict=True)
        for j in range(nominal.nv)
        if (slug, j) not in instead
    ]


def hide(
    slug: str, nominal: mujoco.MjModel, plant: Plant, j: int, share: float, sizes: Sizes, rng: np.random.Generator
) -> dict:
    """Put a law into a plant, of a share of the joint's torque, and say what it is."""
    values = LAWS[slug](plant, j, share * sizes.tau[j], sizes, rng)
    names = [nominal.joint(i).name for i in (range(nominal.nv) if slug in EVERYWHERE else [j])]
    return {"effect": slug, "joints": names, "parameters": {k: float(v) for k, v in values.items()}}


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    kind: tyro.conf.Positional[Literal["clean", "abrupt", "rough", "parts", "rough_parts"]] = "clean"
    first: int = 0
    last: int | None = None
    """The last seed; 71 of the clean and the abrupt ones, 47 of the rough ones, 53 of either with parts."""
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the page from the results that are there."""


KINDS = {
    "clean": (case, 71), "abrupt": (partial(clean_case, logger=abrupt, stream=143), 71), "rough": (rough_case, 47),
    "parts": (parts_case, 53), "rough_parts": (partial(parts_case, logger=rough), 53),
}  # fmt: skip


def judged(kind: str, seed: int) -> dict:
    arm, robot, recordings, truth = KINDS[kind][0](seed)
    d = diagnose(robot, recordings).diagnosis.to_json()
    return {
        "seed": seed, "arm": arm, "truth": truth, "found": d["findings"], "unexplained": d["unexplained"],
        "verdict": d["verdict"], "fit": d["fit"], "exact": {*map(key, d["findings"])} == {*map(key, truth)},
        "not_testable": [x for x in d["not_testable"] if x["effect"] in {e["effect"] for e in truth}],
    }  # fmt: skip


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    paths = {kind: config.out / f"arms_by_hand_{kind}.jsonl" for kind in KINDS}
    done = {c["seed"] for c in read(paths[config.kind])}
    last = KINDS[config.kind][1] if config.last is None else config.last
    for seed in range(config.first, last + 1) if not config.table else ():
        if seed in done:
            continue
        c = judged(config.kind, seed)
        with paths[config.kind].open("a", encoding="utf-8") as file:
            file.write(json.dumps(c) + "\n")
        missed, added = say(without(c["truth"], c["found"])), say(without(c["found"], c["truth"]))
        mark = "ok  " if c["exact"] else f"MISS missed {missed}; added {added};"
        print(f"{mark} {seed} {c['arm']}: hidden {say(c['truth'])}; {c['verdict']}", flush=True)
    write(paths)


if __name__ == "__main__":
    main()
