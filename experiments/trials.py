"""Hide physics of every kind and strength, diagnose blind, and count: the tables of docs/trials.md.

    python experiments/trials.py single   # one effect of the vocabulary, clean log: plain 20 %, masked 6 %, buried 2 %
    python experiments/trials.py rough    # friction on every joint, a rough log, and one more effect under another law
    python experiments/trials.py several  # two or three effects, one an order stronger than another
    python experiments/trials.py clean    # nothing hidden, clean and rough logs
    python experiments/trials.py outside  # physics that is in no library

Robots are the IRB 140 and random ones of 1 to 7 joints, inertials 5 % wrong, recordings by MuJoCo in closed loop.
Cases are appended to results/trials_<kind>.jsonl as they are done, so an interrupted run goes on where it stopped.
`--table` writes docs/trials.md from what is there.
"""

import dataclasses
import json
import pathlib
import time
from typing import Literal

import numpy as np
import study_provenance
import trials_report
import tyro
from unseen import unseen_errors

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.errors import InputError
from irb140_jax.mismatch import diagnose
from irb140_jax.mismatch.diagnose import DiagnoseConfig
from irb140_jax.recordings.conceal import ROUGH, ConcealedCase, Concealment, Noise, conceal, random_robot
from irb140_jax.recordings.concealed.catalogue import HIDDEN
from irb140_jax.recordings.concealed.choice import meaningful_sites
from irb140_jax.recordings.concealed.hidden import Survey, survey_of
from irb140_jax.recordings.concealed.other_laws import OTHER_LAWS
from irb140_jax.recordings.concealed.outside import JUDGED_ON, TUNED_ON
from irb140_jax.recordings.concealed.plant import arm_model, arm_spec
from irb140_jax.recordings.excite import Excitation, fourier_motion, three_motions
from irb140_jax.robot import Robot, irb140_path, robot_from_model

