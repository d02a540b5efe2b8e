"""Sliding mode control with the identified models: Table 4, figures 14 to 17 and what the text says of them.

    python experiments/table4_control.py                 # three joints, as in the study; some minutes
    python experiments/table4_control.py --joints 6      # the whole arm
    python experiments/table4_control.py --robot ARM.xml # any other arm's first joints
    python experiments/table4_control.py --smoke         # seconds

Identified sets are those of results/table3_swarms.json if it is there; else random ones at the published errors, and
the table says so.  Every reading is stored in results/ when it is done; an interrupted run goes on after it.
"""

import dataclasses
import hashlib
import itertools
import json
import pathlib
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import tyro
from table4_report import write_report

from irb140_jax import control, dynamics, kinematics, simulate
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.oracle.closed_loop import sliding_mode_loop
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.robot import Robot, first_joints, irb140, load_robot

MODELS = ("reference", "PSO", "QPSO")
CONDITIONS = ("nominal", "disturbed")
SIDES = ("controller", "plant", "both")
# f of the law, and which speeds C acts on.
LAWS = (("saturation", "computed"), ("tanh", "computed"), ("sign", "computed"), ("saturation", "passivity"))
# Mean absolute percentage errors that the study gives, of centres of mass and of inertias.
PUBLISHED_MAPE = {"PSO": (2.94, 4.66), "QPSO": (0.43, 0.76)}
SETTLED = 2.0  # [s] after which tracking and roughness count: the error at the start has died out
THIN = 20  # of the samples, one in so many goes into the figures


@dataclasses.dataclass(frozen=True)
class Config:
    """What the text leaves open is an option; defaults are ours."""

    robot: pathlib.Path | None = None
    """Model file of another arm; its first joints take the IRB 140's place."""
    joints: Literal[3, 6] = 3
    seeds: int = 30
    duration: float = 30.0
    dt: float = 0.001
    radius: float = 0.1
    start_error: float = 0.1
    """Offset of every joint at the start [rad], for rise, settling and overshoot to have a meaning."""
    share: float = 0.4
    """Of the disturbance: of each joint's largest torque along the motion, or of its momentary torque."""
    frequency: float = 1.0
    """Of the disturbance [Hz]."""
    rotors: bool | None = None
    """Whether rotor inertia counts; the study has none. Default: with six joints only, whose wrist needs it."""
    oracle: bool = True
    """Whether to run MuJoCo beside it, one run per model, condition and side."""
    smoke: bool = False
    out: pathlib.Path = pathlib.Path("results")


def reduced(config: Config) -> Config:
    """The same in seconds."""
    if not config.smoke:
        return config
    return dataclasses.replace(config, seeds=2, duration=5.0, dt=0.002)


def arm_of(config: Config) -> Robot:
    """The first joints of the arm, as a rigid body as the study has it."""
    robot = first_joints(irb140() if config.robot is None else load_robot(config.robot), config.joints)
    zero = jnp.zeros(robot.n)
    rotors = config.joints == 6 if config.rotors is None else config.rotors
    fields = lambda r: (r.armature, r.damping, r.frictionloss, r.stiffness)  # noqa: E731
    return eqx.tree_at(fields, robot, (robot.armature if rotors else zero, zero, zero, zero))


def identified(config: Config, arm: Robot) -> tuple[dict[str, tuple[np.ndarray, np.ndarray]], str]:
    """Centres of mass (seeds, n, 3) and inertias (seeds, n, 3, 3) of each model, and where they come from."""
    com, inertia = np.asarray(arm.com), np.asarray(arm.inertia)
    rows, cols = np.triu_indices(3)
    exact = np.repeat(com[None], config.seeds, 0), np.repeat(inertia[None], config.seeds, 0)
    sets, path = {"reference": exact}, config.out / "table3_swarms.json"
    stored = json.loads(path.read_text(encoding="utf-8")).get("sets", {}) if path.is_file() else {}
    for number, model in enumerate(MODELS[1:]):
        values = np.asarray(stored.get(model, []), float)
        if values.ndim == 2 and values.shape[0] >= config.seeds and values.shape[1] == 9 * arm.n:
            values = values[: config.seeds]
            source = f"sets of {path}"
        else:
            rng = np.random.default_rng([number, 2631])
            # A normal deviate's mean size is sqrt(2 / pi) of its standard deviation.
            sigma = np.repeat(PUBLISHED_MAPE[model], (3 * arm.n, 6 * arm.n)) / 100.0 * np.sqrt(np.pi / 2.0)
            truth = np.concatenate([com.ravel(), inertia[:, rows, cols].ravel()])
            values = truth * (1.0 + sigma * rng.normal(size=(config.seeds, 9 * arm.n)))
            source = "random sets at the published mean errors"
        tensors = np.zeros((config.seeds, arm.n, 3, 3))
        tensors[..., rows, cols] = tensors[..., cols, rows] = values[:, 3 * arm.n :].reshape(-1, arm.n, 6)
        sets[model] = values[:, : 3 * arm.n].reshape(-1, arm.n, 3), tensors
    return sets, source


