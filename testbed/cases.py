"""Cases: a model, recordings of a plant that differs from it, unseen motions, and the truth.

    case = make("work", 17)          # always the same
    case.xml, case.recordings, case.held_out, case.truth
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from testbed import leaving_out, outside, rubbing
from testbed.arms import built, irb140, random_arm
from testbed.loggers import Logger, logged, random_logger
from testbed.motions import PROGRAMMES, Motion, programme
from testbed.plants import Plant, Sizes, channels, sizes_of
from testbed.seeds import generator

Kind = Callable[[Plant, Sizes, np.random.Generator, int, float], None]

# The contract's vocabulary by laws of another form, and what it has no word for.
NAMED: dict[str, Kind] = {
    "asymmetric_friction": rubbing.asymmetric, "stribeck_friction": rubbing.stribeck,
    "nonlinear_viscous_friction": rubbing.shear_thinning, "load_dependent_friction": rubbing.loaded,
    "thermal_friction_drift": rubbing.warming, "presliding_hysteresis": rubbing.springy,
    "position_dependent_friction": rubbing.bump, "rotor_inertia": leaving_out.rotor, "torque_gain": leaving_out.gain,
    "torque_offset": leaving_out.offset, "torque_ripple": leaving_out.cogging, "actuator_lag": leaving_out.lag,
    "time_delay": leaving_out.delay, "joint_elasticity": leaving_out.elasticity, "backlash": leaving_out.play,
    "transmission_coupling": leaving_out.coupling, "gravity_spring": leaving_out.counterbalance,
    "gravity_tilt": leaving_out.tilt, "payload": leaving_out.payload, "encoder_offset": leaving_out.zero,
    "contact": leaving_out.wall, "external_wrench": leaving_out.push,
}  # fmt: skip
OTHER: dict[str, Kind] = {
    "lugre": rubbing.bristles, "maxwell_slip": rubbing.slipping, "stiff_dahl": rubbing.stiff_dahl,
    "gear_mesh": rubbing.gear_mesh, "by_the_day": rubbing.by_the_day, "hardening_spring": leaving_out.hardening_spring,
    "all_constants": leaving_out.all_constants, "two_constants": leaving_out.two_constants, "skew": leaving_out.skew,
    "current_loop": leaving_out.current_loop, "geometry": leaving_out.geometry, "dead": leaving_out.dead,
    "slow_filter": leaving_out.slow_filter,
}  # fmt: skip
KINDS = NAMED | OTHER | outside.KINDS
# Whole-machine frictions: the same odd law at every joint, as machines have it.
EVERY_JOINT = ("lugre", "maxwell_slip", "stiff_dahl", "by_the_day", "gear_mesh")
SCALES = ("torque constant", "saturating motor", "sagging motor", "warm magnets")
# One pass of the mixture; a draw shuffles each pass, so that any stretch of indices holds about these shares.
PASS = (*NAMED, *OTHER, "lugre", "stiff_dahl", "by_the_day", "all_constants", *("ordinary",) * 6, *("nothing",) * 5)
OUTSIDE = tuple(outside.KINDS)
ERRORS = (0.05,) * 8 + (0.02, 0.1, 0.2, 0.3)  # true relative errors of inertials; the stated one is always 5 %
STATED = 0.05
SECONDS = (12.0, 20.0)


@dataclasses.dataclass(frozen=True)
class Case:
    """What a diagnosis is given, and what it is judged by.

    Attributes:
        draw, index: Which case.
        xml: MJCF text of the nominal model.
        joint_names: Of its joints.
        recordings: What `logged` returns of each motion.
        held_out: The same of motions that no diagnosis sees; `tau` is there without noise, too.
        truth: See `truth_of`.
        hidden: Kinds that were drawn.
        plant: What was recorded, along motions.
        motions: Those.
        prescribed: Whether the plant followed them exactly, so that its torque along any path is known.
    """

    draw: str
    index: int
    xml: str
    joint_names: tuple[str, ...]
    recordings: list[dict[str, np.ndarray]]
    held_out: list[dict[str, np.ndarray]]
    truth: dict[str, Any]
    hidden: tuple[str, ...]
    plant: Plant
    motions: tuple[Motion, ...]
    prescribed: bool = True


def kinds_of(draw: str, index: int, commit: str = "", mixture: tuple[str, ...] = PASS) -> tuple[str, ...]:
    """What a case hides: one kind of a shuffled pass of the mixture, and in `PASS` one more in every sixth case."""
    order = generator(draw, index // len(mixture), "pass", commit).permutation(len(mixture))
    first = mixture[order[index % len(mixture)]]
    rng = generator(draw, index, "second", commit)
    if mixture is not PASS or first in ("ordinary", "nothing") or rng.random() > 1.0 / 6.0:
        return (first,)
    second = str(rng.choice([k for k in NAMED if k != first]))
    two_masses = {"joint_elasticity", "backlash"}  # a plant has room for one flexible joint
    return (first,) if {first, second} == two_masses else (first, second)


@dataclasses.dataclass(frozen=True)
class Variation:
    """The same case under other conditions, for sweeps.

    Attributes:
        noise: Factor on the noise and the steps of the sensors.
        longer: Factor on the length of the recordings.
        error: True relative error of the inertials in place of the one that was drawn.
    """

    noise: float = 1.0
    longer: float = 1.0
    error: float | None = None


def make(
    draw: str, index: int, commit: str = "", vary: Variation = Variation(), mixture: tuple[str, ...] = PASS  # noqa: B008
) -> Case:
    """A case: a pure function of its draw and its index.

    Args:
        draw: "work", "check" or "final".
        index: 0, 1, 2, ...
        commit: Seeds "final".
        vary: Conditions other than those drawn.
        mixture: What may be hidden: `PASS`, or `OUTSIDE` for what it does not have, most of it without a name.
    """
    rng, moving, logging = (generator(draw, index, stream, commit) for stream in ("plant", "motions", "logger"))
    kinds = kinds_of(draw, index, commit, mixture)
    nominal = irb140() if rng.random() < 0.4 else random_arm(rng, int(rng.integers(2, 8)))
    drawn, name = float(rng.choice(ERRORS)), str(rng.choice(list(PROGRAMMES), p=(0.2, 0.5, 0.15, 0.15)))
    error = drawn if vary.error is None else vary.error
    unseen = [dataclasses.replace(m, number=100) for m in programme(nominal, moving, "fourier", 8.0)[:1]]
    motions = programme(nominal, moving, name, moving.uniform(*SECONDS) * vary.longer)
    plant, sizes = Plant(nominal, built(nominal, rng, error)), sizes_of(nominal, motions)
    strength: dict[str, float] = {}
    for kind in kinds:
        if kind in KINDS:
            strength[kind] = put_in(kind, plant, sizes, rng)
    if kinds != ("nothing",) and (kinds[0] == "ordinary" or rng.random() < 0.9):
        rubbing.rubbed(plant, sizes, rng)
    logger = random_logger(logging, nominal.slide, sizes.tau)
    logger = dataclasses.replace(logger, noise=vary.noise * logger.noise, steps=vary.noise * logger.steps)
    setting = {"inertial_error": error, "stated_error": STATED, "programme": name, "strength": strength}
    return assembled(draw, index, kinds, plant, sizes, motions, unseen, logger, logging, setting)


def put_in(kind: str, plant: Plant, sizes: Sizes, rng: np.random.Generator) -> float:
    """Hide a kind, at one free joint or at every one, and say how strong it is, in shares of the joint's torque."""
    strength = 10.0 ** rng.uniform(-1.5, -0.6)
    used = {h.joints[0] for h in plant.hidden if len(h.joints) == 1}
    free = [j for j in range(plant.arm.n) if j not in used]  # two laws on one joint would share parameters
    joints = free if kind in EVERY_JOINT and rng.random() < 0.6 else free and [int(rng.choice(free))]
    for j in joints:
        KINDS[kind](plant, sizes, rng, j, strength * float(sizes.tau[j]))
    return strength


