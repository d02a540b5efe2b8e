"""The readings of the study's swarms: every choice that its text leaves open, as a value to be tried."""

import dataclasses
import itertools
import math
from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np
from study_arm import StudyArm

from irb140_jax import identify, swarm

# What the text states: Table 3's mean absolute percentage errors, section 3's fitness and figure 8's plateau.
PUBLISHED = {
    "pso": {"com": 2.94, "inertia": 4.66, "fitness": 2.09, "fitness_sd": 0.901, "plateau": 27},
    "qpso": {"com": 0.43, "inertia": 0.76, "fitness": 1.02, "fitness_sd": 0.923},
}
PARTICLES, ITERATIONS, SEEDS = 120, 150, 30
C1, C2 = 2.5, 1.5

INERTIA = {
    "w 0.99": swarm.constant(0.99),
    "w 0.99 to 0.4": swarm.linear(0.99, 0.4),
    "w 1 x 0.99^t": swarm.damped(1.0, 0.99),
}
PENALTY = {
    "t/T": identify.Penalty(weight=1.0),
    "none": identify.Penalty(weight=0.0),
    "100 t/T": identify.Penalty(weight=100.0),
    "(1 + t/T)^2": identify.Penalty(weight=1.0, offset=1.0, power=2.0),
    "10^(t/T)": identify.Penalty(weight=1.0, power=0.0, ratio=10.0),
    "t/T, absolute": identify.Penalty(weight=1.0, violation="absolute"),
}
DECODE = {"D1": swarm.Amplitude(), "D2": swarm.Bits(1), "D3, 8 bits": swarm.Bits(8), "D3, 12 bits": swarm.Bits(12)}
# Bits that choose: between two sides of the own best, or between the own best and the best of all.
CHOOSING = {"D4, one attractor": False, "D4, two attractors": True}
PERTURBATION = 0.05  # [rad]
START_SPEEDS = (0.1, 0.5, 1.0)  # Algorithm 1 begins with random velocities and does not say how large
OTHER_BOXES = range(1, 11)
LIMITS = (math.inf, 0.5, 0.2, 0.1, 0.05, 0.02)
OTHERS = {
    "constricted": swarm.ConstrictedPso(),
    "delta well": swarm.DeltaWellQpso(),
    "adaptive attractor": swarm.AdaptiveAttractorQpso(),
    "self tuning": swarm.SelfTuningQpso(),
    "noise resilient": swarm.NoiseResilientQpso(),
}


@dataclasses.dataclass(frozen=True)
class Reading:
    """One way to read the text.

    Attributes:
        algorithm: "pso", "qpso" (angles of qubits), or one of `OTHERS`.
        inertia: One of `INERTIA`.
        velocity_limit: Fraction of the box for PSO, rad for angles.
        walls: Whether positions are clamped to the box, angles to [0, pi/2].
        decode: One of `DECODE` or of `CHOOSING`.
        collapse: Whether bests are kept as measured bits.
        perturbed: Whether stagnation is answered by a perturbation.
        units: Of equation 20.
        width: Half of the box's width, as a fraction of the reference.
        place: Where the reference lies in the box: "centre", or "anywhere".
        penalty: One of `PENALTY`.
        start_speed: Largest speed of PSO's particles at the start, as a fraction of the box.
        perturbation: Largest size of an angle's perturbation [rad].
        box: Which draw of "anywhere"; 0 in all readings, others to see what the draw does.
    """

    algorithm: str
    inertia: str = "w 0.99"
    velocity_limit: float = math.inf
    walls: bool = True
    decode: str = "D1"
    collapse: bool = False
    perturbed: bool = True
    units: identify.Units = "normalised"
    width: float = 0.5
    place: str = "centre"
    penalty: str = "t/T"
    start_speed: float = 0.0
    perturbation: float = PERTURBATION
    box: int = 0

    @property
    def family(self) -> str:
        """Which published row it stands for."""
        return self.algorithm if self.algorithm in ("pso", "qpso") else "other"

    @property
    def problem(self) -> tuple:
        """What two algorithms compared with each other must share."""
        return self.inertia, self.units, self.width, self.place, self.penalty, self.box

    def __str__(self) -> str:
        parts = [self.algorithm]
        if self.family == "qpso":
            parts += [self.decode + (" collapsed" if self.collapse else "")]
        if self.family != "other":
            limit = "no v limit" if math.isinf(self.velocity_limit) else f"v <= {self.velocity_limit:g}"
            parts += [self.inertia, limit, "walls" if self.walls else "free"]
        if self.family == "qpso":
            parts += ["perturbed" if self.perturbed else "not perturbed"]
        parts += [self.units, f"box {100 * self.width:g} %", self.place]
        parts += [f"penalty {self.penalty}"] * (self.penalty != "t/T")
        parts += [f"start v <= {self.start_speed:g}"] * (self.start_speed > 0.0)
        parts += [f"perturbation {self.perturbation:g}"] * (self.perturbation != PERTURBATION)
        return ", ".join(parts + [f"other box {self.box}"] * (self.box > 0))


