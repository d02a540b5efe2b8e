"""Kinds of friction to hide at a joint: those of the contract's names in another form, and those without a name.

Each kind takes the plant, sizes, random numbers, the joint and a torque [N m or N] that says how strong it shall be.
"""

import numpy as np

from testbed import friction
from testbed.motions import STEP
from testbed.plants import Hidden, Plant, Sizes, on

STILL = 0.003  # of a joint's usual speed, within which dry friction without a step changes its sign
SHARES = {"coulomb_friction": (0.05, 0.2), "viscous_friction": (0.03, 0.15)}  # of a joint's torque, where ordinary
ORDINARY = tuple(SHARES)


def coulomb(plant: Plant, sizes: Sizes, rng: np.random.Generator, j: int, torque: float, role: str = "special"):
    """Dry friction with a smooth turn."""
    still, form = sizes.qd[j] * 10.0 ** rng.uniform(-3.0, -2.0), str(rng.choice(["root", "arc"]))
    plant.laws.append(on(j, lambda m, load: friction.dry(m.qd[:, j], torque, still, form)))
    hide(plant, "coulomb", "coulomb_friction", j, {"coulomb": torque}, role=role)


def viscous(plant: Plant, sizes: Sizes, rng: np.random.Generator, j: int, torque: float, role: str = "special"):
    """Friction in proportion to speed, which has no other form; `shear_thinning` is one that bends."""
    slope = torque / sizes.qd[j]
    plant.laws.append(on(j, lambda m, load: slope * m.qd[:, j]))
    hide(plant, "viscous", "viscous_friction", j, {"viscous": slope}, role=role)