def assembled(
    draw: str, index: int, kinds: tuple[str, ...], plant: Plant, sizes: Sizes, motions: list[Motion],
    unseen: list[Motion], logger: Logger, rng: np.random.Generator, setting: dict[str, Any],
) -> Case:  # fmt: skip
    """Recordings of a plant and the truth about it."""

    def record(motion: Motion) -> dict[str, np.ndarray]:
        q, tau = channels(plant, motion)
        return logged(logger, rng, motion.t, q, motion.qd, tau)

    recordings = [record(m) for m in motions]
    held_out = [record(m) for m in unseen]
    held_out = [r | {"tau": r["tau_true"]} for r in held_out]
    for r in recordings:
        for j in plant.dead:
            r["tau"][:, j] = np.round(r["tau_true"][:, j], 6)  # a dead channel has no noise either
    truth = truth_of(plant, sizes, logger) | setting
    return Case(draw, index, plant.nominal.xml, plant.nominal.names, recordings, held_out, truth, kinds, plant,
                tuple(motions))  # fmt: skip


def truth_of(plant: Plant, sizes: Sizes, logger: Logger) -> dict[str, Any]:
    """The truth in words and numbers that fit into JSON.

    Returns:
        hidden: A list of `Hidden` by field, joints by name.
        sensor_noise: Standard deviation of each logged torque about the true one.
        torque: RMS of each joint's rigid-body torque.
        rate, jitter, encoder: Of the logger.
        dead: Joints whose torque channel shows nothing.
    """
    names = plant.nominal.names
    scaled = {j for h in plant.hidden if h.kind in SCALES for j in h.joints}
    hidden = [dataclasses.asdict(h) | {"joints": [names[j] for j in h.joints]} for h in plant.hidden]
    for entry, h in zip(hidden, plant.hidden, strict=True):
        if h.kind not in SCALES and scaled & set(h.joints):
            entry["parameters"] = {}  # in which torque they are to be stated, the real or the logged one, is open
    return {
        "hidden": hidden, "sensor_noise": dict(zip(names, logger.sensor_noise.tolist(), strict=True)),
        "torque": dict(zip(names, sizes.tau.tolist(), strict=True)), "rate": logger.rate, "jitter": logger.jitter,
        "encoder": logger.counts.tolist(), "dead": [names[j] for j in plant.dead],
    }  # fmt: skip

