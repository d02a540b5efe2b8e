"""The study's network for the kinematics: position error beside 0.48 and 0.61 mm, and what the penalty does; figure 12.

    python experiments/mlp_kinematics.py [--smoke] [--out results] [--figures docs/figures]

Every reading of the text is a case.  A case's training is saved every few epochs in results/mlp_kinematics/ and its
figures there when it is done, so an interrupted run goes on where it stopped.  Writes results/mlp_kinematics.json and
.md, and figure12.svg.
"""

import dataclasses
import json
import pathlib
import time
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import tyro
from mlp_report import FILE, figure12, page, runs_of, tests
from study_provenance import made, store

from irb140_jax import learned
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.robot import Robot, first_joints, irb140

SAMPLES, VALIDATION = 40_000, 10_000
# Samples of the second stage: 24,000 residuals for 353 weights.
REFINED_WITH = 8_000
# Epochs between two savings: some ten seconds.
CHUNK = 25
# Joint positions [deg] that the samples are spread over.
REGIONS = {
    # In front of the robot, where it works; the text says no more of where than "executing physical tasks".
    "task": ([-90.0, -30.0, -45.0], [90.0, 60.0, 30.0]),
    # Between the joint limits, all around.
    "whole": ([-180.0, -90.0, -230.0], [180.0, 110.0, 50.0]),
    # One branch of the inverse up to its ends: arm stretched at q3 = -90, tool over joint 1's axis at the other.
    "branch": ([-90.0, 20.0, -90.0], [90.0, 100.0, 45.0]),
}
HIDDEN = {
    "1 x 50": learned.ONE_LAYER_50,
    "4 x 122": learned.FOUR_LAYERS_488_TOTAL,
    "4 x 488": learned.FOUR_LAYERS_488_EACH,
}
# Bins of the condition number (2-norm) of the pose asked for.
BINS = (1.0, 5.0, 10.0, 20.0, 50.0, np.inf)


@dataclasses.dataclass(frozen=True)
class Config:
    """What to run and where to write.

    Attributes:
        out: Folder of the results.
        figures: Folder of the figure.
        smoke: Few samples and epochs, to see that all works.
        seeds: Trainings of each reading whose seeds are compared: with a penalty, without, and without a warm-up.
        few_seeds: Trainings of each of the readings nearest to the published errors; one takes minutes.
    """

    out: pathlib.Path = pathlib.Path("results")
    figures: pathlib.Path = pathlib.Path("docs/figures")
    smoke: bool = False
    seeds: int = 10
    few_seeds: int = 5

    @property
    def samples(self) -> tuple[int, int]:
        """For training and for validation."""
        return (400, 200) if self.smoke else (SAMPLES, VALIDATION)


@dataclasses.dataclass(frozen=True)
class Case:
    """One reading of the text.

    Attributes:
        direction: "forward", joints to position, or "inverse".
        region: One of `REGIONS`.
        hidden: One of `HIDDEN`.
        epochs: Longest training; chosen by what a core does in one to four minutes.
        batch: Samples per step.
        velocities: Whether velocities are inputs, too.
        loss: "mse" as section 3, or "mae" as equation 33.
        penalty: Form of the penalty of equation 33, or "none".
        weight: Of the penalty [m].
        rate: Of learning at the start.
        warm_up: Share of the epochs over which it rises to that, which the text does not name.
        refined: Steps of Levenberg-Marquardt afterwards, which the text does not name.
        seed: Of the first weights and of the order of the samples.
        optimiser: "plain" as the text tells, or "adam" with clipped steps, ours.
    """

    direction: learned.Direction
    region: str
    hidden: str
    epochs: int
    batch: int = 500
    velocities: bool = False
    loss: learned.Loss = "mse"
    penalty: learned.Form | Literal["none"] = "none"
    weight: float = 0.0
    rate: float = 0.01
    warm_up: float = 0.0
    refined: int = 0
    seed: int = 0
    optimiser: Literal["adam", "plain"] = "adam"

    def __str__(self) -> str:
        return self.reading + f", seed {self.seed}" * bool(self.seed)

    @property
    def reading(self) -> str:
        """What every seed of it shares."""
        parts = [self.direction, self.region, self.hidden]
        parts += ["plain gradient descent"] * (self.optimiser == "plain")
        parts += ["with velocities"] * self.velocities + ["MAE"] * (self.loss == "mae")
        parts += ["warmed up"] * bool(self.warm_up) + ["then Levenberg-Marquardt"] * bool(self.refined)
        return ", ".join(parts + [f"{self.penalty} penalty {self.weight:g}"] * (self.penalty != "none"))

    @property
    def settings(self) -> learned.Settings:
        """How to train."""
        return learned.Settings(epochs=self.epochs, batch=self.batch, rate=self.rate, warm_up=self.warm_up,
                                optimiser=self.optimiser)  # fmt: skip

    def task(self, robot: Robot) -> learned.Task:
        """What is asked."""
        weight = jnp.asarray(self.weight)
        penalty = None if self.penalty == "none" else learned.ConditionPenalty(weight, form=self.penalty)
        return learned.Task(robot, penalty, self.direction, self.velocities, self.loss)


