"""Cases of position servos: MuJoCo closes the loop with actuators of its own, and no torque is logged.

    case = make_servo("work", 17, "known")

A case comes in four forms of the same motion: "torque" logs what the motors gave; the others log commands, and the
model has the true gains ("known"), gains that are some 10 % wrong ("wrong") or no servos at all ("unknown").  Those
called "laws" hide what a servo itself does: a limit of its torque, a dead band, a motor that gives less at speed.
"""

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Callable
from functools import partial
from typing import Literal

import mujoco
import numpy as np
from scipy import ndimage

from testbed import friction, leaving_out, rigid, rubbing
from testbed.arms import built, irb140, random_arm
from testbed.cases import ERRORS, STATED, Case, truth_of
from testbed.loggers import Logger, clock, logged, random_logger
from testbed.motions import PROGRAMMES, STEP, Motion, programme
from testbed.plants import Hidden, Plant, Sizes, sizes_of
from testbed.seeds import generator

Form = Literal["torque", "known", "wrong", "unknown", "laws"]
PARTS = 2  # steps of the simulation in one of the log's fine ones
SETTLE = 1.5  # s before a recording begins, in which the arm sags into its first posture
BETWEEN = "between"  # name of the joint between motor and link
STOP = (0.004, 0.7)  # time constant [s] and damping ratio of the stops of play
WRONG = 0.1  # relative error of gains that are wrong


@dataclasses.dataclass
class Loop:
    """A plant on servos.

    Attributes:
        plant: Its bodies, zeros and the truth; laws and drives are not used here.
        kp, kd: Gains of the servos, shape (n,).
        loss, damping, stiffness, rest: Of MuJoCo's joints, shape (n,).
        second: Joint with a second one between motor and link, the stiffness and damping of that, and its play.
        dead: Position error below which a servo does nothing, shape (n,).
        stall, fastest: Torque of a motor at rest, and speed at which it has none left, shape (n,).
        coupled: Two joints, the sign between them and the damping of their relative speed.
        forces: Each makes, for a recording, what acts at every step on a model, its data and the joints' degrees of
            freedom.
    """

    plant: Plant
    kp: np.ndarray
    kd: np.ndarray
    loss: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    damping: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    stiffness: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    rest: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    dead: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    stall: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    fastest: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))
    second: tuple[int, float, float, float] | None = None
    coupled: tuple[int, int, float, float] | None = None
    forces: list[Callable[[int], Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray], None]]] = dataclasses.field(
        default_factory=list
    )

    def __post_init__(self) -> None:
        of = (self.loss, self.damping, self.stiffness, self.rest)
        self.loss, self.damping, self.stiffness, self.rest = (x if len(x) else np.zeros(len(self.kp)) for x in of)
        self.dead, self.stall, self.fastest = np.zeros(len(self.kp)), *np.full((2, len(self.kp)), np.inf)


def bodies(
    loop: Loop, sizes: Sizes, rng: np.random.Generator, j: int, torque: float, put_in: Callable[..., None]
) -> None:
    """What changes the bodies, rotors, gravity or zeros alone is put in as for plants on prescribed paths."""
    put_in(loop.plant, sizes, rng, j, torque)


