"""The study's future research: swarms judged by the tracking, torque smoothness or energy of a controlled motion.

    python experiments/tracking_swarms.py [--robot arm.xml] [--joints n] [--smoke]   # 14 minutes of one core
    python experiments/tracking_swarms.py --circle                                   # two hours of one core

A candidate is what the controller believes of the arm; the arm itself is the true one.  Each candidate drives the arm
along a lively motion for some seconds, or along the study's own motion, the circle in 30 s.  Two questions: what do
these objectives identify, and which parameters can no closed loop see?  Every search is stored when it is done, and an
interrupted run goes on after the last.  Writes tracking_runs.parquet (one row a run), tracking_swarms.json and .md, and
figure_tracking.svg; with --circle tracking_circle_runs.parquet, tracking_circle.json and .md.
"""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import dataclasses
import hashlib
import itertools
import json
import pathlib
import time
from collections.abc import Callable
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import tyro
from jaxtyping import Array, Float
from study_arm import StudyArm, StudyConfig
from study_provenance import made, store
from study_readings import ITERATIONS, PARTICLES, SEEDS, Reading, rule
from study_statistics import Test, tested
from tracking_report import figure, page

from irb140_jax import control, simulate, swarm
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.dynamics import regressor_batch
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import Robot
from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Scalar

OBJECTIVES = ("tracking", "smoothness", "energy", "all three")
# Both algorithms with the weight that decreases as section 2.7 says, and a limit to speed: they converge.
RULES = {
    "PSO": rule(Reading("pso", "w 0.99 to 0.4", 0.1)),
    "QPSO": rule(Reading("qpso", "w 0.99 to 0.4", 0.05)),
}
ENCODER = np.radians(0.01)  # [rad] resolution of the IRB 140's joints by its specification
VISIBLE_CHANGE = 0.1  # share by which parameters change when visibility is asked: between PSO's error and the box
ROUND_OFF = 1e-9  # share of the largest singular value below which a direction is not there at all
MEASURES = ("tracking", "smoothness", "energy")


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What to run.

    Attributes:
        circle: Judge along the circle of Table 4 in place of the lively motion.
        seeds: Runs of each search.
        duration: Of the lively motion [s].
        dt: Half of a step of Runge-Kutta's [s].  Its error must stay below what the parameters do: Euler's own at 4 ms,
            half a milliradian, is not zero at the truth, so that tracking would lead away from it.
        width: Half of the box's width, as a fraction of the truth.
        speed: Of the motion, as a share of the joints' largest speeds.
        circle_duration: Of the circle [s].
        circle_dt: Half of a step there [s]; the motion is so calm that the error is a ten-thousandth of a candidate's.
    """

    circle: bool = False
    seeds: int = SEEDS
    duration: float = 1.6
    dt: float = 0.002
    width: float = 0.5
    speed: float = 0.6
    circle_duration: float = 30.0
    circle_dt: float = 0.004

    @property
    def name(self) -> str:
        """What the files of results begin with."""
        return "tracking_circle" if self.circle else "tracking"

    @property
    def motion(self) -> str:
        """What the arm is driven along."""
        return "circle" if self.circle else "Fourier motion"

    @property
    def size(self) -> dict[str, Any]:
        """Particles and iterations."""
        return {"particles": 6, "iterations": 3} if self.smoke else {"particles": PARTICLES, "iterations": ITERATIONS}


@dataclasses.dataclass(frozen=True, eq=False)
class Loop:
    """A closed loop as a function of what the controller believes.

    Attributes:
        study: The arm and what is sought of it.
        plant: The true arm.
        reference: The motion.
        regressor: Of torque along it, shape (S, n, 10 n).
    """

    study: StudyArm
    plant: Robot
    reference: control.Reference
    regressor: np.ndarray

    def motion(self, x: Float[Array, " d"], integrator: simulate.AbstractIntegrator) -> Trajectory:
        """The arm's motion under a controller that believes x; gains are those of the true model."""
        gain = control.sliding_mode(self.plant).gain
        controller = control.sliding_mode(self.model(x), gain=gain)
        return simulate.rollout(self.plant, controller, self.reference, integrator=integrator)

    def model(self, x: Float[Array, " d"]) -> Robot:
        """The true arm with the inertials of x; its geometry stays concrete, which compiles to quicker code."""
        believed = self.study.reduced(x)
        return eqx.tree_at(lambda r: (r.com, r.inertia), self.plant, (believed.com, believed.inertia))

    def torque(self, x: Float[Array, " d"]) -> Float[Array, "S n"]:
        """Joint torques along the wanted motion, rotors left out."""
        return jnp.asarray(self.regressor) @ self.model(x).phi.ravel()

    def measures(self, x: Float[Array, " d"]) -> dict[str, Scalar]:
        """Tracking error [rad or m], roughness [N m/s or N/s] and energy [J], all joints together."""
        run = self.motion(x, simulate.RungeKutta4())
        tracking = simulate.tracking_error(run, self.reference.q[: 2 * len(run.t) : 2])
        energy, _ = simulate.energies(run)
        return {
            "tracking": jnp.linalg.norm(tracking), "smoothness": jnp.linalg.norm(simulate.roughness(run)),
            "energy": jnp.sum(energy[-1]),
        }  # fmt: skip

    @cached_property
    def measures_of(self) -> Callable[[Float[Array, "s d"]], dict[str, Float[Array, " s"]]]:
        """Of many sets at once, compiled once."""
        return jax.jit(jax.vmap(self.measures))


