"""Arms, loops and physics that share nothing with this library: MJCF written by hand, laws of MuJoCo itself.

    python experiments/arms_by_hand.py                    # cases 0 to 71
    python experiments/arms_by_hand.py --first 72 --last 107
    python experiments/arms_by_hand.py --table            # docs/arms-by-hand.md from what is there

`experiments/trials.py` hides physics by this library's own simulation of concealed effects.  A mistake in what a law
means could be in both.  Here friction is MuJoCo's `frictionloss`, viscosity its `damping`, a rotor its `armature`, a
spring its `stiffness`, a tilt its `gravity`, a payload a heavier last body; what MuJoCo has not (ripple, lag, delay) is
a line of NumPy.  Computed torque on an arm whose inertials are 5 % wrong, two recordings of 15 s.

Cases are appended to results/arms_by_hand.jsonl as they are done, so an interrupted run goes on where it stopped.
"""

import dataclasses
import json
import pathlib
from collections.abc import Callable

import mujoco
import numpy as np
import tyro

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot, robot_from_model

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "arms-by-hand.md"
STEP, EVERY, SECONDS = 0.0005, 4, 15.0  # [s], steps a logged sample, [s]

OPENING = """# Arms and physics by hand

Written by `experiments/arms_by_hand.py` from `results/arms_by_hand.jsonl`; don't edit. Six arms (a pendulum, two
links, SCARA, gantry, cylindrical, seven joints) whose MJCF, control and hidden physics are written in that script:
MuJoCo's own `frictionloss`, `damping`, `armature`, `stiffness` and `gravity` where it has the physics. Inertials 5 %
wrong, two recordings of 15 s that begin and end in motion, positions with 1e-5 of noise, torques with 1 %; effects of
6 to 25 % of the joint's torque, inertials as they are; delays of 6 to 22 ms, lags of 15 to 60 ms, zeros off by 0.02 to
0.06, payloads of 0.3 to 1 of the last link. Nothing is left out for being invisible: a zero of a vertical slide, or a
gain where nothing but inertia acts, can't be seen by anyone. The loop holds its torque for 1 ms: beside hidden
delays and lags that is a quarter of a millisecond more, in no truth, and far outside their intervals.
"""
ARMS = {
    "pendulum": """<body pos="0 0 1"><joint name="swing" axis="0 1 0" range="-3 3" armature=".02"/>
<geom type="capsule" fromto="0 0 0 0 0 -.5" size=".03" density="2700"/></body>""",
    "two": """<body pos="0 0 1"><joint name="upper" axis="0 1 0" range="-2.8 2.8" armature=".05"/>
<geom type="capsule" fromto="0 0 0 0 0 -.4" size=".04" density="2700"/>
<body pos="0 0 -.4"><joint name="lower" axis="0 1 0" range="-2.5 2.5" armature=".02"/>
<geom type="capsule" fromto="0 0 0 0 0 -.35" size=".03" density="2700"/></body></body>""",
    "scara": """<body pos="0 0 .3"><joint name="shoulder" axis="0 0 1" range="-2.2 2.2" armature=".05"/>
<geom type="capsule" fromto="0 0 0 .25 0 0" size=".05" density="2500"/>
<body pos=".25 0 0"><joint name="elbow" axis="0 0 1" range="-2.4 2.4" armature=".03"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".04" density="2500"/>
<body pos=".2 0 0"><joint name="lift" type="slide" axis="0 0 -1" range="0 .2" armature="1.5"/>
<geom type="cylinder" size=".012 .15" density="7800"/>
<body pos="0 0 -.15"><joint name="spin" axis="0 0 1" range="-3 3" armature=".004"/>
<geom type="box" size=".04 .02 .02" pos=".01 .005 0" density="2700"/></body></body></body></body>""",
    "gantry": """<body pos="0 0 1"><joint name="x" type="slide" axis="1 0 0" range="-.5 .5" armature="2"/>
<geom type="box" size=".3 .05 .05" density="1500"/>
<body><joint name="y" type="slide" axis="0 1 0" range="-.4 .4" armature="1"/>
<geom type="box" size=".08 .08 .08" density="1500"/>
<body><joint name="z" type="slide" axis="0 0 1" range="-.3 .3" armature="1"/>
<geom type="box" size=".03 .03 .25" density="2700"/></body></body></body>""",
    "cylindrical": """<body><joint name="turn" axis="0 0 1" range="-2.5 2.5" armature=".3"/>
<geom type="cylinder" size=".08 .4" pos="0 0 .4" density="1500"/>
<body pos="0 0 .3"><joint name="rise" type="slide" axis="0 0 1" range="0 .4" armature="2"/>
<geom type="box" size=".1 .08 .08" density="2000"/>
<body><joint name="reach" type="slide" axis="1 0 0" range="0 .35" armature="1"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" density="2700"/>
<body pos=".4 0 0"><joint name="wrist" axis="0 1 0" range="-1.8 1.8" armature=".01"/>
<geom type="capsule" fromto="0 0 0 .15 0 .02" size=".025" density="2700"/></body></body></body></body>""",
    "seven": """<body pos="0 0 .16"><joint name="a1" axis="0 0 1" range="-2.9 2.9" armature=".4"/>
<geom type="capsule" fromto="0 -.02 0 0 -.01 .2" size=".06" density="1800"/>
<body pos="0 0 .2"><joint name="a2" axis="0 1 0" range="-2 2" armature=".4"/>
<geom type="capsule" fromto="0 .03 0 0 .02 .2" size=".06" density="1800"/>
<body pos="0 0 .2"><joint name="a3" axis="0 0 1" range="-2.9 2.9" armature=".25"/>
<geom type="capsule" fromto="0 .02 0 .01 .02 .2" size=".05" density="1800"/>
<body pos="0 0 .2"><joint name="a4" axis="0 -1 0" range="-2 2" armature=".25"/>
<geom type="capsule" fromto="0 0 0 0 .02 .2" size=".05" density="1800"/>
<body pos="0 0 .2"><joint name="a5" axis="0 0 1" range="-2.9 2.9" armature=".1"/>
<geom type="capsule" fromto="0 .01 0 0 .03 .19" size=".045" density="1800"/>
<body pos="0 0 .2"><joint name="a6" axis="0 1 0" range="-2 2" armature=".08"/>
<geom type="capsule" fromto="0 0 0 0 0 .06" size=".045" density="1800"/>
<body pos="0 0 .08"><joint name="a7" axis="0 0 1" range="-3 3" armature=".03"/>
<geom type="box" size=".06 .03 .04" pos=".03 .01 .04" density="1800"/>
</body></body></body></body></body></body></body>""",
}