def asymmetric(loop, sizes, rng, j, torque):
    """Dry friction and a constant torque, which are two levels while a joint moves."""
    more = rng.uniform(0.15, 0.35) * rng.choice([-1.0, 1.0])
    loop.loss[j] = torque
    constantly(loop, j, -more * torque)
    rubbing.hide(loop.plant, "two levels", "asymmetric_friction", j,
                 {"coulomb_pos": torque * (1.0 + more), "coulomb_neg": torque * (1.0 - more)},
                 accept=("torque_offset",), tolerate=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def stribeck(loop, sizes, rng, j, torque):
    """A friction loss that falls with speed by Hess and Soom's form."""
    static, speed = torque * rng.uniform(1.4, 2.2), sizes.qd[j] * rng.uniform(0.05, 0.25)
    level(loop, j, lambda d, i: float(friction.falling(d.qvel[i : i + 1], torque, static, speed)[0]))
    rubbing.hide(loop.plant, "Hess and Soom", "stribeck_friction", j, {"coulomb": torque, "static": static},
         tolerate=("coulomb_friction", "nonlinear_viscous_friction"), instead=("coulomb_friction",))  # fmt: skip


def loaded(loop, sizes, rng, j, torque):
    """A friction loss that grows with the torque of the motor."""
    mu = rng.uniform(0.05, 0.2)
    level(loop, j, lambda d, i: 0.5 * torque + mu * abs(d.qfrc_actuator[i]))
    rubbing.hide(loop.plant, "loaded gear", "load_dependent_friction", j, {"load_coefficient": mu},
         tolerate=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def bump(loop, sizes, rng, j, torque):
    """A friction loss that is larger around a place."""
    span = sizes.high[j] - sizes.low[j]
    centre, width = sizes.low[j] + span * rng.uniform(0.25, 0.75), span * rng.uniform(0.15, 0.35)
    depth = rng.uniform(0.6, 2.0)
    more = lambda q: 0.5 + 0.5 * np.cos(np.pi * np.clip((q - centre) / width, -1.0, 1.0))  # noqa: E731
    level(loop, j, lambda d, i: float(torque * (1.0 + depth * more(d.qpos[i]))))
    rubbing.hide(loop.plant, "bump", "position_dependent_friction", j,
                 {"coulomb": torque, "depth": depth, "centre": centre}, tolerate=("coulomb_friction",),
                 instead=("coulomb_friction",))  # fmt: skip


def springy(loop, sizes, rng, j, torque):
    """Dahl's bristles, soft enough to be seen; dF/dq = stiffness (1 - F/torque sign(v))."""
    stiffness = torque / ((sizes.high[j] - sizes.low[j]) * 10.0 ** rng.uniform(-2.3, -1.5))

    def make(number: int):
        f, before = 0.0, None

        def act(m, d, at):
            nonlocal f, before
            dq = 0.0 if before is None else d.qpos[at[j]] - before
            f = np.sign(dq) * torque + (f - np.sign(dq) * torque) * np.exp(-stiffness / torque * abs(dq)) if dq else f
            before = d.qpos[at[j]]
            d.qfrc_applied[at[j]] -= f

        return act

    loop.forces.append(make)
    rubbing.hide(loop.plant, "Dahl", "presliding_hysteresis", j, {"coulomb": torque, "stiffness": stiffness},
                 tolerate=("coulomb_friction",), instead=("coulomb_friction",))  # fmt: skip


def offset(loop, sizes, rng, j, torque):
    """A constant torque beside the motor's, which the motor holds."""
    sign = rng.choice([-1.0, 1.0])
    constantly(loop, j, -sign * torque)
    rubbing.hide(loop.plant, "constant", "torque_offset", j, {"offset": sign * torque}, accept=("asymmetric_friction",))


def cogging(loop, sizes, rng, j, torque):
    """Teeth of a motor."""
    cycles = 10.0 ** rng.uniform(0.6, 1.4) / (sizes.high[j] - sizes.low[j])
    phase = rng.uniform(0.0, 6.28)

    def act(m, d, at):
        d.qfrc_applied[at[j]] -= torque * np.sin(2.0 * np.pi * cycles * d.qpos[at[j]] + phase)

    loop.forces.append(lambda number: act)
    rubbing.hide(loop.plant, "cogging", "torque_ripple", j, {"amplitude": torque, "cycles_per_rad": cycles})


def spring(loop, sizes, rng, j, torque):
    """MuJoCo's own spring at a joint."""
    loop.stiffness[j] = torque / (0.3 * (sizes.high[j] - sizes.low[j]))
    loop.rest[j] = rng.uniform(sizes.low[j], sizes.high[j])
    rubbing.hide(loop.plant, "joint spring", "gravity_spring", j,
                 {"stiffness": loop.stiffness[j], "rest": loop.rest[j]}, tolerate=("torque_offset",))  # fmt: skip


def coupling(loop, sizes, rng, j, torque):
    """A tendon over two joints, with damping."""
    pairs = [k for k in range(loop.plant.arm.n) if k != j and loop.plant.arm.slide[k] == loop.plant.arm.slide[j]]
    if not pairs:
        return offset(loop, sizes, rng, j, torque)
    other = int(rng.choice([k for k in pairs if abs(k - j) == 1] or pairs))
    way, slope = float(rng.choice([-1.0, 1.0])), torque / float(np.hypot(sizes.qd[j], sizes.qd[other]))
    loop.coupled = (j, other, way, slope)
    loop.plant.hidden.append(Hidden("coupling", "transmission_coupling", tuple(sorted((j, other))), {"viscous": slope},
                                    ("transmission_coupling",), ("viscous_friction",)))  # fmt: skip


def elasticity(loop, sizes, rng, j, torque):
    """A second joint on a spring between motor and link: the encoder is the motor's."""
    stiffness = sizes.inertia[j] * (2.0 * np.pi * rng.uniform(8.0, 20.0)) ** 2
    damping = 2.0 * rng.uniform(0.03, 0.15) * np.sqrt(stiffness * sizes.inertia[j])
    loop.second = (j, stiffness, damping, 0.0)
    rubbing.hide(loop.plant, "two masses", "joint_elasticity", j, {"stiffness": stiffness})


def play(loop, sizes, rng, j, torque):
    """A second joint that is free within a gap, and meets soft stops."""
    gap = torque / sizes.inertia[j] * rng.uniform(0.04, 0.1) ** 3 * 5.0
    loop.second = (j, 0.0, 0.0, gap)
    rubbing.hide(loop.plant, "play", "backlash", j, {"gap": gap}, tolerate=("joint_elasticity",))


def push(loop, sizes, rng, j, torque):
    """A steady push on the tool during one recording."""
    m = sizes.motions[int(rng.integers(len(sizes.motions)))]
    begin = rng.uniform(0.2, 0.6) * m.t[-1]
    end, way = begin + rng.uniform(1.0, 3.0), rng.normal(size=3)
    felt = np.sqrt(np.mean(np.einsum("i,tin->tn", way, rigid.tool(loop.plant.arm, m.q)[1]) ** 2, axis=0)) / sizes.tau
    force = rng.uniform(0.2, 0.6) * way / max(np.max(felt), 1e-9)

    def make(number: int):
        jacobian = None

        def act(model, d, at):
            nonlocal jacobian
            if number == m.number and begin < d.time < end:
                jacobian = np.empty((3, model.nv)) if jacobian is None else jacobian
                mujoco.mj_jacSite(model, d, jacobian, None, model.nsite - 1)
                d.qfrc_applied += force @ jacobian

        return act

    loop.forces.append(make)
    leaving_out.everywhere(loop.plant, "push", "external_wrench", {"t1 - t0": end - begin}, tolerate=("contact",))


def shear_thinning(loop, sizes, rng, j, torque):
    """Friction that grows less than in proportion to speed."""
    speed = sizes.qd[j] * rng.uniform(0.05, 0.4)
    size = torque / np.arcsinh(sizes.qd[j] / speed)

    def act(m, d, at):
        d.qfrc_applied[at[j]] -= size * np.arcsinh(d.qvel[at[j]] / speed)

    loop.forces.append(lambda number: act)
    rubbing.hide(loop.plant, "Eyring", "nonlinear_viscous_friction", j, {}, tolerate=rubbing.ORDINARY,
                 instead=("viscous_friction",))  # fmt: skip


def limit(loop, sizes, rng, j, torque):
    """A motor that is at its limit where most torque is needed."""
    loop.stall[j] = rng.uniform(1.4, 2.0) * sizes.tau[j]
    rubbing.hide(loop.plant, "limit", "torque_saturation", j, {"limit": loop.stall[j]}, accept=("back_emf",))


def dead_band(loop, sizes, rng, j, torque):
    """Position errors that are too small for a servo."""
    loop.dead[j] = rng.uniform(0.1, 0.5) * sizes.tau[j] / loop.kp[j]
    rubbing.hide(loop.plant, "dead band", "servo_deadband", j, {"width": loop.dead[j]})


def voltage(loop, sizes, rng, j, torque):
    """A motor on a voltage."""
    loop.stall[j], loop.fastest[j] = rng.uniform(1.6, 2.4) * sizes.tau[j], rng.uniform(2.5, 4.0) * sizes.qd[j]
    rubbing.hide(loop.plant, "voltage", "back_emf", j, {"stall_torque": loop.stall[j]}, accept=("torque_saturation",))


LAWS: dict[str, Callable[..., None]] = {"torque_saturation": limit, "servo_deadband": dead_band, "back_emf": voltage}
KINDS: dict[str, Callable[..., None]] = {
    "rotor_inertia": partial(bodies, put_in=leaving_out.rotor), "payload": partial(bodies, put_in=leaving_out.payload),
    "gravity_tilt": partial(bodies, put_in=leaving_out.tilt),
    "encoder_offset": partial(bodies, put_in=leaving_out.zero),
    "asymmetric_friction": asymmetric, "stribeck_friction": stribeck, "load_dependent_friction": loaded,
    "position_dependent_friction": bump, "presliding_hysteresis": springy, "nonlinear_viscous_friction": shear_thinning,
    "torque_offset": offset, "torque_ripple": cogging, "gravity_spring": spring, "transmission_coupling": coupling,
    "joint_elasticity": elasticity, "backlash": play, "external_wrench": push,
}  # fmt: skip
PASS = (*KINDS, *("ordinary",) * 3, *("nothing",) * 3)


def constantly(loop: Loop, j: int, torque: float) -> None:
    """A constant torque on a joint."""

    def act(m, d, at):
        d.qfrc_applied[at[j]] += torque

    loop.forces.append(lambda number: act)


def level(loop: Loop, j: int, of: Callable[[mujoco.MjData, int], float]) -> None:
    """A friction loss of a joint that changes, a function of the data and the degree of freedom."""

    def act(m, d, at):
        m.dof_frictionloss[at[j]] = of(d, at[j])

    loop.loss[j] = 1e-6  # MuJoCo makes room for it where it is not zero at first
    loop.forces.append(lambda number: act)


def make_servo(draw: str, index: int, form: Form, commit: str = "") -> Case:
    """A case: a pure function of its draw and its index; its motion is the same in every form."""
    rng, moving, logging = (generator(draw, index, f"servo {s}", commit) for s in ("plant", "motions", "logger"))
    order = generator(draw, index // len(PASS), "servo pass", commit).permutation(len(PASS))
    kind = list(LAWS)[index % len(LAWS)] if form == "laws" else PASS[order[index % len(PASS)]]
    nominal = irb140() if rng.random() < 0.4 else random_arm(rng, int(rng.integers(2, 7)))
    error, name = float(rng.choice(ERRORS)), str(rng.choice(list(PROGRAMMES), p=(0.2, 0.5, 0.15, 0.15)))
    unseen = [dataclasses.replace(m, number=100) for m in programme(nominal, moving, "fourier", 8.0)[:1]]
    motions = programme(nominal, moving, name, moving.uniform(12.0, 20.0))
    sizes, n = sizes_of(nominal, motions), nominal.n
    swing, damped = 2.0 * np.pi * rng.uniform(3.0, 8.0, n), rng.uniform(0.5, 1.0, n)
    inertia = sizes.inertia + nominal.rotor
    kp, kd = inertia * swing**2, 2.0 * damped * inertia * swing
    loop = Loop(Plant(nominal, built(nominal, rng, error)), kp, kd)
    strength = 10.0 ** rng.uniform(-1.5, -0.6)
    if kind in KINDS or kind in LAWS:
        j = int(rng.integers(n))
        (KINDS | LAWS)[kind](loop, sizes, rng, j, strength * float(sizes.tau[j]))
    if kind != "nothing":
        rubbed(loop, sizes, rng)
    logger = random_logger(logging, nominal.slide, sizes.tau)
    held, late = bool(rng.random() < 0.5), float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.01)]))
    missing = None if form == "unknown" else (kp, kd)
    if form == "wrong":
        by = generator(draw, index, "servo gains", commit)
        missing = (kp * np.exp(WRONG * by.normal(size=n)), kd * np.exp(WRONG * by.normal(size=n)))
    record = lambda m: _logged(loop, m, logger, logging, held, late)  # noqa: E731
    recordings, held_out = [record(m) for m in motions], [record(m) for m in unseen]
    for r in recordings:
        del r["qdes" if form == "torque" else "tau"]
    held_out = [{k: v for k, v in r.items() if k != "qdes"} | {"tau": r["tau_true"]} for r in held_out]
    setting = {"inertial_error": error, "stated_error": STATED, "programme": name, "strength": strength, "form": form,
               "held": held, "late": late}  # fmt: skip
    xml = ET.tostring(_with_servos(nominal.xml, None if form == "torque" else missing), encoding="unicode")
    return Case(draw, index, xml, nominal.names, recordings, held_out, truth_of(loop.plant, sizes, logger) | setting,
                (kind,), loop.plant, tuple(motions), prescribed=False)  # fmt: skip


