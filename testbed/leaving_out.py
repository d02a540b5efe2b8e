"""Kinds of physics beside friction to hide: on the arm, in its drives, in its log; see `rubbing` for the arguments."""

import dataclasses

import numpy as np

from testbed import arms, drives, friction, rigid, surroundings
from testbed.flexible import Transmission
from testbed.motions import STEP
from testbed.plants import Hidden, Plant, Sizes, on
from testbed.rubbing import hide


def rotor(plant: Plant, sizes: Sizes, rng: np.random.Generator, j: int, torque: float) -> None:
    """The inertia of a drive that the model does not know."""
    inertia = max(torque / sizes.qdd[j], 0.1 * sizes.inertia[j])
    plant.arm = dataclasses.replace(plant.arm, rotor=plant.arm.rotor + inertia * np.eye(plant.arm.n)[j])
    hide(plant, "rotor", "rotor_inertia", j, {"inertia": inertia})


def offset(plant, sizes, rng, j, torque):
    """A torque of the drive that settles from 2 % more in ten seconds."""
    sign = rng.choice([-1.0, 1.0])
    plant.laws.append(on(j, lambda m, load: sign * torque * (1.0 + 0.02 * np.exp(-m.t / 10.0))))
    hide(plant, "drive offset", "torque_offset", j, {"offset": sign * torque}, accept=("asymmetric_friction",))


def cogging(plant, sizes, rng, j, torque):
    """Teeth of a motor: a sine and a tenth of its second harmonic."""
    span = sizes.high[j] - sizes.low[j]
    cycles, phase = 10.0 ** rng.uniform(0.6, 1.6) / span, rng.uniform(0.0, 6.28)

    def law(m, load):
        angle = 2.0 * np.pi * cycles * m.q[:, j] + phase
        return torque * (np.sin(angle) + 0.1 * np.sin(2.0 * angle + 1.0))

    plant.laws.append(on(j, law))
    hide(plant, "cogging", "torque_ripple", j, {"amplitude": torque, "cycles_per_rad": cycles})


def counterbalance(plant, sizes, rng, j, torque):
    """A spring whose slope grows by a few per cent over the range."""
    spread = 0.3 * (sizes.high[j] - sizes.low[j])
    stiffness, rest = torque / spread, rng.uniform(sizes.low[j], sizes.high[j])
    plant.laws.append(on(j, lambda m, load: stiffness * 3 * spread * np.sinh((m.q[:, j] - rest) / (3 * spread))))
    hide(plant, "counterbalance", "gravity_spring", j, {"rest": rest}, tolerate=("torque_offset",))


def hardening_spring(plant, sizes, rng, j, torque):
    """A spring with a strong cube, for which there is no name of its own."""
    spread = 0.3 * (sizes.high[j] - sizes.low[j])
    rest = 0.5 * (sizes.low[j] + sizes.high[j]) + rng.uniform(-0.5, 0.5) * spread
    slope, cubic = 0.3 * torque / spread, 2.0 * torque / spread**3
    plant.laws.append(on(j, lambda m, load: surroundings.hardening(m.q[:, j], rest, slope, cubic)))
    hide(plant, "hardening spring", None, j, {}, accept=("gravity_spring",), tolerate=("torque_offset",), unnamed=True,
         depends=("position",))  # fmt: skip


def tilt(plant, sizes, rng, j, torque):
    """Gravity turned about a level axis."""
    angle, about = rng.uniform(0.02, 0.08), rng.uniform(0.0, 2.0 * np.pi)
    turned = arms.turn(np.array([np.cos(about), np.sin(about), 0.0]), angle) @ plant.arm.gravity
    plant.arm = dataclasses.replace(plant.arm, gravity=turned)
    everywhere(plant, "tilt", "gravity_tilt", {"tilt": angle})


def payload(plant, sizes, rng, j, torque):
    """One more body on the last link."""
    mass, size = plant.nominal.mass[-1] * rng.uniform(0.5, 2.0), rng.uniform(0.02, 0.08)
    com = plant.arm.tool + rng.normal(0.0, 0.03, 3)
    plant.arm = arms.with_body(plant.arm, plant.arm.n - 1, mass, com, 0.4 * mass * size**2 * np.eye(3))
    everywhere(plant, "payload", "payload", {"mass": mass})


def zero(plant, sizes, rng, j, torque):
    """A whole error of a zero, not its first order."""
    plant.zero = plant.zero.copy()
    plant.zero[j] = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.06) * (0.2 if plant.arm.slide[j] else 1.0)
    hide(plant, "zero", "encoder_offset", j, {"offset": plant.zero[j]})