@dataclasses.dataclass
class Sizes:
    """What a joint does along a motion of the unaltered arm, RMS of each, shape (n,)."""

    tau: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    spread: np.ndarray


@dataclasses.dataclass
class Plant:
    """The true arm and what stands between the logged torque and its joints.

    Attributes:
        model: Of MuJoCo.
        forces: Laws (t, q, qd, logged torque) -> torque on the joints.
        drive: Logged torque to the torque that the motor makes, step by step.
        log: Arrays t, q, tau -> those that are logged.
    """

    model: mujoco.MjModel
    forces: list[Callable]
    drive: list[Callable]
    log: list[Callable]


def spec_of(arm: str) -> mujoco.MjSpec:
    """An arm, without contacts, with motors nowhere: torques are applied."""
    xml = (
        '<mujoco><compiler angle="radian" inertiafromgeom="true"/>'
        f'<option timestep="{STEP}" integrator="implicitfast"/><default><geom contype="0" conaffinity="0"/></default>'
        f"<worldbody>{ARMS[arm]}</worldbody></mujoco>"
    )
    return mujoco.MjSpec.from_string(xml)


# Each law: what it alters, given the plant, a joint, the torque that it may have [N m or N], sizes and random numbers;
# and its true parameters.


def coulomb(plant, j, torque, sizes, rng):
    plant.model.dof_frictionloss[j] += torque
    return {"coulomb": torque}


def viscous(plant, j, torque, sizes, rng):
    plant.model.dof_damping[j] += torque / sizes.qd[j]
    return {"viscous": torque / sizes.qd[j]}


def rotor(plant, j, torque, sizes, rng):
    plant.model.dof_armature[j] += torque / sizes.qdd[j]
    return {"inertia": torque / sizes.qdd[j]}


def spring(plant, j, torque, sizes, rng):
    rest = rng.uniform(-1.0, 1.0) * sizes.spread[j]
    plant.model.jnt_stiffness[j] = torque / sizes.spread[j]
    plant.model.qpos_spring[j] = rest
    return {"stiffness": torque / sizes.spread[j]}


def tilt(plant, j, torque, sizes, rng):
    angle, about = rng.uniform(0.02, 0.08), rng.uniform(0.0, 2.0 * np.pi)
    lean = np.array([np.sin(angle) * np.cos(about), np.sin(angle) * np.sin(about), -np.cos(angle)])
    plant.model.opt.gravity[:] = 9.81 * lean
    return {"tilt": angle}