def rubbed(loop: Loop, sizes: Sizes, rng: np.random.Generator) -> None:
    """Ordinary friction on every joint where nothing stands for it."""
    kinds = (("coulomb", loop.loss, sizes.tau), ("viscous", loop.damping, sizes.tau / sizes.qd))
    for (slug, (low, high)), (name, where, unit) in zip(rubbing.SHARES.items(), kinds, strict=True):
        for j in range(loop.plant.arm.n):
            share = rng.uniform(low, high)
            if j not in loop.plant.taken.get(slug, ()):
                where[j] = share * unit[j]
                rubbing.hide(loop.plant, name, slug, j, {name: where[j]}, role="ordinary")


def simulated(loop: Loop, motion: Motion, command: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, speeds and the motors' torques that answer a command, each (T, n) at the motion's times."""
    m, arm = _model(loop), loop.plant.arm
    d = mujoco.MjData(m)
    at = np.array([m.joint(name).dofadr[0] for name in arm.names])
    acting = [make(motion.number) for make in loop.forces]
    before = round(SETTLE / STEP)
    out = np.zeros((3, len(command), arm.n))
    d.qpos[at], d.time = command[0], motion.t[0] - before * STEP
    for i in range(-before, len(command)):
        now, after = command[max(i, 0)], command[np.clip(i + 1, 0, len(command) - 1)]
        if i >= 0:
            out[0, i], out[1, i] = d.qpos[at], d.qvel[at]
        for part in range(PARTS):
            d.ctrl[:] = now + part / PARTS * (after - now) - loop.plant.zero
            d.qfrc_applied[:] = 0.0
            for act in acting:
                act(m, d, at)
            d.ctrl[:] -= np.clip(d.ctrl - d.qpos[at], -loop.dead, loop.dead)
            slower = d.qvel[at] / loop.fastest
            m.actuator_forcerange[:] = np.stack([-loop.stall * (1.0 + slower), loop.stall * (1.0 - slower)], axis=1)
            mujoco.mj_step(m, d)
            if part == 0 and i >= 0:
                out[2, i] = d.actuator_force
    return out[0], out[1], out[2]


def _logged(loop: Loop, motion: Motion, logger: Logger, rng, held: bool, late: float) -> dict[str, np.ndarray]:
    """A recording of what the servos were told and did; qdes as it was told, taken up `late` [s] afterwards.

    A command that is held from row to row makes torque a saw-tooth; drives log its mean over a cycle.
    """
    rows, told = clock(logger, rng, motion.t), motion.q
    at = np.clip(np.round((rows[1] - motion.t[0]) / STEP).astype(int), 0, len(told) - 1)
    if held:
        told = told[np.concatenate([[0], at])[np.searchsorted(at, np.arange(len(told)), side="right")]]
    asked = told[np.maximum(np.arange(len(told)) - round(late / STEP), 0)]
    q, qd, tau = simulated(loop, motion, asked)
    if held:
        tau = ndimage.uniform_filter1d(tau, round(1.0 / logger.rate / STEP), axis=0, mode="nearest")
    return logged(logger, rng, motion.t, q + loop.plant.zero, qd, tau, rows) | {"qdes": told[at]}


def _with_servos(xml: str, gains: tuple[np.ndarray, np.ndarray] | None) -> ET.Element:
    """A model with position servos in the place of its actuators, or with none."""
    root = ET.fromstring(xml)
    for old in (*root.findall("actuator"), *root.findall("sensor"), *root.findall("keyframe")):
        root.remove(old)
    if gains is not None:
        new = ET.SubElement(root, "actuator")
        for joint, kp, kd in zip(root.findall(".//joint[@name]"), *gains, strict=True):
            ET.SubElement(new, "position", joint=joint.get("name", ""), kp=f"{kp:.9g}", kv=f"{kd:.9g}",
                          ctrllimited="false", inheritrange="0")  # fmt: skip
    return root


def _model(loop: Loop) -> mujoco.MjModel:
    """The plant as MuJoCo simulates it."""
    arm, root = loop.plant.arm, _with_servos(loop.plant.nominal.xml, (loop.kp, loop.kd))
    if loop.second is not None:
        motor = root.findall(".//joint[@name]")[loop.second[0]]
        body = next(b for b in root.iter("body") if motor in list(b))
        between = {k: v for k, v in motor.attrib.items() if k in ("axis", "type")} | {"name": BETWEEN, "armature": "0"}
        body.insert(list(body).index(motor) + 1, ET.Element("joint", between))
    if loop.coupled is not None:
        j, other, way, slope = loop.coupled
        tendon = ET.SubElement(ET.SubElement(root, "tendon"), "fixed", damping=f"{slope:.9g}")
        for k, by in ((j, 1.0), (other, way)):
            ET.SubElement(tendon, "joint", joint=arm.names[k], coef=f"{by:g}")
    m = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    m.actuator_forcelimited[:] = np.isfinite(loop.stall)
    m.opt.timestep, m.opt.gravity = STEP / PARTS, arm.gravity
    # Damping taken implicitly would not be the servo's law to the step.
    m.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    ids = np.array([m.joint(name).id for name in arm.names])
    m.jnt_limited[ids] = 0
    at, of = m.jnt_dofadr[ids], m.jnt_bodyid[ids]
    m.dof_armature[at], m.dof_damping[at], m.dof_frictionloss[at] = arm.rotor, loop.damping, loop.loss
    m.jnt_stiffness[ids], m.qpos_spring[m.jnt_qposadr[ids]] = loop.stiffness, loop.rest
    if loop.second is not None:
        i, (_, stiffness, damping, gap) = m.joint(BETWEEN).id, loop.second
        m.jnt_stiffness[i], m.dof_damping[m.jnt_dofadr[i]] = stiffness, damping
        m.jnt_limited[i], m.jnt_range[i], m.jnt_solref[i] = gap > 0.0, (-0.5 * gap, 0.5 * gap), STOP
    for k, body in enumerate(of):
        mine = np.flatnonzero(arm.link == k)
        mass = arm.mass[mine].sum()
        com = arm.mass[mine] @ arm.com[mine] / mass
        apart = arm.com[mine] - com
        about = sum(J + w * (x @ x * np.eye(3) - np.outer(x, x))
                    for J, w, x in zip(arm.inertia[mine], arm.mass[mine], apart, strict=True))  # fmt: skip
        moments, axes = np.linalg.eigh(about)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        m.body_mass[body], m.body_ipos[body], m.body_inertia[body] = mass, com, moments
        mujoco.mju_mat2Quat(m.body_iquat[body], axes.flatten())
    mujoco.mj_setConst(m, mujoco.MjData(m))
    return m