def elasticity(plant, sizes, rng, j, torque):
    """A link on a spring that stiffens a little, damped at 2 to 15 % of critical."""
    stiffness = sizes.inertia[j] * (2.0 * np.pi * rng.uniform(8.0, 25.0)) ** 2
    damping = 2.0 * rng.uniform(0.02, 0.15) * np.sqrt(stiffness * sizes.inertia[j])
    bend = 3.0 * sizes.tau[j] / stiffness
    plant.transmission = Transmission(j, stiffness, damping, cubic=0.05 * stiffness / bend**2)
    hide(plant, "two masses", "joint_elasticity", j, {"stiffness": stiffness}, accept=())


def play(plant, sizes, rng, j, torque):
    """A link that flies through play onto springy flanks."""
    gap = torque / sizes.inertia[j] * rng.uniform(0.04, 0.1) ** 3 * 5.0
    stiffness = sizes.inertia[j] * (2.0 * np.pi * rng.uniform(25.0, 50.0)) ** 2
    damping = 2.0 * rng.uniform(0.1, 0.4) * np.sqrt(stiffness * sizes.inertia[j])
    plant.transmission = Transmission(j, stiffness, damping, gap=gap)
    hide(plant, "play", "backlash", j, {"gap": gap}, tolerate=("joint_elasticity",))


def coupling(plant, sizes, rng, j, torque):
    """A wrist whose parts rub by asinh of their speed against each other."""
    pairs = [k for k in range(plant.arm.n) if k != j and plant.arm.slide[k] == plant.arm.slide[j]]
    if not pairs:
        return offset(plant, sizes, rng, j, torque)
    other = int(rng.choice([k for k in pairs if abs(k - j) == 1] or pairs))
    way, both = float(rng.choice([-1.0, 1.0])), float(np.hypot(sizes.qd[j], sizes.qd[other]))
    slope = torque / both

    def law(m, load):
        rub = slope * 6.0 * both * np.arcsinh((m.qd[:, j] + way * m.qd[:, other]) / (6.0 * both))
        tau = np.zeros_like(m.q)
        tau[:, j], tau[:, other] = rub, way * rub
        return tau

    plant.laws.append(law)
    joints = tuple(sorted((j, other)))
    plant.hidden.append(Hidden("coupling", "transmission_coupling", joints, {"viscous": slope},
                               ("transmission_coupling",), ("viscous_friction",)))  # fmt: skip


def wall(plant, sizes, rng, j, torque):
    """Hunt and Crossley's wall, touched during 3 to 12 % of the time."""
    x, reach = (np.concatenate(v) for v in zip(*(rigid.tool(plant.arm, m.q) for m in sizes.motions), strict=True))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    at = float(np.quantile(x @ normal, rng.uniform(0.03, 0.12)))
    depth = np.maximum(at - x @ normal, 0.0)
    lever = np.abs(np.einsum("i,tin->tn", normal, reach)[depth > 0.0]).mean(axis=0)
    k = int(np.argmax(lever / sizes.tau))
    deepest = max(float(depth.max()), 1e-4)
    hertz = rng.uniform(0.3, 1.0) * sizes.tau[k] / max(lever[k], 1e-6) / deepest**1.5

    def law(m, load):
        return surroundings.wall(*rigid.tool(plant.arm, m.q), normal, at, hertz, 0.1, STEP)[0]

    plant.laws.append(law)
    everywhere(plant, "wall", "contact", {}, tolerate=("external_wrench",))


def push(plant, sizes, rng, j, torque):
    """A push during one recording, that comes and goes as a raised cosine."""
    m = sizes.motions[int(rng.integers(len(sizes.motions)))]
    begin = rng.uniform(0.2, 0.6) * m.t[-1]
    end = begin + rng.uniform(1.0, 3.0)
    _, reach = rigid.tool(plant.arm, m.q)
    way = rng.normal(size=3)
    felt = np.sqrt(np.mean(np.einsum("i,tin->tn", way, reach) ** 2, axis=0)) / sizes.tau
    force = rng.uniform(0.2, 0.6) * way / max(np.max(felt), 1e-9)

    def law(motion, load):
        if motion.number != m.number:
            return np.zeros_like(motion.q)
        return surroundings.push(motion.t, rigid.tool(plant.arm, motion.q)[1], force, begin, end, 0.3)

    plant.laws.append(law)
    everywhere(plant, "push", "external_wrench", {"t1 - t0": end - begin}, tolerate=("contact",))


def everywhere(plant: Plant, kind: str, slug: str, values: dict[str, float], accept=(), tolerate=()) -> None:
    """The truth about something that all joints feel."""
    plant.hidden.append(
        Hidden(kind, slug, tuple(range(plant.arm.n)), {k: float(v) for k, v in values.items()}, (slug, *accept),
               tuple(tolerate))
    )  # fmt: skip