def rule(reading: Reading) -> swarm.Rule:
    """The update rule of a reading."""
    if reading.family == "other":
        return OTHERS[reading.algorithm]
    common = {"inertia": INERTIA[reading.inertia], "c1": C1, "c2": C2, "velocity_limit": reading.velocity_limit}
    if reading.algorithm == "pso":
        return swarm.Pso(**common, outside=0.0 if reading.walls else math.inf, start_speed=reading.start_speed)
    if reading.decode in CHOOSING:
        return swarm.TwoAttractorsQpso(**common, both=CHOOSING[reading.decode])
    lowest, highest = (0.0, 0.5 * math.pi) if reading.walls else (-math.inf, math.inf)
    patience = 10.0 if reading.perturbed else math.inf
    return swarm.QubitPso(
        **common, decode=DECODE[reading.decode], collapse=reading.collapse, lowest=lowest, highest=highest,
        patience=patience, perturbation=reading.perturbation,
    )  # fmt: skip


def objective(reading: Reading, arm: StudyArm) -> identify.ParameterDistance:
    """Equation 20 over the arm's unknowns as the reading has it, box included."""
    d = arm.x.shape[0]
    place = 0.5 if reading.place == "centre" else jnp.asarray(np.random.default_rng(reading.box).uniform(size=d))
    return arm.unknowns.distance(reading.width, place=place, units=reading.units, penalty=PENALTY[reading.penalty])


def all_readings() -> Iterator[Reading]:
    """Every reading that is tried, each once."""
    parts = (_pso(), _angles(), _bits(), _penalties(), _others(), _starts(), _thrown(), _choosing())
    return iter(dict.fromkeys(itertools.chain(*parts)))


def usual_readings() -> Iterator[Reading]:
    """Those of one problem, a box of 50 % whose middle is not the answer, without bits: enough for another arm."""
    usual = Reading("pso", place="anywhere")
    for reading in all_readings():
        told = dataclasses.replace(reading, algorithm="pso", inertia=usual.inertia, velocity_limit=usual.velocity_limit,
                                   walls=True, perturbed=True)  # fmt: skip
        if told == usual:
            yield reading


def literal_readings() -> Iterator[Reading]:
    """What the text says and no more: w 0.99, no velocity limit; in the box of 50 % that is ours, as it names none."""
    for reading in all_readings():
        named = (reading.inertia, reading.velocity_limit, reading.units, reading.width, reading.penalty)
        of_text = reading.family in PUBLISHED and reading.decode == "D1" and reading.perturbation == PERTURBATION
        if of_text and named == ("w 0.99", math.inf, "normalised", 0.5, "t/T"):
            yield reading


def in_other_boxes(reading: Reading) -> list[Reading]:
    """The same with other draws of where the reference lies in its box."""
    return [dataclasses.replace(reading, place="anywhere", box=box) for box in OTHER_BOXES]


def _problems(units: tuple[identify.Units, ...] = ("normalised", "si", "mm")) -> Iterator[dict]:
    for unit in units:
        # MAPE is proportional to the width where the objective is normalised; two widths show what units change.
        for width in (0.1, 0.2, 0.5, 1.0) if unit == "normalised" else (0.2, 0.5):
            for place in ("centre", "anywhere"):
                yield {"units": unit, "width": width, "place": place}


def _pso() -> Iterator[Reading]:
    for problem, inertia, limit, walls in itertools.product(_problems(), INERTIA, LIMITS, (True, False)):
        yield Reading("pso", inertia, limit, walls, **problem)


def _angles() -> Iterator[Reading]:
    choices = itertools.product(_problems(), INERTIA, LIMITS, (True, False), (True, False))
    for problem, inertia, limit, walls, perturbed in choices:
        yield Reading("qpso", inertia, limit, walls, "D1", perturbed=perturbed, **problem)


def _bits() -> Iterator[Reading]:
    choices = itertools.product(("D2", "D3, 8 bits", "D3, 12 bits"), INERTIA, LIMITS, (True, False), (True, False))
    for decode, inertia, limit, walls, collapse in choices:
        for place in ("centre", "anywhere"):
            yield Reading("qpso", inertia, limit, walls, decode, collapse, place=place)
    for unit, width in itertools.product(("normalised", "si", "mm"), (0.2, 0.5)):
        for limit in (0.5, 0.2):
            yield Reading("qpso", "w 0.99 to 0.4", limit, False, "D3, 12 bits", True, units=unit, width=width)


def _penalties() -> Iterator[Reading]:
    for penalty, inertia, limit in itertools.product(PENALTY, INERTIA, (math.inf, 0.1)):
        yield Reading("pso", inertia, limit, walls=False, penalty=penalty)


def _others() -> Iterator[Reading]:
    for name, problem in itertools.product(OTHERS, _problems()):
        yield Reading(name, **problem)


def _starts() -> Iterator[Reading]:
    for speed, inertia, limit, walls in itertools.product(START_SPEEDS, INERTIA, LIMITS, (True, False)):
        for place in ("centre", "anywhere"):
            yield Reading("pso", inertia, limit, walls, place=place, start_speed=speed)


def _thrown() -> Iterator[Reading]:
    for size, inertia, limit in itertools.product((0.01, 0.2, 0.5), INERTIA, LIMITS):
        for place in ("centre", "anywhere"):
            yield Reading("qpso", inertia, limit, place=place, perturbation=size)


def _choosing() -> Iterator[Reading]:
    for decode, inertia, limit in itertools.product(CHOOSING, INERTIA, LIMITS):
        for place in ("centre", "anywhere"):
            yield Reading("qpso", inertia, limit, True, decode, perturbed=False, place=place)