def with_set(arm: Robot, com: jax.Array, inertia: jax.Array) -> Robot:
    """The arm with other centres of mass and inertias; masses stay, as in the study."""
    return eqx.tree_at(lambda r: (r.com, r.inertia), arm, (com, inertia))


@dataclasses.dataclass(frozen=True)
class Task:
    """What all runs share."""

    arm: Robot
    reference: control.Reference
    start: jax.Array
    gain: jax.Array
    peak: np.ndarray


def task_of(config: Config, arm: Robot) -> Task:
    """Circle, start, gains by the true model, and the largest torque that each joint needs."""
    # With six joints the tool points down: straight, as at zero, the wrist is singular.
    posture = arm.reference.at[4].add(0.5 * jnp.pi) if config.joints == 6 else arm.reference
    reference = control.circle(
        arm, duration=config.duration, dt=config.dt, radius=config.radius, posture=posture,
        ramp=min(2.0, config.duration / 4.0),
    )  # fmt: skip
    needed = dynamics.inverse_dynamics_batch(arm, reference.q, reference.qd, reference.qdd)
    gain = control.sliding_mode(arm).gain
    return Task(arm, reference, reference.q[0] + config.start_error, gain, np.abs(np.asarray(needed)).max(axis=0))


def runs_of(config: Config, task: Task, law: tuple):
    """A function of plant, model and disturbance that runs one lane and reads everything off it."""
    arm, reference = task.arm, task.reference
    wanted = reference.q[:-1]

    def one(plant, model, push, share):
        controller = control.sliding_mode(with_set(arm, *model), gain=task.gain, switching=law[0], form=law[1])
        disturbance = simulate.SinusoidalTorque(push, share, jnp.asarray(config.frequency), jnp.zeros(()))
        run = simulate.rollout(with_set(arm, *plant), controller, reference, disturbance, q0=task.start)
        absolute, signed = simulate.energies(run)
        tool = jax.vmap(lambda q: kinematics.forward_kinematics(arm, q)[:3, 3])
        path = tool(run.q[::THIN])
        settled = (run.t[::THIN] >= SETTLED)[:, None]
        miss = jnp.where(settled, path - tool(wanted[::THIN]), 0.0)
        measures = {
            **jax.vmap(simulate.response, in_axes=(None, 1))(run.t, wanted - run.q)._asdict(),
            "tracking": simulate.tracking_error(run, wanted, SETTLED),
            "tool": jnp.sqrt(jnp.sum(miss**2) / jnp.sum(settled)),
            "roughness": simulate.roughness(run, SETTLED),
            "energy": absolute[-1],
            "signed_energy": signed[-1],
        }
        traces = {"q": run.q[::THIN], "tau": run.tau[::THIN], "energy": absolute[::THIN], "tool": path}
        return measures, traces

    return jax.jit(jax.vmap(one))


def lanes(sets: dict, side: str, arm: Robot, push: np.ndarray, share: np.ndarray) -> tuple:
    """Arguments of every lane, in the order model, seed, condition."""
    com, inertia = (np.concatenate([sets[m][k] for m in MODELS]) for k in (0, 1))
    found = np.repeat(com, 2, axis=0), np.repeat(inertia, 2, axis=0)
    true = tuple(np.broadcast_to(np.asarray(x), y.shape) for x, y in zip((arm.com, arm.inertia), found, strict=True))
    plant, model = (found if side in (part, "both") else true for part in ("plant", "controller"))
    on = np.tile([0.0, 1.0], len(com))[:, None]
    return plant, model, on * push, on * share


