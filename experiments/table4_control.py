"""Sliding mode control with the identified models: Table 4, figures 14 to 17 and what the text says of them.

    python experiments/table4_control.py                  # three joints, as in the study; some minutes
    python experiments/table4_control.py --joints 6       # the whole arm
    python experiments/table4_control.py --robot arm.xml  # any other arm; with the boundary layer only
    python experiments/table4_control.py --devices 2      # runs shared among two devices
    python experiments/table4_control.py --smoke          # a minute

The identified sets are those that table3_swarms.py of the same arm stored.  Every reading is stored when it is done; an
interrupted run goes on after it.  Writes table4_runs.parquet, one row a run, beside the table and the figures.
"""

import dataclasses
import hashlib
import itertools
import json
import pathlib
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import tyro
from study_arm import StudyArm, StudyConfig
from study_provenance import made
from table4_report import write_report

from irb140_jax import control, dynamics, kinematics, simulate
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.dynamics.mass import mass_matrix
from irb140_jax.errors import InputError
from irb140_jax.oracle.closed_loop import sliding_mode_loop
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import Robot

MODELS = ("reference", "PSO", "QPSO")
CONDITIONS = ("nominal", "disturbed")
SIDES = ("controller", "plant", "both")
# f of the law, and which speeds C acts on.
LAWS = (("saturation", "computed"), ("tanh", "computed"), ("sign", "computed"), ("saturation", "passivity"))
SETTLED = 2.0  # [s] after which tracking and roughness count: the error at the start has died out
EARLY, THIRD = 2.0, 1.0 / 3.0  # [s], and of the duration: when energy is read off beside the end
THIN = 20  # of the samples, one in so many goes into the figures
PATHS = 5  # of those again, for the paths of all seeds
# Our own choices, each changed alone, in the reading that changes least else.
SENSITIVITY = (
    ("layer", 0.02), ("layer", 0.5), ("slope", 5.0), ("slope", 20.0), ("authority", 10.0), ("authority", 40.0),
    ("start_error", 0.05), ("start_error", 0.2), ("frequency", 0.25), ("frequency", 4.0), ("share", 0.2),
)  # fmt: skip
BASE = ("controller", "of peak", ("saturation", "computed"))
FOURIER_SPEED = 0.1  # share of the joints' largest speeds, for arms that can't follow the circle: as calm as that


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What the text leaves open is an option; defaults are ours.

    Attributes:
        seeds: Of the stored sets, so many.
        duration: Of the motion [s].
        dt: Step [s].
        radius: Of the circle [m]; default 0.1, less for an arm that is too short for it.
        start_error: Offset of every joint at the start [rad or m], for rise, settling and overshoot to have a meaning.
        share: Of the disturbance: of each joint's largest torque along the motion, or of its momentary torque.
        frequency: Of the disturbance [Hz].
        slope: Rate at which the error dies out on the sliding surface [1/s].
        layer: Half width of the boundary layer [rad/s or m/s].
        authority: Acceleration that the switching gain stands for [rad/s^2 or m/s^2].
        rotors: Whether rotor inertia counts; the study has none. Default: with other arms than the study's, whose light
            wrists need it.
        laws: How many of the control's laws are tried, from the first of `LAWS` on; of the study's own arm.
        oracle: Whether to run MuJoCo beside it, one run per model, condition and side.
    """

    seeds: int = 30
    duration: float = 30.0
    dt: float = 0.001
    radius: float | None = None
    start_error: float = 0.1
    share: float = 0.4
    frequency: float = 1.0
    slope: float = 10.0
    layer: float = 0.1
    authority: float = 20.0
    rotors: bool | None = None
    laws: int = len(LAWS)
    oracle: bool = True


def reduced(config: Config) -> Config:
    """The same in seconds."""
    if not config.smoke:
        return config
    return dataclasses.replace(config, seeds=2, duration=5.0, dt=0.002)


def arm_of(config: Config, study: StudyArm) -> Robot:
    """The first joints of the arm, as a rigid body as the study has it."""
    robot = study.reduced()
    rotors = not study.is_studys if config.rotors is None else config.rotors
    return eqx.tree_at(lambda r: r.armature, robot, robot.armature if rotors else jnp.zeros(robot.n))


def identified(config: Config, study: StudyArm) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Centres of mass (seeds, n, 3) and inertias (seeds, n, 3, 3) of each model, what is beyond counted to the last.

    Raises:
        InputError: There are no stored sets, or they are of another arm.
    """
    path = config.folder(study) / "table3_sets.json"
    if not path.is_file():
        raise InputError(f"{path} is not there; run experiments/table3_swarms.py with the same arm and folder first")
    stored = json.loads(path.read_text(encoding="utf-8"))
    if not np.array_equal(stored["reference"], np.asarray(study.x)):
        raise InputError(f"{path} holds sets of '{stored['arm']}', not of '{study.name}'; run table3_swarms.py for it")
    x = {"reference": np.repeat(np.asarray(study.x)[None], config.seeds, 0)}
    x |= {model: np.asarray(stored["sets"][model])[: config.seeds] for model in MODELS[1:]}
    if any(len(values) < config.seeds for values in x.values()):
        raise InputError(f"{path} holds fewer than {config.seeds} sets; give --seeds, or run table3_swarms.py anew")
    reduced_arms = jax.jit(jax.vmap(study.reduced))
    arms = {model: reduced_arms(jnp.asarray(values)) for model, values in x.items()}
    return {model: (np.asarray(arm.com), np.asarray(arm.inertia)) for model, arm in arms.items()}