def loop_of(config: Config, study: StudyArm, seed: int) -> Loop:
    """A Fourier motion of the first joints."""
    plant = plant_of(study)
    played = fourier_motion(plant, config.duration, 1.0 / config.dt, seed=seed, speed=config.speed)
    return _loop(study, plant, control.Reference(*map(jnp.asarray, (played.t, played.q, played.qd, played.qdd))))


def circle_loop_of(config: Config, study: StudyArm) -> Loop:
    """The circle of the tool, as in Table 4."""
    plant = plant_of(study)
    return _loop(study, plant, control.circle(plant, duration=config.circle_duration, dt=config.circle_dt))


def plant_of(study: StudyArm) -> Robot:
    """The true arm; the study's has no rotors."""
    plant = study.reduced()
    rotors = plant.armature if not study.is_studys else jnp.zeros(plant.n)
    return eqx.tree_at(lambda r: r.armature, plant, rotors)


def _loop(study: StudyArm, plant: Robot, reference: control.Reference) -> Loop:
    regressor = np.asarray(regressor_batch(plant, reference.q, reference.qd, reference.qdd))
    return Loop(study, plant, reference, regressor)


def objective(name: str, loop: Loop, truth: dict[str, float]) -> Callable[[Float[Array, " u"], Scalar], Scalar]:
    """Fitness of the unknowns: one measure, or all three, each as a multiple of what the true model reaches."""

    def fitness(unknowns: Float[Array, " u"], progress: Scalar) -> Scalar:
        measures = loop.measures(loop.study.unknowns.full(unknowns))
        return measures[name] if name in measures else jnp.sum(jnp.stack([measures[k] / truth[k] for k in measures]))

    return fitness