def by_mujoco(config: Config, task: Task, args: tuple, lane: int, switching: str) -> np.ndarray:
    """Joint positions of this lane by MuJoCo's engine and NumPy, shape (T, n)."""
    plant, model, push, share = jax.tree.map(lambda x: np.asarray(x)[lane], args)
    true, believed = (
        mujoco.MjModel.from_xml_string(mjcf(with_set(task.arm, *map(jnp.asarray, x)), config.dt))
        for x in (plant, model)
    )
    reference = task.reference
    wanted = (np.asarray(reference.q), np.asarray(reference.qd), np.asarray(reference.qdd))
    each = np.ones(task.arm.n)
    law = (10.0 * each, np.asarray(task.gain), 0.1 * each, switching)  # the defaults of control.sliding_mode
    sine = lambda t: np.sin(2.0 * np.pi * config.frequency * t)  # noqa: E731
    disturbance = lambda t, tau: (push + share * tau) * sine(t)  # noqa: E731
    return sliding_mode_loop(true, believed, wanted, law, (np.asarray(task.start), wanted[1][0]), disturbance)[0]


def run(config: Config) -> dict:
    """All readings; each is stored as it is done."""
    config = reduced(config)
    arm = arm_of(config)
    sets, source = identified(config, arm)
    task = task_of(config, arm)
    folder = config.out / f"table4_{config.joints}_joints"
    folder.mkdir(parents=True, exist_ok=True)
    mark = _mark(config, sets, arm)
    disturbances = {
        "of peak": (config.share * task.peak, np.zeros(arm.n)),
        "of torque": (np.zeros(arm.n), np.full(arm.n, config.share)),
    }
    readings = {}
    for law in LAWS[::3] if config.smoke else LAWS:
        compiled = runs_of(config, task, law)
        for side, (kind, (push, share)) in itertools.product(SIDES, disturbances.items()):
            name = " ".join((side, kind, *law)).replace(" ", "_")
            path = folder / f"{name}.npz"
            if not _is_done(path, mark):
                args = lanes(sets, side, arm, push, share)
                measures, traces = jax.block_until_ready(compiled(*args))
                by = lambda x: np.asarray(x).reshape(len(MODELS), config.seeds, 2, *x.shape[1:])  # noqa: E731
                store = {f"measure_{key}": by(value) for key, value in measures.items()}
                apart = by(traces["tau"]) - by(traces["tau"])[:1]
                store["measure_torque_apart"] = np.sqrt(np.mean(apart**2, axis=-2))
                store |= {f"trace_{key}": by(value)[:, 0] for key, value in traces.items()}  # the first seed's
                if config.oracle and law[1] == "computed" and kind == "of peak":
                    store["mujoco"] = np.array([
                        [np.abs(by_mujoco(config, task, args, _lane(config, m, c), law[0])[::THIN]
                                - store["trace_q"][m, c]).max() for c in range(2)]
                        for m in range(len(MODELS))
                    ])  # fmt: skip
                _store(path, mark, store)
                print(f"  done: {side}, disturbance {kind}, {', '.join(law)}", flush=True)
            readings[name] = str(path)
    shared = folder / "shared.npz"
    tool = jax.vmap(lambda q: kinematics.forward_kinematics(arm, q)[:3, 3])
    thin = task.reference.q[:-1][::THIN]
    np.savez(shared, t=np.asarray(task.reference.t[:-1][::THIN]), q=np.asarray(thin), tool=np.asarray(tool(thin)))
    return {
        "config": {key: str(value) for key, value in dataclasses.asdict(config).items()},
        "robot": arm.name, "joints": list(arm.joint_names), "sets": source, "gain": np.asarray(task.gain).tolist(),
        "peak_torque": task.peak.tolist(), "shared": str(shared), "readings": readings,
    }  # fmt: skip


def _lane(config: Config, model: int, condition: int) -> int:
    return (model * config.seeds) * 2 + condition


def _mark(config: Config, sets: dict, arm: Robot) -> str:
    """What a stored result depends on, in one number."""
    digest = hashlib.sha256(repr(dataclasses.replace(config, out=pathlib.Path())).encode())
    for leaf in jax.tree.leaves((sets, arm)):
        digest.update(np.ascontiguousarray(leaf).tobytes())
    return digest.hexdigest()


def _is_done(path: pathlib.Path, mark: str) -> bool:
    if not path.is_file():
        return False
    with np.load(path) as stored:
        return str(stored["mark"]) == mark


def _store(path: pathlib.Path, mark: str, arrays: dict) -> None:
    part = path.with_suffix(".part.npz")
    np.savez_compressed(part, mark=np.array(mark), **arrays)
    part.replace(path)


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    result = run(config)
    for path in write_report(result, config.out):
        print(path)


if __name__ == "__main__":
    main()
