"""Kinds of physics outside the mixture of the other draws, most of them without a name; see `rubbing` for arguments.

Of those without a name it is right to say that something is left, or a name alike, at the joints that carry them: a
name that says something else is false.
"""

import numpy as np

from testbed import friction, rigid, surroundings
from testbed.motions import STEP
from testbed.plants import Hidden, Plant, Sizes, on
from testbed.rubbing import ORDINARY, STILL, hide


def crosstalk(plant: Plant, sizes: Sizes, rng: np.random.Generator, j: int, torque: float) -> None:
    """A torque sensor that also feels another joint's torque."""
    k = _another(plant, rng, j)
    share = rng.choice([-1.0, 1.0]) * torque / sizes.tau[k]

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] += share * tau[:, k]
        return tau

    plant.drives.append(drive)
    _nameless(plant, "crosstalk", j, f"of {plant.nominal.names[k]}")


def worm(plant, sizes, rng, j, torque):
    """A gear that loses more of the power when it is driven than when the load drives it back."""
    forth, back = rng.uniform(0.1, 0.25), rng.uniform(0.02, 0.08)
    still = STILL * sizes.qd[j]

    def law(m, load):
        way = friction.dry(m.qd[:, j], 1.0, still)
        return np.where(load * way > 0.0, forth, back) * np.abs(load) * way

    plant.laws.append(on(j, law))
    _nameless(plant, "worm", j, "load", ("load_dependent_friction",), ("coulomb_friction", "torque_gain"))


def eccentric_encoder(plant, sizes, rng, j, torque):
    """A position that is read with one wave a turn of an encoder that turns a few times faster than the joint."""
    turns, phase = float(rng.integers(1, 6)), rng.uniform(0.0, 6.28)
    size = rng.uniform(0.002, 0.01) * (0.2 if plant.arm.slide[j] else 1.0) / turns
    plant.misread[j] = lambda q: size * np.sin(turns * q + phase)
    # A hundredth of a joint's speed and of the slope of gravity may drown in what the inertials are unsure by.
    plant.hidden.append(Hidden("eccentric encoder", None, (j,), {}, ("encoder_offset",), (), "instrument", True,
                               ("position",)))  # fmt: skip


def dry_coupling(plant, sizes, rng, j, torque):
    """Dry friction on the speed of two joints against each other."""
    k = _another(plant, rng, j)
    way, still = float(rng.choice([-1.0, 1.0])), STILL * float(np.hypot(sizes.qd[j], sizes.qd[k]))

    def law(m, load):
        rub, tau = friction.dry(m.qd[:, j] + way * m.qd[:, k], torque, still), np.zeros_like(m.q)
        tau[:, j], tau[:, k] = rub, way * rub
        return tau

    plant.laws.append(law)
    either = tuple(f"of {plant.nominal.names[i]}" for i in (j, k))
    plant.hidden.append(Hidden("dry coupling", None, tuple(sorted((j, k))), {}, ("transmission_coupling",), ORDINARY,
                               "special", True, either))  # fmt: skip


def sagging_motor(plant, sizes, rng, j, torque):
    """A drive that needs more current for the same torque as its speed grows."""
    loss = 3.0 * torque / sizes.tau[j] / (sizes.qd[j] / np.sqrt(0.5))

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] *= 1.0 + loss * np.abs(m.qd[:, j])
        return tau

    plant.drives.append(drive)
    _nameless(plant, "sagging motor", j, "load and speed", ("torque_gain",), ORDINARY)


def hose(plant, sizes, rng, j, torque):
    """A hose that pulls back and gives way within seconds: a spring and a damper in a row."""
    time, stiffness = rng.uniform(0.5, 4.0), 2.0 * torque / (0.3 * (sizes.high[j] - sizes.low[j]))
    keep = np.exp(-STEP / time)
    plant.laws.append(on(j, lambda m, load: stiffness * friction.recurrence(
        np.full(len(m.q), keep), np.diff(m.q[:, j], prepend=m.q[:1, j]))))  # fmt: skip
    _nameless(plant, "hose", j, "past", ("gravity_spring",), ("viscous_friction", "torque_offset"))