def seen(loop: Loop) -> dict:
    """Which parameters the closed loop shows: singular values of d(joint errors)/dx at the truth, x in units of itself.

    A parameter's share is the squared length of its projection onto the directions that show at all; torque's own
    share, through the regressor along the same motion, stands beside it.
    """
    study = loop.study
    place, size = study.unknowns.place, jnp.abs(study.unknowns.start)
    # Derivatives by the simpler integrator: its own error does not depend on what the controller believes.
    errors = lambda y: loop.motion(study.unknowns.full(y * size), simulate.SemiImplicitEuler()).q.ravel()  # noqa: E731
    J = np.asarray(jax.jit(jax.jacfwd(errors))(study.unknowns.start / size))
    torques = lambda y: loop.torque(study.unknowns.full(y * size)).ravel()  # noqa: E731
    Y = np.asarray(jax.jit(jax.jacfwd(torques))(study.unknowns.start / size))
    told: dict[str, Any] = {"names": [study.unknowns.names[i] for i in place]}
    for name, matrix in (("tracking", J), ("torque", Y)):
        _, values, directions = np.linalg.svd(matrix, full_matrices=False)
        shown = values > ROUND_OFF * values[0]
        told[name] = {
            "rank": int(shown.sum()), "singular_values": values.tolist(),
            "share": np.sum(directions[shown] ** 2, axis=0).tolist(),
        }  # fmt: skip
    # Root mean square over the samples of a joint error that a change along each direction makes.
    rms = np.array(told["tracking"]["singular_values"]) * VISIBLE_CHANGE / np.sqrt(len(J) / loop.plant.n)
    told["above_encoder"] = int((rms > ENCODER).sum())
    return told


def search(config: Config, loop: Loop, name: str, algorithm: str, truth: dict[str, float]) -> dict[str, np.ndarray]:
    """What the seeds of one search found, the processor time that it took [s], and the commit that ran it."""
    study, started = loop.study, time.process_time()
    lower, upper = box_of(config, study)
    found = swarm.minimise(
        objective(name, loop, truth), RULES[algorithm], lower, upper, keys=swarm.seed_keys(config.seeds), **config.size
    )
    x, fitness = np.asarray(study.unknowns.full(found.x)), np.asarray(found.fitness)
    commit = made(config.said())["commit"]
    return {"x": x, "fitness": fitness, "seconds": np.array(time.process_time() - started), "commit": np.array(commit)}


def box_of(config: Config, study: StudyArm) -> tuple[Float[Array, " u"], Float[Array, " u"]]:
    """Where the candidates lie; the truth is not in its middle."""
    place = np.random.default_rng(0).uniform(size=study.x.shape)
    return study.unknowns.box(config.width, place=jnp.asarray(place))


def judged(name: str, algorithm: str, x: np.ndarray, loops: tuple[Loop, Loop]) -> pd.DataFrame:
    """One row a run: errors of the parameters, and what the set does in the loop that was searched and in another."""
    study = loops[0].study
    com, inertia = study.unknowns.mape(x)
    own, other = (loop.measures_of(jnp.asarray(x)) for loop in loops)
    tau, true = (np.asarray(jax.vmap(loops[1].torque)(jnp.asarray(y))) for y in (x, np.asarray(study.x)[None]))
    told = {"objective": name, "algorithm": algorithm, "seed": np.arange(len(x)), "com": com, "inertia": inertia}
    told |= {key: np.asarray(value) for key, value in own.items()}
    told |= {f"unseen_{key}": np.asarray(value) for key, value in other.items()}
    return pd.DataFrame(told | {"torque_rmse": np.sqrt(np.mean((tau - true) ** 2, axis=(1, 2)))})


def run(config: Config, study: StudyArm) -> tuple[pd.DataFrame, dict]:
    """All searches, those stored taken from there, one row a run; and what is told of the motion.

    The middle of the box stands beside what was found.
    """
    judging = circle_loop_of(config, study) if config.circle else loop_of(config, study, seed=1)
    loops = judging, judging if config.smoke else loop_of(config, study, seed=2)
    tried = [("tracking", "PSO")] if config.smoke else list(itertools.product(OBJECTIVES, RULES))
    alike = lambda x: jnp.tile(jnp.asarray(x), (config.seeds, 1))  # noqa: E731  in the shape that is compiled anyway
    truth, unseen = (
        {key: float(value[0]) for key, value in loop.measures_of(alike(study.x)).items()} for loop in loops
    )
    folder = config.folder(study) / f"{config.name}_runs"
    folder.mkdir(exist_ok=True)
    mark = _mark(config, loops[0])
    frames, seconds, commits = [], [], set()
    for name, algorithm in tried:
        path = folder / f"{config.motion}_{name}_{algorithm}.npz".replace(" ", "_")
        found = _stored(path, mark, lambda n=name, a=algorithm: search(config, loops[0], n, a, truth))
        frames.append(judged(name, algorithm, found["x"], loops))
        seconds.append(float(found["seconds"]))
        commits.add(str(found["commit"]))
        print(f"  done: {config.motion}, {name}, {algorithm}", flush=True)
    middle = np.asarray(alike(study.unknowns.full(0.5 * sum(box_of(config, study)))))
    frames.append(judged("middle of the box", "", middle, loops).iloc[:1])
    told = {"truth": truth, "truth_unseen": unseen, "seeds": config.seeds, "seconds": sum(seconds)}
    told |= {"commits": sorted(commits), "seen": seen(loops[0])}
    return pd.concat(frames, ignore_index=True), told