def lag(plant, sizes, rng, j, torque):
    """A drive with a pole and, ten times as fast, a zero."""
    time = rng.uniform(0.008, 0.03)

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] = drives.asked_of_lag(tau[:, j], STEP, time)
        return tau

    plant.drives.append(drive)
    hide(plant, "lead-lag drive", "actuator_lag", j, {"time_constant": 0.9 * time})  # slow torques are late by that


def delay(plant, sizes, rng, j, torque):
    """All torque channels early by the same time, by resampling: what the library calls a positive delay."""
    time = rng.uniform(0.004, 0.016) * rng.choice([-1.0, 1.0])
    plant.late = plant.late - time
    everywhere(plant, "resampled", "time_delay", {"delay": time})


def skew(plant, sizes, rng, j, torque):
    """Every torque channel late by a time of its own, up to 6 ms."""
    plant.late = plant.late + rng.uniform(0.0, 0.006, plant.arm.n)
    either = ("time_delay", "channel_skew")
    plant.hidden.append(Hidden("skew", None, tuple(range(plant.arm.n)), {}, either, (), unnamed=True))


def gain(plant, sizes, rng, j, torque):
    """A torque constant of one drive."""
    constants(plant, {j: 10.0 ** rng.uniform(0.04, 0.15) if rng.random() < 0.5 else 10.0 ** rng.uniform(-0.15, -0.04)})


def all_constants(plant, sizes, rng, j, torque, factor: float = 1.15):
    """All torques are logged 15 % too large."""
    constants(plant, dict.fromkeys(range(plant.arm.n), factor))


def two_constants(plant, sizes, rng, j, torque, factor: float = 1.7):
    """Two joints' torques are logged 70 % too large."""
    constants(plant, dict.fromkeys((j, (j + 1) % plant.arm.n), factor))


def constants(plant: Plant, factors: dict[int, float]) -> None:
    """Log these joints' torques too large by these factors."""
    scale = np.ones(plant.arm.n)
    for j, factor in factors.items():
        scale[j] = factor
        hide(plant, "torque constant", "torque_gain", j, {"gain": 1.0 / factor})
    plant.drives.append(lambda m, tau: tau * scale)


def current_loop(plant, sizes, rng, j, torque):
    """A motor that saturates, with teeth: its torque is a tanh of the current that is logged."""
    most = 2.0 * sizes.tau[j] * rng.uniform(1.6, 3.0)
    x, y = friction.curve(rng, sizes.low[j] - 0.2, sizes.high[j] + 0.2, 0.3)

    def drive(m, tau):
        tau = tau.copy()
        tau[:, j] = drives.asked_of_saturating(tau[:, j] + 0.3 * torque * np.interp(m.q[:, j], x, y), most)
        return tau

    plant.drives.append(drive)
    hide(plant, "saturating motor", None, j, {}, accept=("torque_ripple", "torque_gain"), unnamed=True,
         depends=("load", "position"))  # fmt: skip


def geometry(plant, sizes, rng, j, torque):
    """Frames off by 3 mm and 0.3 degrees."""
    place = plant.arm.place + rng.normal(0.0, 0.003, plant.arm.place.shape)
    rest = np.array([R @ arms.turn(rng.normal(size=3), rng.normal(0.0, 0.005)) for R in plant.arm.rest])
    plant.arm = dataclasses.replace(plant.arm, place=place, rest=rest)
    plant.hidden.append(
        Hidden("wrong frames", None, tuple(range(plant.arm.n)), {}, (), ("encoder_offset", "gravity_tilt"),
               "instrument", True)
    )  # fmt: skip


def dead(plant, sizes, rng, j, torque):
    """A torque channel that shows nothing, or freezes after a while."""
    freeze = rng.uniform(0.1, 0.4) if rng.random() < 0.5 else 0.0
    plant.dead[j] = lambda t, tau: tau[np.minimum(np.arange(len(t)), int(freeze * len(t)))] * (freeze > 0.0)
    hide(plant, "frozen channel" if freeze else "dead channel", None, j, {}, unnamed=True)


def slow_filter(plant, sizes, rng, j, torque):
    """A drive that filters the torques it logs at 15 to 40 Hz."""
    cut = rng.uniform(15.0, 40.0)
    plant.drives.append(lambda m, tau: drives.filtered(tau, STEP, cut))
    plant.hidden.append(Hidden("filtered log", None, tuple(range(plant.arm.n)), {}, ("time_delay",),
                               ("actuator_lag",), "instrument", True))  # fmt: skip
