"""The swarms that the study leaves to the future, where they could win: every evaluation is a measurement with new noise.

    python experiments/noisy_swarms.py [--robot arm.xml] [--joints n] [--smoke]

A candidate's fitness is the torque error along a motion that is driven anew each time, with MuJoCo's torques and fresh
noise.  A greedy swarm keeps its lucky evaluations; "noise-resilient", "adaptive" and "self-tuning" ones should not.
Judged without noise on another motion.  Writes noisy_runs.parquet, noisy_swarms.json and .md.
"""
# ruff: noqa: E501  sentences read better whole

import dataclasses
import json
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
from study_readings import SEEDS, Reading, rule
from study_statistics import Test, said, tested
from torque_swarms import TorqueError, recorded

from irb140_jax import identify, swarm
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.types import Scalar

FILE = "noisy_runs.parquet"
PLAIN = "delta-well QPSO"
RULES = {
    PLAIN: swarm.DeltaWellQpso(),
    "noise-resilient QPSO": swarm.NoiseResilientQpso(),
    "adaptive-attractor QPSO": swarm.AdaptiveAttractorQpso(),
    "self-tuning QPSO": swarm.SelfTuningQpso(),
    "constricted PSO": swarm.ConstrictedPso(),
    "PSO, w 0.99 to 0.4, v <= 0.1": rule(Reading("pso", "w 0.99 to 0.4", 0.1)),
    "QPSO of angles, w 0.99 to 0.4, v <= 0.05": rule(Reading("qpso", "w 0.99 to 0.4", 0.05)),
}
SMOKE = (PLAIN, "noise-resilient QPSO")  # what takes longest is to compile
FUTURE = ("noise-resilient QPSO", "adaptive-attractor QPSO", "self-tuning QPSO")


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What to run.

    Attributes:
        duration: Of the motion that each evaluation drives [s].
        noise: Standard deviations of the torque, as shares of the joints' RMS.
        width: Half of the box's width, as a fraction of the truth.
        seeds: Runs of each swarm.
    """

    duration: float = 2.0
    noise: tuple[float, ...] = (0.02, 0.1, 0.3)
    width: float = 0.5
    seeds: int = SEEDS


class Measured(eqx.Module):
    """Torque error of a candidate as a new recording shows it: exact in distribution, without playing the motion.

    With white noise n of deviation s, W phi - b - n has the triangular factor's residual less s g, g ~ N(0, 1) by
    entry, and a rest of s^2 chi^2 with as many degrees of freedom as there are equations left (Cochran's theorem).
    """

    aim: TorqueError
    noise: Scalar

    def __call__(self, unknowns: Float[Array, " u"], progress: Scalar) -> Scalar:
        residual = self.aim.residual(unknowns)
        left = self.aim.fit.rows - residual.size
        g = jax.random.normal(self._key(unknowns, progress), (residual.size + 1,))
        rest = self.noise**2 * left * (1.0 + jnp.sqrt(2.0 / left) * g[-1])
        return jnp.sqrt((jnp.sum((residual - self.noise * g[:-1]) ** 2) + rest) / self.aim.fit.rows)

    def _key(self, unknowns, progress):
        """A fresh one for every candidate and iteration."""
        bits = jax.lax.bitcast_convert_type(jnp.append(unknowns, progress), jnp.uint32).ravel()
        odd = 2 * jnp.arange(bits.size, dtype=jnp.uint32) + 1
        word = jnp.sum((bits ^ (bits >> 15)) * (odd * jnp.uint32(0x9E3779B1)), dtype=jnp.uint32)
        return jax.random.key(word)


def run(config: Config, study: StudyArm) -> pd.DataFrame:
    """One row a run: errors of the parameters, and of torque on another motion."""
    robot, links = study.whole, study.links
    where = jnp.asarray(np.random.default_rng(0).uniform(size=study.x.shape))
    lower, upper = study.unknowns.box(config.width, place=where)
    size: dict[str, Any] = {"particles": 12, "iterations": 10} if config.smoke else {}
    clean = recorded(robot, config.duration, 0.0, seed=1)
    fit = identify.linear_fit(robot, links, clean)
    unseen = identify.linear_fit(robot, links, recorded(robot, config.duration, 0.0, seed=2))
    aim, rms = TorqueError(fit, study.unknowns), float(jnp.sqrt(jnp.mean(clean.tau**2)))
    keys, frames = swarm.seed_keys(config.seeds), []
    held_out = jax.jit(jax.vmap(lambda u: unseen(study.unknowns.full(u), jnp.zeros(()))))
    for name in SMOKE if config.smoke else RULES:
        for noise in config.noise:
            found = swarm.minimise(Measured(aim, jnp.asarray(noise * rms)), RULES[name], lower, upper, keys=keys, **size)
            com, inertia = study.unknowns.mape(np.asarray(study.unknowns.full(found.x)))
            row = {"swarm": name, "noise": noise, "seed": np.arange(config.seeds), "com": com, "inertia": inertia,
                   "held_out": np.asarray(held_out(found.x))}  # fmt: skip
            frames.append(pd.DataFrame(row))
        print(f"  done: {name}", flush=True)
    return pd.concat(frames, ignore_index=True).astype({k: "float32" for k in ("com", "inertia", "held_out")})


def tests_of(config: Config) -> list[Test]:
    """Each of the future's swarms against the plain one, at each noise."""
    of = lambda name, noise: (("swarm", name), ("noise", noise))  # noqa: E731
    return [
        Test("future", f"noise {noise:g}: {name} lower than {PLAIN}", FILE, "held_out", of(name, noise), of(PLAIN, noise))
        for noise in config.noise
        for name in FUTURE
        if name in SMOKE or not config.smoke
    ]


def table(result: dict) -> str:
    """In Markdown."""
    noises = sorted({row["noise"] for row in result["rows"]})
    head = " | ".join(f"noise {100 * n:g} %: torque, N m | COM / inertia, %" for n in noises)
    lines = [f"| swarm | {head} |", "|---" * (2 * len(noises) + 1) + "|"]
    for name in dict.fromkeys(row["swarm"] for row in result["rows"]):
        own = {row["noise"]: row for row in result["rows"] if row["swarm"] == name}
        cells = [f"{own[n]['held_out']:.3g} | {own[n]['com']:.3g} / {own[n]['inertia']:.3g}" for n in noises]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    lines += ["", f"Medians of {result['tests'][0]['n'][0]} seeds: torque on another motion without noise, errors of the parameters.  Is the "
              f"held-out torque lower than that of {PLAIN}?", ""]  # fmt: skip
    return "\n".join(lines + [f"- {test['name'].removesuffix(f' lower than {PLAIN}')}: {said(test)}" for test in result["tests"]])


def main(config: Config) -> None:
    """Run, judge, write."""
    set_up_compilation_cache()
    config = dataclasses.replace(config, seeds=3, noise=config.noise[:1]) if config.smoke else config
    study = config.arm()
    folder = config.folder(study)
    frame = run(config, study)
    store(frame, folder / FILE)
    middle = frame.groupby(["swarm", "noise"], sort=False)[["com", "inertia", "held_out"]].median().reset_index()
    told = {"made": made(config.said()), "arm": study.name, "rows": middle.to_dict("records")}
    result = told | {"tests": tested(tests_of(config), folder)}
    (folder / "noisy_swarms.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    text = f"# Swarms whose every evaluation is measured with new noise: {study.name}\n\n{table(result)}\n"
    (folder / "noisy_swarms.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(tyro.cli(Config))