def payload(plant, j, torque, sizes, rng):
    mass = rng.uniform(0.3, 1.0) * plant.model.body_mass[-1]
    where = plant.model.body_ipos[-1] + rng.uniform(-0.05, 0.05, 3)
    body, m0 = plant.model, plant.model.body_mass[-1]
    # A small ball, as a change of the last body's own mass, centre and inertia.
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, body.body_iquat[-1])
    R = frame.reshape(3, 3)
    com = (m0 * body.body_ipos[-1] + mass * where) / (m0 + mass)
    about = lambda m, d: m * (d @ d * np.eye(3) - np.outer(d, d))  # noqa: E731
    inertia = R @ np.diag(body.body_inertia[-1]) @ R.T + about(m0, body.body_ipos[-1] - com)
    inertia += about(mass, where - com) + 0.4 * mass * 0.02**2 * np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    body.body_mass[-1], body.body_ipos[-1], body.body_inertia[-1] = m0 + mass, com, moments
    mujoco.mju_mat2Quat(body.body_iquat[-1], axes.ravel())
    return {"mass": mass}


def gain(plant, j, torque, sizes, rng):
    value = 1.0 + rng.choice([-1.0, 1.0]) * torque / sizes.tau[j]
    plant.drive.append(lambda tau: np.where(np.arange(len(tau)) == j, value * tau, tau))
    return {"gain": value}


def offset(plant, j, torque, sizes, rng):
    value = torque * rng.choice([-1.0, 1.0])
    plant.drive.append(lambda tau: np.where(np.arange(len(tau)) == j, tau - value, tau))
    return {"offset": value}


def ripple(plant, j, torque, sizes, rng):
    n, phase = rng.uniform(2.0, 12.0) / max(sizes.spread[j], 0.05), rng.uniform(0.0, 2.0 * np.pi)
    n = n / (2.0 * np.pi)
    top = np.sqrt(2.0) * torque
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -top * np.sin(2.0 * np.pi * n * q[j] + phase))
    return {"amplitude": top, "cycles_per_rad": n}


def asymmetric(plant, j, torque, sizes, rng):
    forth, back = torque * rng.uniform(1.0, 1.5), torque * rng.uniform(0.3, 0.7)
    mean, shift = (forth + back) / 2.0, (forth - back) / 2.0
    plant.model.dof_frictionloss[j] += mean
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -shift)
    return {"coulomb_pos": forth, "coulomb_neg": back}


def load(plant, j, torque, sizes, rng):
    share, base = 0.7 * torque / sizes.tau[j], 0.3 * torque
    still = 0.01 * sizes.qd[j]

    def law(t, q, qd, tau):
        # The transmitted torque is what friction leaves of the motor's: solved for friction that opposes the speed.
        along = np.sign(qd[j]) * tau[j]
        size = (base + share * along) / (1.0 + share) if along > base else (base - share * along) / (1.0 - share)
        return np.eye(len(q))[j] * -size * np.tanh(qd[j] / still)

    plant.forces.append(law)
    return {"load_coefficient": share, "coulomb": base}


def drag(plant, j, torque, sizes, rng):
    power = rng.choice([0.4, 2.0])
    speed = np.sqrt(2.0) * sizes.qd[j] * np.sin(np.linspace(0.0, 2.0 * np.pi, 99))
    value = torque / np.sqrt(np.mean(np.abs(speed) ** (2 * power)))
    plant.forces.append(lambda t, q, qd, tau: np.eye(len(q))[j] * -value * np.sign(qd[j]) * abs(qd[j]) ** power)
    return {"coefficient": value, "exponent": float(power)}


def lag(plant, j, torque, sizes, rng):
    time = rng.uniform(0.015, 0.06)
    state = np.full(plant.model.nv, np.nan)

    def law(tau):
        state[j] = tau[j] if np.isnan(state[j]) else state[j] + (tau[j] - state[j]) * STEP / time
        return np.where(np.arange(len(tau)) == j, state[j], tau)

    plant.drive.append(law)
    return {"time_constant": time}


def delay(plant, j, torque, sizes, rng):
    samples = int(rng.choice([-1, 1]) * rng.integers(3, 12))

    def late(t, q, tau):
        return t[12:-12], q[12:-12], tau[12 - samples : len(t) - 12 - samples]

    plant.log.append(late)
    return {"delay": -samples * STEP * EVERY}  # a torque that is logged late belongs to an earlier position


def zero(plant, j, torque, sizes, rng):
    value = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.06)
    plant.log.append(lambda t, q, tau: (t, q + value * (np.arange(q.shape[1]) == j), tau))
    return {"offset": value}