def rows_of(frame: pd.DataFrame) -> list[dict]:
    """One row a search: means of its runs, deviations of the errors."""
    rows = []
    for (objective, algorithm), runs in frame.groupby(["objective", "algorithm"], sort=False):
        mean = runs.drop(columns=["objective", "algorithm", "seed"]).mean()
        row = {"objective": objective, "algorithm": algorithm, "runs": len(runs)}
        row |= {key: float(mean[key]) for key in ("com", "inertia", "torque_rmse")}
        row |= {f"{key}_sd": float(runs[key].std()) if len(runs) > 1 else 0.0 for key in ("com", "inertia")}
        row["measures"] = {key: float(mean[key]) for key in MEASURES}
        rows.append(row | {"unseen": {key: float(mean[f"unseen_{key}"]) for key in MEASURES}})
    return rows


def tests_of(config: Config, frame: pd.DataFrame, file: str) -> list[Test]:
    """QPSO against PSO at each objective, by what the sets are worth: their errors, unseen torque."""
    of = lambda objective, by: (("objective", objective), ("algorithm", by))  # noqa: E731
    return [
        Test(config.name, f"{config.motion}, {name}: {key}, QPSO lower than PSO", file, key, of(name, "QPSO"),
             of(name, "PSO"))
        for name in frame.loc[frame["algorithm"] == "QPSO", "objective"].unique()
        for key in ("com", "inertia", "torque_rmse")
    ]  # fmt: skip


def _mark(config: Config, loop: Loop) -> str:
    """What a stored search depends on, in one number."""
    digest = hashlib.sha256(repr((config.seeds, config.width, config.size)).encode())
    for leaf in (loop.study.x, *jax.tree.leaves((loop.plant, loop.reference))):
        digest.update(np.ascontiguousarray(leaf).tobytes())
    return digest.hexdigest()


def _stored(path: pathlib.Path, mark: str, compute: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """What a search found, computed unless it is stored for the same choices."""
    if path.is_file():
        with np.load(path) as there:
            if str(there["mark"]) == mark:
                return dict(there)
    found, part = compute(), path.with_suffix(".part.npz")
    np.savez(part, mark=np.array(mark), **found)
    part.replace(path)
    return found


def main(config: Config) -> None:
    """Search, judge, write."""
    set_up_compilation_cache()
    config = dataclasses.replace(config, seeds=2, duration=0.2) if config.smoke else config
    study = config.arm()
    folder = config.folder(study)
    frame, told = run(config, study)
    file = f"{config.name}_runs.parquet"
    store(frame, folder / file)
    own = made(config.said()) | {"commits": told["commits"]}
    result = {"made": own, "config": config.said(), "arm": study.name, **told, "rows": rows_of(frame)}
    result |= {"motion": config.motion, "tests": tested(tests_of(config, frame, file), folder)}
    stem = config.name if config.circle else "tracking_swarms"
    (folder / f"{stem}.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    (folder / f"{stem}.md").write_text(page(result), encoding="utf-8")
    if not config.circle:
        figure(result, config.figure_folder(study) / "figure_tracking.svg")
    print(page(result))


if __name__ == "__main__":
    main(tyro.cli(Config))
