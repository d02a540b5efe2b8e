"""The identified model on an embedded controller: its inverse dynamics exported ahead of time, and as plain C.

    python experiments/embedded_model.py [--robot arm.xml] [--joints n] [--smoke]

Each form is compiled, compared with the library, and timed cycle by cycle against a cycle of 1 kHz.  The model is the
mean of the sets that QPSO ended with (table3_sets.json).  Writes embedded_model.json and embedded_model.c.
"""

import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

import jax
import jax.export
import jax.numpy as jnp
import numpy as np
import tyro
from study_arm import StudyArm, StudyConfig
from study_provenance import made

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.dynamics import c_source, inverse_dynamics
from irb140_jax.robot import Robot

# Reads states, writes torques and the time that each took [ns].
MAIN = """
#include <stdio.h>
#include <time.h>
int main(int argc, char **argv) {
    (void)argc;
    FILE *in = fopen(argv[1], "rb"), *out = fopen(argv[2], "wb");
    double x[3 * N], y[N + 1];
    while (fread(x, sizeof x, 1, in) == 1) {
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        inverse_dynamics(x, x + N, x + 2 * N, y);
        clock_gettime(CLOCK_MONOTONIC, &b);
        y[N] = 1e9 * (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec);
        fwrite(y, sizeof y, 1, out);
    }
    return fclose(in) | fclose(out);
}
"""


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """What to run.

    Attributes:
        cycles: How many are timed.
    """

    cycles: int = 20_000


def by_c(robot: Robot, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Torques (T, n), and time of each cycle [us], by the compiled C code."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise FileNotFoundError("no C compiler")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "model.c").write_text("#define _POSIX_C_SOURCE 199309L\n" + c_source(robot) + MAIN, encoding="utf-8")
        states.tofile(folder / "in")
        subprocess.run([compiler, "-O2", "-o", folder / "model", folder / "model.c", "-lm"], check=True)
        subprocess.run([folder / "model", folder / "in", folder / "out"], check=True)
        out = np.fromfile(folder / "out").reshape(len(states), robot.n + 1)
    return out[:, :-1], 1e-3 * out[:, -1]


def by_export(robot: Robot, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same by the program that `jax.export` wrote and read again."""
    shape = jax.ShapeDtypeStruct((robot.n,), jnp.float64)
    law = jax.jit(lambda q, qd, qdd: inverse_dynamics(robot, q, qd, qdd))
    program = jax.export.deserialize(bytearray(jax.export.export(law)(shape, shape, shape).serialize()))
    call = jax.jit(program.call)
    tau, spent = np.empty((len(states), robot.n)), np.empty(len(states))
    jax.block_until_ready(call(*states[0]))
    for k, state in enumerate(states):
        started = time.perf_counter_ns()
        tau[k] = np.asarray(call(*state))
        spent[k] = 1e-3 * (time.perf_counter_ns() - started)
    return tau, spent


def run(config: Config, study: StudyArm) -> list[dict]:
    """Every form of the arm's first joints with the identified set, and of the whole arm."""
    sets = json.loads((config.folder(study) / "table3_sets.json").read_text(encoding="utf-8"))
    x = jnp.asarray(np.mean(sets["sets"]["QPSO"], axis=0))
    robots = {study.reduced(x).n: study.reduced(x), study.whole.n: study.whole}
    rows = []
    for robot in robots.values():
        states = np.random.default_rng(0).normal(size=(500 if config.smoke else config.cycles, 3, robot.n))
        wanted = np.asarray(jax.vmap(lambda s, r=robot: inverse_dynamics(r, *s))(jnp.asarray(states[:500])))
        for form, way in (("plain C, -O2", by_c), ("jax.export", by_export)):
            tau, spent = way(robot, states)
            rows.append({
                "form": form, "joints": robot.n, "median_us": float(np.median(spent)),
                "p999_us": float(np.quantile(spent, 0.999)), "most_us": float(spent.max()),
                "apart": float(np.abs(tau[:500] - wanted).max()),
            })  # fmt: skip
    (config.folder(study) / "embedded_model.c").write_text(c_source(study.reduced(x)), encoding="utf-8")
    return rows


def main(config: Config) -> None:
    """Export, measure, write."""
    set_up_compilation_cache()
    study = config.arm()
    load = os.getloadavg()[0]  # what else kept the machine busy in the minute before
    result = {"made": made(config.said()), "load": load, "rows": run(config, study)}
    text = json.dumps(result, indent=1) + "\n"
    (config.folder(study) / "embedded_model.json").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(tyro.cli(Config))