def with_set(arm: Robot, com: jax.Array, inertia: jax.Array) -> Robot:
    """The arm with other centres of mass and inertias; masses stay, as in the study."""
    return eqx.tree_at(lambda r: (r.com, r.inertia), arm, (com, inertia))


@dataclasses.dataclass(frozen=True)
class Task:
    """What all runs share."""

    arm: Robot
    reference: control.Reference
    motion: str
    peak: np.ndarray

    def settings(self, config: Config) -> dict[str, jax.Array]:
        """Numbers that a run may change without a new program."""
        told = {name: jnp.asarray(getattr(config, name)) for name in ("slope", "layer", "frequency")}
        gain = config.authority * jnp.diag(mass_matrix(self.arm, self.arm.reference))
        return told | {"gain": gain, "start": self.reference.q[0] + config.start_error}


def task_of(config: Config, arm: Robot) -> Task:
    """Motion, and the largest torque that each joint needs."""
    reference, motion = motion_of(config, arm)
    needed = dynamics.inverse_dynamics_batch(arm, reference.q, reference.qd, reference.qdd)
    peak = np.abs(np.asarray(needed)).max(axis=0)
    return Task(arm, reference, motion, peak)


def motion_of(config: Config, arm: Robot) -> tuple[control.Reference, str]:
    """The tool's circle; for an arm that can't follow it, a calm motion of its joints; and which, in words."""
    try:
        reference = control.circle(
            arm, duration=config.duration, dt=config.dt, radius=config.radius, ramp=min(2.0, config.duration / 4.0)
        )
    except InputError as reason:
        played = fourier_motion(arm, config.duration, 1.0 / config.dt, seed=0, speed=FOURIER_SPEED)
        reference = control.Reference(*map(jnp.asarray, (played.t, played.q, played.qd, played.qdd)))
        return reference, f"a Fourier motion of the joints, as the circle is not possible ({reason})"
    tool = np.asarray(_tool(arm, reference.q))
    radius = 0.5 * float(np.linalg.norm(tool - tool[0], axis=1).max())
    level = "level " * bool(np.ptp(tool[:, 2]) < 1e-6 * radius)
    return reference, f"a {level}circle of {radius:.3g} m radius in {config.duration:g} s"