def rubbing_hose(plant, sizes, rng, j, torque):
    """A dress pack whose friction follows over a fifth of the range: a wide loop over position."""
    stiffness = torque / (rng.uniform(0.1, 0.3) * (sizes.high[j] - sizes.low[j]))
    plant.laws.append(on(j, lambda m, load: friction.dahl(m.q[:, j], torque, stiffness)))
    _nameless(plant, "rubbing hose", j, "past", ("presliding_hysteresis",),
              ("gravity_spring", "coulomb_friction", "torque_offset"))  # fmt: skip


def late_brake(plant, sizes, rng, j, torque):
    """A brake that goes on rubbing for the first seconds of each recording."""
    end, still = rng.uniform(2.0, 6.0), STILL * sizes.qd[j]
    fading = lambda t: 1.0 / (1.0 + np.exp((t - end) / 0.1))  # noqa: E731
    plant.laws.append(on(j, lambda m, load: friction.dry(m.qd[:, j], 2.0 * torque * fading(m.t), still)))
    _nameless(plant, "late brake", j, "time", ("thermal_friction_drift",), ("coulomb_friction",))


def led_cable(plant, sizes, rng, j, torque):
    """Dry friction of one joint that depends on where another stands."""
    k, still = _another(plant, rng, j), STILL * sizes.qd[j]
    span, phase = sizes.high[k] - sizes.low[k], rng.uniform(0.0, 6.28)
    level = lambda q: torque * (1.0 + 0.9 * np.sin(2.0 * np.pi * q[:, k] / span + phase))  # noqa: E731
    plant.laws.append(on(j, lambda m, load: friction.dry(m.qd[:, j], level(m.q), still)))
    _nameless(plant, "led cable", j, f"of {plant.nominal.names[k]}", (), ("coulomb_friction",))


def warm_magnets(plant, sizes, rng, j, torque):
    """A torque constant that falls as the motor warms up."""
    fall, time = 3.0 * torque / sizes.tau[j], rng.uniform(3.0, 10.0)

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] *= 1.0 + fall * (1.0 - np.exp(-m.t / time))
        return tau

    plant.drives.append(drive)
    _nameless(plant, "warm magnets", j, "time", ("torque_gain",), ORDINARY)


def latch(plant, sizes, rng, j, torque):
    """A magnet that holds the joint at one place: a pull and a push beside each other."""
    wide = rng.uniform(0.02, 0.06) * (sizes.high[j] - sizes.low[j])
    at = rng.uniform(0.7 * sizes.low[j] + 0.3 * sizes.high[j], 0.3 * sizes.low[j] + 0.7 * sizes.high[j])
    x = lambda m: (m.q[:, j] - at) / wide  # noqa: E731
    plant.laws.append(on(j, lambda m, load: 5.0 * torque * x(m) * np.exp(0.5 - 0.5 * x(m) ** 2)))
    _nameless(plant, "latch", j, "position")


def air_drag(plant, sizes, rng, j, torque):
    """A fan on the joint: the square of its speed."""
    size = torque / sizes.qd[j] ** 2
    plant.laws.append(on(j, lambda m, load: size * m.qd[:, j] * np.abs(m.qd[:, j])))
    hide(plant, "air drag", "nonlinear_viscous_friction", j, {"coefficient": size, "exponent": 2.0}, tolerate=ORDINARY,
         instead=("viscous_friction",))  # fmt: skip