# At the study's rate of 0.01 from the first step on, four or five of ten such networks get stuck.
WARM_UP = 0.05
COLD = (Case("inverse", "branch", "4 x 122", 60, loss="mae"), Case("inverse", "task", "4 x 122", 1000, 1000))
UNPENALISED, NEAREST_INVERSE = (dataclasses.replace(case, warm_up=WARM_UP) for case in COLD)
NEAR_SINGULAR = (
    UNPENALISED,
    dataclasses.replace(UNPENALISED, penalty="log", weight=1e-3),
    dataclasses.replace(UNPENALISED, penalty="log", weight=1e-2),
    dataclasses.replace(UNPENALISED, penalty="hinge", weight=1e-3),
    dataclasses.replace(UNPENALISED, penalty="sigmoid", weight=1e-2),
)
# The readings nearest to the published errors.
NEAREST = (Case("forward", "task", "1 x 50", 20, 250, refined=300), NEAREST_INVERSE)
ONCE = (
    Case("forward", "task", "1 x 50", 1500, 250),
    NEAREST[0],
    Case("inverse", "task", "1 x 50", 20, 250, refined=300),
    Case("forward", "task", "4 x 122", 600, 1000),
    COLD[0],
    *NEAR_SINGULAR,
    COLD[1],
    NEAREST[1],
    Case("forward", "task", "1 x 50", 1500, 250, optimiser="plain"),
    Case("inverse", "task", "1 x 50", 1500, 250, optimiser="plain"),
    Case("forward", "task", "1 x 50", 400, 250, velocities=True),
    Case("inverse", "task", "1 x 50", 400, 250, velocities=True),
    Case("inverse", "task", "4 x 122", 150, 1000, velocities=True, warm_up=WARM_UP),
    Case("forward", "whole", "4 x 122", 200, 500),
    # At a rate of 0.01 layers as wide as these are thrown out of the workspace by the first steps.
    Case("forward", "task", "4 x 488", 15, 250, rate=1e-3),
)


def cases_of(config: Config) -> tuple[Case, ...]:
    """What is trained: what a penalty or a warm-up changes is told from what a seed changes; the same seeds for all."""
    if config.smoke:
        return (NEAREST[0], UNPENALISED, dataclasses.replace(UNPENALISED, seed=1), NEAR_SINGULAR[2])
    more = [(seed, case) for seed in range(1, config.seeds) for case in (COLD[0], *NEAR_SINGULAR)]
    more += [(seed, case) for seed in range(1, config.few_seeds) for case in NEAREST]
    return (*ONCE, *(dataclasses.replace(case, seed=seed) for seed, case in more))


def samples_of(config: Config, case: Case, robot: Robot) -> tuple[learned.Samples, ...]:
    """Samples to learn from, others to validate with, and a third set that nothing is chosen by."""
    low, high = (jnp.radians(jnp.array(end)) for end in REGIONS[case.region])
    keys = jax.random.split(jax.random.key(sorted(REGIONS).index(case.region)))
    counts = (*config.samples, config.samples[1])
    keys = [*keys, jax.random.fold_in(keys[1], 1)]
    return tuple(learned.joint_samples(robot, low, high, n, key=k) for n, k in zip(counts, keys, strict=True))


def trained(config: Config, case: Case, folder: pathlib.Path) -> dict:
    """One row; what an earlier run saved of it is taken up."""
    robot = first_joints(irb140(), 3)
    task, settings = case.task(robot), case.settings._replace(epochs=4) if config.smoke else case.settings
    parts = samples_of(config, case, robot)
    state = learned.begin(task.network(parts[0], HIDDEN[case.hidden], key=jax.random.key(2 * case.seed)), settings)
    # Epochs after the end stay NaN.
    progress: Any = state, np.full((settings.epochs + CHUNK, len(learned.Curve._fields)), np.nan), np.zeros(1)
    saved = folder / f"{str(case).replace(' ', '_').replace(',', '')}.eqx"
    if saved.exists():
        progress = eqx.tree_deserialise_leaves(saved, progress)
    while not bool(progress[0].stopped(settings)):
        progress = _chunk(task, parts, settings, jax.random.key(2 * case.seed + 1), *progress)
        eqx.tree_serialise_leaves(saved, progress)
    state, curve, seconds = progress
    started = time.process_time()
    network, errors = _refined(task, parts, state.best, min(case.refined, 3) if config.smoke else case.refined)
    row = judged(task, network, *parts)
    row |= {"epochs": int(state.epoch), "seconds": _round(float(seconds[0]) + time.process_time() - started)}
    saved.unlink()
    head = {"name": str(case), "reading": case.reading, "case": dataclasses.asdict(case)}
    return {**head, **row, "curve": thinned(curve), "refinement": errors}


