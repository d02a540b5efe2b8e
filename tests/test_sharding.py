"""Sweeps: lanes are as if alone, on one device and on several, whatever their number."""

import os
import pathlib
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from irb140_jax.errors import InputError
from irb140_jax.sharding import sweep

ON_FOUR_DEVICES = """
import irb140_jax, jax, jax.numpy as jnp, numpy as np
from irb140_jax import control, simulate, swarm
from irb140_jax.robot import first_joints, irb140

assert len(jax.devices()) == 4
mesh = jax.make_mesh((4,), ("lanes",))

sphere = swarm.Steady(lambda x: jnp.sum((x - 0.3) ** 2))
def minima(mesh, seeds=8):
    settings = dict(keys=swarm.seed_keys(seeds), particles=10, iterations=20, mesh=mesh)
    return swarm.minimise(sphere, swarm.Pso(), -jnp.ones(3), jnp.ones(3), **settings)
one, four = minima(None), minima(mesh)
assert len(four.x.sharding.device_set) == 4
jax.tree.map(np.testing.assert_array_equal, one, four)

arm = first_joints(irb140(), 3)
t = 0.002 * jnp.arange(101)
q = 0.2 * jnp.sin(jnp.stack([t, 2 * t, 3 * t], axis=1))
reference = control.Reference(t, q, jnp.gradient(q, 0.002, axis=0), 0.0 * q)
def motion(start):
    return simulate.rollout(arm, control.sliding_mode(arm), reference, q0=start)
starts = 0.1 * jax.random.normal(jax.random.key(0), (8, 3))
one, four = simulate.sweep(motion, starts), simulate.sweep(motion, starts, mesh=mesh)
assert len(four.q.sharding.device_set) == 4
jax.tree.map(np.testing.assert_array_equal, one, four)

# Six seeds on four devices: the last one is computed three times, and told once.
jax.tree.map(np.testing.assert_array_equal, minima(None, 6), minima(mesh, 6))
print("six are six")
"""


STUDY_ON_TWO_DEVICES = """
import sys
sys.path.insert(0, "experiments")
import table3_swarms, table4_control
from irb140_jax.errors import InputError

one, two = (table3_swarms.Config(devices=n) for n in (1, 2))
assert one.said() == two.said()

for study in (table3_swarms, table4_control):
    assert study.Config(devices=2).mesh.devices.size == 2

try:
    table3_swarms.Config(devices=3).mesh
except InputError as error:
    print(error)
"""


def said_on(devices: int, script: str) -> str:
    """What a script says where the processor counts as so many devices; it must end well."""
    env = os.environ | {"XLA_FLAGS": f"--xla_force_host_platform_device_count={devices}", "JAX_PLATFORMS": "cpu"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=env, capture_output=True, text=True, timeout=300,
        cwd=pathlib.Path(__file__).parents[1],
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_swarms_and_rollouts_are_the_same_on_one_and_on_four_devices():
    assert "six are six" in said_on(4, ON_FOUR_DEVICES)


def test_the_study_s_meshes_hold_as_many_devices_as_are_asked_for():
    assert "this process has 2; give 1 to 2" in said_on(2, STUDY_ON_TWO_DEVICES)


def test_a_lane_is_as_if_alone():
    lanes = {"a": jnp.arange(5.0), "b": jnp.ones((5, 2))}
    one = lambda lane, factor, name: {name: factor * lane["a"] + lane["b"].sum()}  # noqa: E731
    together = sweep(one, lanes, jnp.asarray(3.0), "x")["x"]
    np.testing.assert_array_equal(together, [one({"a": a, "b": jnp.ones(2)}, 3.0, "x")["x"] for a in lanes["a"]])


def test_other_common_numbers_need_no_new_program():
    traced = []

    def one(lane, factor):
        traced.append(lane)
        return factor * lane

    for mesh in (None, jax.make_mesh((1,), ("lanes",))):
        for factor in (2.0, 3.0):
            result = sweep(one, jnp.arange(3.0), jnp.asarray(factor), mesh=mesh)
            np.testing.assert_array_equal(result, factor * np.arange(3.0))
    assert len(traced) == 2  # once for each kind of mesh


@pytest.mark.parametrize("lanes", [(jnp.ones(3), jnp.ones(4)), jnp.asarray(1.0), jnp.ones((0, 2)), ()])
def test_lanes_of_different_numbers_or_none_are_refused(lanes):
    with pytest.raises(InputError, match="first axes"):
        sweep(lambda lane: lane, lanes)
