"""The network of the kinematics: its shape, its penalty, training that learns, stops and goes on; the experiment."""

import json
import os
import pathlib
import subprocess
import sys
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from irb140_jax import learned
from irb140_jax.errors import InputError
from irb140_jax.kinematics import forward_kinematics, jacobian
from irb140_jax.learned.mlp import scaled
from irb140_jax.robot import first_joints, irb140, irb140_path

ROOT = pathlib.Path(__file__).parents[1]
ROBOT = first_joints(irb140(), 3)
LOWER, UPPER = jnp.array([-1.5, -0.5, -0.8]), jnp.array([1.5, 1.0, 0.5])
# Small, so that a test takes a second or two.
SETTINGS = learned.Settings(epochs=30, batch=100)


@pytest.fixture(scope="module")
def samples() -> tuple[learned.Samples, learned.Samples]:
    make = lambda count, seed: learned.joint_samples(ROBOT, LOWER, UPPER, count, key=jax.random.key(seed))  # noqa: E731
    return make(2000, 0), make(500, 1)


def task(direction: learned.Direction = "forward", **changes: Any) -> learned.Task:
    return learned.Task(ROBOT, direction=direction, **changes)


def trained(task: learned.Task, samples, settings=SETTINGS, chunks=(30,), **shape):
    state = learned.begin(task.network(samples[0], key=jax.random.key(2), **shape), settings)
    curves = []
    for epochs in chunks:
        state, curve = learned.train(state, task, samples[0], samples[1], settings, epochs, key=jax.random.key(3))
        curves.append(curve)
    return state, learned.Curve(*(jnp.concatenate(x) for x in zip(*curves, strict=True)))


def mean_error(task: learned.Task, network: learned.KinematicMlp, samples: learned.Samples) -> float:
    return float(learned.position_errors(task, network, samples).mean())


def test_the_samples_are_where_mujoco_puts_the_tool(samples):
    model = mujoco.MjModel.from_xml_path(str(irb140_path()))
    data = mujoco.MjData(model)
    for q, position in zip(samples[0].q[:20], samples[0].position[:20], strict=True):
        data.qpos[:3] = q
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(position, data.site_xpos[0], atol=1e-12)  # round-off of 1 m


def test_the_velocities_of_samples_are_the_change_of_position(samples):
    q, qd, position, velocity = (x[:50] for x in samples[0])
    step = 1e-6  # [s]; the error of the difference is of its size
    moved = jax.vmap(lambda q: forward_kinematics(ROBOT, q)[:3, 3])(q + step * qd)
    np.testing.assert_allclose((moved - position) / step, velocity, atol=1e-4)


@pytest.mark.parametrize(
    ("hidden", "neurons"),
    [(learned.ONE_LAYER_50, 50), (learned.FOUR_LAYERS_488_TOTAL, 488), (learned.FOUR_LAYERS_488_EACH, 4 * 488)],
)
def test_the_networks_have_the_neurons_that_the_text_names(samples, hidden, neurons):
    network = task().network(samples[0], hidden, key=jax.random.key(0))
    assert sum(layer.weight.shape[0] for layer in network.layers.layers[:-1]) == neurons


@pytest.mark.parametrize("direction", ["forward", "inverse"])
@pytest.mark.parametrize("velocities", [False, True])
def test_inputs_reach_the_layers_between_minus_one_and_one(samples, direction, velocities):
    asked = task(direction=direction, velocities=velocities)
    network = asked.network(samples[0], key=jax.random.key(0))
    inputs = np.asarray(jax.vmap(scaled, (0, None))(asked.inputs(samples[0]), network.inputs))
    assert inputs.shape[1] == (6 if velocities else 3)
    np.testing.assert_allclose([inputs.min(0), inputs.max(0)], np.outer([-1, 1], np.ones(inputs.shape[1])), atol=1e-12)


@pytest.mark.parametrize("activation", ["sigmoid", "tanh", "gelu"])
def test_four_layers_start_with_signals_that_neither_fade_nor_grow(samples, activation):
    network = task().network(samples[0], learned.FOUR_LAYERS_488_TOTAL, activation, key=jax.random.key(0))
    spread = np.std(jax.vmap(network.layers)(jnp.linspace(-1, 1, 200)[:, None] * jnp.ones(3, jnp.float32)))
    assert 0.03 < spread < 3.0  # outputs are to fill [-1, 1]; with usual weights four sigmoids leave less than 1e-3