LAWS = {
    "coulomb_friction": coulomb, "viscous_friction": viscous, "rotor_inertia": rotor, "gravity_spring": spring,
    "gravity_tilt": tilt, "payload": payload, "torque_gain": gain, "torque_offset": offset, "torque_ripple": ripple,
    "asymmetric_friction": asymmetric, "load_dependent_friction": load, "nonlinear_viscous_friction": drag,
    "actuator_lag": lag, "time_delay": delay, "encoder_offset": zero,
}  # fmt: skip
EVERYWHERE = ("gravity_tilt", "payload", "time_delay")


def wrong(model: mujoco.MjModel, rng: np.random.Generator) -> None:
    """Every body's mass, centre and moments of inertia, 5 % wrong."""
    for b in range(1, model.nbody):
        grown = 1.0 + 0.05 * rng.normal()
        radius = np.sqrt(model.body_inertia[b].sum() / 2.0 / model.body_mass[b])
        model.body_mass[b] *= grown
        model.body_inertia[b] *= grown * (1.0 + 0.05 * rng.normal() + 0.01 * rng.normal(size=3))
        model.body_ipos[b] += 0.05 * radius * rng.normal(size=3)


def recorded(nominal: mujoco.MjModel, plant: Plant, rng: np.random.Generator, noisy: bool = True) -> Recording:
    """A sum of sines under computed torque and proportional-derivative feedback on what the encoders say."""
    n, true = nominal.nv, mujoco.MjData(plant.model)
    model, torque = mujoco.MjData(nominal), np.zeros(n)
    low, high = nominal.jnt_range.T
    middle, reach = (low + high) / 2.0, 0.35 * (high - low)
    rate, phase = 2.0 * np.pi * rng.uniform(0.1, 0.7, (4, n)), rng.uniform(0.0, 2.0 * np.pi, (4, n))
    wave = lambda f, t, power: reach * np.mean(f(rate * t + phase) * rate**power, axis=0)  # noqa: E731
    true.qpos[:], true.qvel[:] = middle + wave(np.sin, 0.0, 0), wave(np.cos, 0.0, 1)
    q, tau, times = [], [], np.arange(0.0, SECONDS, STEP)
    for k, t in enumerate(times):
        if k % 2 == 0:
            off = middle + wave(np.sin, t, 0) - true.qpos, wave(np.cos, t, 1) - true.qvel
            model.qpos[:], model.qvel[:] = true.qpos, true.qvel
            mujoco.mj_forward(nominal, model)
            mujoco.mj_mulM(nominal, model, torque, -wave(np.sin, t, 2) + 40.0 * off[1] + 400.0 * off[0])
            torque += model.qfrc_bias
        made = torque.copy()
        for drive in plant.drive:
            made = drive(made)
        for force in plant.forces:
            made = made + force(t, true.qpos, true.qvel, torque)
        true.qfrc_applied[:] = made
        if k % EVERY == 0:
            q.append(true.qpos.copy())
            tau.append(torque.copy())
        mujoco.mj_step(plant.model, true)
    t, q, tau = times[::EVERY], np.array(q), np.array(tau)
    for log in plant.log:
        t, q, tau = log(t, q, tau)
    if noisy:
        q = q + 1e-5 * rng.normal(size=q.shape)
        tau = tau + 0.01 * np.sqrt(np.mean(tau**2, axis=0)) * rng.normal(size=tau.shape)
    names = tuple(nominal.joint(i).name for i in range(n))
    return Recording(t - t[0], q, tau, names, source="by hand")


def sizes_of(arm: str) -> Sizes:
    """How large things are along a motion of the unaltered arm."""
    model = spec_of(arm).compile()
    r = recorded(model, Plant(model, [], [], []), np.random.default_rng(0), noisy=False)
    qd = np.gradient(r.q, r.t, axis=0)
    rms = lambda x: np.sqrt(np.mean(x**2, axis=0))  # noqa: E731
    return Sizes(rms(r.tau), rms(qd), rms(np.gradient(qd, r.t, axis=0)), np.std(r.q, axis=0))