def runs_of(config: Config, task: Task, law: tuple):
    """A function of (plant, model, push, share), lanes first, and settings, that runs them and reads all off them."""
    arm, reference = task.arm, task.reference
    wanted = reference.q[:-1]

    def one(lane, settings):
        plant, model, push, share = lane
        controller = control.sliding_mode(
            with_set(arm, *model), slope=settings["slope"], gain=settings["gain"], layer=settings["layer"],
            switching=law[0], form=law[1],
        )  # fmt: skip
        disturbance = simulate.SinusoidalTorque(push, share, settings["frequency"], jnp.zeros(()))
        run = simulate.rollout(with_set(arm, *plant), controller, reference, disturbance, q0=settings["start"])
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
            "energy_early": absolute[round(EARLY / config.dt)],
            "energy_third": absolute[round(THIRD * len(run.t))],
            "signed_energy": signed[-1],
        }
        traces = {"q": run.q[::THIN], "tau": run.tau[::THIN], "energy": absolute[::THIN], "tool": path}
        return measures, traces

    return partial(simulate.sweep, one, mesh=config.mesh)


def lanes(sets: dict, side: str, arm: Robot, push: np.ndarray, share: np.ndarray) -> tuple:
    """Plant, model, push and share of every lane, in the order model, seed, condition."""
    com, inertia = (np.concatenate([sets[m][k] for m in MODELS]) for k in (0, 1))
    found = np.repeat(com, 2, axis=0), np.repeat(inertia, 2, axis=0)
    true = tuple(np.broadcast_to(np.asarray(x), y.shape) for x, y in zip((arm.com, arm.inertia), found, strict=True))
    plant, model = (found if side in (part, "both") else true for part in ("plant", "controller"))
    on = np.tile([0.0, 1.0], len(com))[:, None]
    return jax.tree.map(jnp.asarray, (plant, model, on * push, on * share))


def by_mujoco(config: Config, task: Task, args: tuple, lane: int, switching: str) -> np.ndarray:
    """Joint positions of this lane by MuJoCo's engine and NumPy, shape (T, n).

    Raises:
        ValueError: No body can have the set, so that MuJoCo refuses it.
    """
    plant, model, push, share = jax.tree.map(lambda x: np.asarray(x)[lane], args)
    true, believed = (
        mujoco.MjModel.from_xml_string(mjcf(with_set(task.arm, *map(jnp.asarray, x)), config.dt))
        for x in (plant, model)
    )
    reference = task.reference
    wanted = (np.asarray(reference.q), np.asarray(reference.qd), np.asarray(reference.qdd))
    each, settings = np.ones(task.arm.n), task.settings(config)
    law = (config.slope * each, np.asarray(settings["gain"]), config.layer * each, switching)
    sine = lambda t: np.sin(2.0 * np.pi * config.frequency * t)  # noqa: E731
    disturbance = lambda t, tau: (push + share * tau) * sine(t)  # noqa: E731
    return sliding_mode_loop(true, believed, wanted, law, (np.asarray(settings["start"]), wanted[1][0]), disturbance)[0]


def run(config: Config) -> dict:
    """All readings; each is stored as it is done."""
    config, study = reduced(config), config.arm()
    arm, sets = arm_of(config, study), identified(config, study)
    task = task_of(config, arm)
    folder = config.folder(study) / "table4_runs"
    folder.mkdir(exist_ok=True)
    mark = _mark(config, sets, arm)
    readings, compiled = {}, {}

    def add(name: str, own: Config, reading: tuple) -> None:
        path = folder / f"{name}.npz"
        if not _is_done(path, mark):
            law = reading[2]
            compiled[law] = compiled.get(law) or runs_of(config, task, law)
            _store(path, mark, _reading(own, task, compiled[law], sets, reading))
            print(f"  done: {name}", flush=True)
        readings[name] = {"side": reading[0], "disturbance": reading[1], "law": list(reading[2])}

    # Other arms show whether the findings carry over; the text's open choices are the study's own.
    whole = study.is_studys and not config.smoke
    for law in LAWS[: config.laws] if whole else LAWS[:1]:
        for side, kind in itertools.product(SIDES, ("of peak", "of torque")):
            add(" ".join((side, kind, *law)).replace(" ", "_"), config, (side, kind, law))
        for option, value in SENSITIVITY if whole and law == BASE[2] else ():
            name = f"choice_{option}_{value:g}"
            add(name, dataclasses.replace(config, **{option: value}, oracle=False), BASE)
            readings[name]["choice"] = [option, value, getattr(config, option)]
    tool = _tool(arm, task.reference.q[:-1][::THIN])
    t = np.asarray(task.reference.t[:-1][::THIN])
    np.savez(folder / "shared.npz", t=t, tool=np.asarray(tool))
    return {
        "made": made(config.said()), "config": config.said(), "robot": study.name, "joints": list(arm.joint_names),
        "motion": task.motion, "gain": np.asarray(task.settings(config)["gain"]).tolist(),
        "peak_torque": task.peak.tolist(), "readings": readings,
    }  # fmt: skip