def _chunk(task, parts, settings: learned.Settings, key, state: learned.State, curve: np.ndarray, seconds: np.ndarray):
    """Some more epochs."""
    started, done = time.process_time(), int(state.epoch)
    state, more = learned.train(state, task, parts[0], parts[1], settings, CHUNK, key=key)
    curve[done : done + CHUNK] = np.stack(more, axis=1)
    print(f"  epoch {int(state.epoch)}, best {1e3 * float(state.best_error):.3f} mm", flush=True)
    return state, curve, seconds + time.process_time() - started


def _refined(task, parts, network: learned.KinematicMlp, steps: int) -> tuple[learned.KinematicMlp, list[float]]:
    """The second stage, and its errors on validation [m]; on a part of the samples, as they are many per weight."""
    state, errors = learned.begin_refinement(network), []
    if not steps:
        return network, errors
    part = jax.tree.map(lambda x: x[:REFINED_WITH], parts[0])
    while len(errors) < steps:
        state, more = learned.refine(state, task, part, parts[1], min(CHUNK, steps))
        errors += [_round(float(x)) for x in more]
        print(f"  step {len(errors)}, {1e3 * errors[-1]:.3f} mm", flush=True)
    return state.network, errors


def judged(task: learned.Task, network: learned.KinematicMlp, *parts: learned.Samples) -> dict:
    """Errors [mm] on all three sets; of an inverse, what it does near singular poses of the third one."""
    weights = sum(x.size for x in jax.tree.leaves(eqx.filter(network.layers, eqx.is_array)))
    row: dict = {"weights": weights}
    for name, samples in zip(("training", "validation", "test"), parts, strict=True):
        error = 1e3 * np.asarray(eqx.filter_jit(learned.position_errors)(task, network, samples))
        row |= {name: _round(error.mean()), f"{name}_p95": _round(np.percentile(error, 95))}
    if task.direction == "inverse":
        row["bins"] = binned(learned.manners(task, network, parts[2]))
    return row


def binned(manners: learned.Manners) -> list[dict]:
    """Means and 95th percentiles by the condition number of the pose that was asked for."""
    asked = np.asarray(manners.asked)
    rows = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        inside = (asked >= low) & (asked < high)
        if not inside.any():
            continue
        pick = {name: np.asarray(x)[inside] for name, x in manners._asdict().items()}
        high95 = {f"{name}_p95": _round(np.percentile(pick[name], 95)) for name in pick if name != "error"}
        millimetres = 1e3 * pick["error"]
        error = {"error": _round(millimetres.mean()), "error_p95": _round(np.percentile(millimetres, 95))}
        bounds = {"from": low, "to": high if np.isfinite(high) else None, "samples": int(inside.sum())}
        rows.append(bounds | error | high95)
    return rows


def thinned(curve: np.ndarray, points: int = 200) -> dict[str, list]:
    """At most so many epochs of a curve, for the figure."""
    epochs = np.flatnonzero(np.isfinite(curve[:, 0]))
    epochs = epochs[:: -(-len(epochs) // points)]
    columns = {name: [_round(x) for x in curve[epochs, i]] for i, name in enumerate(learned.Curve._fields)}
    return {"epoch": [int(e) + 1 for e in epochs]} | columns


def _round(value: float) -> float:
    return float(f"{value:.4g}")


def run(config: Config) -> list[dict]:
    """Train the cases that the file of results lacks; all rows."""
    folder = config.out / ("mlp_kinematics_smoke" if config.smoke else "mlp_kinematics")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "cases.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {row["name"] for row in rows}
    cases = cases_of(config)
    for number, case in enumerate(cases):
        if str(case) in done:
            continue
        print(f"{number + 1}/{len(cases)} {case}", flush=True)
        rows.append(trained(config, case, folder))
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    names = [str(case) for case in cases]
    return sorted((row for row in rows if row["name"] in names), key=lambda row: names.index(row["name"]))


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    rows = run(config)
    stem = "mlp_kinematics_smoke" if config.smoke else "mlp_kinematics"
    store(runs_of(rows), config.out / FILE)
    told = tests(rows, config.out)
    options = {name: str(value) for name, value in vars(config).items() if name not in ("out", "figures")}
    result = {"made": made(options), "regions": REGIONS, "cases": rows, "tests": told}
    (config.out / f"{stem}.json").write_text(json.dumps(result) + "\n", encoding="utf-8")
    (config.out / f"{stem}.md").write_text(page(rows, REGIONS, told), encoding="utf-8")
    figure12(rows, config.figures)
    print(page(rows, REGIONS, told))


if __name__ == "__main__":
    main()