def wandering_sensor(plant, sizes, rng, j, torque):
    """A torque sensor whose zero wanders: an Ornstein-Uhlenbeck process of 3 to 15 s, another one each recording."""
    time, seed = rng.uniform(3.0, 15.0), int(rng.integers(2**31))
    keep = np.exp(-STEP / time)

    def law(m, load):
        steps = np.random.default_rng([seed, m.number]).normal(size=len(m.t)) * np.sqrt(1.0 - keep**2)
        start = np.random.default_rng([seed, m.number, 1]).normal()
        return torque * (friction.recurrence(np.full(len(m.t), keep), steps) + start * keep ** np.arange(len(m.t)))

    plant.laws.append(on(j, law))
    _nameless(plant, "wandering sensor", j, "time", ("torque_offset",), ("thermal_friction_drift",))


def coarse_drive(plant, sizes, rng, j, torque):
    """A drive that logs no current below a threshold."""
    least = 2.0 * torque

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] = np.where(np.abs(tau[:, j]) < least, 0.0, tau[:, j])
        return tau

    plant.drives.append(drive)
    _nameless(plant, "coarse drive", j, "load")


def hanging_load(plant, sizes, rng, j, torque):
    """A load that hangs from the tool on a rope: its weight, and its pull sideways as it swings in small angles."""
    mass, length, loss = plant.nominal.mass[-1] * rng.uniform(0.5, 2.0), rng.uniform(0.15, 0.6), rng.uniform(0.02, 0.1)
    rate = np.sqrt(9.81 / length)

    def law(m, load):
        x, reach = rigid.tool(plant.arm, m.q)
        at, speed, pull = x[0, :2].copy(), np.zeros(2), np.empty((len(x), 2))
        for i, target in enumerate(x[:, :2]):
            pull[i] = rate**2 * (at - target)
            speed = speed - STEP * (pull[i] + 2.0 * loss * rate * speed)
            at = at + STEP * speed
        force = mass * np.column_stack([pull, np.full(len(x), -9.81)])
        return -np.einsum("ti,tin->tn", force, reach)

    plant.laws.append(law)
    plant.hidden.append(Hidden("hanging load", None, tuple(range(plant.arm.n)), {"mass": mass}, ("payload",),
                               ("external_wrench",), "special", True, ("past", "of ")))  # fmt: skip


def soft_wall(plant, sizes, rng, j, torque):
    """A foam that the joint is pressed into on both ends of its range, which pushes back less on the way out."""
    room = rng.uniform(0.1, 0.25) * (sizes.high[j] - sizes.low[j])
    plant.laws.append(on(j, lambda m, load: 8.0 * torque * surroundings.foam(
        m.q[:, j], m.qd[:, j], sizes.low[j] + room, sizes.high[j] - room, room)))  # fmt: skip
    _nameless(plant, "foam", j, "position", ("contact",), ("gravity_spring", "position_dependent_friction"))


def _another(plant: Plant, rng: np.random.Generator, j: int) -> int:
    """A neighbour of a joint that moves as it does, or any other joint."""
    others = [k for k in range(plant.arm.n) if k != j and plant.arm.slide[k] == plant.arm.slide[j]]
    others = others or [k for k in range(plant.arm.n) if k != j]
    return int(rng.choice([k for k in others if abs(k - j) == 1] or others))


def _nameless(plant: Plant, kind: str, j: int, depends: str, accept=(), tolerate=()) -> None:
    hide(plant, kind, None, j, {}, accept=accept, tolerate=tolerate, unnamed=True, depends=(depends,))


KINDS = {
    "crosstalk": crosstalk, "worm": worm, "eccentric_encoder": eccentric_encoder, "dry_coupling": dry_coupling,
    "sagging_motor": sagging_motor, "hose": hose, "rubbing_hose": rubbing_hose, "late_brake": late_brake,
    "led_cable": led_cable, "warm_magnets": warm_magnets, "latch": latch, "air_drag": air_drag,
    "wandering_sensor": wandering_sensor, "coarse_drive": coarse_drive, "hanging_load": hanging_load,
    "soft_wall": soft_wall,
}  # fmt: skip
