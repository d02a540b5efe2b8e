"""The fast path of dynamics against MuJoCo's C engine, which shares no code with it, and against its own laws."""

import pathlib

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from irb140_jax import dynamics
from irb140_jax.dynamics import chunks
from irb140_jax.dynamics.trig import sincos
from irb140_jax.robot import Robot, robot_from_model, with_phi

ARM = pathlib.Path(__file__).parents[1] / "assets" / "irb140.xml"
# Two independent recursions of some thousand operations agree to a few thousand ulp of the largest term.
ROUND_OFF = 1e-11


def random_chain(seed: int, n: int) -> mujoco.MjModel:
    """A chain with tilted base, random axes, some slides, reference offsets, springs, dampers and armature."""
    rng = np.random.default_rng(seed)
    numbers = lambda x: " ".join(repr(float(v)) for v in np.atleast_1d(x))  # noqa: E731
    opening, closing = "", ""
    for i in range(n):
        slide = i % 3 == 1
        A = rng.normal(size=(3, 3))
        inertia = A @ A.T * 0.05 + np.eye(3) * 0.1
        full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        opening += (
            f'<body pos="{numbers(rng.normal(size=3) * 0.3)}" quat="{numbers(rng.normal(size=4))}">'
            f'<inertial pos="{numbers(rng.normal(size=3) * 0.2)}" mass="{rng.uniform(1, 5)}" '
            f'fullinertia="{numbers(full)}"/>'
            f'<joint name="j{i}" type="{"slide" if slide else "hinge"}" axis="{numbers(rng.normal(size=3))}" '
            f'pos="{numbers(rng.normal(size=3) * 0.1)}" ref="{numbers(rng.normal())}" '
            f'springref="{numbers(rng.normal())}" stiffness="{rng.uniform(0, 20)}" damping="{rng.uniform(0, 2)}" '
            f'armature="{rng.uniform(0, 1)}"/>'
        )
        closing += "</body>"
    return mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian" balanceinertia="true"/><worldbody>'
        f'<body pos="0.1 0.2 0.3" quat="{numbers(rng.normal(size=4))}">{opening}{closing}</body></worldbody></mujoco>'
    )


CASES = {"irb140": mujoco.MjModel.from_xml_path(str(ARM)), **{f"random{n}": random_chain(n, n) for n in (1, 4)}}


@pytest.fixture(params=list(CASES), scope="module")
def case(request) -> tuple[mujoco.MjModel, Robot]:
    model = CASES[request.param]
    return model, robot_from_model(model)


def motion(n: int, size: int, seed: int = 0) -> tuple[jax.Array, jax.Array, jax.Array]:
    rng = np.random.default_rng(seed)
    q, qd, qdd = rng.uniform(-2.5, 2.5, (3, size, n))
    return jnp.asarray(q), jnp.asarray(qd), jnp.asarray(qdd * 4.0)


def mujoco_torque(model: mujoco.MjModel, q: jax.Array, qd: jax.Array, qdd: jax.Array) -> np.ndarray:
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    torques = []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(np.asarray(q), np.asarray(qd), np.asarray(qdd), strict=True):
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return np.array(torques)


def assert_close(ours, theirs, tolerance: float = ROUND_OFF) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=tolerance * max(1.0, float(np.abs(theirs).max())))


def test_inverse_dynamics_agrees_with_mujoco(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 20)
    ours = jnp.stack([dynamics.inverse_dynamics(robot, *x) for x in zip(q, qd, qdd, strict=True)])
    assert_close(ours, mujoco_torque(model, q, qd, qdd))


def test_jit_and_vmap_of_a_traced_robot_change_nothing():
    robot = robot_from_model(CASES["random4"])
    q, qd, qdd = motion(4, 20)
    traced = jax.jit(jax.vmap(dynamics.inverse_dynamics, in_axes=(None, 0, 0, 0)))(robot, q, qd, qdd)
    assert_close(traced, dynamics.inverse_dynamics_batch(robot, q, qd, qdd))


def test_batched_inverse_dynamics_agrees_with_mujoco(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 333)
    assert_close(dynamics.inverse_dynamics_batch(robot, q, qd, qdd), mujoco_torque(model, q, qd, qdd))


def test_regressor_times_inertials_is_the_rigid_torque(case):
    model, robot = case
    q, qd, qdd = motion(robot.n, 20)
    Y = dynamics.regressor_batch(robot, q, qd, qdd)
    rest = jax.vmap(dynamics.passive_torque, in_axes=(None, 0, 0))(robot, q, qd) + robot.armature[None] * qdd
    assert_close(Y @ robot.phi.ravel() + rest, mujoco_torque(model, q, qd, qdd))


def test_a_joint_does_not_feel_links_before_it(case):
    _, robot = case
    Y = dynamics.regressor_batch(robot, *motion(robot.n, 3)).reshape(3, robot.n, robot.n, 10)
    rows, links = np.tril_indices(robot.n, -1)
    assert not np.any(Y[:, rows, links])


def test_forward_dynamics_undoes_inverse_dynamics(case):
    _, robot = case
    q, qd, qdd = (x[0] for x in motion(robot.n, 1))
    tau = dynamics.inverse_dynamics(robot, q, qd, qdd)
    # The solve multiplies round-off by the condition number of M, here up to 1e4.
    assert_close(dynamics.forward_dynamics(robot, q, qd, tau), qdd, 1e4 * ROUND_OFF)