def _reading(config: Config, task: Task, compiled, sets: dict, reading: tuple[str, str, tuple]) -> dict:
    """Measures of all runs of a reading (model, seed, condition, ...), and traces of the first seed's."""
    (side, kind, law), none = reading, np.zeros(task.arm.n)
    push, share = (config.share * task.peak, none) if kind == "of peak" else (none, none + config.share)
    args = lanes(sets, side, task.arm, push, share)
    measures, traces = jax.block_until_ready(compiled(args, task.settings(config)))
    by = lambda x: np.asarray(x).reshape(len(MODELS), config.seeds, 2, *x.shape[1:])  # noqa: E731
    store = {f"measure_{key}": by(value) for key, value in measures.items()}
    tau, energy, tool = by(traces["tau"]), by(traces["energy"]).sum(axis=-1), by(traces["tool"])
    store["measure_torque_apart"] = np.sqrt(np.mean((tau - tau[:1]) ** 2, axis=-2))
    wanted = np.asarray(_tool(task.arm, task.reference.q[:-1][::THIN]))
    curves = {"tau": tau, "tau_apart": tau - tau[:1], "energy": energy, "energy_apart": energy - energy[:1],
              "miss": np.linalg.norm(tool - wanted, axis=-1)}  # fmt: skip
    # Lowest, middle and highest of the seeds: (model, 3, condition, time, ...).
    bands = {f"band_{key}": np.moveaxis(np.quantile(x, [0.0, 0.5, 1.0], axis=1), 0, 1) for key, x in curves.items()}
    store |= bands | {"paths": tool[:, :, 0, ::PATHS], "trace_q": by(traces["q"])[:, 0]}
    if config.oracle and law[1] == "computed" and kind == "of peak":
        store["mujoco"] = np.array([
            [_apart_from_mujoco(config, task, args, (m, c), law[0], store["trace_q"][m, c]) for c in range(2)]
            for m in range(len(MODELS))
        ])  # fmt: skip
    return store


def _apart_from_mujoco(config: Config, task: Task, args: tuple, place: tuple[int, int], switching: str, q) -> float:
    """Largest difference of a joint's position [rad or m] in the first seed's run; NaN where MuJoCo refuses the set."""
    model, condition = place
    try:
        theirs = by_mujoco(config, task, args, model * config.seeds * 2 + condition, switching)
    except ValueError:
        return float("nan")
    return float(np.abs(theirs[::THIN] - q).max())


@jax.jit
def _tool(arm: Robot, q: jax.Array) -> jax.Array:
    """Where the tool is along a motion [m], shape (T, 3)."""
    return jax.vmap(lambda q: kinematics.forward_kinematics(arm, q)[:3, 3])(q)


def _mark(config: Config, sets: dict, arm: Robot) -> str:
    """What a stored result depends on, in one number."""
    told = {name: value for name, value in config.said().items() if name != "laws"}
    digest = hashlib.sha256(repr(told).encode())
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


def main(config: Config) -> None:
    """Run what is missing, write table and figures."""
    set_up_compilation_cache()
    study = config.arm()
    for path in write_report(run(config), config.folder(study), config.figure_folder(study)):
        print(path)


if __name__ == "__main__":
    main(tyro.cli(Config))