def test_an_unknown_activation_is_refused_by_name(samples):
    with pytest.raises(InputError, match="'relu6'.*sigmoid"):
        task().network(samples[0], activation="relu6", key=jax.random.key(0))  # pyright: ignore


def test_samples_over_an_empty_box_are_refused():
    with pytest.raises(InputError, match="lower ends below"):
        learned.joint_samples(ROBOT, UPPER, LOWER, 10, key=jax.random.key(0))


def test_the_condition_number_is_the_product_of_the_norms_of_the_jacobian_and_its_inverse(samples):
    for q in samples[0].q[:20]:
        J = np.asarray(jacobian(ROBOT, q)[:3])
        expected = np.linalg.norm(J) * np.linalg.norm(np.linalg.inv(J))
        # The determinant of J J^T loses kappa^2 of its digits.
        assert float(learned.frobenius_condition_number(ROBOT, q)) == pytest.approx(expected, rel=1e-9)


def test_the_condition_number_and_its_slope_are_finite_where_the_arm_is_stretched():
    q = jnp.array([0.3, 0.8, -0.5 * jnp.pi])
    kappa, slope = jax.value_and_grad(learned.frobenius_condition_number, argnums=1)(ROBOT, q)
    assert float(kappa) > 1e6
    assert np.isfinite(slope).all()


@pytest.mark.parametrize("form", ["log", "hinge", "sigmoid"])
def test_a_pose_costs_more_the_nearer_it_is_to_a_singular_one(form):
    penalty = learned.ConditionPenalty(1.0, 20.0, form=form)
    costs = [float(penalty(jnp.asarray(kappa))) for kappa in (3.0, 19.0, 30.0, 50.0)]
    assert costs[3] > costs[2] > costs[1] >= costs[0]
    assert form == "sigmoid" or costs[1] == 0.0


@pytest.mark.parametrize(("direction", "loss"), [("forward", "mse"), ("inverse", "mae")])
def test_training_learns(samples, direction, loss):
    asked = task(direction=direction, loss=loss)
    state, curve = trained(asked, samples)
    first = mean_error(asked, asked.network(samples[0], key=jax.random.key(2)), samples[1])
    # 600 steps of 353 weights: from some 0.5 m.
    assert mean_error(asked, state.best, samples[1]) < 0.25 * first
    assert curve.validation[-1] < 0.25 * first


def test_the_best_network_is_the_one_whose_error_is_reported(samples):
    state, curve = trained(task(), samples)
    assert float(state.best_error) == np.min(curve.validation)
    assert mean_error(task(), state.best, samples[1]) == pytest.approx(float(state.best_error), rel=1e-6)


def test_training_saved_halfway_ends_as_training_in_one(samples, tmp_path):
    whole, curve = trained(task(), samples)
    half, first = trained(task(), samples, chunks=(15,))
    eqx.tree_serialise_leaves(tmp_path / "state.eqx", half)
    blank = learned.begin(task().network(samples[0], key=jax.random.key(5)), SETTINGS)
    read = eqx.tree_deserialise_leaves(tmp_path / "state.eqx", blank)
    end, second = learned.train(read, task(), samples[0], samples[1], SETTINGS, 15, key=jax.random.key(3))
    np.testing.assert_array_equal(np.concatenate([first.validation, second.validation]), curve.validation)
    jax.tree.map(np.testing.assert_array_equal, eqx.filter(end, eqx.is_array), eqx.filter(whole, eqx.is_array))


def test_training_stops_where_validation_no_longer_improves(samples):
    settings = SETTINGS._replace(rate=0.0, stop=0.2)  # of 30 epochs; the first always improves on nothing
    state, curve = trained(task(), samples, settings)
    assert int(state.epoch) == 7
    assert np.isfinite(curve.validation[:7]).all()
    assert np.isnan(curve.validation[7:]).all()