def test_one_regressor_equals_a_batch_of_it(case):
    _, robot = case
    q, qd, qdd = motion(robot.n, 2)
    single = jnp.stack([dynamics.regressor(robot, *x) for x in zip(q, qd, qdd, strict=True)])
    assert_close(dynamics.regressor_batch(robot, q, qd, qdd), single)


def arm() -> Robot:
    return robot_from_model(CASES["irb140"])


def test_the_gram_matrix_is_that_of_the_weighted_regressor():
    robot = arm()
    q, qd, qdd = motion(6, 2345)
    tau, weight = jnp.asarray(np.random.default_rng(1).uniform(0.5, 2.0, (2, 2345, 6)))
    W = np.concatenate([dynamics.regressor_batch(robot, q, qd, qdd), tau[:, :, None]], axis=2) * weight[:, :, None]
    W = W.reshape(-1, 61)
    assert_close(dynamics.regressor_gram(robot, q, qd, qdd, tau, weight), W.T @ W)


def compiled() -> tuple[int, int]:
    """Programs compiled so far to run over chunks."""
    return chunks._loop._cache_size(), chunks._sum_loop._cache_size()  # pyright: ignore


def test_a_new_recording_length_compiles_nothing():
    robot = arm()
    run = lambda size: (  # noqa: E731
        dynamics.inverse_dynamics_batch(robot, *motion(6, size)),
        dynamics.regressor_gram(robot, *motion(6, size), motion(6, size)[0]),
    )
    run(999)
    run(1001)
    before = compiled()
    for size in (1, 17, 1000, 1777, 20_000, 20_001):
        assert run(size)[0].shape == (size, 6)
    assert compiled() == before


def test_a_refitted_robot_compiles_nothing():
    robot = arm()
    q, qd, qdd = motion(6, 10)
    nominal = dynamics.inverse_dynamics_batch(robot, q, qd, qdd)
    before = compiled()
    heavier = dynamics.inverse_dynamics_batch(with_phi(robot, 1.1 * robot.phi), q, qd, qdd)
    assert compiled() == before
    assert not np.allclose(heavier, nominal)


def test_a_batch_inside_a_trace_equals_one_outside():
    robot = arm()
    q, qd, qdd = motion(6, 1500)
    torque = lambda q: dynamics.inverse_dynamics_batch(robot, q, qd, qdd)  # noqa: E731
    assert_close(jax.jit(torque)(q), torque(q))


def test_not_a_number_stays_in_its_sample():
    q, qd, qdd = motion(6, 5)
    q = q.at[0, 0].set(jnp.nan)
    tau = np.asarray(dynamics.inverse_dynamics_batch(arm(), q, qd, qdd))
    assert np.isnan(tau[0]).any()
    assert np.isfinite(tau[1:]).all()


def test_torque_is_differentiable_in_every_number_of_the_robot():
    robot = robot_from_model(random_chain(0, 3))
    q, qd, qdd = (x[0] for x in motion(3, 1))
    cost = jax.jit(lambda robot: jnp.sum(jnp.sin(dynamics.inverse_dynamics(robot, q, qd, qdd))))
    slopes = jax.grad(cost)(robot)
    rng, step = np.random.default_rng(3), 1e-5
    moved = lambda leaf, by: eqx.tree_at(lambda r: getattr(r, leaf), robot, getattr(robot, leaf) + by)  # noqa: E731
    fields = "rotation position axis reference mass com inertia armature damping stiffness springref gravity"
    for leaf in fields.split():
        way = rng.normal(size=getattr(robot, leaf).shape)
        numeric = (cost(moved(leaf, step * way)) - cost(moved(leaf, -step * way))) / (2.0 * step)
        ours = float(jnp.sum(getattr(slopes, leaf) * way))
        # Central differences: step^2 times third derivatives, and round-off over step.
        assert ours == pytest.approx(float(numeric), rel=1e-5, abs=1e-5), leaf
        assert ours != 0.0, leaf


def test_slope_of_a_batch_in_the_inertials_is_the_regressor():
    robot = arm()
    q, qd, qdd = motion(6, 1100)
    w = np.random.default_rng(4).normal(size=q.shape)
    cost = lambda phi: jnp.sum(w * dynamics.inverse_dynamics_batch(with_phi(robot, phi), q, qd, qdd))  # noqa: E731
    expected = np.einsum("tj,tjk->k", w, dynamics.regressor_batch(robot, q, qd, qdd))
    assert_close(jax.grad(cost)(robot.phi).ravel(), expected, 1e-9)


def test_base_parameters_explain_every_motion():
    robot = arm()
    base = dynamics.base_parameters(robot)
    Y = np.asarray(dynamics.regressor_batch(robot, *motion(6, 30, seed=5)))
    assert_close(Y[:, :, base.columns] @ base.grouping, Y, 1e-9)


def test_the_arm_has_36_base_parameters_as_is_known_of_such_wrists():
    base = dynamics.base_parameters(arm())
    assert len(base.columns) == len(base.names) == 36
    assert np.linalg.matrix_rank(base.grouping) == 36


def test_sine_and_cosine_are_those_of_the_c_library():
    x = np.concatenate([np.linspace(-1e4, 1e4, 100_001), np.linspace(-1e6, 1e6, 1001), np.arange(-8, 9) * np.pi / 4])
    s, c = sincos(jnp.asarray(x))
    # One ulp of 1, and half of one for the reference.
    np.testing.assert_allclose(s, np.sin(x), rtol=0.0, atol=3.4e-16)
    np.testing.assert_allclose(c, np.cos(x), rtol=0.0, atol=3.4e-16)