def asymmetric(plant, sizes, rng, j, torque):
    """Two levels, turned into each other smoothly."""
    more, still = rng.uniform(1.25, 2.0), STILL * sizes.qd[j]
    up, down = (torque, torque * more) if rng.random() < 0.5 else (torque * more, torque)

    def law(m, load):
        turn = friction.dry(m.qd[:, j], 1.0, still)
        return 0.5 * (up + down) * turn + 0.5 * (up - down) * turn**2

    plant.laws.append(on(j, law))
    hide(plant, "two levels", "asymmetric_friction", j, {"coulomb_pos": up, "coulomb_neg": down},
         accept=("torque_offset",), tolerate=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def stribeck(plant, sizes, rng, j, torque):
    """Hess and Soom's fall instead of a Gaussian one."""
    static, speed = torque * rng.uniform(1.4, 2.2), sizes.qd[j] * rng.uniform(0.05, 0.25)
    still = 0.1 * speed
    plant.laws.append(on(j, lambda m, load: friction.dry(
        m.qd[:, j], friction.falling(m.qd[:, j], torque, static, speed), still)))  # fmt: skip
    hide(plant, "Hess and Soom", "stribeck_friction", j, {"coulomb": torque, "static": static},
         tolerate=("coulomb_friction", "nonlinear_viscous_friction"), instead=("coulomb_friction",))  # fmt: skip


def shear_thinning(plant, sizes, rng, j, torque):
    """Eyring's lubricant, asinh of speed, which no power is."""
    speed = sizes.qd[j] * rng.uniform(0.05, 0.4)
    size = torque / np.arcsinh(sizes.qd[j] / speed)
    plant.laws.append(on(j, lambda m, load: size * np.arcsinh(m.qd[:, j] / speed)))
    hide(plant, "Eyring", "nonlinear_viscous_friction", j, {}, tolerate=ORDINARY, instead=("viscous_friction",))


def loaded(plant, sizes, rng, j, torque):
    """A gear that rubs by the root mean square of its own weight and of what it transmits."""
    mu, own = rng.uniform(0.04, 0.15), 0.1 * sizes.tau[j]
    still = STILL * sizes.qd[j]
    plant.laws.append(on(j, lambda m, load: friction.dry(
        m.qd[:, j], torque + mu * (np.sqrt(load**2 + own**2) - own), still)))  # fmt: skip
    hide(plant, "loaded gear", "load_dependent_friction", j, {"load_coefficient": mu}, tolerate=("coulomb_friction",),
         instead=("coulomb_friction",))  # fmt: skip


def warming(plant, sizes, rng, j, torque):
    """Viscosity that falls by its own heat."""
    cold, per_heat, time = torque / sizes.qd[j], rng.uniform(0.6, 1.5), rng.uniform(3.0, 12.0)
    plant.laws.append(on(j, lambda m, load: friction.heated(m.qd[:, j], STEP, cold, per_heat, time)))
    hide(plant, "heat", "thermal_friction_drift", j, {"viscous_cold": cold}, tolerate=("viscous_friction",),
         instead=("viscous_friction",))  # fmt: skip


def bump(plant, sizes, rng, j, torque):
    """A raised cosine of more friction around a place."""
    span = sizes.high[j] - sizes.low[j]
    centre, width = sizes.low[j] + span * rng.uniform(0.25, 0.75), span * rng.uniform(0.15, 0.35)
    depth, still = rng.uniform(0.6, 2.0), STILL * sizes.qd[j]

    def law(m, load):
        more = 0.5 + 0.5 * np.cos(np.pi * np.clip((m.q[:, j] - centre) / width, -1.0, 1.0))
        return friction.dry(m.qd[:, j], torque * (1.0 + depth * more), still)

    plant.laws.append(on(j, law))
    hide(plant, "bump", "position_dependent_friction", j, {"coulomb": torque, "depth": depth, "centre": centre},
         tolerate=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def springy(plant, sizes, rng, j, torque):
    """Dahl's bristles with his exponent at 1.5, soft enough to be seen."""
    stiffness = torque / ((sizes.high[j] - sizes.low[j]) * 10.0 ** rng.uniform(-2.3, -1.5))
    plant.laws.append(on(j, lambda m, load: friction.dahl(m.q[:, j], torque, stiffness, 1.5)))
    hide(plant, "Dahl 1.5", "presliding_hysteresis", j, {"coulomb": torque}, tolerate=("coulomb_friction",),
         instead=("coulomb_friction",))  # fmt: skip


def stiff_dahl(plant, sizes, rng, j, torque, travel: float = 0.0):
    """Dahl's own law with bristles that slip after a milliradian or less (of the range, for a slide)."""
    unit = (sizes.high[j] - sizes.low[j]) / 2.0 if plant.arm.slide[j] else 1.0
    stiffness = torque / ((travel or 10.0 ** rng.uniform(-3.7, -3.0)) * unit)
    plant.laws.append(on(j, lambda m, load: friction.dahl(m.q[:, j], torque, stiffness)))
    hide(plant, "stiff Dahl", "presliding_hysteresis", j, {"coulomb": torque, "stiffness": stiffness},
         accept=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def bristles(plant, sizes, rng, j, torque, travel: float = 0.0):
    """LuGre with a Stribeck level and bristles of a milliradian."""
    static, speed = torque * rng.uniform(1.0, 1.5), sizes.qd[j] * rng.uniform(0.03, 0.1)
    unit = (sizes.high[j] - sizes.low[j]) / 2.0 if plant.arm.slide[j] else 1.0
    stiffness = torque / ((travel or 10.0 ** rng.uniform(-3.3, -2.5)) * unit)
    damping = 0.2 * np.sqrt(stiffness * sizes.inertia[j])
    plant.laws.append(on(j, lambda m, load: friction.lugre(
        m.qd[:, j], STEP, friction.falling(m.qd[:, j], torque, static, speed), stiffness, damping)))  # fmt: skip
    hide(plant, "LuGre", "presliding_hysteresis", j, {"coulomb": torque}, accept=("coulomb_friction",
         "stribeck_friction"), instead=("coulomb_friction",))  # fmt: skip


def slipping(plant, sizes, rng, j, torque):
    """Generalised Maxwell slip of five elements."""
    static, speed = torque * rng.uniform(1.0, 1.4), sizes.qd[j] * rng.uniform(0.03, 0.1)
    shares = rng.dirichlet(np.full(5, 3.0))
    travel = (sizes.high[j] - sizes.low[j]) * 10.0 ** rng.uniform(-3.5, -1.8) * np.array([0.1, 0.3, 1.0, 2.0, 4.0])
    stiffness = torque * shares / travel
    plant.laws.append(on(j, lambda m, load: friction.maxwell_slip(
        m.q[:, j], friction.falling(m.qd[:, j], torque, static, speed), shares, stiffness)))  # fmt: skip
    hide(plant, "Maxwell slip", "presliding_hysteresis", j, {"coulomb": torque}, accept=("coulomb_friction",
         "stribeck_friction"), instead=("coulomb_friction",))  # fmt: skip


def gear_mesh(plant, sizes, rng, j, torque):
    """Friction whose level is a random curve of position."""
    x, y = friction.curve(rng, sizes.low[j] - 0.2, sizes.high[j] + 0.2, rng.uniform(0.3, 1.2))
    depth, still = rng.uniform(0.15, 0.4), STILL * sizes.qd[j]
    plant.laws.append(on(j, lambda m, load: friction.dry(
        m.qd[:, j], torque * np.maximum(1.0 + depth * np.interp(m.q[:, j], x, y), 0.1), still)))  # fmt: skip
    hide(plant, "gear mesh", None, j, {}, accept=("position_dependent_friction", "torque_ripple"), unnamed=True,
         tolerate=("coulomb_friction",), instead=("coulomb_friction",), depends=("position",))  # fmt: skip


def by_the_day(plant, sizes, rng, j, torque, factors=None):
    """Coulomb and viscous friction that differ from recording to recording by a common factor."""
    by = np.exp(0.3 * rng.normal(size=8)) if factors is None else np.asarray(factors)
    still, slope = STILL * sizes.qd[j], 0.7 * torque / sizes.qd[j]
    plant.laws.append(on(j, lambda m, load: by[m.number % len(by)] * (
        friction.dry(m.qd[:, j], torque, still) + slope * m.qd[:, j])))  # fmt: skip
    mean = float(np.mean(by[: len({m.number for m in sizes.motions})]))
    for slug, name, value in (("coulomb_friction", "coulomb", torque), ("viscous_friction", "viscous", slope)):
        hide(plant, "by the day", slug, j, {name: value * mean}, instead=(slug,))


def hide(plant: Plant, kind: str, slug: str | None, j: int, parameters: dict[str, float], *, accept=(), tolerate=(),
         role: str = "special", unnamed: bool = False, instead=(), depends=()) -> None:  # fmt: skip
    """Write down the truth, and which ordinary friction it stands for."""
    accept = ((slug,) if slug else ()) + tuple(accept)
    values = {name: float(value) for name, value in parameters.items()}
    plant.hidden.append(Hidden(kind, slug, (j,), values, accept, tuple(tolerate), role, unnamed, tuple(depends)))
    for other in (*instead, *((slug,) if slug in ORDINARY else ())):
        plant.taken.setdefault(other, set()).add(j)


def rubbed(plant: Plant, sizes: Sizes, rng: np.random.Generator) -> None:
    """Ordinary friction on every joint where nothing stands for it."""
    for (slug, (low, high)), law in zip(SHARES.items(), (coulomb, viscous), strict=True):
        for j in range(plant.arm.n):
            share = rng.uniform(low, high)
            if j not in plant.taken.get(slug, ()):
                law(plant, sizes, rng, j, share * sizes.tau[j], role="ordinary")