def case(seed: int) -> tuple[str, Robot, list[Recording], list[dict]]:
    """An arm, its nominal model, two recordings, and what is hidden in them: every sixth case hides nothing."""
    rng = np.random.default_rng([seed, 140])
    arm = list(ARMS)[seed % len(ARMS)]
    sizes = sizes_of(arm)
    nominal = spec_of(arm).compile()
    true = spec_of(arm).compile()
    wrong(true, rng)
    plant, truth = Plant(true, [], [], []), []
    count = 0 if (seed // len(ARMS)) % 6 == 5 else int(rng.choice([1, 1, 2]))
    for slug in rng.choice(list(LAWS), count, replace=False):
        j = int(rng.integers(nominal.nv))
        values = LAWS[slug](plant, j, rng.uniform(0.06, 0.25) * sizes.tau[j], sizes, rng)
        names = [nominal.joint(i).name for i in (range(nominal.nv) if slug in EVERYWHERE else [j])]
        truth.append({"effect": str(slug), "joints": names, "parameters": {k: float(v) for k, v in values.items()}})
    recordings = [recorded(nominal, plant, rng) for _ in range(2)]
    return arm, robot_from_model(nominal, source=arm), recordings, truth


@dataclasses.dataclass(frozen=True)
class Config:
    """Which cases."""

    first: int = 0
    last: int = 71
    out: pathlib.Path = pathlib.Path("results")
    table: bool = False
    """Only write the page from the results that are there."""


def judged(seed: int) -> dict:
    arm, robot, recordings, truth = case(seed)
    d = diagnose(robot, recordings).diagnosis
    key = lambda f: (f["effect"], *sorted(f["joints"]))  # noqa: E731
    named, hidden = {key(f): f for f in d["findings"]}, {key(e): e for e in truth}
    return {
        "seed": seed, "arm": arm, "truth": truth, "found": d["findings"], "unexplained": d["unexplained"],
        "verdict": d["verdict"], "fit": d["fit"], "exact": set(named) == set(hidden),
        "not_testable": [x for x in d["not_testable"] if x["effect"] in {e["effect"] for e in truth}],
    }  # fmt: skip


def say(items: list[dict]) -> str:
    """Effects with their joints, in words."""
    return "; ".join(f"{i['effect']} on {', '.join(i['joints'])}" for i in items) or "nothing"


def table(cases: list[dict]) -> str:
    """The page with all figures."""
    key = lambda f: (f["effect"], *sorted(f["joints"]))  # noqa: E731
    lines = [
        OPENING,
        "| arm | cases | exact, nothing added | effects hidden | named | listed as not testable | findings not there |",
        "|---|---|---|---|---|---|---|",
    ]
    misses, values = [], []
    for arm, part in [*((a, [c for c in cases if c["arm"] == a]) for a in ARMS), ("all", cases)]:
        hidden = [(c, e) for c in part for e in c["truth"]]
        missed = [(c, e) for c, e in hidden if key(e) not in {key(f) for f in c["found"]}]
        listed = sum(e["effect"] in {x["effect"] for x in c["not_testable"]} for c, e in missed)
        added = sum(key(f) not in {key(e) for e in c["truth"]} for c in part for f in c["found"])
        counts = (len(part), sum(c["exact"] for c in part), len(hidden), len(hidden) - len(missed), listed, added)
        lines.append(f"| {arm} | {' | '.join(map(str, counts))} |")
    for c in cases:
        found = {key(f): f["parameters"] for f in c["found"]}
        for e in c["truth"]:
            own = found.get(key(e), {})
            values += [(own[k]["value"], own[k]["std"], v) for k, v in e["parameters"].items() if k in own and v]
        if not c["exact"]:
            misses.append(f"| {c['seed']} | {c['arm']} | {say(c['truth'])} | {say(c['found'])} | {c['verdict']} |")
    error = np.median([abs(v / true - 1.0) for v, _, true in values])
    cover = np.mean([abs(v - true) <= 1.645 * std for v, std, true in values])
    clean = [c for c in cases if not c["truth"]]
    false = sum(len(c["found"]) for c in clean)
    lines += [
        "",
        f"Nothing was hidden in {len(clean)} of them; findings there: {false}. Median error of the parameters of what",
        f"is named {100 * error:.2g} %; {100 * cover:.0f} % of their 90 % intervals cover the truth.",
        "",
        "## Every case that is not exact",
        "",
        "| case | arm | hidden | found | verdict |",
        "|---|---|---|---|---|",
        *misses,
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "arms_by_hand.jsonl"
    read = lambda: [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []  # noqa: E731
    done = {c["seed"] for c in read()}
    for seed in range(config.first, config.last + 1) if not config.table else ():
        if seed in done:
            continue
        c = judged(seed)
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(c) + "\n")
        mark = "ok  " if c["exact"] else "MISS"
        hidden, found = say(c["truth"]), say(c["found"])
        print(f"{mark} {seed} {c['arm']}: hidden {hidden}; found {found}; {c['verdict']}", flush=True)
    PAGE.write_text(table(sorted(read(), key=lambda c: c["seed"])), encoding="utf-8")


if __name__ == "__main__":
    main()