def test_the_rate_starts_at_a_hundredth_and_falls_where_validation_rests(samples):
    _, curve = trained(task(), samples)
    assert curve.rate[0] == pytest.approx(0.01)
    resting = SETTINGS._replace(patience=0.1, improvement=0.99)
    _, slower = trained(task(), samples, resting)
    assert np.all(np.diff(curve.rate) < 0.0)
    assert slower.rate[10] <= 0.5 * curve.rate[10]


def test_a_warm_up_makes_the_first_steps_short_and_then_nothing_else(samples):
    _, cold = trained(task(), samples)
    _, warm = trained(task(), samples, SETTINGS._replace(warm_up=0.2))  # six epochs
    np.testing.assert_allclose(warm.rate[:6] / cold.rate[:6], np.arange(1, 7) / 6, rtol=1e-6)
    np.testing.assert_array_equal(warm.rate[6:], cold.rate[6:])
    start = task().network(samples[0], key=jax.random.key(2))
    moved = {}
    for settings in (SETTINGS, SETTINGS._replace(warm_up=0.2)):
        state = learned.begin(start, settings)
        after, _ = learned.train(state, task(), samples[0], samples[1], settings, 1, key=jax.random.key(3))
        weights = [jax.tree.leaves(eqx.filter(x.layers, eqx.is_array)) for x in (start, after.network)]
        moved[settings.warm_up] = max(float(jnp.abs(a - b).max()) for a, b in zip(*weights, strict=True))
    assert moved[0.2] < 0.2 * moved[0.0]


def test_an_error_that_is_no_number_never_makes_the_best_network(samples):
    broken = samples[1]._replace(position=jnp.full_like(samples[1].position, jnp.nan))
    state, _ = trained(task(), (samples[0], broken), chunks=(2,))
    assert np.isinf(float(state.best_error))


def test_the_second_stage_goes_on_downhill_from_the_first(samples):
    before = trained(task(), samples)[0].best
    state, errors = learned.refine(learned.begin_refinement(before), task(), samples[0], samples[1], 15)
    assert errors[-1] < 0.3 * mean_error(task(), before, samples[1])
    assert mean_error(task(), state.network, samples[1]) == pytest.approx(float(errors[-1]), rel=1e-9)


def test_the_penalty_keeps_chosen_poses_away_from_singular_ones():
    lower, upper = jnp.array([-1.0, 0.4, -0.5 * jnp.pi]), jnp.array([1.0, 1.2, -1.2])
    make = lambda count, seed: learned.joint_samples(ROBOT, lower, upper, count, key=jax.random.key(seed))  # noqa: E731
    parts = make(2000, 0), make(500, 1)
    chosen = {}
    for weight in (0.0, 1e-2):
        asked = task(direction="inverse", loss="mae", penalty=learned.ConditionPenalty(weight))
        state, _ = trained(asked, parts)
        chosen[weight] = np.percentile(learned.manners(asked, state.best, parts[1]).chosen, 95)
    assert chosen[1e-2] < 0.5 * chosen[0.0]
    assert chosen[1e-2] < 25.0  # the penalty begins at 20 in the Frobenius norm, which is the larger one


def test_the_experiment_is_made_whole_and_is_not_repeated(tmp_path):
    command = [sys.executable, "experiments/mlp_kinematics.py", "--smoke", "--out", str(tmp_path)]
    command += ["--figures", str(tmp_path / "figures")]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    run = lambda: subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, timeout=300)  # noqa: E731
    first = run()
    assert first.returncode == 0, first.stderr
    table = json.loads((tmp_path / "mlp_kinematics_smoke.json").read_text())
    assert all(np.isfinite(row["validation"]) for row in table["cases"])
    reading = "inverse, branch, 4 x 122, MAE, warmed up"
    by_seed = {row["case"]["seed"]: row for row in table["cases"] if row["reading"] == reading}
    assert by_seed[0]["validation"] != by_seed[1]["validation"]
    said = (tmp_path / "mlp_kinematics_smoke.md").read_text()
    mean = np.mean([row["bins"][-1]["chosen_p95"] for row in by_seed.values()])
    assert "| none | 2 | 0 | " in said and f" {mean:.3g} [" in said
    assert (tmp_path / "figures" / "figure12.svg").exists()
    again = run()
    assert "epoch" not in again.stdout.split("#")[0]
    assert json.loads((tmp_path / "mlp_kinematics_smoke.json").read_text()) == table
