"""Inverse dynamics as plain C: compiled by the system's compiler, it says what the library says."""

import ctypes
import dataclasses
import shutil
import subprocess

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from irb140_jax.dynamics import c_source, inverse_dynamics
from irb140_jax.recordings.conceal import random_robot
from irb140_jax.robot import irb140, load_robot

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler here")


def compiled(robot, folder):
    """The function of the compiled code, on NumPy arrays."""
    source, library = folder / "model.c", folder / "model.so"
    source.write_text(c_source(robot), encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-shared", "-fPIC"]
    done = subprocess.run([str(COMPILER), *flags, "-o", library, source, "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    call = ctypes.CDLL(str(library)).inverse_dynamics
    pointer = np.ctypeslib.ndpointer(float, flags="C_CONTIGUOUS")
    call.argtypes, call.restype = [pointer] * 4, None

    def torque(q, qd, qdd):
        tau = np.empty(robot.n)
        call(*(np.ascontiguousarray(x, float) for x in (q, qd, qdd)), tau)
        return tau

    return torque


def robots(tmp_path):
    """The IRB 140 with friction and springs, one of hinges and slides, and one that branches."""
    path = tmp_path / "robot.xml"
    path.write_text(random_robot(3, 5, slides=0.4))
    fields = lambda r: (r.damping, r.frictionloss, r.stiffness)  # noqa: E731
    each = jnp.arange(1.0, 7.0)
    chain = load_robot(path)
    tree = dataclasses.replace(chain, parent=(-1, 0, 1, 0, 3))
    return [eqx.tree_at(fields, irb140(), (each, 0.5 * each, 2.0 * each)), chain, tree]


@pytest.mark.parametrize("which", [0, 1, 2])
def test_the_c_code_says_what_the_library_says(tmp_path, which):
    robot = robots(tmp_path)[which]
    torque = compiled(robot, tmp_path)
    for q, qd, qdd in np.random.default_rng(0).normal(size=(20, 3, robot.n)):
        wanted = np.asarray(inverse_dynamics(robot, *map(jnp.asarray, (q, qd, qdd))))
        np.testing.assert_allclose(torque(q, qd, qdd), wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())