Kind = Literal["single", "rough", "several", "clean", "outside"]
SHARES = {"plain": 0.2, "masked": 0.06, "buried": 0.02}
DURATION = 15.0  # [s] of each of the three recordings
ORDINARY = {"coulomb_friction": 0.15, "viscous_friction": 0.1}  # shares on every joint of a real arm
# What is hidden under ordinary friction: these laws differ from it, and are no mere change of its numbers.
BENEATH = (
    *OTHER_LAWS, "asymmetric_friction", "rotor_inertia", "torque_offset", "torque_gain", "transmission_coupling",
    "payload", "gravity_tilt", "time_delay", "encoder_offset",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    kind: tyro.conf.Positional[Kind] = "single"
    first: int = 0
    last: int = 99
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the page from the results that are there."""


@dataclasses.dataclass(frozen=True)
class Arm:
    """A robot with motions, and what it does along them."""

    source: str
    robot: Robot
    motions: list[Excitation]
    survey: Survey


def arm_of(seed: int) -> Arm:
    """The IRB 140 every fourth time, else a random robot of 1 to 7 joints out of 14."""
    k = seed // 4 * 3 + seed % 4 - 1
    source = str(irb140_path()) if seed % 4 == 0 else random_robot(100 + k % 14, 1 + k % 7)
    spec = arm_spec(source)
    robot = robot_from_model(spec.compile(), source=source[:40])
    motions = [*three_motions(robot, DURATION, 1000.0, seed=seed), fourier_motion(robot, DURATION, seed=seed + 104729)]
    return Arm(source, robot, motions, survey_of(arm_model(spec, 1e-3), motions, every=20))


def _placed(arm: Arm, effects, rng: np.random.Generator, share: float, other_law: bool = False) -> Concealment:
    """The first of the effects, in random order, that this robot has a place for."""
    for effect in rng.permutation(np.array(effects)):
        try:
            sites = meaningful_sites(str(effect), arm.survey)
        except InputError:
            continue
        joints = tuple(arm.robot.joint_names[j] for j in sites[rng.integers(len(sites))])
        return Concealment(str(effect), joints, share=share, other_law=other_law)
    raise InputError("none of the effects has a place on this robot")


def case_of(kind: Kind, seed: int) -> tuple[Arm, ConcealedCase, Noise, str]:
    """The case of a seed (three recordings to diagnose and one kept back), its noise, and its row in the table."""
    rng, arm = np.random.default_rng([seed, 91]), arm_of(seed)
    noise, hidden, row = Noise(), [], kind
    if kind == "single":
        # Every effect in turn, so that each stands in the table equally often.
        row = list(SHARES)[seed % 3]
        effect = list(HIDDEN)[(seed // 3) % len(HIDDEN)]
        try:
            hidden = [_placed(arm, [effect], rng, SHARES[row])]
        except InputError:
            hidden = [_placed(arm, list(HIDDEN), rng, SHARES[row])]
    elif kind == "rough":
        row, noise = ("plain", "masked")[seed % 2], ROUGH
        for effect, share in ORDINARY.items():
            hidden += [Concealment(effect, (j,), share=share * rng.uniform(0.6, 1.4)) for j in arm.robot.joint_names]
        hidden.append(_placed(arm, BENEATH, rng, SHARES[row], other_law=True))
    elif kind == "several":
        row = ("two", "three")[seed % 2]
        shares = (0.3, 0.03) if row == "two" else (0.2, 0.1, 0.03)
        while len(hidden) < len(shares):
            one = _placed(arm, list(HIDDEN), rng, shares[len(hidden)])
            alike = [h for h in hidden if h.effect == one.effect or _overlap(h, one)]
            hidden += [] if alike else [one]
    elif kind == "clean":
        row, noise = ("clean log", Noise()) if seed % 2 else ("rough log", ROUGH)
    else:
        half = (TUNED_ON, JUDGED_ON)[seed % 2]
        row = ("tuned on", "judged on")[seed % 2]
        slugs = [k.slug for k in half if arm.robot.n > 1 or k.slug in ALONE]
        joint = str(rng.choice(arm.robot.joint_names))
        hidden = [Concealment(slugs[(seed // 2) % len(slugs)], (joint,), share=0.15)]
    return arm, conceal(arm.source, hidden, arm.motions, seed=seed, noise=noise), noise, row


# Physics outside the library that needs no second joint.
ALONE = (
    "magnetic_saturation", "hum", "slosh", "snap_through", "back_emf_sag", "drive_dead_zone", "drifting_zero",
    "leaking_tank",
)  # fmt: skip


def _overlap(a: Concealment, b: Concealment) -> bool:
    """Whether two effects are special cases of one another at one joint: together they are one law."""
    if not set(a.joints) & set(b.joints):
        return False
    contains = {s: set(CATALOGUE[s].law.contains) if s in CATALOGUE else set() for s in (a.effect, b.effect)}
    return a.effect in contains[b.effect] or b.effect in contains[a.effect]


def judged(kind: Kind, seed: int) -> dict:
    """Make the case, diagnose it, and compare."""
    arm, case, noise, row = case_of(kind, seed)
    robot, recordings = arm.robot, list(case.recordings[:-1])
    start = time.monotonic()
    result = diagnose(robot, recordings)
    seconds = time.monotonic() - start
    d = result.diagnosis.to_json()
    record = {
        "seed": seed, "row": row, "joints_of_robot": robot.n, "truth": case.truth["effects"], "found": d["findings"],
        "verdict": d["verdict"], "unexplained": d["unexplained"], "fit": d["fit"], "oracle": None,
        "not_testable": d["not_testable"], **unseen_errors(result.model, case, noise), "seconds": seconds,
        "engine": study_provenance.commit(),
    }  # fmt: skip
    told = {e["effect"] for e in case.truth["effects"]} & set(CATALOGUE)
    # Beside them their special cases: an oracle without them would call dry friction asymmetric whatever the data say.
    told |= {special for slug in told for special in CATALOGUE[slug].law.contains}
    if told and (kind == "single" or trials_report.missed(record)):
        oracle = diagnose(robot, recordings, DiagnoseConfig(effects=tuple(CATALOGUE[s] for s in told)))
        said = oracle.diagnosis.to_json()
        record["oracle"] = {"fit": said["fit"], "found": said["findings"]}
    return record


def main() -> None:
    config = tyro.cli(Config)
    if not config.table:
        set_up_compilation_cache()
        config.out.mkdir(parents=True, exist_ok=True)
        path = config.out / f"trials_{config.kind}.jsonl"
        done = {json.loads(line)["seed"] for line in path.read_text().splitlines()} if path.exists() else set()
        for seed in range(config.first, config.last + 1):
            if seed in done:
                continue
            try:
                case = judged(config.kind, seed)
            except InputError as error:
                print(f"left out: {config.kind} {seed}: {error}", flush=True)
                continue
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
            print(trials_report.line_of(case), flush=True)
    trials_report.write(config.out)


if __name__ == "__main__":
    main()
