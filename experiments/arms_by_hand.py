"""Arms, loops and physics that share nothing with this library: MJCF written by hand, laws of MuJoCo itself.

    python experiments/arms_by_hand.py                    # cases 0 to 71, one or two effects, clean logs
    python experiments/arms_by_hand.py rough              # cases 0 to 47, friction everywhere and one more, rough logs
    python experiments/arms_by_hand.py --first 72 --last 107
    python experiments/arms_by_hand.py --table            # docs/arms-by-hand.md from what is there

`experiments/trials.py` hides physics by this library's own simulation of concealed effects.  A mistake in what a law
means could be in both.  Here friction is MuJoCo's `frictionloss`, viscosity its `damping`, a rotor its `armature`, a
spring its `stiffness`, a tilt its `gravity`, a payload a heavier last body; what MuJoCo has not (ripple, lag, delay) is
a line of NumPy.  Computed torque on an arm whose inertials are 5 % wrong; two recordings of 15 s of a sum of sines, or
three rough ones of 20 s: sines, point to point, slow sines.

Cases are appended to results/arms_by_hand_*.jsonl as they are done, so an interrupted run goes on where it stopped.
"""

import dataclasses
import json
import pathlib
from collections.abc import Callable
from typing import Literal

import numpy as np
import tyro
from arms_by_hand_report import key, read, say, without, write
from hand_arms import ARMS, MOTIONS, Plant, clean, recorded, rough, sizes_of, spec_of, wrong
from hand_laws import BENEATH_ONLY, EVERYWHERE, INSTEAD_OF, LAWS, ORDINARY

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot, robot_from_model


def case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm, its nominal model, two clean recordings, and what is hidden in them: every sixth round hides nothing."""
    rng = np.random.default_rng([seed, 140])
    arm = list(ARMS)[seed % len(ARMS)]
    count = 0 if (seed // len(ARMS)) % 6 == 5 else int(rng.choice([1, 1, 2]))
    clean_laws = [slug for slug in LAWS if slug not in BENEATH_ONLY]
    return arm, *hidden(arm, [str(slug) for slug in rng.choice(clean_laws, count, replace=False)], clean, rng)


def rough_case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm with MuJoCo's friction on all its joints, three rough recordings; all but every sixth round hide more."""
    rng = np.random.default_rng([seed, 141])
    arm = list(ARMS)[seed % len(ARMS)]
    beneath = [slug for slug in LAWS if slug not in ORDINARY]
    slugs = [] if (seed // len(ARMS)) % 6 == 5 else [str(rng.choice(beneath))]
    return arm, *hidden(arm, slugs, rough, rng)


def hidden(
    arm: str, slugs: list[str], logger: Callable, rng: np.random.Generator
) -> tuple[Robot, list[Recording], list[dict]]:
    """The nominal arm, recordings of one with other inertials and these laws, and their truth."""
    sizes, nominal, true = sizes_of(arm), spec_of(arm).compile(), spec_of(arm).compile()
    wrong(true, rng)
    plant, truth = Plant(true, [], [], []), []

    def hide(slug: str, j: int, share: float) -> None:
        values = LAWS[slug](plant, j, share * sizes.tau[j], sizes, rng)
        names = [nominal.joint(i).name for i in (range(nominal.nv) if slug in EVERYWHERE else [j])]
        truth.append({"effect": slug, "joints": names, "parameters": {k: float(v) for k, v in values.items()}})

    at = [int(rng.integers(nominal.nv)) for _ in slugs]
    for slug, j in zip(slugs, at, strict=True):
        hide(slug, j, rng.uniform(0.06, 0.25))
    if logger is rough:
        instead = {(INSTEAD_OF.get(slug), j) for slug, j in zip(slugs, at, strict=True)}
        for slug, share in zip(ORDINARY, (0.15, 0.1), strict=True):
            for j in range(nominal.nv):
                if (slug, j) not in instead:
                    hide(slug, j, share * rng.uniform(0.6, 1.4))
    recordings = [recorded(nominal, plant, rng, motion, logger) for motion in MOTIONS[logger]]
    return robot_from_model(nominal, source=arm), recordings, truth


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    kind: tyro.conf.Positional[Literal["clean", "rough"]] = "clean"
    first: int = 0
    last: int | None = None
    """The last seed; 71 of the clean ones, 47 of the rough ones."""
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the page from the results that are there."""


KINDS = {"clean": (case, 71), "rough": (rough_case, 47)}


def judged(kind: str, seed: int) -> dict:
    arm, robot, recordings, truth = KINDS[kind][0](seed)
    d = diagnose(robot, recordings).diagnosis
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
