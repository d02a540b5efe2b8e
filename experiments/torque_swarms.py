"""What the study's objective leaves out: the same unknowns from the torque of a motion, swarms beside least squares.

    python experiments/torque_swarms.py [--robot arm.xml] [--joints n] [--smoke]

MuJoCo's C engine gives the torques of the arm, with noise; the box holds the truth, but not in its middle.  Judged on
another motion, without noise.  Writes torque_swarms.json and .md.
"""

import dataclasses
import json
import time
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import tyro
from jaxtyping import Array, Float
from study_arm import StudyArm, StudyConfig
from study_provenance import made
from study_readings import SEEDS, Reading, rule

from irb140_jax import identify, swarm
from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.oracle.mjcf import mjcf
from irb140_jax.recordings.excite import fourier_motion
from irb140_jax.robot import Robot
from irb140_jax.trajectory import Trajectory
from irb140_jax.types import Scalar


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What to run.

    Attributes:
        duration: Length of either motion [s].
        noise: Standard deviation of the torque, as a share of each joint's RMS.
        width: Half of the box's width, as a fraction of the truth.
        seeds: Runs of each swarm, starts of each descent.
    """

    duration: float = 20.0
    noise: float = 0.02
    width: float = 0.5
    seeds: int = SEEDS


# One of each kind, for what takes longest is to compile.
SMOKE = ("PSO, w 0.99", "Levenberg-Marquardt, box as prior", "least squares, base parameters")


class TorqueError(eqx.Module):
    """A fit as a function of what is sought of its parameters.

    Attributes:
        fit: Of all parameters of the links.
        unknowns: Which of these are sought.
    """

    fit: identify.LinearFit
    unknowns: identify.Unknowns

    def __call__(self, sought: Float[Array, " u"], progress: Scalar) -> Scalar:
        return self.fit(self.unknowns.full(sought), progress)

    def residual(self, sought: Float[Array, " u"]) -> Float[Array, " m"]:
        """What least squares minimises."""
        return self.fit.residual(self.unknowns.full(sought))


def recorded(robot: Robot, duration: float, noise: float, seed: int) -> Trajectory:
    """A motion, and MuJoCo's torques along it."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    played = fourier_motion(robot, duration=duration, rate=100.0, seed=seed)
    data, tau = mujoco.MjData(model), np.empty_like(played.q)
    for k, (q, qd, qdd) in enumerate(zip(played.q, played.qd, played.qdd, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        tau[k] = data.qfrc_inverse
    scale = noise * np.sqrt(np.mean(tau**2, axis=0))
    tau += scale * np.random.default_rng(seed).normal(size=tau.shape)
    return Trajectory(*(jnp.asarray(x) for x in (played.t, played.q, played.qd, played.qdd, tau)))


def swarms() -> dict[str, swarm.Rule]:
    """The study's algorithms in two readings each, and better ones."""
    return {
        "PSO, w 0.99": rule(Reading("pso")),
        "PSO, w 0.99 to 0.4, v <= 0.1": rule(Reading("pso", "w 0.99 to 0.4", 0.1)),
        "QPSO of angles, w 0.99": rule(Reading("qpso")),
        "QPSO of angles, w 0.99 to 0.4, v <= 0.05": rule(Reading("qpso", "w 0.99 to 0.4", 0.05)),
        "QPSO of 12 bits, collapsed": rule(Reading("qpso", "w 0.99 to 0.4", 0.5, False, "D3, 12 bits", True)),
        "constricted PSO": swarm.ConstrictedPso(),
        "delta-well QPSO": swarm.DeltaWellQpso(),
        "self-tuning QPSO": swarm.SelfTuningQpso(),
    }


class PossibleResidual(eqx.Module):
    """Residual of a fit in the log-Cholesky numbers."""

    fit: identify.LinearFit

    def __call__(self, theta: Float[Array, " d"]) -> Float[Array, " m"]:
        return self.fit.residual(identify.consistent_parameters(theta, self.fit.mass))


class BoxedResidual(eqx.Module):
    """Residual of a fit, and how far the box's middle lies: what a swarm's box tells it, told to least squares.

    Uniform in the box means a standard deviation of its width / sqrt(12).
    """

    aim: TorqueError
    lower: Float[Array, " u"]
    upper: Float[Array, " u"]

    def __call__(self, x: Float[Array, " u"]) -> Float[Array, " r"]:
        noise = jnp.sqrt(self.aim.fit.rest / self.aim.fit.rows)
        apart = (x - 0.5 * (self.lower + self.upper)) / (self.upper - self.lower) * 12.0**0.5
        return jnp.concatenate([self.aim.residual(x), noise * apart])


def ways(aim: TorqueError, lower, upper, config: Config) -> dict[str, Callable[[], Float[Array, "s m"]]]:
    """Every way to estimate, as functions that give inertial parameters (s, 10 k)."""
    keys, fit = swarm.seed_keys(config.seeds), aim.fit
    size: dict[str, Any] = {"particles": 12, "iterations": 10} if config.smoke else {}
    phi = jax.jit(jax.vmap(lambda u: identify.phi_of(aim.unknowns.full(u), fit.mass).ravel()))
    starts = lower + (upper - lower) * jax.random.uniform(jax.random.key(1), (config.seeds, len(lower)))
    scale = jnp.abs(upper - lower)
    middle = 0.5 * (lower + upper)
    numbers = _possible_numbers(aim.unknowns.full(starts), aim.unknowns.full(middle), fit.mass)

    def possible() -> Float[Array, "s m"]:
        found = identify.descents(PossibleResidual(fit), numbers, max_steps=100).x
        x = jax.vmap(identify.consistent_parameters, (0, None))(found, fit.mass)
        return jax.vmap(lambda x: identify.phi_of(x, fit.mass).ravel())(x)

    found = {
        name: lambda r=r: phi(swarm.minimise(aim, r, lower, upper, keys=keys, **size).x) for name, r in swarms().items()
    }
    return found | {
        "Levenberg-Marquardt": lambda: phi(identify.descents(aim.residual, starts, scale=scale, max_steps=100).x),
        "Levenberg-Marquardt, box as prior": lambda: phi(
            identify.descents(BoxedResidual(aim, lower, upper), starts, scale=scale, max_steps=100).x
        ),
        "BFGS": lambda: phi(identify.descents(aim.residual, starts, "bfgs", scale=scale, max_steps=200).x),
        "Levenberg-Marquardt, possible bodies": possible,
        "least squares, base parameters": lambda: identify.nearest_least_squares(fit, phi(middle[None])[0])[None],
    }


def _possible_numbers(starts, middle, mass) -> Float[Array, "s d"]:
    """Log-Cholesky numbers of the starts; of a sphere-like body where a start is none."""
    numbers = jax.vmap(identify.log_cholesky, (0, None))(starts, mass)
    k = len(mass)
    plain = jnp.concatenate([middle[: 3 * k], jnp.tile(jnp.array([-2.0, 0.0, 0.0, -2.0, 0.0, -2.0]), k)])
    return jnp.where(jnp.isfinite(numbers).all(axis=1, keepdims=True), numbers, plain)


def run(config: Config, study: StudyArm) -> dict:
    """All ways on one recording, judged on another."""
    robot, links = study.whole, study.links
    where = jnp.asarray(np.random.default_rng(0).uniform(size=study.x.shape))
    lower, upper = study.unknowns.box(config.width, place=where)
    duration = 3.0 if config.smoke else config.duration
    fit = identify.linear_fit(robot, links, recorded(robot, duration, config.noise, seed=1))
    unseen = identify.linear_fit(robot, links, recorded(robot, duration, 0.0, seed=2))
    aim = TorqueError(fit, study.unknowns)
    tried = ways(aim, lower, upper, config)
    tried = {name: tried[name] for name in SMOKE} if config.smoke else tried
    rows = [_row(name, way, fit, unseen, study) for name, way in tried.items()]
    middle = identify.phi_of(aim.unknowns.full(0.5 * (lower + upper)), fit.mass).ravel()
    truth = identify.phi_of(study.x, fit.mass).ravel()
    bounds = {"middle of the box": float(unseen.of_phi(middle)), "noise": float(fit.of_phi(truth))}
    return {"bounds": bounds, "rows": rows}


def _row(name: str, way: Callable, fit: identify.LinearFit, unseen: identify.LinearFit, study: StudyArm) -> dict:
    """Held-out error of the run that fits best, and of all; time with and without compiling."""
    seconds = []
    for _ in range(2):
        start = time.perf_counter()
        phi = jax.block_until_ready(way())
        seconds.append(time.perf_counter() - start)
    seen, held_out = (np.asarray(jax.vmap(f.of_phi)(phi)) for f in (fit, unseen))
    best = int(np.argmin(np.where(np.isnan(seen), np.inf, seen)))
    x = np.asarray(jax.vmap(_parameters)(phi))
    com, inertia = study.unknowns.mape(x)
    mass = phi.reshape(len(phi), -1, 10)[:, :, 0]
    possible = jax.vmap(identify.consistency)(jnp.asarray(x), mass).pseudo_inertia
    return {
        "name": name, "fitted": float(seen[best]), "held_out": float(held_out[best]),
        "held_out_median": float(np.median(held_out)), "com": float(com[best]), "inertia": float(inertia[best]),
        "possible": float(np.mean(np.asarray(possible))), "first_s": seconds[0], "run_s": seconds[1],
    }  # fmt: skip


def _parameters(phi: Float[Array, " m"]) -> Float[Array, " d"]:
    """Centres of mass and inertias about them, out of inertial parameters."""
    one = phi.reshape(-1, 10)
    zero = jnp.zeros(9 * len(one))
    com = one[:, 1:4] / one[:, :1]
    # `phi_of` adds m (c^2 1 - c c^T) to the inertia: taken off again.
    moved = identify.phi_of(zero.at[: 3 * len(one)].set(com.ravel()), one[:, 0])[:, 4:]
    return jnp.concatenate([com.ravel(), (one[:, 4:] - moved).ravel()])


def table(result: dict) -> str:
    """The table in Markdown."""
    columns = "fitted RMSE N m", "held-out RMSE N m", "median of runs", "COM %", "inertia %", "possible", "s", "s first"
    head = f"| | {' | '.join(columns)} |"
    lines = [
        f"| {r['name']} | {r['fitted']:.4g} | {r['held_out']:.3g} | {r['held_out_median']:.3g} | {r['com']:.3g} | "
        f"{r['inertia']:.3g} | {r['possible']:.2f} | {r['run_s']:.3f} | {r['first_s']:.2f} |"
        for r in result["rows"]
    ]
    bounds = ", ".join(f"{name} {value:.3g} N m" for name, value in result["bounds"].items())
    return f"{bounds[0].upper()}{bounds[1:]}.\n\n{head}\n" + "|---" * 9 + "|\n" + "\n".join(lines)


def page(result: dict) -> str:
    """With a title."""
    return f"# Torque instead of known answers: {result['arm']}\n\n{table(result)}\n"


def main(config: Config) -> None:
    """Estimate, judge, write."""
    set_up_compilation_cache()
    config = dataclasses.replace(config, seeds=2) if config.smoke else config
    study = config.arm()
    result = {"made": made(config.said()), "config": config.said(), "arm": study.name} | run(config, study)
    folder = config.folder(study)
    (folder / "torque_swarms.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    (folder / "torque_swarms.md").write_text(page(result), encoding="utf-8")
    print(page(result))


if __name__ == "__main__":
    main(tyro.cli(Config))
